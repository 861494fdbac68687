/* What the tests of the cell grid share: balls at random places in a grid over one box. */
#ifndef CELLS_FIXTURE_H
#define CELLS_FIXTURE_H

#include "engine/cells.h"

#include "draws.h"

static const vec3 corner_lo = {-0.06, -0.075, -0.075}, corner_hi = {0.06, 0.075, 0.075};

/* Cuts the box into cells of this diameter at least. */
static inline void cut_box(struct mill_cells *cells, vec3 lo, vec3 hi, double diameter,
                           double least_diameter, int32_t balls)
{
    int32_t inner[3];
    mill_cells_cut(lo, hi, diameter, balls, inner);
    if (!mill_cells_init(cells, lo, hi, inner, 1, 1, least_diameter, balls))
        ck_abort_msg("out of memory");
}

/* Lists the offsets, in words, from a cell to itself and those around it; face >= 0: only to those
 * ahead, after a ball has crossed this face. Returns how many. */
static inline int32_t list_near(const struct mill_cells *c, int32_t face, int64_t offset[27])
{
    int32_t n = 0;
    for (int32_t k = 0; k < 27; k++) {
        const int32_t d[3] = {k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1};
        if (face < 0 || d[face / 2] == (face % 2 ? 1 : -1))
            offset[n++] = (((int64_t)d[0] * c->n[1] + d[1]) * c->n[2] + d[2]) * c->row;
    }
    return n;
}

/* Gathers the balls in and around a cell. */
static inline int32_t gather(const struct mill_cells *c, int32_t cell, int32_t scale, int32_t *near)
{
    int64_t offset[27];
    const int32_t n = list_near(c, -1, offset);
    return mill_cells_gather(c, cell, offset, n, false, scale, near);
}

struct swarm {
    struct mill_cells cells;
    int32_t balls;
    vec3 *r;
    int32_t *near;
};

static inline struct swarm make_swarm(int32_t balls, double diameter, double least_diameter)
{
    struct swarm s;
    s.balls = balls;
    s.r = malloc(sizeof *s.r * (size_t)balls);
    s.near = malloc(sizeof *s.near * ((size_t)balls + MILL_CELL_ROW));
    if (!s.r || !s.near)
        ck_abort_msg("out of memory");
    cut_box(&s.cells, corner_lo, corner_hi, diameter, least_diameter, balls);
    return s;
}

static inline void free_swarm(struct swarm *s)
{
    mill_cells_release(&s->cells);
    free(s->r);
    free(s->near);
}

static inline void cross(struct swarm *s, int32_t ball, int32_t face)
{
    const int32_t to = s->cells.cell[ball] + mill_cells_step(&s->cells, face);
    mill_cells_remove(&s->cells, ball);
    ck_assert(mill_cells_insert(&s->cells, ball, to));
}

static inline void place(struct swarm *s, int32_t ball, vec3 r)
{
    s->r[ball] = r;
    ck_assert(mill_cells_insert(&s->cells, ball, mill_cells_at(&s->cells, r)));
}

#endif
