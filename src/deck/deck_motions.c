/* Converts the rotor and the [motion.NAME] to the engine's form, each after the motion that carries
 * it, and reads the tables of measured motions. */
#include "deck/deck_private.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_ROWS = 10000000, COLUMNS = 7 };
#define NEARLY 1e-3  /* a rotation this near to whole turns, relative to them, is meant as these */
#define ROUNDED 1e-5 /* [rad] error of 2 pi with five decimals or more */

static const char *name_of(const struct mill_deck_section *section)
{
    return strchr(section->title, '.') + 1;
}

/* ---- tables ---- */

/* Whole turns from the first rotation vector to the last, if all of them are along one axis; 0:
 * none
 */
static double turns_of(const struct mill_deck_rows *t)
{
    const double *first = t->row[0] + 4, *last = t->row[t->count - 1] + 4;
    const vec3 by = {last[0] - first[0], last[1] - first[1], last[2] - first[2]};
    const double size = vec3_norm(by), turns = round(size / (2.0 * MILL_PI));
    for (long k = 0; k < t->count; k++) {
        const vec3 r = {t->row[k][4], t->row[k][5], t->row[k][6]};
        if (vec3_norm(vec3_cross(r, by)) > 1e-9 * size * (1.0 + vec3_norm(r)))
            return 0.0;
    }
    return fabs(size - 2.0 * MILL_PI * turns) < NEARLY * size ? turns : 0.0;
}

/* Checks that the last row of a period is the position of the first, and lets whole turns be whole
 * to the last digit: no decimal number is 2 pi. */
static enum mill_status check_rows(struct mill_deck_rows *t, struct mill_error *error)
{
    static const char *const column[COLUMNS] = {"t", "x", "y", "z", "rx", "ry", "rz"};
    enum { LEAST = 4 };
    const long end = t->count > 0 ? t->line[t->count - 1] : 1;
    for (long k = 1; k < t->count; k++)
        if (!(t->row[k][0] > t->row[k - 1][0]))
            return mill_deck_files_wrong(t, t->line[k], error,
                                         "times must ascend, but %.10g s comes after %.10g s",
                                         t->row[k][0], t->row[k - 1][0]);
    if (t->count < LEAST)
        return mill_deck_files_wrong(
            t, end, error, "%ld rows are too few: a period needs at least %d", t->count, LEAST);
    const double *first = t->row[0], turns = turns_of(t);
    double *last = t->row[t->count - 1], size = 0.0;
    for (int i = 4; i < COLUMNS; i++)
        size = hypot(size, last[i] - first[i]);
    for (int i = 1; i < COLUMNS; i++) {
        const double off = last[i] - first[i];
        const double good =
            i < 4 || turns == 0.0 ? first[i] : first[i] + 2.0 * MILL_PI * turns * (off / size);
        double lo = first[i], hi = lo;
        for (long k = 1; k < t->count; k++) {
            lo = fmin(lo, t->row[k][i]);
            hi = fmax(hi, t->row[k][i]);
        }
        if (!(fabs(last[i] - good) <= (good != first[i] ? ROUNDED : fmax(1e-9 * (hi - lo), 1e-12))))
            return mill_deck_files_wrong(
                t, end, error,
                "the last row must repeat the first, but %s is %.10g there and %.10g here, %.2g "
                "%s off: write %.10g%s",
                column[i], first[i], last[i], fabs(last[i] - good), i < 4 ? "m" : "rad", good,
                i > 3 && fabs(last[i] - good) > 1.0 ? "; whole turns are about one axis" : "");
        if (good != first[i])
            last[i] = good;
    }
    return MILL_OK;
}

static enum mill_status read_table(struct mill_deck *deck, const struct mill_deck_section *section,
                                   struct mill_table *table)
{
    struct mill_error *error = deck->text.reading->error;
    const char **file = &((struct mill_deck_motion *)section->form)->as.file;
    enum mill_status status = mill_deck_files_find(&deck->text, section->title, "file", file);
    struct mill_deck_rows rows = {.text = &deck->text,
                                  .section = section->title,
                                  .key = "file",
                                  .path = *file,
                                  .form = "7 numbers 't x y z rx ry rz' in SI units",
                                  .columns = 1u << COLUMNS,
                                  .most = MOST_ROWS,
                                  .many = "more than %ld rows"};
    if (status == MILL_OK)
        status = mill_deck_files_read(&rows, error);
    if (status == MILL_OK)
        status = check_rows(&rows, error);
    double(*row)[COLUMNS] = malloc(((size_t)rows.count + 1) * sizeof *row);
    if (status == MILL_OK && !row)
        status = mill_deck_memory(&deck->text);
    for (long k = 0; k < rows.count && row; k++)
        memcpy(row[k], rows.row[k], sizeof *row);
    free(rows.row);
    free(rows.line);
    mill_deck_files_keep(&deck->text, row);
    *table = (struct mill_table){(size_t)rows.count, (const double(*)[COLUMNS])row};
    return status;
}

/* ---- the list ---- */

/* Adds a motion of the engine. Scales its axis to length 1, exactly so along x, y or z. */
static enum mill_status add_motion(struct mill_deck *deck, const struct mill_deck_section *section,
                                   int on)
{
    static const struct mill_motion_type *const type[] = {&mill_turn_type, &mill_swing_type,
                                                          &mill_shift_type, &mill_table_type};
    struct mill_deck_motion *is = &deck->mill.form[deck->mill.motions];
    *is = *(struct mill_deck_motion *)section->form;
    deck->mill.motion[deck->mill.motions] = (struct mill_setup_motion){
        .name = name_of(section), .type = type[is->kind], .form = &is->as, .on = on};
    deck->mill.motions++;
    if (is->kind == MILL_DECK_TURN)
        is->as.turn.axis = mill_deck_motions_unit(is->as.turn.axis);
    else if (is->kind == MILL_DECK_SWING)
        is->as.swing.axis = mill_deck_motions_unit(is->as.swing.axis);
    return is->kind == MILL_DECK_TABLE ? read_table(deck, section, &is->as.table) : MILL_OK;
}

int mill_deck_motions_place(const struct mill_deck *deck, const char *name)
{
    for (int k = 0; k < deck->mill.motions; k++)
        if (strcmp(deck->mill.motion[k].name, name) == 0)
            return k;
    return MILL_STILL;
}

vec3 mill_deck_motions_unit(vec3 a)
{
    const double length = vec3_norm(a);
    return vec3_make(a.x / length, a.y / length, a.z / length);
}

enum mill_status mill_deck_motions_find(const struct mill_deck *deck, const char *section,
                                        const char *key, const char *name, int *motion)
{
    char hint[2 * MILL_NAME_LENGTH] = "";
    int edits, best = MILL_DECK_MOST_EDITS;
    *motion = name ? mill_deck_motions_place(deck, name) : MILL_STILL;
    if (!name || *motion != MILL_STILL)
        return MILL_OK;
    if (strcmp(name, "rotor") == 0)
        return mill_deck_wrong(&deck->text, section, key, "there is no section [rotor]");
    for (const struct mill_deck_section *s = NULL;
         (s = mill_deck_named(&deck->text, "motion", s));) {
        edits = mill_deck_suggest_edits(name_of(s), name);
        if (edits < best) {
            best = edits;
            snprintf(hint, sizeof hint, "; did you mean '%s'?", name_of(s));
        }
    }
    return mill_deck_wrong(&deck->text, section, key, "there is no section [motion.%.63s]%s", name,
                           hint);
}

/* The remaining motions all wait for their carriers. Following the carriers leads
 * into the circle. */
static enum mill_status tell_circle(const struct mill_deck *deck,
                                    const struct mill_deck_section *section)
{
    char title[MILL_NAME_LENGTH + 8];
    for (int k = 0; k < MILL_MOTIONS_MOST; k++) {
        snprintf(title, sizeof title, "motion.%s", ((struct mill_deck_motion *)section->form)->on);
        section = mill_deck_section(&deck->text, title);
    }
    const struct mill_deck_motion *is = section->form;
    if (strcmp(is->on, name_of(section)) == 0)
        return mill_deck_wrong(&deck->text, section->title, "on", "a motion cannot carry itself");
    return mill_deck_wrong(&deck->text, section->title, "on",
                           "motions carry each other in a circle: '%s' is itself carried by '%s'",
                           is->on, name_of(section));
}

static enum mill_status list_named(struct mill_deck *deck)
{
    const struct mill_deck_section *waiting[MILL_MOTIONS_MOST], *s = NULL;
    int n = 0;
    while ((s = mill_deck_named(&deck->text, "motion", s))) {
        if (deck->mill.motions + n == MILL_MOTIONS_MOST)
            return mill_deck_wrong(&deck->text, s->title, NULL,
                                   "there are more than %d motions, the rotor's included",
                                   MILL_MOTIONS_MOST);
        waiting[n++] = s;
    }
    while (n > 0) {
        enum mill_status status = MILL_OK;
        int left = 0;
        for (int k = 0; k < n && status == MILL_OK; k++) {
            const char *on = ((struct mill_deck_motion *)waiting[k]->form)->on;
            char title[MILL_NAME_LENGTH + 8];
            snprintf(title, sizeof title, "motion.%.63s", on ? on : "");
            int carrier = MILL_STILL;
            if (on && mill_deck_motions_place(deck, on) == MILL_STILL &&
                mill_deck_section(&deck->text, title)) {
                waiting[left++] = waiting[k];
                continue;
            }
            status = mill_deck_motions_find(deck, waiting[k]->title, "on", on, &carrier);
            if (status == MILL_OK)
                status = add_motion(deck, waiting[k], carrier);
        }
        if (status != MILL_OK)
            return status;
        if (left == n)
            return tell_circle(deck, waiting[0]);
        n = left;
    }
    return MILL_OK;
}

enum mill_status mill_deck_motions_list(struct mill_deck *deck)
{
    if (deck->mill.rotor) {
        deck->given.rotor.axis = vec3_make(1.0, 0.0, 0.0);
        deck->mill.motion[deck->mill.motions++] = (struct mill_setup_motion){
            .name = "rotor", .type = &mill_turn_type, .form = &deck->given.rotor, .on = MILL_STILL};
    }
    int rides = MILL_STILL;
    enum mill_status status = list_named(deck);
    if (status == MILL_OK && deck->mill.drum)
        status = mill_deck_motions_find(deck, "drum", "motion", deck->given.drum_motion, &rides);
    deck->mill.drum_rides = 1 + rides;
    return status;
}
