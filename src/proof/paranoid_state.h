/* What the files of a paranoid run share */
#ifndef MILL_PARANOID_STATE_H
#define MILL_PARANOID_STATE_H

#include "engine/sim_private.h"
#include "proof/paranoid.h"

struct mill_paranoid {
    struct mill_sim_proof proof;
    struct mill_paranoid_checks checks;
    struct mill_plan due; /* the plan of the present event */
    uint32_t contacts;    /* of the ball of this event, before the event */
    int64_t asleep;       /* balls, before the event */
    struct mill_paranoid_quartics quartics;
};

static inline struct mill_paranoid *mill_paranoid_of(const struct mill_sim *sim)
{
    return (struct mill_paranoid *)sim->proof;
}

/* The checks of a paranoid run compare plans and effects of each event with brute force and write
 * only their own counts. true: the check holds; else status and error are set. */

/* Before ball i's event at local time t: the event is not in the past, no plan is earlier, every
 * entry of the calendar has the time of its plan, and bodies that are due to meet touch. */
bool mill_paranoid_before(struct mill_sim *sim, int32_t i, double t);

/* After that event: checks the balls that took part; every thousand events, also the account. */
bool mill_paranoid_after(struct mill_sim *sim, int32_t i);

/* Checks all balls, the calendar and the account. fresh: all balls have been planned now. */
bool mill_paranoid_all(struct mill_sim *sim, bool fresh);

/* Work of all motions = change of energy + dissipation, to 1e-9 of the energy turned over. */
bool mill_paranoid_account(struct mill_sim *sim);

/* Does every entry of the calendar have the time of its plan? *first: the ball that is due first */
bool mill_paranoid_calendar(struct mill_sim *sim, int32_t *first);

/* Is ball i in its cell at local time t, and in the rows of this cell? */
bool mill_paranoid_place(struct mill_sim *sim, int32_t i, double t);

/* Ends the run with this message, followed by local time t (NAN: none). The result is false. */
__attribute__((format(printf, 3, 4))) bool mill_paranoid_fault(struct mill_sim *sim, double t,
                                                               const char *format, ...);

/* Bound of a coordinate in the mill [m]; rounding errors of positions are relative to it */
double mill_paranoid_size(const struct mill_world *world);

/* Maximum sum of rounding errors in a position, a root or an energy: a few dozen operations each */
#define MILL_SIM_ROUNDINGS (64.0 * 2.2e-16)

/* Checks ball i's plan, if it is not stale: at its time the bodies touch and do not move apart. */
bool mill_paranoid_touch(struct mill_sim *sim, int32_t i, const struct mill_plan *plan);

/* Checks ball i against all other balls and surfaces: no overlap now, and no contact before the
 * next event of either. fresh: ball i has been planned now, so its own plan must include all
 * contacts with balls of the cells around. touched: the surface that it meets now, or -1 */
bool mill_paranoid_ball(struct mill_sim *sim, int32_t i, bool fresh, int32_t touched);

#endif
