/* What may stand in a deck: every key with its type, SI unit, range, default, meaning and place in
 * struct mill_deck. Reading, checking, printing and the messages all work from this one list, in
 * its order. A wrong name is answered with the nearest right one (edit distance with
 * transpositions: Damerau 1964, restricted form). */
#include "deck/deck_private.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#define SEED_MAX 4294967295.0 /* what the generator tells apart */
#define MOST_COLLISIONS 1e15  /* as a double a count is exact that far */
#define DECK(member) DECK_IN_DECK, offsetof(struct mill_deck, member)
#define BALLS(member) DECK_IN_BALLS, offsetof(struct mill_deck_balls, member)
#define BLADES(member) DECK_IN_BLADES, offsetof(struct mill_deck_blades, member)
#define BLADE(member) DECK_IN_BLADE, offsetof(struct mill_deck_blade, member)
#define LAW(member) DECK_IN_LAW, offsetof(struct mill_law, member)
#define NOWHERE DECK_NOWHERE, 0
#define ANY -MILL_DECK_LARGEST, MILL_DECK_LARGEST, false, false
#define POSITIVE 0, MILL_DECK_LARGEST, true, false
/* In a mill of ten kilometres a place is told to 2e-12 m: a larger one could not keep overlaps
 * below a nanometre. */
#define SIZE_OF_MILL 0, 1e4, true, false
#define NOT_NEGATIVE 0, MILL_DECK_LARGEST, false, false
#define FROM_TO(lo, hi) lo, hi, false, false
#define WAVY_FROM_TO(lo, hi) lo, hi, false, true
#define FILL 0, 1, true, false
#define REQUIRED NULL, false
#define DERIVED NULL, true
#define PRESET(text) text, false

/* More buckles would be finer than the few hundred points around by which maps and outlines see a
 * drum. */
enum { MOST_BUCKLES = 500, MOST_BLADES = 10000, MOST_FRICTION = 10 };

/* clang-format off: a table */
const struct mill_deck_key mill_deck_table[] = {
    {DECK_RUN, "time", DECK_NUMBER, "s", POSITIVE, REQUIRED, DECK(time), NULL, "end of the run"},
    {DECK_RUN, "sample_from", DECK_NUMBER, "s", NOT_NEGATIVE, PRESET("0 s"), DECK(sample_from),
     NULL, "statistics are gathered from here to the end"},
    {DECK_RUN, "precision", DECK_NUMBER, "1", FROM_TO(0, 1), PRESET("0"), DECK(precision), NULL,
     "the run ends when median and rotor power are known to this; 0: at its time"},
    {DECK_RUN, "max_collisions", DECK_NUMBER, NULL, FROM_TO(0, MOST_COLLISIONS), PRESET("0"),
     DECK(max_collisions), NULL, "the run ends after so many collisions; 0: at its time"},
    {DECK_RUN, "seed", DECK_SEED, NULL, FROM_TO(0, SEED_MAX), PRESET("1"), DECK(seed), NULL,
     "of every random choice"},

    {DECK_GRAVITY, "acceleration", DECK_VECTOR, "m/s^2", ANY, PRESET("0 0 -9.81 m/s^2"),
     DECK(gravity), NULL, "of gravity, along x y z"},

    {DECK_BALLS, "count", DECK_WHOLE, NULL, FROM_TO(1, MILL_DECK_MOST_BALLS), REQUIRED,
     BALLS(count), NULL, "number of balls"},
    {DECK_BALLS, "fill", DECK_NUMBER, "1", FILL, DERIVED, BALLS(fill), NULL,
     "volume of the balls over that of the drum, instead of their number"},
    {DECK_BALLS, "diameter", DECK_NUMBER, "m", POSITIVE, REQUIRED, BALLS(diameter), NULL,
     "of a ball"},
    {DECK_BALLS, "density", DECK_NUMBER, "kg/m^3", POSITIVE, REQUIRED, BALLS(density), NULL,
     "of the balls' material"},
    {DECK_BALLS, "start", DECK_FILE, NULL, ANY, PRESET("random"), DECK(start), "random",
     "random, or a file with one ball a line: x y z [vx vy vz [wx wy wz]] in SI"},
    {DECK_BALLS, "speed", DECK_NUMBER, "m/s", NOT_NEGATIVE, PRESET("0 m/s"), DECK(speed), NULL,
     "of every ball at a random start, in a random direction"},

    {DECK_BALLS_NAME, "count", DECK_WHOLE, NULL, FROM_TO(1, MILL_DECK_MOST_BALLS), REQUIRED,
     BALLS(count), NULL, "number of balls of this kind"},
    {DECK_BALLS_NAME, "fill", DECK_NUMBER, "1", FILL, DERIVED, BALLS(fill), NULL,
     "volume of these balls over that of the drum, instead of their number"},
    {DECK_BALLS_NAME, "diameter", DECK_NUMBER, "m", POSITIVE, REQUIRED, BALLS(diameter), NULL,
     "of a ball of this kind"},
    {DECK_BALLS_NAME, "density", DECK_NUMBER, "kg/m^3", POSITIVE, REQUIRED, BALLS(density), NULL,
     "of this kind's material"},

    {DECK_DRUM, "radius", DECK_NUMBER, "m", SIZE_OF_MILL, REQUIRED, DECK(drum_radius), NULL,
     "inner radius of the drum"},
    {DECK_DRUM, "length", DECK_NUMBER, "m", SIZE_OF_MILL, REQUIRED, DECK(drum_length), NULL,
     "inner length of the drum"},
    {DECK_DRUM, "profile", DECK_CHOICE, NULL, ANY, PRESET("circle"), DECK(wavy), "circle|wavy",
     "shape of the drum's wall"},
    {DECK_DRUM, "buckles", DECK_WHOLE, NULL, WAVY_FROM_TO(2, MOST_BUCKLES), REQUIRED, DECK(buckles),
     NULL, "number of buckles around the drum"},
    {DECK_DRUM, "buckle_height", DECK_NUMBER, "m", WAVY_FROM_TO(0, MILL_DECK_LARGEST), REQUIRED,
     DECK(buckle_height), NULL, "of the buckles: the wall lies within the radius less and more it"},
    {DECK_DRUM, "buckle_angle", DECK_NUMBER, "rad",
     WAVY_FROM_TO(-MILL_DECK_LARGEST, MILL_DECK_LARGEST), PRESET("0 deg"), DECK(buckle_angle), NULL,
     "of one outermost point, from +y towards +z"},

    {DECK_ROTOR, "speed", DECK_NUMBER, "rad/s", ANY, REQUIRED, DECK(rotor_speed), NULL,
     "constant speed of the rotor, positive about +x"},
    {DECK_ROTOR, "shaft_radius", DECK_NUMBER, "m", NOT_NEGATIVE, REQUIRED, DECK(shaft_radius), NULL,
     "radius of the shaft; 0 m: none"},
    {DECK_ROTOR, "angle", DECK_NUMBER, "rad", ANY, PRESET("0 deg"), DECK(rotor_angle), NULL,
     "of the rotor at t = 0, from +y towards +z"},

    {DECK_BLADES, "count", DECK_WHOLE, NULL, FROM_TO(1, MOST_BLADES), REQUIRED, BLADES(count), NULL,
     "number of equal blades, evenly spaced along the drum"},
    {DECK_BLADES, "tip_radius", DECK_NUMBER, "m", POSITIVE, REQUIRED, BLADES(tip_radius), NULL,
     "reach of a blade from the axis"},
    {DECK_BLADES, "width", DECK_NUMBER, "m", POSITIVE, REQUIRED, BLADES(width), NULL,
     "of a blade along the axis, before pitching"},
    {DECK_BLADES, "thickness", DECK_NUMBER, "m", POSITIVE, REQUIRED, BLADES(thickness), NULL,
     "of a blade around the axis, before pitching"},
    {DECK_BLADES, "pitch", DECK_NUMBER, "rad", ANY, PRESET("0 deg"), BLADES(pitch), NULL,
     "turn of a blade about its radial mid-line"},
    {DECK_BLADES, "angle_step", DECK_NUMBER, "rad", ANY, DERIVED, BLADES(angle_step), NULL,
     "angle from one blade to the next"},

    {DECK_BLADE_NAME, "position", DECK_NUMBER, "m", ANY, REQUIRED, BLADE(position), NULL,
     "x of the blade's centre"},
    {DECK_BLADE_NAME, "angle", DECK_NUMBER, "rad", ANY, REQUIRED, BLADE(angle), NULL,
     "of the blade on the rotor, from +y towards +z"},
    {DECK_BLADE_NAME, "tip_radius", DECK_NUMBER, "m", POSITIVE, REQUIRED, BLADE(tip_radius), NULL,
     "reach of the blade from the axis"},
    {DECK_BLADE_NAME, "width", DECK_NUMBER, "m", POSITIVE, REQUIRED, BLADE(width), NULL,
     "of the blade along the axis, before pitching"},
    {DECK_BLADE_NAME, "thickness", DECK_NUMBER, "m", POSITIVE, REQUIRED, BLADE(thickness), NULL,
     "of the blade around the axis, before pitching"},
    {DECK_BLADE_NAME, "pitch", DECK_NUMBER, "rad", ANY, PRESET("0 deg"), BLADE(pitch), NULL,
     "turn of the blade about its radial mid-line"},

    {DECK_CONTACT, "restitution", DECK_NUMBER, NULL, FROM_TO(0, 1), REQUIRED, LAW(restitution),
     NULL, "normal coefficient of restitution"},
    {DECK_CONTACT, "friction", DECK_NUMBER, NULL, FROM_TO(0, MOST_FRICTION), PRESET("0"),
     LAW(friction), NULL, "Coulomb's coefficient of friction; 0: smooth"},
    {DECK_CONTACT, "tangential_restitution", DECK_NUMBER, NULL, FROM_TO(-1, 1), PRESET("0"),
     LAW(tangential), NULL, "tangential restitution of a sticking contact"},
    {DECK_CONTACT, "rebound_floor", DECK_NUMBER, "m/s", NOT_NEGATIVE, PRESET("5 mm/s"),
     DECK(rebound_floor), NULL, "least normal speed after any contact"},

    {DECK_CONTACT_KIND, "restitution", DECK_NUMBER, NULL, FROM_TO(0, 1), DERIVED, LAW(restitution),
     NULL, "normal coefficient of restitution of this kind of contact"},
    {DECK_CONTACT_KIND, "friction", DECK_NUMBER, NULL, FROM_TO(0, MOST_FRICTION), DERIVED,
     LAW(friction), NULL, "Coulomb's coefficient of friction of this kind"},
    {DECK_CONTACT_KIND, "tangential_restitution", DECK_NUMBER, NULL, FROM_TO(-1, 1), DERIVED,
     LAW(tangential), NULL, "tangential restitution of this kind, sticking"},

    {DECK_OUTPUT, "frames", DECK_NUMBER, "s", NOT_NEGATIVE, PRESET("10 ms"), DECK(frames), NULL,
     "interval of stored ball states; 0 s: none"},
    {DECK_OUTPUT, "series", DECK_NUMBER, "s", POSITIVE, PRESET("1 ms"), DECK(series), NULL,
     "interval of the time series"},
    {DECK_OUTPUT, "impacts", DECK_CHOICE, NULL, ANY, PRESET("statistics"), DECK(log_impacts),
     "statistics|all", "statistics, or all to log every impact"},
    {DECK_OUTPUT, "strike_window", DECK_NUMBER, "s", NOT_NEGATIVE, PRESET("10 us"),
     DECK(strike_window), NULL, "contacts of a pair closer in time than this are one strike"},
    {DECK_OUTPUT, "checkpoint", DECK_NUMBER, "s", POSITIVE, PRESET("60 s"), DECK(checkpoint), NULL,
     "wall-clock interval of checkpoints"},
};
/* clang-format on */

const int mill_deck_table_length = sizeof mill_deck_table / sizeof *mill_deck_table;

static const char *const titles[DECK_PARTS] = {"run",     "gravity",  "balls",  "balls.",
                                               "drum",    "rotor",    "blades", "blade.",
                                               "contact", "contact.", "output"};

const char *mill_deck_table_title(enum mill_deck_part part)
{
    return titles[part];
}

enum mill_deck_part mill_deck_table_part(const char *title, const char **name)
{
    for (int part = 0; part < DECK_PARTS; part++) {
        const size_t length = strlen(titles[part]);
        const bool named = titles[part][length - 1] == '.';
        if (named ? strncmp(title, titles[part], length) == 0 : strcmp(title, titles[part]) == 0) {
            if (name)
                *name = named ? title + length : "";
            return (enum mill_deck_part)part;
        }
    }
    return DECK_PARTS;
}

const struct mill_deck_key *mill_deck_table_key(enum mill_deck_part part, const char *name)
{
    for (int i = 0; i < mill_deck_table_length; i++)
        if (mill_deck_table[i].part == part && strcmp(mill_deck_table[i].name, name) == 0)
            return &mill_deck_table[i];
    return NULL;
}

static int least(int a, int b, int c)
{
    const int ab = a < b ? a : b;
    return ab < c ? ab : c;
}

static char lower(char c)
{
    return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

/* Edits (a letter more, less, other, or two swapped) from one word to the other, case aside. */
static int edits(const char *a, const char *b)
{
    enum { LONGEST = 32 };
    int d[LONGEST + 1][LONGEST + 1];
    const int m = (int)strlen(a), n = (int)strlen(b);
    if (m > LONGEST || n > LONGEST)
        return 2 * LONGEST;
    for (int i = 0; i <= m; i++) {
        for (int j = 0; j <= n; j++) {
            if (i == 0 || j == 0) {
                d[i][j] = i + j;
                continue;
            }
            const int same = lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1;
            d[i][j] = least(d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + same);
            if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
                lower(a[i - 2]) == lower(b[j - 1]))
                d[i][j] = least(d[i][j], d[i - 2][j - 2] + same, d[i][j]);
        }
    }
    return d[m][n];
}

/* More edits than a third of the word and it is no longer a slip of the finger. */
static bool near(int distance, const char *word)
{
    const int third = (int)strlen(word) / 3;
    return distance <= (third > 1 ? third : 1);
}

void mill_deck_table_suggest_section(const char *title, char *hint, size_t size)
{
    const char *dot = strchr(title, '.');
    const size_t stem = dot ? (size_t)(dot - title) + 1 : strlen(title);
    char start[40];
    int best = 0, fewest = 1000;
    snprintf(start, sizeof start, "%.*s", stem < sizeof start ? (int)stem : 39, title);
    for (int part = 0; part < DECK_PARTS; part++) {
        const int distance = edits(start, titles[part]);
        if (distance < fewest) {
            fewest = distance;
            best = part;
        }
    }
    hint[0] = '\0';
    if (near(fewest, titles[best]))
        snprintf(hint, size, "; did you mean [%s%s]?", titles[best],
                 titles[best][strlen(titles[best]) - 1] == '.' ? "NAME" : "");
}

void mill_deck_table_suggest_key(enum mill_deck_part part, const char *name, char *hint,
                                 size_t size)
{
    const struct mill_deck_key *best = NULL;
    int fewest = 1000;
    hint[0] = '\0';
    for (int i = 0; i < mill_deck_table_length; i++) {
        const struct mill_deck_key *key = &mill_deck_table[i];
        const int distance = edits(name, key->name);
        if (key->part == part && distance < fewest) {
            fewest = distance;
            best = key;
        }
    }
    if (best && near(fewest, best->name)) {
        snprintf(hint, size, "; did you mean '%s'?", best->name);
        return;
    }
    for (int i = 0; i < mill_deck_table_length && !hint[0]; i++)
        if (strcmp(mill_deck_table[i].name, name) == 0) {
            const char *title = titles[mill_deck_table[i].part];
            snprintf(hint, size, "; '%s' belongs to [%s%s]", name, title,
                     title[strlen(title) - 1] == '.' ? "NAME" : "");
        }
}
