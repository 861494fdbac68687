/* What the tests of the loop share: a mill from a deck written into a folder of its own, an
 * observer that checks every impact, and the state of all balls at one time. */
#ifndef SIM_FIXTURE_H
#define SIM_FIXTURE_H

#include "geometry/shape.h"
#include "deck/deck.h"
#include "millsim/sim.h"

#include <check.h>
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define NO_LIMIT UINT64_MAX

struct bench {
    char folder[32];
    struct mill_deck *deck;
    struct mill_world *world;
    struct mill_sim *sim;
    struct mill_error error;
};

/* The warnings of the last deck read */
static int bench_warnings;

static inline void bench_warn(const char *line)
{
    (void)line;
    bench_warnings++;
}

static inline void bench_write(const char *path, const char *text)
{
    FILE *out = fopen(path, "w");
    ck_assert_ptr_nonnull(out);
    fputs(text, out);
    ck_assert_int_eq(fclose(out), 0);
}

/* Writes the deck, and the start file `start.txt` if there is one; builds world and loop. */
static inline void bench_open(struct bench *b, const char *deck, const char *start)
{
    char path[64];
    memset(b, 0, sizeof *b);
    bench_warnings = 0;
    strcpy(b->folder, "/tmp/millsim_sim_XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(b->folder));
    snprintf(path, sizeof path, "%s/start.txt", b->folder);
    bench_write(path, start ? start : "");
    snprintf(path, sizeof path, "%s/mill.ini", b->folder);
    bench_write(path, deck);
    ck_assert_msg(mill_deck_read(path, 0, NULL, bench_warn, &b->deck, &b->error) == MILL_OK, "%s",
                  b->error.text);
    ck_assert_msg(mill_world_create(b->deck, &b->world, &b->error) == MILL_OK, "%s", b->error.text);
    ck_assert_msg(mill_sim_create(b->world, &b->sim, &b->error) == MILL_OK, "%s", b->error.text);
    unlink(path);
    snprintf(path, sizeof path, "%s/start.txt", b->folder);
    unlink(path);
    rmdir(b->folder);
}

static inline void bench_close(struct bench *b)
{
    mill_sim_free(b->sim);
    mill_world_free(b->world);
    mill_deck_free(b->deck);
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
    const double turn = w->turn + w->rotor_speed * mill_sim_local_time(b->sim);
    for (int32_t i = 0; i < w->balls; i++) {
        const double radius = w->species[w->ball[i].species].radius;
        deepest = fmax(deepest, -mill_world_gap(w, bench_position(b, i), radius, turn));
        for (int32_t j = 0; j < i; j++) {
            const vec3 d = vec3_sub(bench_position(b, i), bench_position(b, j));
            deepest = fmax(deepest, radius + w->species[w->ball[j].species].radius - vec3_norm(d));
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

#endif
