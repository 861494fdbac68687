/* The event loop. Each event: move the balls to it, change their velocities, call the observers,
 * make new plans. Local time restarts after each epoch of simulated time: then every ball is moved
 * to the same time, checked for overlaps and planned again. Thus local times stay small and
 * precise. Only the clock ends an epoch, so no output option can change the run. */
#include "engine/sim_private.h"
#include "engine/slabs.h"
#include "engine/soft.h"

#include <assert.h>
#include <stdlib.h>

#define DEEP 1e-9 /* [m] an overlap beyond this is an anomaly */

/* ---- epochs ---- */

/* Plans all balls for an epoch, which begins now. */
static void begin_epoch(struct mill_sim *sim)
{
    mill_schedule_begin(sim->schedule, MILL_WORLD_EPOCH);
    for (int32_t i = 0; i < sim->world->balls; i++)
        if (!mill_world_asleep(sim->world, i)) {
            mill_schedule_ball(sim->schedule, i, 0.0, MILL_NOBODY);
            mill_sim_look_clear(sim, i);
        }
}

void mill_sim_audit(struct mill_sim *sim)
{
    struct mill_counts *counts = &sim->world->counts;
    for (int32_t i = 0; i < sim->world->balls && !sim->soft; i++) {
        const double overlap = mill_schedule_overlap(sim->schedule, i, sim->now);
        counts->largest_overlap = mill_greatest(overlap, counts->largest_overlap);
        counts->overlaps += overlap > DEEP;
        if (overlap == (double)INFINITY)
            sim->status = mill_error_set(sim->error, MILL_FAILED,
                                         "the position of ball %ld is not a number at t = %.9g s",
                                         (long)i, sim->world->base + sim->now);
    }
}

/* Ends the epoch and begins the next one. */
static void end_epoch(struct mill_sim *sim)
{
    struct mill_world *w = sim->world;
    if (sim->soft) {
        mill_world_restart(w);
        sim->now = 0.0;
        if (!mill_soft_restart(sim->soft))
            sim->status =
                mill_error_set(sim->error, MILL_FAILED, "out of memory for the soft spheres");
        return;
    }
    sim->now = MILL_WORLD_EPOCH;
    mill_sim_audit(sim);
    for (int32_t i = 0; i < w->balls; i++) {
        mill_sim_move(w, i, MILL_WORLD_EPOCH);
        w->ball[i].t = mill_world_asleep(w, i) ? HUGE_VAL : 0.0;
    }
    w->counts.sleep += (double)w->counts.asleep * MILL_WORLD_EPOCH;
    mill_pinches_restart(&sim->pinches, w, MILL_WORLD_EPOCH);
    mill_bridges_restart(&sim->bridges, w, MILL_WORLD_EPOCH);
    mill_world_restart(w);
    sim->watch.last -= MILL_WORLD_EPOCH;
    sim->watch.since -= MILL_WORLD_EPOCH;
    sim->now = 0.0;
    if (sim->status == MILL_OK)
        mill_sim_rest_settle(sim);
    if (sim->status != MILL_OK)
        return;
    begin_epoch(sim);
    if (sim->proof)
        sim->proof->all(sim, true);
}

/* ---- the loop ---- */

/* For contacts that follow each other within the duration of one. false: out of memory */
static bool remember_contacts(struct mill_sim *s)
{
    const struct mill_world *w = s->world;
    s->met = mill_memory_take(&s->memory, (size_t)w->balls, sizeof *s->met);
    s->touch = mill_memory_take(&s->memory, (size_t)w->species_count, sizeof *s->touch);
    for (int32_t i = 0; s->met && i < w->balls; i++)
        s->met[i] = -(double)INFINITY;
    for (int k = 0; s->touch && k < w->species_count; k++)
        s->touch[k] = mill_impact_duration(0.5 * w->species[k].mass, 0.5 * w->species[k].radius,
                                           MILL_IMPACT_SLOW);
    return !s->memory.failed;
}

enum mill_status mill_sim_create(struct mill_world *world, struct mill_sim **sim,
                                 struct mill_error *error)
{
    struct mill_sim *s = *sim = calloc(1, sizeof *s);
    const bool soft = world->soft.on != 0;
    bool fits = s != NULL;
    if (fits)
        s->world = world;
    if (fits && soft)
        fits = (s->soft = mill_soft_create(world)) != NULL;
    else if (fits)
        fits = mill_pinches_create(&s->pinches, world, &s->memory) &&
               mill_bridges_create(&s->bridges, world, &s->memory) && remember_contacts(s);
    const enum mill_status status =
        !fits  ? mill_error_set(error, MILL_FAILED, "out of memory for the %s",
                               soft ? "soft spheres" : "event loop")
        : soft ? MILL_OK
               : mill_schedule_create(world, &s->schedule, error);
    if (status == MILL_OK && !s->soft) {
        begin_epoch(s);
    } else if (status != MILL_OK) {
        mill_sim_free(s);
        *sim = NULL;
    }
    return status;
}

void mill_sim_free(struct mill_sim *sim)
{
    if (!sim)
        return;
    mill_sim_slabs_free(sim->slabs);
    mill_soft_free(sim->soft);
    mill_schedule_free(sim->schedule);
    mill_memory_drop(&sim->memory);
    free(sim->proof);
    free(sim);
}

enum mill_status mill_sim_observe(struct mill_sim *sim, struct mill_observer *observer)
{
    assert(observer && observer->type);
    if (sim->observers == (int)(sizeof sim->observer / sizeof sim->observer[0]))
        return MILL_FAILED;
    observer->next = observer->type->sample ? observer->next : (double)INFINITY;
    sim->observer[sim->observers++] = observer;
    if (observer->type->impact)
        sim->impact_observer[sim->impact_observers++] = observer;
    return MILL_OK;
}

void mill_sim_use_threads(struct mill_sim *sim, int threads)
{
    mill_sim_slabs_free(sim->slabs);
    sim->slabs = NULL;
    if (sim->soft)
        mill_soft_use_threads(sim->soft, threads);
    else if (!sim->proof)
        sim->slabs = mill_sim_slabs_create(sim, mill_slabs_worth(sim->schedule, threads), false);
}

int mill_sim_threads(const struct mill_sim *sim)
{
    return sim->soft ? sim->soft->threads : sim->slabs ? mill_sim_slabs_count(sim->slabs) : 1;
}

const struct mill_world *mill_sim_world(const struct mill_sim *sim)
{
    return sim->world;
}

double mill_sim_time(const struct mill_sim *sim)
{
    return sim->world->base + sim->now;
}

double mill_sim_local_time(const struct mill_sim *sim)
{
    return sim->now;
}

/* Takes the samples that are due at this simulated time [s]. */
static void take_samples(struct mill_sim *sim, double due)
{
    bool goes_on = true;
    for (int k = 0; goes_on && k < sim->observers; k++) {
        struct mill_observer *o = sim->observer[k];
        if (o->next > due)
            continue;
        enum mill_status one = o->type->sample(o, sim->world, sim->now, sim->error);
        if (one == MILL_OK && !(o->next > due))
            one = mill_error_set(sim->error, MILL_FAILED,
                                 "%s: did not set a later time for its next sample", o->type->name);
        goes_on = mill_sim_heed(sim, one);
    }
}

enum mill_status mill_sim_run(struct mill_sim *sim, double until, uint64_t budget,
                              const volatile sig_atomic_t *stop, struct mill_error *error)
{
    assert(until == until);
    sim->error = error;
    sim->stop = stop;
    sim->status = MILL_OK;
    sim->world->counts.quartics.check = sim->proof ? sim->proof->check : NULL;
    if (sim->slabs)
        mill_sim_slabs_begin(sim->slabs);
    while (budget > 0 && sim->status == MILL_OK) {
        double sample = INFINITY; /* [s] simulated time of the next one */
        for (int k = 0; k < sim->observers; k++)
            sample = mill_least(sample, sim->observer[k]->next);
        const double halt = mill_least(sample, until) - sim->world->base;
        const double limit = mill_least(mill_greatest(halt, sim->now), MILL_WORLD_EPOCH);
        if (sim->soft)
            mill_soft_run(sim, limit, &budget);
        else if (sim->slabs)
            mill_sim_slabs_run(sim, limit, &budget);
        else
            mill_sim_take_events(sim, limit, &budget);
        if (sim->status != MILL_OK || budget == 0)
            break;
        sim->now = limit;
        if (halt > MILL_WORLD_EPOCH) {
            end_epoch(sim);
        } else if (sample <= until) {
            take_samples(sim, sample);
        } else {
            if (sim->proof)
                sim->proof->account(sim);
            break;
        }
        if (sim->status == MILL_OK && mill_sim_stops(sim))
            sim->status = MILL_STOPPED;
    }
    if (sim->slabs)
        mill_sim_slabs_end(sim->slabs);
    sim->world->counts.quartics.check = NULL; /* the counts are stored */
    sim->error = NULL;
    return sim->status;
}
