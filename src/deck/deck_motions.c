/* Converts the rotor and the [motion.NAME] to the engine's form, each after the motion that carries
 * it, and reads the tables of measured motions. */
#include "deck/deck_private.h"

enum { MOST_ROWS = 10000000, COLUMNS = 7 };
#define MOST_CRITICAL 10.0 /* times the critical speed */
#define NEARLY 1e-3  /* a rotation this near to whole turns, relative to them, is meant as these */
#define ROUNDED 1e-5 /* [rad] error of 2 pi with five decimals or more */
#define ALONG 1e-6   /* two lines nearer than this, relative to their lengths, are meant as one */

/* ---- tables ---- */

/* Whole turns from the first rotation vector to the last, if all are along one axis; 0: none */
static double turns_of(const double (*row)[COLUMNS], size_t rows)
{
    const double *first = row[0] + 4, *last = row[rows - 1] + 4;
    const vec3 by = {last[0] - first[0], last[1] - first[1], last[2] - first[2]};
    const double size = vec3_norm(by), turns = round(size / (2.0 * MILL_PI));
    for (size_t k = 0; k < rows; k++) {
        const vec3 r = {row[k][4], row[k][5], row[k][6]};
        if (vec3_norm(vec3_cross(r, by)) > 1e-9 * size * (1.0 + vec3_norm(r)))
            return 0.0;
    }
    return fabs(size - 2.0 * MILL_PI * turns) < NEARLY * size ? turns : 0.0;
}

/* Checks that the last row of a period is the position of the first, and lets whole turns be whole
 * to the last digit: no decimal number is 2 pi. */
static bool check_rows(const struct mill_deck_rows *t)
{
    static const char *const column[COLUMNS] = {"t", "x", "y", "z", "rx", "ry", "rz"};
    enum { LEAST = 4 };
    double(*row)[COLUMNS] = t->row.item;
    const size_t rows = t->row.count;
    const long *line = t->line.item, end = rows > 0 ? line[rows - 1] : 1;
    for (size_t k = 1; k < rows; k++)
        if (!(row[k][0] > row[k - 1][0]))
            return mill_deck_files_wrong(t, line[k],
                                         "times must ascend, but %.10g s comes after %.10g s",
                                         row[k][0], row[k - 1][0]);
    if (rows < LEAST)
        return mill_deck_files_wrong(t, end, "%zu rows are too few: a period needs at least %d",
                                     rows, LEAST);
    const double *first = row[0], turns = turns_of((const double(*)[COLUMNS])row, rows);
    double *last = row[rows - 1], size = 0.0;
    for (int i = 4; i < COLUMNS; i++)
        size = hypot(size, last[i] - first[i]);
    for (int i = 1; i < COLUMNS; i++) {
        const double off = last[i] - first[i];
        const double good =
            i < 4 || turns == 0.0 ? first[i] : first[i] + 2.0 * MILL_PI * turns * (off / size);
        double lo = first[i], hi = lo;
        for (size_t k = 1; k < rows; k++) {
            lo = fmin(lo, row[k][i]);
            hi = fmax(hi, row[k][i]);
        }
        if (!(fabs(last[i] - good) <= (good != first[i] ? ROUNDED : fmax(1e-9 * (hi - lo), 1e-12))))
            return mill_deck_files_wrong(
                t, end,
                "the last row must repeat the first, but %s is %.10g there and %.10g here, %.2g "
                "%s off: write %.10g%s",
                column[i], first[i], last[i], fabs(last[i] - good), i < 4 ? "m" : "rad", good,
                i > 3 && fabs(last[i] - good) > 1.0 ? "; whole turns are about one axis" : "");
        if (good != first[i])
            last[i] = good;
    }
    return true;
}

static bool read_table(struct mill_deck *deck, const struct mill_deck_section *section,
                       struct mill_table *table)
{
    const char **file = &((struct mill_deck_motion *)section->form)->as.file;
    if (!mill_deck_files_find(&deck->text, section->title, "file", file))
        return false;
    struct mill_deck_rows rows = {
        &deck->text,   section->title,   "file", *file, "7 numbers 't x y z rx ry rz' in SI units",
        1u << COLUMNS, .most = MOST_ROWS};
    const bool good = mill_deck_files_read(&rows) && check_rows(&rows);
    *table = (struct mill_table){rows.row.count, rows.row.item};
    return good;
}

/* ---- the list ---- */

/* Adds a motion of the engine. Scales its axis to length 1, exactly so along x, y or z. */
static bool add_motion(struct mill_deck *deck, const struct mill_deck_section *section, int on)
{
    static const struct mill_motion_type *const type[] = {&mill_turn_type, &mill_swing_type,
                                                          &mill_shift_type, &mill_table_type};
    const int k = deck->setup.motions++;
    struct mill_deck_motion *is = &deck->mill.form[k];
    *is = *(struct mill_deck_motion *)section->form;
    deck->mill.motion[k] = (struct mill_setup_motion){
        .name = mill_deck_name(section), .type = type[is->kind], .form = &is->as, .on = on};
    if (is->kind == MILL_DECK_TURN)
        is->as.turn.axis = mill_deck_motions_unit(is->as.turn.axis);
    else if (is->kind == MILL_DECK_SWING)
        is->as.swing.axis = mill_deck_motions_unit(is->as.swing.axis);
    return is->kind != MILL_DECK_TABLE || read_table(deck, section, &is->as.table);
}

/* The number of the motion of this name; MILL_STILL: there is none yet */
static int place_of(const struct mill_deck *deck, const char *name)
{
    for (int k = 0; k < deck->setup.motions; k++)
        if (strcmp(deck->mill.motion[k].name, name) == 0)
            return k;
    return MILL_STILL;
}

vec3 mill_deck_motions_unit(vec3 a)
{
    const double length = vec3_norm(a);
    return vec3_make(a.x / length, a.y / length, a.z / length);
}

bool mill_deck_motions_find(const struct mill_deck *deck, const char *section, const char *key,
                            const char *name, int *motion)
{
    const struct mill_deck_section *s = NULL;
    char hint[2 * MILL_NAME_LENGTH] = "";
    int edits, best = MILL_DECK_MOST_EDITS;
    *motion = name ? place_of(deck, name) : MILL_STILL;
    if (!name || *motion != MILL_STILL)
        return true;
    if (strcmp(name, "rotor") == 0)
        return mill_deck_wrong(&deck->text, section, key, "there is no section [rotor]");
    while ((s = mill_deck_named(&deck->text, "motion", s)))
        if ((edits = mill_deck_suggest_edits(mill_deck_name(s), name)) < best) {
            best = edits;
            snprintf(hint, sizeof hint, "; did you mean '%s'?", mill_deck_name(s));
        }
    return mill_deck_wrong(&deck->text, section, key, "there is no section [motion.%.63s]%s", name,
                           hint);
}

/* The remaining motions all wait for their carriers. Following these leads into the circle. */
static bool tell_circle(const struct mill_deck *deck, const struct mill_deck_section *section)
{
    for (int k = 0; k < MILL_MOTIONS_MOST; k++)
        section =
            mill_deck_find(&deck->text, "motion", ((struct mill_deck_motion *)section->form)->on);
    const char *on = ((struct mill_deck_motion *)section->form)->on;
    const char *name = mill_deck_name(section), *wrong = "a motion cannot carry itself";
    if (strcmp(on, name) != 0)
        wrong = "motions carry each other in a circle: '%s' is itself carried by '%s'";
    return mill_deck_wrong(&deck->text, section->title, "on", wrong, on, name);
}

static bool list_named(struct mill_deck *deck)
{
    const struct mill_deck_section *waiting[MILL_MOTIONS_MOST], *s = NULL;
    int n = 0;
    while ((s = mill_deck_named(&deck->text, "motion", s))) {
        if (deck->setup.motions + n == MILL_MOTIONS_MOST)
            return mill_deck_wrong(&deck->text, s->title, NULL,
                                   "there are more than %d motions, the rotor's included",
                                   MILL_MOTIONS_MOST);
        waiting[n++] = s;
    }
    for (int left = 0; n > 0; n = left, left = 0) {
        for (int k = 0; k < n; k++) {
            const char *on = ((struct mill_deck_motion *)waiting[k]->form)->on;
            int carrier = MILL_STILL;
            if (on && place_of(deck, on) == MILL_STILL && mill_deck_find(&deck->text, "motion", on))
                waiting[left++] = waiting[k];
            else if (!mill_deck_motions_find(deck, waiting[k]->title, "on", on, &carrier) ||
                     !add_motion(deck, waiting[k], carrier))
                return false;
        }
        if (left == n)
            return tell_circle(deck, waiting[0]);
    }
    return true;
}

void mill_deck_motions_list(struct mill_deck *deck)
{
    int rides = MILL_STILL;
    deck->setup.motion = deck->mill.motion;
    deck->setup.rotor = deck->mill.rotor ? 0 : MILL_STILL;
    if (deck->mill.rotor) {
        deck->given.rotor.axis = vec3_make(1.0, 0.0, 0.0);
        deck->mill.motion[deck->setup.motions++] = (struct mill_setup_motion){
            .name = "rotor", .type = &mill_turn_type, .form = &deck->given.rotor, .on = MILL_STILL};
    }
    if (list_named(deck) && deck->mill.drum)
        mill_deck_motions_find(deck, "drum", "motion", deck->given.drum_motion, &rides);
    deck->setup.drum.rides = 1 + rides;
}

/* The drum, or a round container, that one turn alone carries about its own axis: the largest ball
 * at its wall has no weight at the top if w^2 (R - r) = g, of gravity the part across the axis. */
static double critical_of(const struct mill_deck *deck)
{
    const struct mill_setup *setup = &deck->setup;
    const struct mill_setup_surface *c = deck->mill.container;
    const struct mill_setup_motion *m =
        deck->mill.carrier >= 0 ? &setup->motion[deck->mill.carrier] : NULL;
    if (!m || m->type != &mill_turn_type || m->on >= 0 || (c && !c->solid->round))
        return 0.0;
    const struct mill_turn *turn = m->form;
    const struct mill_body is = c ? *c->body : mill_setup_drum_body(&setup->drum);
    const double radius = c ? mill_solid_hull(c->solid, &is).radius : is.radius;
    const vec3 off = vec3_cross(vec3_sub(is.centre, turn->centre), turn->axis);
    const double across = vec3_norm(vec3_cross(setup->gravity, turn->axis));
    const bool own =
        vec3_norm(vec3_cross(is.z, turn->axis)) < ALONG && vec3_norm(off) < ALONG * radius;
    return own && across > ALONG * vec3_norm(setup->gravity)
               ? sqrt(across / (radius - 0.5 * deck->mill.widest))
               : 0.0;
}

/* Sets the speed of motion k that is a share of the critical one. */
static void resolve(struct mill_deck *deck, const char *section, int k, double share, double *speed)
{
    const struct mill_deck_mill *mill = &deck->mill;
    if (fabs(share) > MOST_CRITICAL)
        mill_deck_wrong(&deck->text, section, "speed",
                        "%g times the critical speed: write '%g %% critical'?", share, share);
    else if (share != 0.0 && (k != mill->carrier || mill->critical == 0.0))
        mill_deck_wrong(
            &deck->text, section, "speed", "there is no critical speed: %s; give the speed in rpm",
            k != mill->carrier ? "this motion does not carry the container"
                               : "the container must be a drum or round body that this turn alone "
                                 "carries about its own axis, across gravity");
    else if (share != 0.0)
        *speed = deck->mill.form[k].as.turn.speed = share * mill->critical;
    if (k == mill->carrier && mill->critical > 0.0)
        deck->mill.share = fabs(*speed) / mill->critical;
}

void mill_deck_motions_turn(struct mill_deck *deck)
{
    struct mill_deck_section *s = NULL;
    deck->mill.critical = critical_of(deck);
    resolve(deck, "rotor", deck->setup.rotor, deck->given.share, &deck->given.rotor.speed);
    while ((s = mill_deck_named(&deck->text, "motion", s))) {
        struct mill_deck_motion *is = s->form;
        resolve(deck, s->title, place_of(deck, mill_deck_name(s)), is->share, &is->as.turn.speed);
    }
}
