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
