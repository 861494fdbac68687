/* What a deck may contain: every section with its keys, each with type, SI unit, range, default,
 * meaning and place in a struct. Reading, checking, printing and messages all use these tables, in
 * their order. Keys that must agree with others are with their checks in deck_run.c, deck_mill.c
 * and deck_uses.c, the sizes of solids with the code of the solids. */
#include "deck/deck_keys.h"
#include "geometry/shapes.h"

#include <assert.h>
#include <string.h>

enum { MOST_FRICTION = 10 };

static bool is_inside(const void *body)
{
    return ((const struct mill_deck_body *)body)->is.inside != 0;
}

static bool is_single(const void *body)
{
    return ((const struct mill_deck_body *)body)->copies < 2;
}

/* clang-format off */
#define LAW(member) .derived = true, IN(mill_deck_law, member)
static const struct mill_key law_key[] = {
    {"restitution", "normal coefficient of restitution", .lo = 0, .hi = 1, LAW(restitution)},
    {"restitution_speed", "normal speed at which it has this value; loss (1 - e) grows as v^(1/5); "
     "0 m/s: it is the same at any speed", .unit = "m/s", NOT_NEGATIVE, .zero_is_off = true,
     LAW(speed)},
    {"restitution_table", "a file with a row 'v e' for each normal speed [m/s], ascending",
     .type = MILL_KEY_FILE, LAW(table), .words = "none", .known = "steel"},
    {"friction", "Coulomb's coefficient of friction; 0: smooth", .lo = 0, .hi = MOST_FRICTION,
     LAW(friction)},
    {"tangential_restitution", "tangential restitution of a sticking contact", .lo = -1, .hi = 1,
     LAW(tangential)},
    {.name = NULL},
};

static const struct mill_key material_key[] = {
    {"density", "density of the material", .unit = "kg/m^3", .lo = LEAST_DENSITY,
     .hi = MILL_KEY_LARGEST, .derived = true, IN(mill_deck_material, density)},
    {.name = NULL},
};

static const struct mill_key floor_key[] = {
    {"rebound_floor", "minimum normal speed after any contact", .unit = "m/s", .lo = 0, .hi = 10,
     .preset = "5 mm/s", DECK(rebound_floor)},
    {"between", "material between the surfaces, such as powder; its contacts replace those of the "
     "materials", TEXT, DECK(between)},
    {.name = NULL},
};

#define PLACE .type = MILL_KEY_VECTOR, .unit = "m", .lo = -1e4, .hi = 1e4
#define DIRECTION .type = MILL_KEY_VECTOR, ANY, .direction = true, .preset = "0 0 1"
#define MOTION(member) IN(mill_deck_motion, member)
static const struct mill_key motion_key[] = {
    {"kind", "kind of motion", .type = MILL_KEY_CHOICE, MOTION(kind),
     .words = "turn|swing|shift|table"},
    {"on", "the motion that carries this one", TEXT, MOTION(on)},
    {.name = NULL},
};

static const struct mill_key turn_key[] = {
    {"centre", "a point of the axis", PLACE, .preset = "0 0 0 m", MOTION(as.turn.centre)},
    {"axis", "direction of the axis", DIRECTION, MOTION(as.turn.axis)},
    {"speed", "constant speed, by the right-hand rule", .unit = "rad/s", ANY,
     MOTION(as.turn.speed)},
    {"angle", "angle at t = 0", .unit = "rad", ANY, .preset = "0 deg", MOTION(as.turn.angle)},
    {.name = NULL},
};

static const struct mill_key swing_key[] = {
    {"centre", "a point of the axis", PLACE, .preset = "0 0 0 m", MOTION(as.swing.centre)},
    {"axis", "direction of the axis", DIRECTION, MOTION(as.swing.axis)},
    {"amplitude", "half of the whole swing", .unit = "rad", ANY, MOTION(as.swing.amplitude)},
    {"frequency", "whole swings per time", .unit = "Hz", NOT_NEGATIVE,
     MOTION(as.swing.frequency)},
    {"phase", "the angle is amplitude sin(2 pi frequency t + phase)", .unit = "rad", ANY,
     .preset = "0 deg", MOTION(as.swing.phase)},
    {.name = NULL},
};

static const struct mill_key shift_key[] = {
    {"amplitude", "half of the whole stroke, along x, y and z", PLACE, MOTION(as.shift.amplitude)},
    {"frequency", "cycles per time", .unit = "Hz", NOT_NEGATIVE, MOTION(as.shift.frequency)},
    {"phase", "along x, y and z: amplitude sin(2 pi frequency t + phase)",
     .type = MILL_KEY_VECTOR, .unit = "rad", ANY, .preset = "0 deg", .one_for_all = true,
     MOTION(as.shift.phase)},
    {.name = NULL},
};

static const struct mill_key table_key[] = {
    {"file", "one period, a row for each time: t x y z rx ry rz in SI, r a rotation vector",
     .type = MILL_KEY_FILE, MOTION(as.file)},
    {.name = NULL},
};

#define BODY(member) IN(mill_deck_body, member)
static const struct mill_key body_key[] = {
    {"shape", "shape of the body", .type = MILL_KEY_CHOICE, BODY(shape),
     .words = MILL_SOLID_WORDS},
    {"side", "where the balls are: outside of it, or inside", .type = MILL_KEY_CHOICE,
     .preset = "outside", BODY(is.inside), .words = "outside|inside"},
    {"motion", "what carries it: a motion's name, or rotor", TEXT, BODY(motion)},
    {"centre", "its middle in its motion's frame", PLACE, .preset = "0 0 0 m", BODY(is.centre)},
    {"axis", "direction of its own z in its motion's frame", DIRECTION, BODY(axis)},
    {"angle", "its turn about its own z", .unit = "rad", ANY, .preset = "0 deg", BODY(angle)},
    {"material", "its material", TEXT, BODY(material)},
    {.name = NULL},
};

static const struct mill_key mesh_key[] = {
    {"file", "an STL file", .type = MILL_KEY_FILE, BODY(file)},
    {"unit", "length of one unit in the file", .unit = "m", .lo = 0, .above = true, .hi = 1e4, .unit_alone = true,
     BODY(unit)},
    {.name = NULL},
};

static const struct mill_key copies_key[] = {
    {"copies", "number of equal bodies in all", .type = MILL_KEY_WHOLE, .lo = 1, .hi = MILL_DECK_MOST_BLADES,
     .preset = "1", BODY(copies), .hidden = is_inside,
     .needs = "a mill has one container: leave it out"},
    {"turn_by", "angle by which each copy is turned from the one before it", .unit = "rad", ANY,
     .preset = "0 deg", BODY(turn_by), .hidden = is_single},
    {"turn_about", "axis of this turn, through the origin of the motion's frame", DIRECTION,
     BODY(turn_about), .hidden = is_single},
    {"shift_by", "shift of each copy from the one before it, after the turn", PLACE, .preset = "0 0 0 m", BODY(shift_by),
     .hidden = is_single},
    {"kind", "kind of contact under which its contacts are counted", TEXT, BODY(kind)},
    {.name = NULL},
};

#define VALUES(member) .values = offsetof(struct mill_deck, given.member)
#define OF_MOTION "motion", .named = true, .size = sizeof(struct mill_deck_motion)
#define OF_BLADE "blade", .named = true, .size = sizeof(struct mill_blade)
#define OF_BODY "body", .named = true, .size = sizeof(struct mill_deck_body)
#define OF_MATERIAL                                                                                \
    "material", .named = true, .inherits = true, VALUES(unknown),                                  \
        .size = sizeof(struct mill_deck_material)
static const struct mill_deck_block blocks[] = {
    {"run", .key = mill_deck_run_key},
    {"gravity", .key = mill_deck_run_gravity},
    {"balls", .key = mill_deck_mill_ball, .unless_named = true, .size = sizeof(struct mill_deck_balls)},
    {"balls", .key = mill_deck_mill_start},
    {"balls", .named = true, .key = mill_deck_mill_ball, .size = sizeof(struct mill_deck_balls)},
    {"drum", .spared_by = "body", .key = mill_deck_mill_drum},
    {"rotor", .optional = true, .key = mill_deck_mill_rotor},
    {"blades", .optional = true, .key = mill_deck_mill_blades, VALUES(blades)},
    {"blades", .optional = true, .key = mill_deck_mill_blade_form, VALUES(blades.form)},
    {"blades", .optional = true, .key = mill_deck_mill_spread, VALUES(blades)},
    {OF_BLADE, .key = mill_deck_mill_blade},
    {OF_BLADE, .key = mill_deck_mill_blade_form},
    {OF_MOTION, .key = motion_key},
    {OF_MOTION, .key = turn_key, .words = 1u << MILL_DECK_TURN},
    {OF_MOTION, .key = swing_key, .words = 1u << MILL_DECK_SWING},
    {OF_MOTION, .key = shift_key, .words = 1u << MILL_DECK_SHIFT},
    {OF_MOTION, .key = table_key, .words = 1u << MILL_DECK_TABLE},
    {OF_BODY, .key = body_key},
    /* the blocks of the solids are inserted here */
    {OF_BODY, .key = copies_key},
    {"contact", .key = law_key, VALUES(general)},
    {"contact", .key = floor_key},
    {"contact", .named = true, .inherits = true, .key = law_key, VALUES(general),
     .size = sizeof(struct mill_deck_law)},
    {OF_MATERIAL, .key = material_key},
    {OF_MATERIAL, .key = law_key},
    {"powder", .optional = true, .key = mill_deck_uses_powder, VALUES(powder)},
    {"heat", .optional = true, .key = mill_deck_uses_heat, VALUES(heat)},
    {"wear", .optional = true, .key = mill_deck_uses_wear, VALUES(worn)},
    {"wear", .named = true, .inherits = true, .key = mill_deck_uses_wear, VALUES(worn),
     .size = sizeof(struct mill_deck_wear)},
    {"output", .key = mill_deck_run_output},
};
enum { BLOCKS = sizeof blocks / sizeof *blocks };
/* clang-format on */

bool mill_deck_table_block(int i, struct mill_deck_block *block)
{
    int solids = 0, before = 0;
    while (mill_shapes_solid(solids))
        solids++;
    while (blocks[before].key != copies_key)
        before++;
    const int k = i - before;
    if (k >= 0 && k < solids) {
        *block = (struct mill_deck_block){OF_BODY, .words = 1u << k};
        block->key = mill_shapes_solid(k)->key;
        block->at = offsetof(struct mill_deck_body, is);
        if (!block->key) { /* its facets are in a file */
            block->key = mesh_key;
            block->at = 0;
        }
    } else if (i < BLOCKS + solids) {
        *block = blocks[k < 0 ? i : i - solids];
    }
    return i < BLOCKS + solids;
}

bool mill_deck_table_belongs(const struct mill_deck_block *block, const char *title)
{
    const size_t length = strlen(block->title);
    return strncmp(title, block->title, length) == 0 &&
           title[length] == (block->named ? '.' : '\0');
}

const struct mill_key *mill_deck_table_key(const char *title, const char *name, int n)
{
    struct mill_deck_block block;
    for (int i = 0; mill_deck_table_block(i, &block); i++)
        for (const struct mill_key *key = block.key; key->name; key++)
            if (mill_deck_table_belongs(&block, title) && strcmp(key->name, name) == 0 && n-- == 0)
                return key;
    return NULL;
}
