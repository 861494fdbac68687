/* What the tests of the loop share: a mill and its loop, an observer that checks every impact, and
 * when two runs are the same. */
#ifndef SIM_FIXTURE_H
#define SIM_FIXTURE_H

#include "engine/sim_private.h"
#include "mills.h"
#include "state_fixture.h"

#define NO_LIMIT UINT64_MAX

struct bench {
    struct mill_world *world;
    struct mill_sim *sim;
    struct mill_error error;
};

static inline void bench_open(struct bench *b, const struct model *model)
{
    memset(b, 0, sizeof *b);
    b->world = model_world(model);
    ck_assert_msg(mill_sim_create(b->world, &b->sim, &b->error) == MILL_OK, "%s", b->error.text);
}

static inline void bench_close(struct bench *b)
{
    mill_sim_free(b->sim);
    mill_world_free(b->world);
}

static inline void bench_run(struct bench *b, double until)
{
    ck_assert_msg(mill_sim_run(b->sim, until, NO_LIMIT, NULL, &b->error) == MILL_OK, "%s",
                  b->error.text);
}

static inline vec3 bench_position(const struct bench *b, int32_t i)
{
    return mill_world_position(b->world, i, mill_sim_local_time(b->sim));
}

static inline vec3 bench_velocity(const struct bench *b, int32_t i)
{
    return mill_world_velocity(b->world, i, mill_sim_local_time(b->sim));
}

static inline double bench_balance(const struct bench *b)
{
    double error, turnover;
    mill_world_balance(b->world, mill_sim_local_time(b->sim), &error, &turnover);
    return turnover > 0.0 ? error / turnover : error;
}

static inline uint64_t bench_collisions(const struct bench *b)
{
    uint64_t all = 0;
    for (int k = 0; k < MILL_KINDS; k++)
        all += b->world->account.collisions[k];
    return all;
}

/* Deepest overlap of any ball with any other or with any surface, by trying all pairs */
static inline double bench_overlap(const struct bench *b)
{
    const struct mill_world *w = b->world;
    double deepest = -INFINITY;
    const double now = mill_sim_local_time(b->sim);
    for (int32_t i = 0; i < w->balls; i++) {
        const double radius = radius_of(w, i);
        deepest = fmax(deepest, -world_gap(w, bench_position(b, i), radius, now));
        for (int32_t j = 0; j < i; j++) {
            const vec3 d = vec3_sub(bench_position(b, i), bench_position(b, j));
            deepest = fmax(deepest, radius + radius_of(w, j) - vec3_norm(d));
        }
    }
    return deepest;
}

/* An observer that checks what the loop promises of each impact, and remembers a few figures. */
struct witness {
    struct mill_observer base; /* first: the loop hands its address back */
    uint64_t impacts[MILL_KINDS];
    double last, sampled;                       /* [s] of the last impact, the last sample */
    double speed[64];                           /* [m/s] normal, of the first impacts */
    double time[64];                            /* [s] of the same */
    double dissipation;                         /* [J] */
    int out_of_order, not_unit, backward, lost; /* faults */
    double every;                               /* [s] of samples */
    uint64_t samples;
    struct mill_impact impact; /* the last one */
};

static inline enum mill_status witness_impact(struct mill_observer *o, const struct mill_impact *i,
                                              struct mill_error *error)
{
    struct witness *w = (struct witness *)o;
    uint64_t n = 0;
    (void)error;
    for (int k = 0; k < MILL_KINDS; k++)
        n += w->impacts[k];
    if (n < 64) {
        w->speed[n] = i->normal_speed;
        w->time[n] = i->time;
    }
    w->impacts[i->kind]++;
    w->out_of_order += !(i->time >= w->last && i->time >= w->sampled);
    w->not_unit += !(fabs(vec3_norm(i->normal) - 1.0) < 1e-12);
    w->backward += !(i->normal_speed >= 0.0) || !(i->tangential_speed >= 0.0);
    w->lost += i->kind == MILL_BALL_BALL ? !(i->partner > i->ball) : i->partner < -1;
    w->dissipation += i->dissipation;
    w->last = i->time;
    w->impact = *i;
    return MILL_OK;
}

static inline enum mill_status witness_sample(struct mill_observer *o,
                                              const struct mill_world *world, double t,
                                              struct mill_error *error)
{
    struct witness *w = (struct witness *)o;
    (void)error;
    w->lost += !(fabs(world->base + t - o->next) < 1e-12);
    w->out_of_order += !(w->last < o->next);
    w->sampled = o->next;
    w->samples++;
    o->next = w->every * (double)(w->samples + 1);
    return MILL_OK;
}

static const struct mill_observer_type witness_type = {.impact = witness_impact,
                                                       .sample = witness_sample};

/* Watches all impacts; samples every so many seconds, INFINITY: never. */
static inline void witness_join(struct witness *w, struct bench *b, double every)
{
    memset(w, 0, sizeof *w);
    w->every = every;
    w->base = (struct mill_observer){&witness_type, every};
    ck_assert_int_eq(mill_sim_observe(b->sim, &w->base), MILL_OK);
}

static inline void witness_is_content(const struct witness *w)
{
    ck_assert_int_eq(w->out_of_order, 0);
    ck_assert_int_eq(w->not_unit, 0);
    ck_assert_int_eq(w->backward, 0);
    ck_assert_int_eq(w->lost, 0);
}

static inline void runs_are_alike(const struct bench *a, const struct bench *b)
{
    const struct mill_world *v = a->world, *w = b->world;
    ck_assert_double_eq(mill_sim_time(a->sim), mill_sim_time(b->sim));
    ck_assert_mem_eq(v->ball, w->ball, sizeof *v->ball * (size_t)v->balls);
    ck_assert_mem_eq(v->spin, w->spin, sizeof *v->spin * (size_t)v->balls);
    ck_assert_mem_eq(&v->account, &w->account, sizeof v->account);
    ck_assert_mem_eq(&v->counts, &w->counts, sizeof v->counts);
}

/* Takes out of a state where the calendar has filed the plans' events: it files them anew. */
static inline void forget_places(struct kept *state, const char *plans)
{
    struct kept_field *field = kept_find(state, plans);
    struct mill_plan *plan = (struct mill_plan *)(void *)field->value;
    for (size_t i = 0; i < field->bytes / sizeof *plan; i++) {
        plan[i].event.next = 0;
        plan[i].event.prev = 0;
        plan[i].event.place = 0;
    }
}

#endif
