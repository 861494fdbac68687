/* What a classic mill is made of: the keys of [balls], [drum], [rotor], [blades] and [blade.NAME],
 * and whether they agree: do the balls and parts fit into the drum, or the balls into the body that
 * holds them? */
#include "base/elementary.h"
#include "base/profile.h"
#include "deck/deck_keys.h"
#include "geometry/shapes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    /* More buckles would be finer than the few hundred points with which maps and outlines show a
     * drum. */
    MOST_BUCKLES = 500,
    HALVINGS = 60 /* of an interval, down to about the last bit of a double */
};
#define DIAMETER(of) .lo = 2.0 * MILL_SOLID_LEAST, .hi = 2e4, .instead = (of), .factor = 0.5
/* [m] far smaller than anything that flies freely in air */
#define LEAST_DIAMETER 1e-9
/* relative to the drum's reach; more than the tolerance of wavy.c */
#define SNUG 1e-11
#define DENSEST 0.7404804896930611 /* pi / sqrt(18): no packing of equal balls is denser */

static bool is_circle(const void *deck)
{
    return !((const struct mill_deck *)deck)->given.wavy;
}

static bool no_drum(const void *deck)
{
    return !((const struct mill_deck *)deck)->mill.drum;
}

/* True if the balls do not start at random, or the container does not move: the key
 * has no effect. */
static bool starts_alike(const void *deck)
{
    const struct mill_deck *d = deck;
    return d->given.start || !d->mill.carried;
}

/* clang-format off */
#define SHARE .lo = 0, .above = true, .hi = 1
const struct mill_key mill_deck_mill_ball[] = {
    {"count", "number of balls", .type = MILL_KEY_WHOLE, .lo = 1, .hi = MILL_DECK_MOST_BALLS,
     IN(mill_deck_balls, count)},
    {"fill", "volume of the balls divided by that of the container; gives their number",
     .instead = "count", .unit = "1", SHARE, IN(mill_deck_balls, fill)},
    {"bulk_fill", "share of the free volume that the balls fill with the voids between them, "
     "of which 60 % is solid; gives their number", .instead = "count", .unit = "1", SHARE,
     IN(mill_deck_balls, bulk_fill)},
    {"mass", "total mass of the balls of this kind; gives their number", .instead = "count",
     .unit = "kg", POSITIVE, IN(mill_deck_balls, mass)},
    {"diameter", "diameter of a ball", .unit = "m", .lo = LEAST_DIAMETER, .hi = MILL_KEY_LARGEST,
     IN(mill_deck_balls, diameter)},
    {"material", "material of the balls: gives density and contacts that are not given", TEXT,
     IN(mill_deck_balls, material)},
    {"density", "density of the balls' material", .unit = "kg/m^3", .lo = LEAST_DENSITY,
     .hi = MILL_KEY_LARGEST, .unless = "material", IN(mill_deck_balls, density)},
    {.name = NULL},
};

const struct mill_key mill_deck_mill_start[] = {
    {"start", "random, or a file with one ball a line: x y z [vx vy vz [wx wy wz]] in SI",
     .type = MILL_KEY_FILE, .preset = "random", DECK(start), .words = "random"},
    {"speed", "speed of every ball of a random start, in a random direction", .unit = "m/s",
     NOT_NEGATIVE, .preset = "0 m/s", DECK(speed)},
    {"start_motion", "balls of a random start move with the container, or are still",
     .type = MILL_KEY_CHOICE, .preset = "container", DECK(at_rest), .words = "container|still",
     .hidden = starts_alike},
    {.name = NULL},
};

#define WAVY                                                                                       \
    .hidden = is_circle,                                                                           \
    .needs = "belongs to the wavy profile: add 'profile = wavy', or leave it out"
const struct mill_key mill_deck_mill_drum[] = {
    {"radius", "inner radius of the drum", .unit = "m", SIZE_OF_MILL, DECK(drum_radius)},
    {"diameter", "inner diameter of the drum", .unit = "m", DIAMETER("radius"), DECK(drum_radius)},
    {"length", "inner length of the drum", .unit = "m", SIZE_OF_MILL, DECK(drum_length)},
    {"ends", "end walls, or periodic: a slice of a long mill, which balls leave at one end and enter at "
     "the other", .type = MILL_KEY_CHOICE, .preset = "walls", DECK(periodic),
     .words = "walls|periodic"},
    {"profile", "shape of the drum's wall", .type = MILL_KEY_CHOICE, .preset = "circle", DECK(wavy),
     .words = "circle|wavy"},
    {"buckles", "number of buckles around the drum", .type = MILL_KEY_WHOLE, .lo = 2,
     .hi = MOST_BUCKLES, DECK(buckles), WAVY},
    {"buckle_height", "height of the buckles: the wall lies between radius - height and "
     "radius + height", .unit = "m", NOT_NEGATIVE, DECK(buckle_height), WAVY},
    {"buckle_angle", "angle of one outermost point, from +y towards +z", .unit = "rad", ANY,
     .preset = "0 deg", DECK(buckle_angle), WAVY},
    {"motion", "name of the motion that carries the drum, or rotor; the drum's axis is x of its frame",
     TEXT, DECK(drum_motion)},
    {"material", "material of drum, end walls, and parts without a material of their own", TEXT,
     DECK(drum_material)},
    {.name = NULL},
};

const struct mill_key mill_deck_mill_rotor[] = {
    {"speed", "constant speed of the rotor, positive about +x", .unit = "rad/s", ANY,
     DECK(rotor.speed)},
    {"tip_speed", "speed of the point of blades and bodies on the rotor that is farthest from its "
     "axis; gives the speed of the rotor", .instead = "speed", .unit = "m/s", ANY, DECK(tip_speed)},
    {"shaft_radius", "radius of the shaft; 0 m: none", .unit = "m", NOT_NEGATIVE,
     DECK(shaft_radius), .hidden = no_drum},
    {"shaft_diameter", "diameter of the shaft; 0 m: none", .instead = "shaft_radius", .factor = 0.5,
     .unit = "m", NOT_NEGATIVE, DECK(shaft_radius), .hidden = no_drum},
    {"angle", "angle of the rotor at t = 0, from +y towards +z", .unit = "rad", ANY,
     .preset = "0 deg", DECK(rotor.angle)},
    {"material", "material of shaft, blades and bodies on the rotor", TEXT, DECK(rotor_material)},
    {.name = NULL},
};

const struct mill_key mill_deck_mill_blades[] = {
    {"count", "number of equal blades, evenly spaced along the drum", .type = MILL_KEY_WHOLE,
     .lo = 1, .hi = MILL_DECK_MOST_BLADES, IN(mill_deck_blades, count)},
    {.name = NULL},
};

const struct mill_key mill_deck_mill_spread[] = {
    {"angle_step", "angle from one blade to the next", .unit = "rad", ANY, .derived = true,
     IN(mill_deck_blades, angle_step)},
    {.name = NULL},
};

#define BLADE(member) IN(mill_blade, member)
const struct mill_key mill_deck_mill_blade[] = {
    {"position", "x of the blade's centre", .unit = "m", ANY, BLADE(position)},
    {"angle", "angle of the blade on the rotor, from +y towards +z", .unit = "rad", ANY,
     BLADE(angle)},
    {.name = NULL},
};

const struct mill_key mill_deck_mill_blade_form[] = {
    {"tip_radius", "reach of a blade from the axis", .unit = "m", SIZE_OF_MILL, BLADE(tip_radius)},
    {"width", "width of a blade along the axis, before pitching", .unit = "m", SIZE_OF_MILL,
     BLADE(width)},
    {"thickness", "thickness of a blade around the axis, before pitching", .unit = "m", SIZE_OF_MILL,
     BLADE(thickness)},
    {"pitch", "turn of a blade about its radial mid-line", .unit = "rad", ANY,
     .preset = "0 deg", BLADE(pitch)},
    {.name = NULL},
};
/* clang-format on */

struct mill_setup_drum mill_deck_drum(const struct mill_deck *deck)
{
    const struct mill_deck_given *is = &deck->given;
    return (struct mill_setup_drum){
        .radius = is->drum_radius,
        .length = is->drum_length,
        .buckles = (int)is->buckles,
        .buckle_height = is->buckle_height,
        .buckle_angle = is->buckle_angle,
        .rides = deck->mill.drum_rides,
        .periodic = is->periodic != 0,
    };
}

struct mill_profile mill_deck_mill_profile(const struct mill_deck *deck)
{
    const struct mill_setup_drum drum = mill_deck_drum(deck);
    const struct mill_body body = mill_setup_drum_body(&drum);
    return mill_solid_profile(&body);
}

double mill_deck_mill_volume(const struct mill_deck *deck)
{
    const struct mill_setup_surface *container = deck->mill.container;
    const struct mill_deck_given *is = &deck->given;
    return container ? container->solid->volume(container->body)
                     : MILL_PI * is->drum_radius * is->drum_radius * is->drum_length;
}

/* [m^3] of the container without the shaft */
static double room_of(const struct mill_deck *deck)
{
    if (deck->mill.container)
        return mill_deck_mill_volume(deck);
    const double shaft = deck->mill.rotor ? deck->given.shaft_radius : 0.0;
    const struct mill_profile drum = mill_deck_mill_profile(deck);
    return (mill_profile_area(&drum) - MILL_PI * shaft * shaft) * deck->given.drum_length;
}

/* [m] diameter of the widest ball that fits between the walls of a container and has its centre on
 * the container's axis; INFINITY: it has no walls. The gap to the nearest wall is concave along the
 * axis. */
static double width_of(const struct mill_setup_surface *container)
{
    const struct mill_hull hull = mill_solid_hull(container->solid, container->body);
    double from = -hull.half, to = hull.half, width = INFINITY;
    struct mill_wall wall[MILL_WALLS];
    if (!container->solid->walls)
        return width;
    const int walls = container->solid->walls(container->body, wall);
    for (int step = 0; step < 200; step++) {
        double least[2];
        for (int side = 0; side < 2; side++) {
            const vec3 at = {0.0, 0.0, from + (side ? 2.0 : 1.0) / 3.0 * (to - from)};
            least[side] = INFINITY;
            for (int k = 0; k < walls; k++)
                least[side] = fmin(least[side], mill_part_wall_gap(&wall[k], at));
        }
        if (least[0] < least[1])
            from += (to - from) / 3.0;
        else
            to -= (to - from) / 3.0;
        width = 2.0 * fmax(least[0], least[1]);
    }
    return width;
}

/* clang-format off */
double mill_deck_mill_highest(int buckles, double radius)
{
    double sound = 0.0, unsound = radius;
    for (int i = 0; i < HALVINGS; i++) {
        const double h = sound + 0.5 * (unsound - sound);
        const struct mill_profile p = mill_profile_make(buckles, radius, h, 0.0);
        if (mill_profile_is_sound(&p))
            sound = h;
        else
            unsound = h;
    }
    return sound;
}

/* Neighbouring buckles must not touch. Height and number limit each other. The message names the
 * height, because users more often need a certain number. */
void mill_deck_mill_buckles(const struct mill_deck *deck, struct mill_deck_check *list)
{
    const struct mill_deck_given *is = &deck->given;
    if (!deck->mill.drum || !is->wavy)
        return;
    const struct mill_profile profile = mill_deck_mill_profile(deck);
    *list = (struct mill_deck_check){
        .wrong = !mill_profile_is_sound(&profile), "drum", "buckle_height",
        "%.0f buckles on a radius of %g m must be lower than %.4g m, or neighbouring ones run into "
        "each other; got %g m",
        {(double)is->buckles, is->drum_radius,
         mill_deck_mill_highest((int)is->buckles, is->drum_radius), is->buckle_height}};
}

/* Shaft and blades */
#define NEED "need a [drum] that does not move; here give the part as a [body.NAME] with 'motion = rotor'"
void mill_deck_mill_parts(const struct mill_deck *deck, struct mill_deck_check *list)
{
    const struct mill_deck_given *is = &deck->given;
    const struct mill_deck_mill *mill = &deck->mill;
    const bool still = mill->drum && mill->drum_rides == 0, wavy = is->wavy;
    const bool shaft = mill->rotor && is->shaft_radius > 0.0;
    const double bore = is->drum_radius - is->buckle_height;
    const char *blades = mill->parts.count > shaft ? mill->parts.section[shaft] : NULL;
    int hidden = shaft; /* the first blade that does not come out of the shaft */
    while (hidden < mill->parts.count && mill->parts.form[hidden].size.y > is->shaft_radius)
        hidden++;
    const bool hides = shaft && is->shaft_radius < bore && hidden < mill->parts.count;
    const struct mill_deck_check all[] = {
        {.wrong = shaft && !still, "rotor", "shaft_radius", "shafts " NEED},
        {.wrong = shaft && is->shaft_radius >= bore, "rotor", "shaft_radius", wavy
         ? "must be less than the drum's radius less the height of its buckles, %g m"
         : "must be less than the drum's radius, %g m", {bore}},
        {.wrong = blades && !still, blades, NULL, "blades " NEED},
        {.wrong = blades && !mill->rotor, blades, NULL, "blades need a section [rotor] that carries them"},
        {.wrong = hides, hides ? mill->parts.section[hidden] : NULL, "tip_radius",
         "must be greater than the shaft's radius, %g m, got %g m",
         {is->shaft_radius, hides ? mill->parts.form[hidden].size.y : 0.0}},
    };
    memcpy(list, all, sizeof all);
}

/* Does a ball of this kind fit into the container? One that fits exactly cannot move: it would hit
 * both sides again and again. One that is as wide as a buckle would touch a whole arc at once. */
void mill_deck_mill_sizes(const struct mill_deck *deck, int kind, struct mill_deck_check *list)
{
    const struct mill_deck_given *is = &deck->given;
    const struct mill_setup_surface *container = deck->mill.container;
    const struct mill_deck_balls *balls = &deck->mill.balls[kind];
    const bool drum = !container, wavy = is->wavy;
    const double d = balls->diameter, bore = is->drum_radius - is->buckle_height;
    const double apart = bore - is->shaft_radius, width = drum ? (double)INFINITY : width_of(container);
    const double buckle = drum && is->buckle_height > 0.0 ? 2.0 * mill_deck_mill_profile(deck).arc : (double)INFINITY;
    const char *name = drum ? "" : deck->mill.bodies.section[container - deck->mill.bodies.surface];
    const struct mill_deck_check all[] = {
        {.wrong = !(d < width * (1.0 - SNUG)), balls->section, "diameter",
         "a ball of %g m does not fit into the container [%s], whose smallest inner width or height "
         "is %g m", {d, width}, name},
        {.wrong = drum && d >= 2.0 * bore, balls->section, "diameter", wavy
         ? "a ball of %g m does not fit into a drum of radius %g m where its buckles come nearest to the axis"
         : "a ball of %g m does not fit into a drum of radius %g m", {d, bore}},
        {.wrong = fabs(d - buckle) <= SNUG * (2.0 * is->drum_radius - bore), balls->section, "diameter",
         "a ball of %g m is exactly as wide as a buckle of the drum and would stick there: make it a "
         "little smaller or larger", {d}},
        {.wrong = drum && d >= is->drum_length, balls->section, "diameter",
         "a ball of %g m does not fit into a drum %g m long", {d, is->drum_length}},
        {.wrong = drum && deck->mill.rotor && d >= apart, balls->section, "diameter", wavy
         ? "a ball of %g m does not fit between the shaft and the drum, %g m apart where its buckles "
         "come nearest to the axis"
         : "a ball of %g m does not fit between the shaft and the drum, %g m apart", {d, apart}},
    };
    memcpy(list, all, sizeof all);
}

/* Are the balls up to this kind too many? */
void mill_deck_mill_amount(const struct mill_deck *deck, int kind, struct mill_deck_check *list)
{
    const struct mill_deck_mill *mill = &deck->mill;
    const struct mill_deck_balls *balls = mill->balls;
    const double room = room_of(deck), most = (mill->kinds == 1 ? DENSEST : 1.0) * room;
    double total = 0.0, before = 0.0, volume = 0.0, filled = 0.0;
    for (int k = 0; k <= kind; k++) {
        const double d = balls[k].diameter, count = (double)balls[k].count;
        before = total;
        filled = volume;
        total += count;
        volume += count * MILL_PI / 6.0 * d * d * d;
    }
    const struct mill_deck_check all[] = {
        {.wrong = total > MILL_DECK_MOST_BALLS && before <= MILL_DECK_MOST_BALLS, balls[kind].section,
         balls[kind].given, "more than %.0f balls in all", {MILL_DECK_MOST_BALLS}},
        {.wrong = volume > most && filled <= most, balls[kind].section, balls[kind].given, mill->drum
         ? "%.0f balls do not fit: they fill %.3g litres of the drum's %.3g"
         : "%.0f balls do not fit: they fill %.3g litres of the container's %.3g",
         {total, 1e3 * volume, 1e3 * room}},
    };
    memcpy(list, all, sizeof all);
}

#define STARTS "is for a random start only; the start file has its own speeds"
void mill_deck_mill_starts(const struct mill_deck *deck, struct mill_deck_check *list)
{
    const struct mill_deck_given *is = &deck->given;
    const struct mill_deck_check all[] = {
        {.wrong = is->start && is->speed != 0.0, "balls", "speed", STARTS},
        {.wrong = is->start && is->at_rest, "balls", "start_motion", STARTS},
    };
    memcpy(list, all, sizeof all);
}
/* clang-format on */
