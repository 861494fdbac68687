/* First positions from a text file, and the check that nothing overlaps. */
#include "start/start.h"

#include "base/textfile.h"
#include "engine/cells.h"
#include "geometry/shape.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* [m] rounding of a decimal position may make touching balls overlap by this much */
#define SLACK 1e-12
#define LIGHT                                                                                      \
    299792458.0 /* [m/s] a speed beyond it is a slip of units, and its square may overflow */

enum { LONGEST_ROW = 4096, TOLD = 8192 /* rows between two reports */ };

static const char *shape_name(const struct mill_shape *shape)
{
    static const char *const name[MILL_KINDS] = {"another ball", "the drum", "an end wall",
                                                 "the shaft", "a blade"};
    return name[shape->ops->kind];
}

/* The next row, without comment and newline, but no more of a file that has no rows than fits.
 * false: the end. *good: it is text. */
static bool next_row(FILE *in, char row[LONGEST_ROW], bool *good)
{
    int length = 0, c = mill_textfile_next(in);
    bool comment = false;
    if (c == EOF)
        return false;
    for (*good = true; c != EOF && c != '\n' && *good; c = mill_textfile_next(in)) {
        comment = comment || c == '#';
        *good = c != '\0' && (comment || length < LONGEST_ROW - 1);
        if (*good && !comment)
            row[length++] = (char)c;
    }
    row[length] = '\0';
    return true;
}

#define BLANKS " \t\r\f\v,"

/* Reads up to nine numbers of a row; -1: something else stands there. Hexadecimal ones are none, as
 * in a deck. A comma stands between all numbers or between none: some, as in "0,1 0,2 0,3", are
 * decimal commas, and would give six numbers. */
static int read_numbers(const char *row, double value[10])
{
    int n = 0, separated = 0;
    for (const char *p = row;;) {
        int commas = 0;
        for (; *p && strchr(BLANKS, *p); p++)
            commas += *p == ',';
        if (!*p)
            return separated == 0 || separated == n - 1 ? n : -1;
        const char *digits = p + (*p == '+' || *p == '-');
        char *end;
        const double x = strtod(p, &end);
        if (end == p || !isfinite(x) || !strchr(BLANKS, *end) || n == 9 || commas > 1 ||
            (digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X')))
            return -1;
        separated += n > 0 && commas > 0;
        value[n++] = x;
        p = end;
    }
}

static enum mill_status read_rows(const struct mill_deck *deck, FILE *in,
                                  const struct mill_start_watch *watch, struct mill_world *world,
                                  long *line_of, struct mill_error *error)
{
    char row[LONGEST_ROW];
    int32_t rows = 0;
    bool good;
    enum mill_status status = MILL_OK;
    errno = 0;
    for (long number = 1; status == MILL_OK && next_row(in, row, &good); number++) {
        double x[10] = {0.0};
        /* of UTF-8 */
        const bool marked = number == 1 && row[0] == '\xef' && row[1] == '\xbb' && row[2] == '\xbf';
        const int n = good ? read_numbers(row + (marked ? 3 : 0), x) : -1;
        if (n == 0)
            continue;
        if (n != 3 && n != 6 && n != 9) {
            status = mill_error_set(error, MILL_BAD_DECK,
                                    "%s:%ld: expected 3, 6 or 9 numbers "
                                    "'x y z [vx vy vz [wx wy wz]]' in SI units",
                                    deck->start, number);
        } else if (rows == world->balls) {
            status = mill_error_set(error, MILL_BAD_DECK,
                                    "%s:%ld: more rows than the %ld balls of the deck", deck->start,
                                    number, (long)world->balls);
        } else {
            world->ball[rows].r = vec3_make(x[0], x[1], x[2]);
            world->ball[rows].v = vec3_make(x[3], x[4], x[5]);
            world->spin[rows] = vec3_make(x[6], x[7], x[8]);
            line_of[rows++] = number;
            if (watch && rows % TOLD == 0)
                watch->tell(watch->self, "reading the start file", rows, world->balls);
        }
    }
    const int failed = ferror(in), why = errno;
    if (status == MILL_OK && failed)
        status = mill_error_set(error, MILL_FAILED, "%s: %s", deck->start, strerror(why));
    if (status == MILL_OK && rows != world->balls)
        status = mill_deck_fault(deck, error, "balls", "start",
                                 "'%s' has %ld rows, but the deck has %ld balls", deck->start,
                                 (long)rows, (long)world->balls);
    return status;
}

static enum mill_status check_speeds(const struct mill_deck *deck, const struct mill_world *world,
                                     const long *line_of, struct mill_error *error)
{
    for (int32_t i = 0; i < world->balls; i++) {
        const struct mill_ball *b = &world->ball[i];
        const double radius = world->species[b->species].radius;
        if (!(vec3_norm(b->v) <= LIGHT) || !(vec3_norm(world->spin[i]) * radius <= LIGHT))
            return mill_error_set(error, MILL_BAD_DECK,
                                  "%s:%ld: a speed beyond that of light: give m/s and rad/s",
                                  deck->start, line_of[i]);
    }
    return MILL_OK;
}

static enum mill_status check_shapes(const struct mill_deck *deck, const struct mill_world *world,
                                     const long *line_of, struct mill_error *error)
{
    for (int32_t i = 0; i < world->balls; i++) {
        const struct mill_ball *b = &world->ball[i];
        const double radius = world->species[b->species].radius;
        for (int k = 0; k < world->shapes; k++) {
            const struct mill_shape *s = world->shape[k];
            const double gap = s->ops->gap(s, b->r, radius, world->turn);
            if (!(gap >= -SLACK))
                return mill_error_set(error, MILL_BAD_DECK,
                                      "%s:%ld: ball overlaps %s by %.4g m: move it", deck->start,
                                      line_of[i], shape_name(s), -gap);
        }
    }
    return MILL_OK;
}

static enum mill_status check_pair(const struct mill_deck *deck, const struct mill_world *world,
                                   const long *line_of, int32_t i, int32_t j,
                                   struct mill_error *error)
{
    const struct mill_ball *a = &world->ball[i], *b = &world->ball[j];
    const double reach = world->species[a->species].radius + world->species[b->species].radius;
    const double gap = vec3_norm(vec3_sub(a->r, b->r)) - reach;
    if (gap >= -SLACK)
        return MILL_OK;
    return mill_error_set(error, MILL_BAD_DECK,
                          "%s:%ld: ball overlaps the one of line %ld by %.4g m: move one of them",
                          deck->start, line_of[i], line_of[j], -gap);
}

static enum mill_status check_pairs(const struct mill_deck *deck, const struct mill_world *world,
                                    const long *line_of, struct mill_error *error)
{
    double widest = 0.0, least = INFINITY;
    for (int k = 0; k < world->species_count; k++) {
        widest = fmax(widest, 2.0 * world->species[k].radius);
        least = fmin(least, 2.0 * world->species[k].radius);
    }
    const double r = world->drum_radius, l = 0.5 * world->drum_length;
    struct mill_cells cells;
    int32_t *near = malloc(sizeof *near * ((size_t)world->balls + MILL_CELL_ROW));
    enum mill_status status = MILL_OK;
    if (!near || !mill_cells_init(&cells, vec3_make(-l, -r, -r), vec3_make(l, r, r), widest, least,
                                  world->balls)) {
        free(near);
        return mill_error_set(error, MILL_FAILED, "out of memory for the cell grid");
    }
    for (int32_t i = 0; i < world->balls && status == MILL_OK; i++) {
        const int32_t cell = mill_cells_at(&cells, world->ball[i].r);
        const int32_t n = mill_cells_gather(&cells, cell, cells.around, 27, 1, near);
        for (int32_t k = 0; k < n && status == MILL_OK; k++)
            status = check_pair(deck, world, line_of, i, near[k], error);
        if (status == MILL_OK && !mill_cells_insert(&cells, i, cell))
            status = mill_error_set(error, MILL_FAILED, "out of memory for the cell grid");
    }
    mill_cells_release(&cells);
    free(near);
    return status;
}

enum mill_status mill_start_read(const struct mill_deck *deck, const struct mill_start_watch *watch,
                                 struct mill_world *world, struct mill_error *error)
{
    const char *wrong;
    FILE *in = mill_textfile_open(deck->start, &wrong);
    if (!in && wrong)
        return mill_deck_fault(deck, error, "balls", "start", "'%s' %s", deck->start, wrong);
    if (!in)
        return mill_deck_fault(deck, error, "balls", "start", "cannot read '%s': %s", deck->start,
                               strerror(errno));
    long *line_of = malloc(sizeof *line_of * ((size_t)world->balls + 1));
    enum mill_status status = MILL_OK;
    if (!line_of)
        status =
            mill_error_set(error, MILL_FAILED, "out of memory for %ld balls", (long)world->balls);
    if (status == MILL_OK)
        status = read_rows(deck, in, watch, world, line_of, error);
    if (status == MILL_OK)
        status = check_speeds(deck, world, line_of, error);
    if (status == MILL_OK)
        status = check_shapes(deck, world, line_of, error);
    if (status == MILL_OK)
        status = check_pairs(deck, world, line_of, error);
    fclose(in);
    free(line_of);
    return status;
}
