/* The epochs of the event loop. At the end of an epoch every ball is moved to the same time,
 * checked for overlaps and planned again. Thus local times stay small and precise. Only the clock
 * decides when an epoch ends, so no output option can change the run. */
#include "engine/sim_private.h"

#define DEEP 1e-9 /* [m] an overlap beyond this is an anomaly */

void mill_sim_epoch_begin(struct mill_sim *sim)
{
    mill_schedule_begin(sim->schedule, MILL_WORLD_EPOCH);
    for (int32_t i = 0; i < sim->world->balls; i++)
        if (!mill_world_asleep(sim->world, i))
            mill_schedule_ball(sim->schedule, i, 0.0, MILL_NOBODY);
}

void mill_sim_audit(struct mill_sim *sim)
{
    struct mill_counts *counts = &sim->world->counts;
    for (int32_t i = 0; i < sim->world->balls; i++) {
        const double overlap = mill_schedule_overlap(sim->schedule, i, sim->now);
        counts->largest_overlap = mill_greatest(overlap, counts->largest_overlap);
        counts->overlaps += overlap > DEEP;
        if (overlap == (double)INFINITY)
            sim->status = mill_error_set(sim->error, MILL_FAILED,
                                         "the position of ball %ld is not a number at t = %.9g s",
                                         (long)i, sim->world->base + sim->now);
    }
}

void mill_sim_epoch_end(struct mill_sim *sim)
{
    struct mill_world *w = sim->world;
    sim->now = MILL_WORLD_EPOCH;
    mill_sim_audit(sim);
    for (int32_t i = 0; i < w->balls; i++) {
        mill_sim_move(w, i, MILL_WORLD_EPOCH);
        w->ball[i].t = mill_world_asleep(w, i) ? HUGE_VAL : 0.0;
    }
    w->counts.sleep += (double)w->counts.asleep * MILL_WORLD_EPOCH;
    mill_pinches_restart(&sim->pinches, w, MILL_WORLD_EPOCH);
    mill_world_restart(w);
    sim->watch.last -= MILL_WORLD_EPOCH;
    sim->watch.since -= MILL_WORLD_EPOCH;
    sim->now = 0.0;
    if (sim->status == MILL_OK)
        mill_sim_rest_settle(sim);
    if (sim->status != MILL_OK)
        return;
    mill_sim_epoch_begin(sim);
    if (sim->proof)
        sim->proof->planned(sim);
}
