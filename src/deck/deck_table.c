/* What a deck may contain: every section with its keys, each with type, SI unit, range, default,
 * meaning and place in a struct. Reading, checking, printing and messages all use these tables, in
 * their order. Keys that must agree with others have their checks in deck_checks.c; the sizes of
 * solids are with the code of the solids. */
#include "deck/deck_private.h"

enum { MOST_FRICTION = 10, MOST_THREADS = 1024 };
#define MOST_FACE 1.4         /* [rad] 80 degrees */
#define SEED_MAX 4294967295.0 /* the random generator distinguishes as many seeds */
#define MOST_COLLISIONS 1e15  /* a double holds counts up to here exactly */
/* [m] far smaller than anything that flies freely in air */
#define LEAST_DIAMETER 1e-9
/* [kg/m^3] A thousandth of the density of air. It allows balls of almost no mass, and the energies
 * of the smallest balls are still far above the smallest double. */
#define LEAST_DENSITY 1e-3

/* ---- keys that have no meaning in some decks ---- */

#define HIDDEN(NAME, TYPE, CONDITION)                                                              \
    static bool NAME(const void *values)                                                           \
    {                                                                                              \
        const struct TYPE *is = values;                                                            \
        return CONDITION;                                                                          \
    }
HIDDEN(sample_found, mill_deck, is->observe.sample_found)
HIDDEN(is_not_wavy, mill_deck, is->given.lining.form != MILL_LINING_WAVY)
HIDDEN(has_no_lifters, mill_deck, is->given.lining.form != MILL_LINING_LIFTERS)
HIDDEN(is_not_free, mill_deck, is->given.lining.form != MILL_LINING_HARMONICS)
HIDDEN(is_not_read, mill_deck, is->given.lining.form != MILL_LINING_FILE)
HIDDEN(no_drum, mill_deck, !is->mill.drum)
/* The balls do not start at random, or the container does not move. */
HIDDEN(starts_alike, mill_deck, is->given.start || is->mill.carrier < 0)
HIDDEN(is_hard, mill_deck, !is->setup.soft.on)
HIDDEN(is_single, mill_deck_body, is->copies < 2)
HIDDEN(no_rosin, mill_deck_balls, !is->sizes || strcmp(is->sizes, "rosin_rammler") != 0)
HIDDEN(no_law, mill_deck_balls, no_rosin(is) && (!is->sizes || strcmp(is->sizes, "bond") != 0))
HIDDEN(is_table, mill_deck_balls, no_law(is) && is->sizes != NULL)

/* ---- the keys; a row has two lines at most ---- */

#define ANY MILL_KEY_ANY
#define ANGLE .unit = "rad", ANY
#define AUTO .words = "auto", .named = NAN, .preset = "auto"
#define WHOLE(least, most) .type = MILL_KEY_WHOLE, .lo = least, .hi = most
#define CHOICE(list, usual) .type = MILL_KEY_CHOICE, .words = list, .preset = usual
#define TEXT .type = MILL_KEY_NAME, .derived = true
#define POSITIVE MILL_KEY_POSITIVE
#define NOT_NEGATIVE MILL_KEY_NOT_NEGATIVE
#define IN(type, member) .offset = offsetof(struct type, member)
#define DECK(member) IN(mill_deck, member)
#define OBSERVE(member) DECK(observe.member)
#define GIVEN(member) DECK(given.member)
#define A_FILE .type = MILL_KEY_FILE
#define UP_TO_LARGEST .hi = MILL_KEY_LARGEST

/* clang-format off */
static const struct mill_key run_key[] = {
    {"time", "end of the run", .unit = "s", POSITIVE, OBSERVE(end)},
    {"sample_from", "statistics are gathered from here to the end; if not given, the run finds it", .unit = "s",
     NOT_NEGATIVE, .preset = "0 s", OBSERVE(sample_from), .hidden = sample_found},
    {"precision", "the run ends when median speed and power are known to this relative error; 0: at run.time",
     .unit = "1", .lo = 0, .hi = 1, .preset = "0", OBSERVE(precision), .zero_is_off = true},
    {"max_collisions", "the run ends after this number of impacts; 0: at run.time", .lo = 0, .hi = MOST_COLLISIONS,
     .preset = "0", OBSERVE(max_collisions), .zero_is_off = true},
    {"seed", "seed of every random choice", WHOLE(0, SEED_MAX), .preset = "1", DECK(setup.seed)},
    {"starts", "starts of the mill with other seeds, side by side: their scatter gives the errors", WHOLE(1, 64),
     .derived = true, OBSERVE(starts)},
    {"hard_impact", "impacts with this energy or more are hard; auto: above it falls half of the lost energy",
     .unit = "J", POSITIVE, AUTO, OBSERVE(hard)},
    {"spheres", "hard, or soft: springs and dashpots in time steps (--soft)", CHOICE("hard|soft", "hard"),
     DECK(setup.soft.on)},
    {"threads", "threads at most; 0: one for each core if there are several starts, or 20 000 balls, else 1",
     WHOLE(0, MOST_THREADS), .preset = "0", GIVEN(threads), .zero_is_off = true},
    {.name = NULL}};

static const struct mill_key soft_key[] = {
    {"modulus", "Young's modulus of all bodies of soft spheres; 'steel' is 210 GPa", .unit = "Pa", .lo = 1e5,
     .hi = 1e13, .words = "steel", .named = 2.1e11, .preset = "1 GPa", DECK(setup.soft.modulus), .hidden = is_hard},
    {"law", "force of a soft contact: linear in the depth, or Hertz' law", CHOICE("linear|hertz", "linear"),
     DECK(setup.soft.hertz), .hidden = is_hard},
    {"steps", "time steps in the shortest contact of soft spheres", WHOLE(10, 10000), .preset = "40",
     DECK(setup.soft.steps), .hidden = is_hard},
    {.name = NULL}};

static const struct mill_key gravity_key[] = {
    {"acceleration", "acceleration of gravity along x, y and z", .type = MILL_KEY_VECTOR, .unit = "m/s^2", ANY,
     .preset = "0 0 -9.81 m/s^2", DECK(setup.gravity)},
    {.name = NULL}};

static const struct mill_key output_key[] = {
    {"frames", "interval of stored ball states; 0 s: none", .unit = "s", NOT_NEGATIVE, .preset = "10 ms",
     OBSERVE(frames)},
    {"series", "interval of the time series", .unit = "s", POSITIVE, .preset = "1 ms", OBSERVE(series)},
    {"impacts", "statistics, or all to log every impact", CHOICE("statistics|all", "statistics"), OBSERVE(log_impacts)},
    {"strike_window", "contacts of a pair closer in time than this are one strike; auto: as long as a contact",
     .unit = "s", NOT_NEGATIVE, AUTO, OBSERVE(strike_window)},
    {"checkpoint", "wall-clock interval of checkpoints", .unit = "s", POSITIVE, .preset = "60 s", GIVEN(checkpoint)},
    {.name = NULL}};

#define SHARE .lo = 0, .above = true, .hi = 1
#define BALLS(member) IN(mill_deck_balls, member)
#define DIAMETER .unit = "m", .lo = LEAST_DIAMETER, UP_TO_LARGEST
#define NO_LAW .hidden = no_law, .needs = "belongs to 'sizes = bond' or 'sizes = rosin_rammler': leave it out"
#define NO_ROSIN .hidden = no_rosin, .needs = "belongs to 'sizes = rosin_rammler': leave it out"
static const struct mill_key ball_key[] = {
    {"count", "number of balls", WHOLE(1, MILL_DECK_MOST_BALLS), BALLS(count)},
    {"fill", "volume of the balls divided by that of the container; gives their number", .instead = "count",
     .unit = "1", SHARE, BALLS(fill)},
    {"bulk_fill", "share of the free volume that the balls fill with the voids between them, of which 60 % is solid; "
     "gives their number", .instead = "count", .unit = "1", SHARE, BALLS(bulk_fill)},
    {"mass", "total mass of the balls of this kind; gives their number", .instead = "count", .unit = "kg", POSITIVE,
     BALLS(mass)},
    {"sizes", "equal, a distribution of the mass, or a file with a row 'd m' for each size: diameter [m], share of the "
     "mass", A_FILE, .derived = true, .words = "equal", .known = "bond|rosin_rammler", BALLS(sizes)},
    {"diameter", "diameter of a ball; of a distribution: of the largest", DIAMETER, BALLS(diameter), .hidden = is_table,
     .needs = "the table of 'sizes' gives the diameters: leave it out; or is 'sizes' bond or rosin_rammler?"},
    {"smallest", "diameter of the smallest ball of the distribution", DIAMETER, .derived = true, BALLS(smallest),
     NO_LAW},
    {"classes", "number of classes of equal mass that stand for the distribution", WHOLE(1, MILL_DECK_MOST_CLASSES),
     .preset = "4", BALLS(classes), NO_LAW},
    {"d63", "size than which 63.2 % of the mass is finer, 1 - exp(-(d/d63)^n)", DIAMETER, BALLS(d63), NO_ROSIN},
    {"uniformity", "exponent n of this distribution", .lo = 0.1, .hi = 100, BALLS(uniformity), NO_ROSIN},
    {"material", "material of the balls: gives density and contacts that are not given", TEXT, BALLS(material)},
    {"density", "density of the balls' material", .unit = "kg/m^3", .lo = LEAST_DENSITY, UP_TO_LARGEST,
     .unless = "material", BALLS(density)},
    {.name = NULL}};

static const struct mill_key start_key[] = {
    {"start", "random, or a file with one ball a line: x y z [vx vy vz [wx wy wz]] in SI", A_FILE, .preset = "random",
     GIVEN(start), .words = "random"},
    {"speed", "speed of every ball of a random start, in a random direction", .unit = "m/s", NOT_NEGATIVE,
     .preset = "0 m/s", DECK(setup.speed)},
    {"start_motion", "balls of a random start move with the container, or are still",
     CHOICE("container|still", "container"), DECK(setup.at_rest), .hidden = starts_alike},
    {.name = NULL}};

#define LINING(member) GIVEN(lining.member)
#define WAVY .hidden = is_not_wavy, .needs = "belongs to the wavy profile: add 'profile = wavy', or leave it out"
#define LIFTED .hidden = has_no_lifters, .needs = "belongs to lifters: add 'profile = lifters', or leave it out"
#define FREE .hidden = is_not_free, .needs = "belongs to a free line: add 'profile = harmonics', or leave it out"
#define READ .hidden = is_not_read, .needs = "belongs to a contour of a file: add 'profile = file', or leave it out"
#define WAVE(k) \
    {"wave_" #k, "height of cos(" #k " a), where a goes once around in each of the equal parts", .unit = "m", ANY, \
     .preset = "0 m", LINING(wave[k - 1]), FREE}, \
    {"lean_" #k, "height of sin(" #k " a)", .unit = "m", ANY, .preset = "0 m", LINING(lean[k - 1]), FREE}
static const struct mill_key drum_key[] = {
    {"radius", "inner radius of the drum", MILL_SOLID_SIZE, DECK(setup.drum.radius)},
    {"diameter", "inner diameter of the drum", MILL_SOLID_WIDTH, .instead = "radius", DECK(setup.drum.radius)},
    {"length", "inner length of the drum", MILL_SOLID_SIZE, DECK(setup.drum.length)},
    {"ends", "end walls, or periodic: a slice of a long mill, which balls leave at one end and enter at the other",
     CHOICE("walls|periodic", "walls"), DECK(setup.drum.periodic)},
    {"profile", "shape of the drum's wall", CHOICE("circle|wavy|lifters|harmonics|file", "circle"), LINING(form)},
    {"buckles", "number of buckles around the drum", WHOLE(2, MILL_LINING_MOST), LINING(count), WAVY},
    {"buckle_height", "height of the buckles: the wall lies between radius - height and radius + height", .unit = "m",
     NOT_NEGATIVE, LINING(height), WAVY},
    {"buckle_angle", "angle of one outermost point, from +y towards +z", ANGLE, .preset = "0 deg", LINING(angle), WAVY},
    {"lifters", "number of lifters around the drum, whose radius is that of the plate between them",
     WHOLE(1, MILL_LINING_MOST), LINING(count), LIFTED},
    {"lifter_height", "height of a lifter at its middle, above the plate", .unit = "m", POSITIVE, LINING(height),
     LIFTED},
    {"lifter_width", "width of a lifter at its top", .unit = "m", POSITIVE, LINING(width), LIFTED},
    {"lifter_front", "angle between the radius and the face towards larger angles, which leads where the drum turns "
     "with positive speed", .unit = "rad", .lo = 0, .hi = MOST_FACE, .preset = "0 deg", LINING(front), LIFTED},
    {"lifter_back", "angle between the radius and the other face", .unit = "rad", .lo = 0, .hi = MOST_FACE,
     .preset = "0 deg", LINING(back), LIFTED},
    {"lifter_rounding", "radius of its edges", .unit = "m", NOT_NEGATIVE, .preset = "0 m", LINING(rounding), LIFTED},
    {"lifter_second_height", "height of every other lifter; auto: that of all", .unit = "m", POSITIVE, AUTO,
     LINING(second), LIFTED},
    {"lifter_angle", "angle of the middle of a lifter, from +y towards +z", ANGLE, .preset = "0 deg", LINING(angle),
     LIFTED},
    {"repeats", "number of equal parts of the line around the drum, whose mean radius is that of the drum",
     WHOLE(1, MILL_LINING_MOST), LINING(count), FREE},
    WAVE(1), WAVE(2), WAVE(3), WAVE(4),
    {"tool_radius", "no place of the line may curve around the balls with a smaller radius, for a milling tool; 0 m: "
     "any", .unit = "m", NOT_NEGATIVE, .preset = "0 m", GIVEN(tool), FREE},
    {"file", "a contour: a row 'x y bulge' for each corner, counter-clockwise; 'mill contour' makes it from a drawing",
     A_FILE, GIVEN(contour), READ},
    {"motion", "name of the motion that carries the drum, or rotor; the drum's axis is x of its frame", TEXT,
     GIVEN(drum_motion)},
    {"material", "material of drum, end walls, and parts without a material of their own", TEXT, GIVEN(drum_material)},
    {.name = NULL}};

#define CRITICAL "speed", "share of the critical speed of the container that it turns", .unit = "critical", ANY
static const struct mill_key rotor_share = {CRITICAL, GIVEN(share)};
static const struct mill_key rotor_key[] = {
    {"speed", "constant speed of the rotor, positive about +x", .unit = "rad/s", ANY, GIVEN(rotor.speed),
     .also = &rotor_share},
    {"tip_speed", "speed of the point of blades and bodies on the rotor that is farthest from its axis; gives the "
     "speed of the rotor", .instead = "speed", .unit = "m/s", ANY, GIVEN(tip_speed)},
    {"shaft_radius", "radius of the shaft; 0 m: none", .unit = "m", NOT_NEGATIVE, GIVEN(shaft_radius),
     .hidden = no_drum},
    {"shaft_diameter", "diameter of the shaft; 0 m: none", .instead = "shaft_radius", .factor = 0.5, .unit = "m",
     NOT_NEGATIVE, GIVEN(shaft_radius), .hidden = no_drum},
    {"angle", "angle of the rotor at t = 0, from +y towards +z", ANGLE, .preset = "0 deg", GIVEN(rotor.angle)},
    {"material", "material of shaft, blades and bodies on the rotor", TEXT, GIVEN(rotor_material)},
    {.name = NULL}};

#define BLADES(member) IN(mill_deck_blades, member)
static const struct mill_key blades_key[] = {
    {"count", "number of equal blades, evenly spaced along the drum", WHOLE(1, MILL_DECK_MOST_BLADES), BLADES(count)},
    {.name = NULL}};

static const struct mill_key spread_key[] = {
    {"angle_step", "angle from one blade to the next", ANGLE, .derived = true, BLADES(angle_step)},
    {.name = NULL}};

#define BLADE(member) IN(mill_blade, member)
static const struct mill_key blade_key[] = {
    {"position", "x of the blade's centre", .unit = "m", ANY, BLADE(position)},
    {"angle", "angle of the blade on the rotor, from +y towards +z", ANGLE, BLADE(angle)},
    {.name = NULL}};

static const struct mill_key blade_form_key[] = {
    {"tip_radius", "reach of a blade from the axis", MILL_SOLID_SIZE, BLADE(tip_radius)},
    {"width", "width of a blade along the axis, before pitching", MILL_SOLID_SIZE, BLADE(width)},
    {"thickness", "thickness of a blade around the axis, before pitching", MILL_SOLID_SIZE, BLADE(thickness)},
    {"pitch", "turn of a blade about its radial mid-line", ANGLE, .preset = "0 deg", BLADE(pitch)},
    {.name = NULL}};
#define LAW(member) .derived = true, IN(mill_deck_law, member)
static const struct mill_key law_key[] = {
    {"restitution", "normal coefficient of restitution", .lo = 0, .hi = 1, LAW(restitution)},
    {"restitution_speed", "normal speed at which it has this value; loss (1 - e) grows as v^(1/5); 0 m/s: it is the "
     "same at any speed", .unit = "m/s", NOT_NEGATIVE, .zero_is_off = true, LAW(speed)},
    {"restitution_table", "a file with a row 'v e' for each normal speed [m/s], ascending", A_FILE, LAW(table),
     .words = "none", .known = "steel"},
    {"friction", "Coulomb's coefficient of friction; 0: smooth", .lo = 0, .hi = MOST_FRICTION, LAW(friction)},
    {"tangential_restitution", "tangential restitution of a sticking contact", .lo = -1, .hi = 1, LAW(tangential)},
    {.name = NULL}};

static const struct mill_key material_key[] = {
    {"density", "density of the material", .unit = "kg/m^3", .lo = LEAST_DENSITY, UP_TO_LARGEST, .derived = true,
     IN(mill_deck_material, density)},
    {.name = NULL}};

static const struct mill_key floor_key[] = {
    {"rebound_floor", "minimum normal speed after any contact; 'auto' follows from the mill", .unit = "m/s", .lo = 0,
     .hi = 10, AUTO, DECK(setup.rebound_floor)},
    {"between", "material between the surfaces, such as powder; its contacts replace those of the materials", TEXT,
     GIVEN(between)},
    {.name = NULL}};

#define PLACE .type = MILL_KEY_VECTOR, .unit = "m", .lo = -1e4, .hi = 1e4
#define DIRECTION .type = MILL_KEY_VECTOR, ANY, .direction = true, .preset = "0 0 1"
#define MOTION(member) IN(mill_deck_motion, member)
static const struct mill_key motion_key[] = {
    {"kind", "kind of motion", .type = MILL_KEY_CHOICE, MOTION(kind), .words = "turn|swing|shift|table"},
    {"on", "the motion that carries this one", TEXT, MOTION(on)},
    {.name = NULL}};

static const struct mill_key turn_share = {CRITICAL, MOTION(share)};
static const struct mill_key turn_key[] = {
    {"centre", "a point of the axis", PLACE, .preset = "0 0 0 m", MOTION(as.turn.centre)},
    {"axis", "direction of the axis", DIRECTION, MOTION(as.turn.axis)},
    {"speed", "constant speed, by the right-hand rule", .unit = "rad/s", ANY, MOTION(as.turn.speed),
     .also = &turn_share},
    {"angle", "angle at t = 0", ANGLE, .preset = "0 deg", MOTION(as.turn.angle)},
    {.name = NULL}};

static const struct mill_key swing_key[] = {
    {"centre", "a point of the axis", PLACE, .preset = "0 0 0 m", MOTION(as.swing.centre)},
    {"axis", "direction of the axis", DIRECTION, MOTION(as.swing.axis)},
    {"amplitude", "half of the whole swing", ANGLE, MOTION(as.swing.amplitude)},
    {"frequency", "whole swings per time", .unit = "Hz", NOT_NEGATIVE, MOTION(as.swing.frequency)},
    {"phase", "the angle is amplitude sin(2 pi frequency t + phase)", ANGLE, .preset = "0 deg", MOTION(as.swing.phase)},
    {.name = NULL}};

static const struct mill_key shift_key[] = {
    {"amplitude", "half of the whole stroke, along x, y and z", PLACE, MOTION(as.shift.amplitude)},
    {"frequency", "cycles per time", .unit = "Hz", NOT_NEGATIVE, MOTION(as.shift.frequency)},
    {"phase", "along x, y and z: amplitude sin(2 pi frequency t + phase)", .type = MILL_KEY_VECTOR, ANGLE,
     .preset = "0 deg", .one_for_all = true, MOTION(as.shift.phase)},
    {.name = NULL}};

static const struct mill_key table_key[] = {
    {"file", "one period, a row for each time: t x y z rx ry rz in SI, r a rotation vector", A_FILE, MOTION(as.file)},
    {.name = NULL}};

#define BODY(member) IN(mill_deck_body, member)
static const struct mill_key body_key[] = {
    {"shape", "shape of the body", .type = MILL_KEY_CHOICE, BODY(shape), .words = MILL_SOLID_WORDS},
    {"side", "where the balls are: outside of it, or inside", CHOICE("outside|inside", "outside"), BODY(is.inside)},
    {"motion", "what carries it: a motion's name, or rotor", TEXT, BODY(motion)},
    {"centre", "its middle in its motion's frame", PLACE, .preset = "0 0 0 m", BODY(is.centre)},
    {"axis", "direction of its own z in its motion's frame", DIRECTION, BODY(axis)},
    {"angle", "its turn about its own z", ANGLE, .preset = "0 deg", BODY(angle)},
    {"material", "its material", TEXT, BODY(material)},
    {.name = NULL}};

static const struct mill_key mesh_key[] = {
    {"file", "an STL file", A_FILE, BODY(file)},
    {"unit", "length of one unit in the file", .unit = "m", .lo = 0, .above = true, .hi = 1e4, .unit_alone = true,
     BODY(unit)},
    {.name = NULL}};

static const struct mill_key contour_key[] = {
    {"file", "a contour: a row 'x y bulge' for each corner, counter-clockwise, in SI", A_FILE, BODY(file)},
    {.name = NULL}};

static const struct mill_key copies_key[] = {
    {"copies", "number of equal bodies in all", WHOLE(1, MILL_DECK_MOST_BLADES), .preset = "1", BODY(copies),
     .hidden = mill_solid_is_inside, .needs = "a mill has one container: leave it out"},
    {"turn_by", "angle by which each copy is turned from the one before it", ANGLE, .preset = "0 deg", BODY(turn_by),
     .hidden = is_single},
    {"turn_about", "axis of this turn, through the origin of the motion's frame", DIRECTION, BODY(turn_about),
     .hidden = is_single},
    {"shift_by", "shift of each copy from the one before it, after the turn", PLACE, .preset = "0 0 0 m",
     BODY(shift_by), .hidden = is_single},
    {"kind", "kind of contact under which its contacts are counted", TEXT, BODY(kind)},
    {.name = NULL}};

#define OPTIONAL NOT_NEGATIVE, .zero_is_off = true
#define POWDER(member) IN(mill_deck_powder, member)
static const struct mill_key powder_key[] = {
    {"mass", "mass of the powder", .unit = "kg", POSITIVE, POWDER(mass)},
    {"ball_to_powder", "mass of the balls divided by that of the powder; gives its mass", POSITIVE, .instead = "mass",
     POWDER(ball_to_powder)},
    {"density", "density of the powder's material", .unit = "kg/m^3", .lo = 1e-3, UP_TO_LARGEST, POWDER(density)},
    {"size", "diameter of a particle; 0 m: not known", .unit = "m", OPTIONAL, .preset = "0 m", POWDER(size)},
    {"packing", "share of a layer of powder that the particles fill", .unit = "1", .lo = 0, .above = true, .hi = 1,
     .preset = "0.6", POWDER(packing)},
    {"capture", "powder that an impact catches: a layer of one particle, the volume between the surfaces, or a layer "
     "on the Hertz contact", CHOICE("monolayer|volume|layer", "monolayer"), POWDER(capture)},
    {"layer", "thickness of the powder on a surface; 0 m: not known", .unit = "m", OPTIONAL, .preset = "0 m",
     POWDER(layer)},
    {"modulus", "reduced elastic modulus of the surfaces, for the Hertz contact", .unit = "Pa", .lo = 1, .hi = 1e13,
     .preset = "115 GPa", POWDER(modulus)},
    {"energy", "energy of an impact: of the normal approach, with the slip, or lost",
     CHOICE("normal|total|dissipated", "normal"), POWDER(energy)},
    {"threshold", "impacts with this `energy` or more are hard; auto: run.hard_impact", .unit = "J", POSITIVE, AUTO,
     POWDER(threshold)},
    {"law", "what an impact of energy E does: c (E / 1 J)^n, c from the threshold on, breakage after Vogel & Peukert, "
     "or a table", CHOICE("none|power|threshold|vogel_peukert|table", "none"), POWDER(law)},
    {"coefficient", "c of the law", OPTIONAL, .preset = "0", POWDER(coefficient)},
    {"exponent", "n of the law", OPTIONAL, .preset = "0", POWDER(exponent)},
    {"strength", "f_Mat of Vogel & Peukert", .unit = "kg/J/m", OPTIONAL, .preset = "0 kg/J/m", POWDER(strength)},
    {"least", "x W_m,min of Vogel & Peukert", .unit = "J m/kg", OPTIONAL, .preset = "0 J m/kg", POWDER(least)},
    {"table", "a file with a row 'E k' for each energy [J], ascending", A_FILE, .preset = "none", POWDER(table),
     .words = "none"},
    {.name = NULL}};

#define HEAT(member) IN(mill_deck_heat, member)
#define CAPACITY .unit = "J/kg/K"
static const struct mill_key heat_key[] = {
    {"ball_heat_capacity", "specific heat capacity of the balls", CAPACITY, POSITIVE, HEAT(ball_capacity)},
    {"powder_heat_capacity", "specific heat capacity of the powder; 0: it is not counted", CAPACITY, OPTIONAL,
     .preset = "0 J/kg/K", HEAT(powder_capacity)},
    {"jar_heat_capacity", "specific heat capacity of the jar or drum", CAPACITY, POSITIVE, HEAT(jar_capacity)},
    {"jar_mass", "mass of the jar or drum", .unit = "kg", POSITIVE, HEAT(jar_mass)},
    {"ball_to_jar", "heat that flows from the balls to the jar, for each kelvin", .unit = "W/K", POSITIVE,
     HEAT(ball_to_jar)},
    {"jar_to_room", "heat that flows from the jar to the room, for each kelvin", .unit = "W/K", NOT_NEGATIVE,
     HEAT(jar_to_room)},
    {"room", "temperature of the room, and of everything at the start", .unit = "K", POSITIVE, .preset = "293.15 K",
     HEAT(room)},
    {"share", "share of the power that heats the balls; the rest heats the jar", .unit = "1", .lo = 0, .hi = 1,
     .preset = "0.5", HEAT(share)},
    {.name = NULL}};

static const struct mill_key wear_key[] = {
    {"archard", "Archard's coefficient K; 0: not known", OPTIONAL, .preset = "0", IN(mill_wear_law, archard)},
    {"hardness", "hardness of the surface", .unit = "Pa", .lo = 0, .hi = 1e12, .zero_is_off = true, .preset = "0 Pa",
     IN(mill_wear_law, hardness)},
    {"erosion", "Finnie's coefficient k: mass removed for each joule; 0: not known", .unit = "kg/J", OPTIONAL,
     .preset = "0 kg/J", IN(mill_wear_law, erosion)},
    {.name = NULL}};

#define VALUES(member) .values = offsetof(struct mill_deck, given.member)
#define OF_MOTION "motion", .named = true, .size = sizeof(struct mill_deck_motion)
#define OF_BLADE "blade", .named = true, .size = sizeof(struct mill_blade)
#define OF_BODY "body", .named = true, .size = sizeof(struct mill_deck_body)
#define OF_MATERIAL                                                                                \
    "material", .named = true, .inherits = true, VALUES(unknown),                                  \
        .size = sizeof(struct mill_deck_material)
/* a block for each solid that a deck can name; the keys of one whose facets are in a file */
#define NUMBER(word, solid) NUMBER_##word,
#define OF_SOLID(word, is) {OF_BODY, .key = mesh_key, .solid = &(is), .words = 1u << NUMBER_##word},
enum { MILL_SOLID_LIST(NUMBER) };
const struct mill_deck_block mill_deck_table[] = {
    {"run", .key = run_key},
    {"soft", .key = soft_key},
    {"gravity", .key = gravity_key},
    {"balls", .key = ball_key, .unless_named = true, .size = sizeof(struct mill_deck_balls)},
    {"balls", .key = start_key},
    {"balls", .named = true, .key = ball_key, .size = sizeof(struct mill_deck_balls)},
    {"drum", .spared_by = "body", .key = drum_key},
    {"rotor", .optional = true, .key = rotor_key},
    {"blades", .optional = true, .key = blades_key, VALUES(blades)},
    {"blades", .optional = true, .key = blade_form_key, VALUES(blades.form)},
    {"blades", .optional = true, .key = spread_key, VALUES(blades)},
    {OF_BLADE, .key = blade_key},
    {OF_BLADE, .key = blade_form_key},
    {OF_MOTION, .key = motion_key},
    {OF_MOTION, .key = turn_key, .words = 1u << MILL_DECK_TURN},
    {OF_MOTION, .key = swing_key, .words = 1u << MILL_DECK_SWING},
    {OF_MOTION, .key = shift_key, .words = 1u << MILL_DECK_SHIFT},
    {OF_MOTION, .key = table_key, .words = 1u << MILL_DECK_TABLE},
    {OF_BODY, .key = body_key},
    MILL_SOLID_LIST(OF_SOLID)
    {OF_BODY, .key = contour_key, .words = 1u << NUMBER_contour},
    {OF_BODY, .key = copies_key},
    {"contact", .key = law_key, VALUES(general)},
    {"contact", .key = floor_key},
    {"contact", .named = true, .inherits = true, .key = law_key, VALUES(general), .size = sizeof(struct mill_deck_law)},
    {OF_MATERIAL, .key = material_key},
    {OF_MATERIAL, .key = law_key},
    {"powder", .optional = true, .key = powder_key, VALUES(powder)},
    {"heat", .optional = true, .key = heat_key, VALUES(heat)},
    {"wear", .optional = true, .key = wear_key, VALUES(worn)},
    {"wear", .named = true, .inherits = true, .key = wear_key, VALUES(worn), .size = sizeof(struct mill_wear_law)},
    {"output", .key = output_key},
    {.title = NULL}};
/* clang-format on */
