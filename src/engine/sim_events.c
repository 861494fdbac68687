/* The events of the loop, one after the other */
#include "engine/sim_private.h"
#include "engine/slabs.h"

void mill_sim_watch(struct mill_watch *w, double t)
{
    /* by a nanosecond at least: hops that shrink to the resolution of time still advance it */
    if (t > w->last + 1e-9) {
        w->last = t;
        w->standing = 0;
    } else {
        w->standing++;
    }
    if (t - w->since > 1e-3) {
        w->since = t;
        w->events = 0;
    } else {
        w->events++;
    }
}

/* Stops runs in which infinitely many contacts would happen in a finite time */
static void watch_time(struct mill_sim *sim, int32_t i, double t)
{
    const struct mill_watch *w = &sim->watch;
    const uint64_t balls = (uint64_t)sim->world->balls;
    mill_sim_watch(&sim->watch, t);
    if (w->standing > 1000000 + 100 * balls)
        sim->status =
            mill_error_set(sim->error, MILL_FAILED,
                           "the simulated time does not advance after t = %.9g s: ball "
                           "%ld has contacts without end; raise contact.rebound_floor "
                           "(now %g m/s)",
                           sim->world->base + sim->now, (long)i, sim->world->rebound_floor);
    if (w->events > 10000000 + 40000 * balls)
        sim->status = mill_error_set(
            sim->error, MILL_FAILED,
            "the simulated time hardly advances at t = %.9g s: %llu events within a millisecond, "
            "now of ball %ld; raise contact.rebound_floor (now %g m/s) or contact.restitution",
            sim->world->base + sim->now, (unsigned long long)w->events, (long)i,
            sim->world->rebound_floor);
}

void mill_sim_take_events(struct mill_sim *sim, double limit, uint64_t *budget,
                          const volatile sig_atomic_t *stop)
{
    const bool large = sim->world->balls >= MILL_SIM_LARGE;
    const struct mill_schedule *p = sim->schedule;
    double t;
    for (; sim->status == MILL_OK && *budget > 0; --*budget) {
        const int32_t i =
            p->slabs ? mill_slabs_next(p->slabs, &t) : mill_calendar_next(p->calendar, &t);
        if (i < 0 || t >= limit)
            return;
        if (stop && *stop)
            sim->status = MILL_STOPPED;
        else if (sim->proof)
            sim->proof->before(sim, i, t);
        if (sim->status != MILL_OK)
            return;
        /* rounding may put an event slightly before the last one, but time must not go backwards */
        sim->now = mill_greatest(t, sim->now);
        if (large)
            mill_schedule_ahead(sim->schedule);
        mill_sim_happen(sim, i);
        watch_time(sim, i, t);
        if (sim->proof && sim->status == MILL_OK)
            sim->proof->after(sim, i);
    }
}
