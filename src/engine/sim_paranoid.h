/* The checks of a paranoid run: after each event, all that it changed is held against brute force.
 * They read what prediction left behind and write nothing but their own counts. */
#ifndef MILL_SIM_PARANOID_H
#define MILL_SIM_PARANOID_H

#include "engine/schedule.h"
#include "millsim/sim.h"

/* Roundings that add up in a position, a root or an energy, at most: a few dozen operations each */
#define MILL_SIM_ROUNDINGS (64.0 * 2.2e-16)

struct mill_sim_paranoid {
    struct mill_schedule *schedule;
    struct mill_sim_checks checks;
    struct mill_plan due; /* the plan of the event under way */
    uint32_t contacts;    /* of its ball, before it */
};

/* All return MILL_OK, or MILL_FAILED and "paranoid: ...". Times are local [s]. */

/* Before ball i's event at time t, `now` being the time reached: it is not in the past, no plan is
 * earlier, every entry of the calendar is its plan's, and bodies that shall meet do touch. */
enum mill_status mill_sim_paranoid_before(struct mill_sim_paranoid *p, int32_t i, double t,
                                          double now, struct mill_error *error);

/* After that event: the balls that took part. Each thousand events also the energy account. */
enum mill_status mill_sim_paranoid_after(struct mill_sim_paranoid *p, int32_t i, double now,
                                         struct mill_error *error);

/* All balls, the calendar and the account. fresh: all balls have been planned at `now`. */
enum mill_status mill_sim_paranoid_all(struct mill_sim_paranoid *p, double now, bool fresh,
                                       struct mill_error *error);

/* Rotor work = change of energy + dissipation, to 1e-9 of the energy turned over. */
enum mill_status mill_sim_paranoid_account(struct mill_sim_paranoid *p, double now,
                                           struct mill_error *error);

/* The contact that a plan of ball i ends with, if it is a sure one: the bodies touch then, and are
 * not parting. */
enum mill_status mill_sim_paranoid_touch(const struct mill_sim_paranoid *p, int32_t i,
                                         const struct mill_plan *plan, struct mill_error *error);

/* What ball i has just met at `now`, by the plan that was due, touches it: a plan that fell due may
 * have been overtaken, and must not have been carried out then. */
enum mill_status mill_sim_paranoid_met(const struct mill_sim_paranoid *p, int32_t i, double now,
                                       struct mill_error *error);

/* Ball i against all other balls and all surfaces: no overlap at `now`, and no contact before
 * the next event of either. fresh: ball i has been planned at `now`, so its own plan must know of
 * all contacts with balls of the cells around. touched: the surface it has just met, or
 * MILL_NOBODY. */
enum mill_status mill_sim_paranoid_ball(struct mill_sim_paranoid *p, int32_t i, double now,
                                        bool fresh, int32_t touched, struct mill_error *error);

/* Bound of a coordinate in the mill [m]: what roundings of positions are measured by. */
static inline double mill_sim_paranoid_size(const struct mill_world *w)
{
    return w->drum_radius + 0.5 * w->drum_length;
}

#endif
