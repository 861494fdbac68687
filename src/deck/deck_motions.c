/* Converts the rotor and the [motion.NAME] to the engine's form, each after the motion that carries
 * it, and reads the tables of measured motions. */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_ROWS = 10000000, COLUMNS = 7 };

static const char *name_of(const struct mill_deck_section *section)
{
    return strchr(section->title, '.') + 1;
}

/* ---- tables ---- */

/* Checks that the last row of a period repeats the first. */
static enum mill_status check_period(const struct mill_deck_rows *in, size_t rows,
                                     const double (*row)[COLUMNS], struct mill_error *error)
{
    static const char *const column[COLUMNS] = {"t", "x", "y", "z", "rx", "ry", "rz"};
    enum { LEAST = 4 };
    if (rows < LEAST)
        return mill_error_set(error, MILL_BAD_DECK,
                              "%s:%ld: %zu rows are too few: a period needs at least %d", in->path,
                              in->line, rows, LEAST);
    for (int i = 1; i < COLUMNS; i++) {
        double lo = row[0][i], hi = lo;
        for (size_t k = 1; k < rows; k++) {
            lo = fmin(lo, row[k][i]);
            hi = fmax(hi, row[k][i]);
        }
        if (!(fabs(row[rows - 1][i] - row[0][i]) <= fmax(1e-9 * (hi - lo), 1e-12)))
            return mill_error_set(error, MILL_BAD_DECK,
                                  "%s:%ld: the last row must repeat the first, but %s is %.10g "
                                  "there and %.10g here",
                                  in->path, in->line, column[i], row[0][i], row[rows - 1][i]);
    }
    return MILL_OK;
}

/* The caller frees *row in all cases. */
static enum mill_status read_rows(struct mill_deck_rows *in, size_t *rows, double (**row)[COLUMNS],
                                  struct mill_error *error)
{
    double value[COLUMNS + 1];
    long last = 0;
    errno = 0;
    for (int n; (n = mill_deck_files_row(in, COLUMNS, value)) != 0; last = in->line) {
        if (n != COLUMNS)
            return mill_error_set(error, MILL_BAD_DECK,
                                  "%s:%ld: expected 7 numbers 't x y z rx ry rz' in SI units",
                                  in->path, in->line);
        if (*rows > 0 && !(value[0] > (*row)[*rows - 1][0]))
            return mill_error_set(error, MILL_BAD_DECK,
                                  "%s:%ld: times must ascend, but %.10g s comes after %.10g s",
                                  in->path, in->line, value[0], (*row)[*rows - 1][0]);
        if (*rows == MOST_ROWS)
            return mill_error_set(error, MILL_BAD_DECK, "%s:%ld: more than %d rows", in->path,
                                  in->line, MOST_ROWS);
        if ((*rows & (*rows - 1)) == 0) { /* the array is full: its size is a power of two */
            double(*more)[COLUMNS] = realloc(*row, (*rows ? 2 * *rows : 1) * sizeof **row);
            if (!more)
                return mill_error_set(error, MILL_FAILED, "out of memory for the rows of %s",
                                      in->path);
            *row = more;
        }
        memcpy((*row)[(*rows)++], value, sizeof **row);
    }
    if (ferror(in->in))
        return mill_error_set(error, MILL_FAILED, "%s: %s", in->path, strerror(errno));
    in->line = last > 0 ? last : 1;
    return check_period(in, *rows, (const double(*)[COLUMNS]) * row, error);
}

static enum mill_status read_table(struct mill_deck *deck, const struct mill_deck_section *section,
                                   struct mill_table *table, struct mill_error *error)
{
    struct mill_deck_motion *given = section->form;
    struct mill_deck_rows in = {.line = 0};
    const char *wrong;
    double(*row)[COLUMNS] = NULL;
    enum mill_status status = mill_deck_files_find(&deck->text, section->title, "file",
                                                   given->as.file, &given->as.file, error);
    if (status != MILL_OK)
        return status;
    in.path = given->as.file;
    in.in = mill_textfile_open(in.path, &wrong);
    if (!in.in)
        return mill_deck_fault(&deck->text, error, section->title, "file",
                               wrong ? "'%s' %s" : "cannot read '%s': %s", in.path,
                               wrong ? wrong : strerror(errno));
    table->rows = 0;
    status = mill_deck_files_told(&deck->text, section->title, "file",
                                  read_rows(&in, &table->rows, &row, error), error);
    fclose(in.in);
    mill_deck_files_keep(&deck->text, row);
    table->row = (const double(*)[COLUMNS])row;
    return status;
}

/* ---- the list ---- */

/* Adds a motion of the engine. Scales its axis to length 1, exactly so along x, y or z. */
static enum mill_status add_motion(struct mill_deck *deck, const struct mill_deck_section *section,
                                   int on, struct mill_error *error)
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
    return is->kind == MILL_DECK_TABLE ? read_table(deck, section, &is->as.table, error) : MILL_OK;
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
                                        const char *key, const char *name, int *motion,
                                        struct mill_error *error)
{
    const struct mill_deck_block named = {.title = "motion", .named = true};
    char hint[2 * MILL_NAME_LENGTH] = "";
    int edits, best = MILL_DECK_MOST_EDITS;
    *motion = name ? mill_deck_motions_place(deck, name) : MILL_STILL;
    if (!name || *motion != MILL_STILL)
        return MILL_OK;
    if (strcmp(name, "rotor") == 0)
        return mill_deck_fault(&deck->text, error, section, key, "there is no section [rotor]");
    for (const struct mill_deck_section *s = NULL; (s = mill_deck_next(&deck->text, &named, s));) {
        edits = mill_deck_suggest_edits(name_of(s), name);
        if (edits < best) {
            best = edits;
            snprintf(hint, sizeof hint, "; did you mean '%s'?", name_of(s));
        }
    }
    return mill_deck_fault(&deck->text, error, section, key, "there is no section [motion.%.63s]%s",
                           name, hint);
}

/* The remaining motions all wait for their carriers. Following the carriers leads
 * into the circle. */
static enum mill_status tell_circle(const struct mill_deck *deck,
                                    const struct mill_deck_section *section,
                                    struct mill_error *error)
{
    char title[MILL_NAME_LENGTH + 8];
    for (int k = 0; k < MILL_MOTIONS_MOST; k++) {
        snprintf(title, sizeof title, "motion.%s", ((struct mill_deck_motion *)section->form)->on);
        section = mill_deck_section(&deck->text, title);
    }
    const struct mill_deck_motion *is = section->form;
    if (strcmp(is->on, name_of(section)) == 0)
        return mill_deck_fault(&deck->text, error, section->title, "on",
                               "a motion cannot carry itself");
    return mill_deck_fault(&deck->text, error, section->title, "on",
                           "motions carry each other in a circle: '%s' is itself carried by '%s'",
                           is->on, name_of(section));
}

static enum mill_status list_named(struct mill_deck *deck, struct mill_error *error)
{
    const struct mill_deck_block named = {.title = "motion", .named = true};
    const struct mill_deck_section *waiting[MILL_MOTIONS_MOST], *s = NULL;
    int n = 0;
    while ((s = mill_deck_next(&deck->text, &named, s))) {
        if (deck->mill.motions + n == MILL_MOTIONS_MOST)
            return mill_deck_fault(&deck->text, error, s->title, NULL,
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
            status = mill_deck_motions_find(deck, waiting[k]->title, "on", on, &carrier, error);
            if (status == MILL_OK)
                status = add_motion(deck, waiting[k], carrier, error);
        }
        if (status != MILL_OK)
            return status;
        if (left == n)
            return tell_circle(deck, waiting[0], error);
        n = left;
    }
    return MILL_OK;
}

enum mill_status mill_deck_motions_list(struct mill_deck *deck, struct mill_error *error)
{
    if (deck->mill.rotor) {
        deck->mill.form[0].as.turn = (struct mill_turn){.axis = {1.0, 0.0, 0.0},
                                                        .speed = deck->given.rotor_speed,
                                                        .angle = deck->given.rotor_angle};
        deck->mill.motion[deck->mill.motions++] =
            (struct mill_setup_motion){.name = "rotor",
                                       .type = &mill_turn_type,
                                       .form = &deck->mill.form[0].as,
                                       .on = MILL_STILL};
    }
    int rides = MILL_STILL;
    enum mill_status status = list_named(deck, error);
    if (status == MILL_OK && deck->mill.drum)
        status =
            mill_deck_motions_find(deck, "drum", "motion", deck->given.drum_motion, &rides, error);
    deck->mill.drum_rides = 1 + rides;
    return status;
}
