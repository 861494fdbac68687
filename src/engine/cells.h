/* The cell grid: it tells which balls may meet soon. The edges of a cell are at least as long as
 * the largest diameter: until a ball leaves its cell, it touches only those in the 27 around it. */
#ifndef MILLSIM_CELLS_H
#define MILLSIM_CELLS_H

#include "millsim/vec3.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define MILL_CELL_ROW 8 /* words of a normal cell: 7 balls and their count */

/* A cell is a row of words. Rows are as short as possible because the search reads them most. */
enum mill_cells_form {
    MILL_CELLS_SHORT,  /* 16-bit words: balls, the last word their count */
    MILL_CELLS_WIDE,   /* the same with 32-bit words */
    MILL_CELLS_PACKED, /* four 32-bit words: balls; the count is in the top bits of the first */
};
enum { MILL_CELLS_PACK = 4, MILL_CELLS_BITS = 28, MILL_CELLS_BALL = (1 << MILL_CELLS_BITS) - 1 };

struct mill_cells {
    vec3 lo;                   /* [m] corner of the first inner cell */
    double side[3];            /* [m] */
    int32_t n[3];              /* cells along x, y, z, with layers of empty cells on each side */
    int32_t margin;            /* number of these layers */
    double per_n[2];           /* 1 / n[1], 1 / n[2] */
    double *edge[3];           /* [m] where cells begin, [n + 1]; the outermost are -+infinity */
    int32_t row;               /* words of one cell in `bucket` */
    enum mill_cells_form form; /* of the rows */
    void *bucket;              /* [cells * row] */
    int32_t *cell;             /* of each ball */
};

struct mill_cell_exit {
    double dt;    /* [s] from now, INFINITY: never */
    int32_t face; /* 0 -x, 1 +x, 2 -y, 3 +y, 4 -z, 5 +z */
};

/* How many cells of at least `diameter` to cut the box [lo, hi] into: not many more than balls */
void mill_cells_cut(vec3 lo, vec3 hi, double diameter, int32_t balls, int32_t inner[3]);

/* Makes a grid over the box [lo, hi] with `inner` cells and `margin` >= 1 layers of empty cells
 * around. factor: cells are cubes of so many of these; the last may reach beyond the box.
 * least_diameter: of the balls in its rows. It holds none yet. False: out of memory; release it. */
bool mill_cells_init(struct mill_cells *cells, vec3 lo, vec3 hi, const int32_t inner[3],
                     int32_t factor, int32_t margin, double least_diameter, int32_t balls);
void mill_cells_release(struct mill_cells *cells);

static inline int32_t mill_cells_count(const struct mill_cells *c)
{
    return c->n[0] * c->n[1] * c->n[2];
}

/* Is this a cell that can hold balls, not one of the empty layers? */
bool mill_cells_is_inner(const struct mill_cells *cells, int32_t cell);

/* The cell of a point, and its index along x, y, z; outside of the box, the nearest inside it */
static inline int32_t mill_cells_along(const struct mill_cells *c, int axis, double from_lo)
{
    const double cell = from_lo / c->side[axis], last = (double)(c->n[axis] - 2 * c->margin - 1);
    return c->margin + (cell > 0.0 ? (int32_t)(cell < last ? cell : last) : 0);
}

static inline int32_t mill_cells_at(const struct mill_cells *c, vec3 r)
{
    const int32_t x = mill_cells_along(c, 0, r.x - c->lo.x);
    const int32_t y = mill_cells_along(c, 1, r.y - c->lo.y);
    return (x * c->n[1] + y) * c->n[2] + mill_cells_along(c, 2, r.z - c->lo.z);
}

/* The index of a cell along x, y, z; exact: cell + 1/2 is never close enough to a multiple. */
static inline void mill_cells_index(const struct mill_cells *c, int32_t cell, int32_t index[3])
{
    const int32_t column = (int32_t)(((double)cell + 0.5) * c->per_n[1]);
    index[2] = cell - column * c->n[2];
    index[0] = (int32_t)(((double)column + 0.5) * c->per_n[0]);
    index[1] = column - index[0] * c->n[1];
}

/* The box of a cell; the outermost cells inside the grid's box reach to infinity. */
void mill_cells_box(const struct mill_cells *cells, int32_t cell, vec3 *lo, vec3 *hi);

/* insert puts a ball into a cell without it, as the last; remove takes it out. false: no memory */
bool mill_cells_insert(struct mill_cells *cells, int32_t ball, int32_t cell);
void mill_cells_remove(struct mill_cells *cells, int32_t ball);
void mill_cells_clear(struct mill_cells *cells); /* takes all balls out */

/* Are the rows the shortest? */
static inline bool mill_cells_shortest(const struct mill_cells *c)
{
    return c->form == MILL_CELLS_SHORT && c->row == MILL_CELL_ROW;
}

static inline size_t mill_cells_word_size(const struct mill_cells *c)
{
    return c->form == MILL_CELLS_SHORT ? sizeof(uint16_t) : sizeof(uint32_t);
}

/* Word `at` of the rows: a ball or a count; the first word of a packed row has both */
static inline uint32_t mill_cells_word(const struct mill_cells *c, int64_t at)
{
    return c->form == MILL_CELLS_SHORT ? ((const uint16_t *)c->bucket)[at]
                                       : ((const uint32_t *)c->bucket)[at];
}

/* The number of balls in a cell, and the kth of them */
static inline int32_t mill_cells_held(const struct mill_cells *c, int32_t cell)
{
    const int64_t first = (int64_t)cell * c->row;
    return (int32_t)(c->form == MILL_CELLS_PACKED ? mill_cells_word(c, first) >> MILL_CELLS_BITS
                                                  : mill_cells_word(c, first + c->row - 1));
}

/* Has the row of a cell room for one more ball? */
static inline bool mill_cells_has_room(const struct mill_cells *c, int32_t cell)
{
    return mill_cells_held(c, cell) < c->row - (c->form != MILL_CELLS_PACKED);
}

static inline int32_t mill_cells_ball(const struct mill_cells *c, int32_t cell, int32_t k)
{
    const uint32_t mask = c->form == MILL_CELLS_PACKED ? MILL_CELLS_BALL : UINT32_MAX;
    return (int32_t)(mill_cells_word(c, (int64_t)cell * c->row + k) & mask);
}

/* The time and the face at which the flight r + v t + g t^2/2 leaves the cell: the first time at
 * which the ball is at or beyond a face and moves outwards. */
struct mill_cell_exit mill_cells_exit(const struct mill_cells *c, int cell, vec3 r, vec3 v, vec3 g);

/* The step in cell numbers from a cell to its neighbour across a face */
static inline int32_t mill_cells_step(const struct mill_cells *c, int32_t face)
{
    const int32_t step[3] = {c->n[1] * c->n[2], c->n[2], 1};
    return face % 2 ? step[face / 2] : -step[face / 2];
}

/* Notes the cell of a ball. Threads that work on other balls may read it at the same time. */
static inline void mill_cells_set(struct mill_cells *c, int32_t ball, int32_t cell)
{
    __atomic_store_n(&c->cell[ball], cell, __ATOMIC_RELAXED);
}

/* Plain pointers without choices, so that the compiler copies each row as one vector (measured) */
#define MILL_CELLS_COPY(type, words, count_of, mask)                                               \
    for (int32_t k = 0; k < count; k++) {                                                          \
        const type *b = (const type *)cells->bucket + at + offset[k];                              \
        const int32_t held = (int32_t)(count_of);                                                  \
        for (int32_t m = 0; m < (words); m++)                                                      \
            out[n + m] = (int32_t)(b[m] & (mask)) * scale;                                         \
        for (int32_t m = (words); m < held; m++)                                                   \
            out[n + m] = (int32_t)(b[m] & (mask)) * scale;                                         \
        n += held;                                                                                 \
    }

/* Copies the balls of `count` cells (offsets from `cell`, in words) to `out`, each number times
 * `scale`, and returns how many. `out` must have room for all of them plus MILL_CELL_ROW. Whole
 * rows are copied: no branch can be mispredicted. threes: the rows are the shortest and the cells
 * in threes along z, so that their rows are neighbours in memory; only first offsets are read. */
static inline __attribute__((always_inline)) int32_t
mill_cells_gather(const struct mill_cells *cells, int32_t cell, const int64_t *restrict offset,
                  int32_t count, bool threes, int32_t scale, int32_t *restrict out)
{
    const int32_t row = cells->row;
    const int64_t at = (int64_t)cell * row;
    int64_t n = 0; /* as wide as an address, because the next store waits for it */
    if (threes) {
        const uint16_t *first = (const uint16_t *)cells->bucket + (int64_t)cell * MILL_CELL_ROW;
        for (int32_t k = 0; k < count; k += 3) {
            const uint16_t *b = first + offset[k];
            for (int32_t next = 0; next < 3; next++, b += MILL_CELL_ROW) {
                for (int32_t m = 0; m < MILL_CELL_ROW; m++)
                    out[n + m] = b[m] * scale;
                n += b[MILL_CELL_ROW - 1];
            }
        }
    } else if (cells->form == MILL_CELLS_PACKED) {
        MILL_CELLS_COPY(uint32_t, MILL_CELLS_PACK, b[0] >> MILL_CELLS_BITS, MILL_CELLS_BALL)
    } else if (cells->form == MILL_CELLS_WIDE) {
        MILL_CELLS_COPY(uint32_t, MILL_CELL_ROW, b[row - 1], UINT32_MAX)
    } else if (row > MILL_CELL_ROW) {
        MILL_CELLS_COPY(uint16_t, MILL_CELL_ROW, b[row - 1], UINT16_MAX)
    } else { /* no row is longer */
        const uint16_t *first = (const uint16_t *)cells->bucket + at;
        for (int32_t k = 0; k < count; k++) {
            const uint16_t *b = first + offset[k];
            for (int32_t m = 0; m < MILL_CELL_ROW; m++)
                out[n + m] = b[m] * scale;
            n += b[MILL_CELL_ROW - 1];
        }
    }
    return (int32_t)n;
}
#undef MILL_CELLS_COPY

#endif
