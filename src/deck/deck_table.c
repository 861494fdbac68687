/* What may stand in a deck: every section with its keys, each with type, SI unit, range, default,
 * meaning and place in a struct. Reading, checking, printing and the messages all work from these
 * tables, in their order; those of the shapes stand beside the shapes. A wrong name is answered
 * with the nearest right one. */
#include "deck/deck_private.h"

#include "geometry/shapes.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum {
    /* More would be finer than the few hundred points by which maps and outlines see a drum. */
    MOST_BUCKLES = 500,
    MOST_BLADES = 10000,
    MOST_FRICTION = 10
};
#define SEED_MAX 4294967295.0 /* what the generator tells apart */
#define MOST_COLLISIONS 1e15  /* as a double a count is exact that far */
/* In a mill of ten kilometres a place is told to 2e-12 m: a larger one could not keep overlaps
 * below a nanometre. */
#define SIZE_OF_MILL .lo = 0, .above = true, .hi = 1e4
/* [m] Far below what flies freely in air */
#define LEAST_DIAMETER 1e-9
/* [kg/m^3] A thousandth of air's, so that balls of next to no mass can be had, and the energies of
 * the smallest stay far above what a double can hold */
#define LEAST_DENSITY 1e-3

#define ANY MILL_KEY_ANY
#define POSITIVE MILL_KEY_POSITIVE
#define NOT_NEGATIVE MILL_KEY_NOT_NEGATIVE
#define IN(type, member) .offset = offsetof(struct type, member)
#define DECK(member) IN(mill_deck, member)

/* It is found in the run. */
static bool sample_found(const void *deck)
{
    return ((const struct mill_deck *)deck)->sample_found;
}

static bool is_circle(const void *deck)
{
    return !((const struct mill_deck *)deck)->wavy;
}

/* The count says it. */
static bool always(const void *balls)
{
    (void)balls;
    return true;
}

/* clang-format off */
static const struct mill_key run_key[] = {
    {"time", "end of the run", .unit = "s", POSITIVE, DECK(time)},
    {"sample_from", "statistics are gathered from here to the end", .unit = "s", NOT_NEGATIVE,
     .preset = "0 s", DECK(sample_from), .hidden = sample_found},
    {"precision", "the run ends when median speed and rotor power are known to this relative "
     "error; 0: at run.time", .unit = "1", .lo = 0, .hi = 1, .preset = "0", DECK(precision),
     .zero_is_off = true},
    {"max_collisions", "the run ends after this many collisions; 0: at run.time", .lo = 0,
     .hi = MOST_COLLISIONS, .preset = "0", DECK(max_collisions), .zero_is_off = true},
    {"seed", "seed of every random choice", .type = MILL_KEY_WHOLE, .lo = 0, .hi = SEED_MAX,
     .preset = "1", DECK(seed)},
    {.name = NULL},
};

static const struct mill_key gravity_key[] = {
    {"acceleration", "acceleration of gravity along x, y and z", .type = MILL_KEY_VECTOR,
     .unit = "m/s^2", ANY, .preset = "0 0 -9.81 m/s^2", DECK(gravity)},
    {.name = NULL},
};

static const struct mill_key ball_key[] = {
    {"count", "number of balls", .type = MILL_KEY_WHOLE, .lo = 1, .hi = MILL_DECK_MOST_BALLS,
     .instead = "fill", IN(mill_deck_balls, count)},
    {"fill", "volume of the balls over that of the drum, instead of their number", .unit = "1",
     .lo = 0, .above = true, .hi = 1, .derived = true, .instead = "count", .hidden = always,
     IN(mill_deck_balls, fill)},
    {"diameter", "diameter of a ball", .unit = "m", .lo = LEAST_DIAMETER, .hi = MILL_KEY_LARGEST,
     IN(mill_deck_balls, diameter)},
    {"density", "density of the balls' material", .unit = "kg/m^3", .lo = LEAST_DENSITY,
     .hi = MILL_KEY_LARGEST, IN(mill_deck_balls, density)},
    {.name = NULL},
};

static const struct mill_key start_key[] = {
    {"start", "random, or a file with one ball a line: x y z [vx vy vz [wx wy wz]] in SI",
     .type = MILL_KEY_FILE, .preset = "random", DECK(start), .words = "random"},
    {"speed", "speed of every ball of a random start, in a random direction", .unit = "m/s",
     NOT_NEGATIVE, .preset = "0 m/s", DECK(speed)},
    {.name = NULL},
};

#define WAVY                                                                                       \
    .hidden = is_circle,                                                                           \
    .needs = "belongs to the wavy profile: add 'profile = wavy', or leave it out"
static const struct mill_key drum_key[] = {
    {"radius", "inner radius of the drum", .unit = "m", SIZE_OF_MILL, DECK(drum_radius)},
    {"length", "inner length of the drum", .unit = "m", SIZE_OF_MILL, DECK(drum_length)},
    {"profile", "shape of the drum's wall", .type = MILL_KEY_CHOICE, .preset = "circle", DECK(wavy),
     .words = "circle|wavy"},
    {"buckles", "number of buckles around the drum", .type = MILL_KEY_WHOLE, .lo = 2,
     .hi = MOST_BUCKLES, DECK(buckles), WAVY},
    {"buckle_height", "height of the buckles: the wall lies between radius - height and "
     "radius + height", .unit = "m", NOT_NEGATIVE, DECK(buckle_height), WAVY},
    {"buckle_angle", "angle of one outermost point, from +y towards +z", .unit = "rad", ANY,
     .preset = "0 deg", DECK(buckle_angle), WAVY},
    {.name = NULL},
};

static const struct mill_key rotor_key[] = {
    {"speed", "constant speed of the rotor, positive about +x", .unit = "rad/s", ANY,
     DECK(rotor_speed)},
    {"shaft_radius", "radius of the shaft; 0 m: none", .unit = "m", NOT_NEGATIVE,
     DECK(shaft_radius)},
    {"angle", "angle of the rotor at t = 0, from +y towards +z", .unit = "rad", ANY,
     .preset = "0 deg", DECK(rotor_angle)},
    {.name = NULL},
};

static const struct mill_key blades_key[] = {
    {"count", "number of equal blades, evenly spaced along the drum", .type = MILL_KEY_WHOLE,
     .lo = 1, .hi = MOST_BLADES, IN(mill_deck_blades, count)},
    {.name = NULL},
};

static const struct mill_key spread_key[] = {
    {"angle_step", "angle from one blade to the next", .unit = "rad", ANY, .derived = true,
     IN(mill_deck_blades, angle_step)},
    {.name = NULL},
};

static const struct mill_key law_key[] = {
    {"restitution", "normal coefficient of restitution", .lo = 0, .hi = 1,
     IN(mill_law, restitution)},
    {"friction", "Coulomb's coefficient of friction; 0: smooth", .lo = 0, .hi = MOST_FRICTION,
     .preset = "0", IN(mill_law, friction)},
    {"tangential_restitution", "tangential restitution of a sticking contact", .lo = -1, .hi = 1,
     .preset = "0", IN(mill_law, tangential)},
    {.name = NULL},
};

static const struct mill_key floor_key[] = {
    {"rebound_floor", "least normal speed after any contact", .unit = "m/s", NOT_NEGATIVE,
     .preset = "5 mm/s", DECK(rebound_floor)},
    {.name = NULL},
};

static const struct mill_key output_key[] = {
    {"frames", "interval of stored ball states; 0 s: none", .unit = "s", NOT_NEGATIVE,
     .preset = "10 ms", DECK(frames)},
    {"series", "interval of the time series", .unit = "s", POSITIVE, .preset = "1 ms",
     DECK(series)},
    {"impacts", "statistics, or all to log every impact", .type = MILL_KEY_CHOICE,
     .preset = "statistics", DECK(log_impacts), .words = "statistics|all"},
    {"strike_window", "contacts of a pair closer in time than this are one strike", .unit = "s",
     NOT_NEGATIVE, .preset = "10 us", DECK(strike_window)},
    {"checkpoint", "wall-clock interval of checkpoints", .unit = "s", POSITIVE, .preset = "60 s",
     DECK(checkpoint)},
    {.name = NULL},
};

#define VALUES(member) .values = offsetof(struct mill_deck, member)
static const struct mill_deck_block blocks[] = {
    {"run", .key = run_key},
    {"gravity", .key = gravity_key},
    {"balls", .key = ball_key, VALUES(alike), .unless_named = true},
    {"balls", .key = start_key},
    {"balls", .named = true, .key = ball_key, .size = sizeof(struct mill_deck_balls)},
    {"drum", .key = drum_key},
    {"rotor", .optional = true, .key = rotor_key},
    {"blades", .optional = true, .key = blades_key, VALUES(blades)},
    {"blades", .optional = true, .key = mill_blade_key + MILL_BLADE_PLACES, VALUES(blades.form)},
    {"blades", .optional = true, .key = spread_key, VALUES(blades)},
    /* here come those of the shapes */
    {"contact", .key = law_key, VALUES(general)},
    {"contact", .key = floor_key},
    {"contact", .named = true, .inherits = true, .key = law_key, VALUES(general),
     .size = sizeof(struct mill_law)},
    {"output", .key = output_key},
};
enum { BEFORE_SHAPES = 10, BLOCKS = sizeof blocks / sizeof *blocks };
/* clang-format on */

bool mill_deck_table_block(int i, struct mill_deck_block *block)
{
    int shapes = 0;
    while (mill_shapes_named[shapes])
        shapes++;
    assert(strcmp(blocks[BEFORE_SHAPES].title, "contact") == 0);
    if (i >= BEFORE_SHAPES && i < BEFORE_SHAPES + shapes) {
        const struct mill_shape_type *t = mill_shapes_named[i - BEFORE_SHAPES];
        *block =
            (struct mill_deck_block){t->name, true, .size = t->form, .key = t->key, .shape = t};
    } else if (i < BLOCKS + shapes) {
        *block = blocks[i < BEFORE_SHAPES ? i : i - shapes];
    }
    return i < BLOCKS + shapes;
}

bool mill_deck_table_belongs(const struct mill_deck_block *block, const char *title)
{
    const size_t length = strlen(block->title);
    return strncmp(title, block->title, length) == 0 &&
           title[length] == (block->named ? '.' : '\0');
}

const struct mill_key *mill_deck_table_key(const char *title, const char *name)
{
    struct mill_deck_block block;
    for (int i = 0; mill_deck_table_block(i, &block); i++)
        for (const struct mill_key *key = block.key; key->name; key++)
            if (mill_deck_table_belongs(&block, title) && strcmp(key->name, name) == 0)
                return key;
    return NULL;
}

static char lower(char c)
{
    return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

/* Do so many edits (a letter more, less, other, or two swapped) make b of a, case aside? */
static bool is_near(const char *a, const char *b, int edits)
{
    for (; *a && lower(*a) == lower(*b); a++)
        b++;
    if (!*a && !*b)
        return true;
    const bool both = *a && *b;
    const bool swapped = both && lower(a[0]) == lower(b[1]) && lower(a[1]) == lower(b[0]);
    return edits > 0 &&
           ((both && is_near(a + 1, b + 1, edits - 1)) || (*a && is_near(a + 1, b, edits - 1)) ||
            (*b && is_near(a, b + 1, edits - 1)) || (swapped && is_near(a + 2, b + 2, edits - 1)));
}

enum { MOST_EDITS = 8 };

/* How many make `word` of `text`; MOST_EDITS: more than a third of the word, no slip of the finger
 */
static int edits_to(const char *word, const char *text)
{
    const int third = (int)strlen(word) / 3, most = third > 1 ? third : 1;
    for (int n = 0; n <= most && n < MOST_EDITS; n++)
        if (is_near(text, word, n))
            return n;
    return MOST_EDITS;
}

/* "run", "balls.NAME" */
static void name_block(const struct mill_deck_block *block, const char *name, char out[40])
{
    snprintf(out, 40, "%s%s%s", block->title, block->named ? "." : "", block->named ? name : "");
}

void mill_deck_table_suggest(const char *title, const char *name, char *hint, size_t size)
{
    const int stem_length = (int)strcspn(title, ".") + 1;
    char stem[40], word[40];
    struct mill_deck_block block;
    int edits, best = MOST_EDITS;
    snprintf(stem, sizeof stem, "%.*s", stem_length, title);
    hint[0] = '\0';
    for (int i = 0; mill_deck_table_block(i, &block); i++) {
        name_block(&block, "", word);
        if (!name && (edits = edits_to(word, stem)) < best) {
            best = edits;
            name_block(&block, "NAME", word);
            snprintf(hint, size, "; did you mean [%s]?", word);
        }
        name_block(&block, "NAME", word);
        for (const struct mill_key *key = block.key; name && key->name; key++) {
            if (!mill_deck_table_belongs(&block, title)) {
                if (!hint[0] && strcmp(key->name, name) == 0)
                    snprintf(hint, size, "; '%s' belongs to [%s]", name, word);
            } else if ((edits = edits_to(key->name, name)) < best) {
                best = edits;
                snprintf(hint, size, "; did you mean '%s'?", key->name);
            }
        }
    }
}
