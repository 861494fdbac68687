/* What the tests of slabs share: mills long enough for four, and what shows that threads have
 * worked in them. */
#ifndef SLABS_FIXTURE_H
#define SLABS_FIXTURE_H

#include "engine/slabs.h"
#include "sim_fixture.h"

/* Long enough for four slabs */
static const struct model long_stirred = {
    .setup = {.gravity.z = -9.81, .drum = {.radius = 0.02, .length = 0.16}},
    .balls = {{.diameter = 0.005, .density = STEEL, .count = 600}},
    .rotor = {.speed = 1500 * RPM},
    .shaft = 0.004,
    .blades = 4,
    .blade = {{.tip_radius = 0.0135, .width = 0.008, .thickness = 0.003, .pitch = 20 * DEG}},
    .law = {0.8, 0.3, 0.484}};

static const struct model long_gas = {
    .setup = {.drum = {.radius = 0.02, .length = 0.2}, .speed = 1.0},
    .balls = {{.diameter = 0.005, .density = STEEL, .count = 300}},
    .law = {0.95, 0.2, 0.5}};

static const struct model long_mixture = {
    .setup = {.gravity = {1.0, -3.0, -8.0}, .drum = {.radius = 0.011, .length = 0.18}},
    .balls = {{.diameter = 0.006, .density = STEEL, .count = 40},
              {.diameter = 0.002, .density = 2500.0, .count = 2500}},
    .rotor = {.speed = -1500 * RPM},
    .shaft = 0.003,
    .law = {.restitution = 0.9, .friction = 0.2}};

/* Balls are pinched between the tips of its blades and the drum. */
static inline struct model narrow_mill(void)
{
    struct model m = long_stirred;
    m.rotor.speed = 300 * RPM;
    m.blade[0] = (struct mill_blade){.tip_radius = 0.01505, .width = 0.01, .thickness = 0.005};
    m.law = (struct mill_law){0.8, 0.5, 0.0};
    return m;
}

enum { MIXED = 2, PERIODIC = 3, NARROW = 4, LONG_MILLS = 5 };

static inline struct model long_mill(int which)
{
    struct model m = long_stirred;
    m.setup.drum.periodic = true;
    return which == PERIODIC ? m
           : which == NARROW
               ? narrow_mill()
               : *(const struct model *[]){&long_stirred, &long_gas, &long_mixture}[which];
}

/* Also in mills where fewer threads would be faster */
static inline void use_threads(struct bench *b, int threads)
{
    mill_sim_use_threads(b->sim, 1);
    b->sim->slabs = mill_sim_slabs_create(b->sim, threads, true);
    ck_assert_int_eq(b->sim->slabs != NULL, threads > 1);
    ck_assert_int_eq(mill_sim_threads(b->sim), threads);
}

/* Windows since local time was last restarted */
static inline int windows(const struct bench *b)
{
    return b->sim->schedule->slabs->tag;
}

/* There have been windows, and threads have carried out events inside each slab. */
static inline void has_shared(const struct bench *b)
{
    const struct mill_slabs *s = b->sim->schedule->slabs;
    ck_assert_int_gt(windows(b), 10);
    for (int k = 0; k < s->count; k++) {
        int blocks = 0;
        for (int32_t at = s->slab[k].inner_lo; at < s->slab[k].inner_hi; at++)
            blocks += s->mark[at].window > 0;
        ck_assert_int_gt(blocks, 5);
    }
}

/* A mill that has run for a while, cut into slabs */
struct sliced {
    struct bench b;
    struct mill_schedule *p;
    struct mill_slabs *s;
    const struct mill_cells *blocks; /* the coarsest grid */
};

static inline void open_sliced(struct sliced *c, int which, int threads)
{
    const struct model model = long_mill(which);
    bench_open(&c->b, &model);
    bench_run(&c->b, which == MIXED ? 0.005 : 0.02);
    c->p = c->b.sim->schedule;
    c->blocks = &c->p->grids.own[c->p->grids.classes - 1];
    ck_assert(mill_slabs_create(c->p, threads, &c->s));
    ck_assert_ptr_nonnull(c->s);
}

static inline void close_sliced(struct sliced *c)
{
    mill_slabs_free(c->s);
    bench_close(&c->b);
}

static inline int32_t block_of_ball(const struct sliced *c, int32_t i)
{
    return mill_grids_block(&c->p->grids, c->p->cells->cell[i]);
}

/* The layer of a block along x, without the empty ones */
static inline int32_t layer_of(const struct sliced *c, int32_t block)
{
    int32_t index[3];
    mill_cells_index(c->blocks, block, index);
    return index[0] - c->blocks->margin;
}

static inline int32_t layers_of(const struct sliced *c)
{
    return c->blocks->n[0] - 2 * c->blocks->margin;
}

#endif
