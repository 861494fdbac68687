/* The cell grid: which balls may meet soon. Cells are cubes not smaller than the largest ball, so
 * only the 27 cells around a ball's centre hold balls it can touch before it changes cell. */
#ifndef MILLSIM_CELLS_H
#define MILLSIM_CELLS_H

#include "millsim/vec3.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define MILL_CELL_ROW 8 /* words of a cell that never overflowed: 7 balls and their count */

struct mill_cells {
    vec3 lo;              /* [m] corner of the first inner cell */
    double side[3];       /* [m] */
    int32_t n[3];         /* cells along x, y, z, one layer of empty ones on each side included */
    double per_n[2];      /* 1 / n[1], 1 / n[2] */
    double *edge[3];      /* [m] where the cells of an axis begin, [n + 1]; -+infinity outermost */
    int64_t around[27];   /* offsets of a cell's neighbourhood in words, itself included */
    int64_t ahead[6][9];  /* of the new neighbours after crossing a face, from the new cell */
    int32_t row;          /* words of one cell in `bucket`: its balls, the last one their count */
    bool narrow;          /* words are uint16_t, else int32_t: half the cache for small mills */
    void *bucket;         /* [cells * row] */
    int32_t *cell, *slot; /* of each ball */
    int32_t balls;
};

struct mill_cell_exit {
    double dt;    /* [s] from now, INFINITY: never */
    int32_t face; /* 0 -x, 1 +x, 2 -y, 3 +y, 4 -z, 5 +z */
};

/* A grid over the box [lo, hi] with cells of at least `diameter`, not many more cells than balls;
 * all balls unplaced. False when out of memory; mill_cells_release frees what init took. */
bool mill_cells_init(struct mill_cells *cells, vec3 lo, vec3 hi, double diameter,
                     double least_diameter, int32_t balls);
void mill_cells_release(struct mill_cells *cells);

int32_t mill_cells_count(const struct mill_cells *cells);

/* The cell of a point; points beyond the box belong to the outermost inner cells. */
int32_t mill_cells_at(const struct mill_cells *cells, vec3 r);

/* The box of a cell; outermost inner cells reach to infinity. */
void mill_cells_box(const struct mill_cells *cells, int32_t cell, vec3 *lo, vec3 *hi);

/* Puts a ball into a cell it is not in / takes it out. insert is false when out of memory. */
bool mill_cells_insert(struct mill_cells *cells, int32_t ball, int32_t cell);
void mill_cells_remove(struct mill_cells *cells, int32_t ball);

/* How many balls a cell holds, and which is its kth. */
int32_t mill_cells_held(const struct mill_cells *cells, int32_t cell);
int32_t mill_cells_word(const struct mill_cells *cells, int32_t cell, int32_t k);

/* When and through which face the flight r + v t + g t^2/2 leaves the cell: the first time at which
 * a face is reached or passed and the motion is outwards. An exit later than the window [s] need
 * not be told; INFINITY: any is. */
struct mill_cell_exit mill_cells_exit(const struct mill_cells *cells, int32_t cell, vec3 r, vec3 v,
                                      vec3 g, double window);

/* From a cell to the one behind its face. */
int32_t mill_cells_step(const struct mill_cells *cells, int32_t face);

/* Moves a ball through a face of its cell. False when out of memory. */
bool mill_cells_cross(struct mill_cells *cells, int32_t ball, int32_t face);

/* Copies the balls of `count` cells (offsets from `cell`) to `out`, returns how many. `out` must
 * have room for all plus MILL_CELL_ROW. Eight words at a time whatever the count: no branch to
 * mispredict. */
static inline int32_t mill_cells_gather(const struct mill_cells *cells, int32_t cell,
                                        const int64_t *restrict offset, int32_t count,
                                        int32_t *restrict out)
{
    const int32_t row = cells->row;
    const int64_t at = (int64_t)cell * row;
    int32_t n = 0;
    if (cells->narrow) {
        const uint16_t *base = (const uint16_t *)cells->bucket + at;
        for (int32_t k = 0; k < count; k++) {
            const uint16_t *b = base + offset[k];
            const int32_t held = b[row - 1];
            for (int32_t m = 0; m < MILL_CELL_ROW; m++)
                out[n + m] = b[m];
            for (int32_t m = MILL_CELL_ROW; m < held; m++)
                out[n + m] = b[m];
            n += held;
        }
    } else {
        const int32_t *base = (const int32_t *)cells->bucket + at;
        for (int32_t k = 0; k < count; k++) {
            const int32_t *b = base + offset[k];
            const int32_t held = b[row - 1];
            memcpy(out + n, b, sizeof *out * MILL_CELL_ROW);
            for (int32_t m = MILL_CELL_ROW; m < held; m++)
                out[n + m] = b[m];
            n += held;
        }
    }
    return n;
}

#endif
