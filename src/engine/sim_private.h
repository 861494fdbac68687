/* Declarations shared by the parts of the event loop (sim*.c). No other file includes this one. */
#ifndef MILL_SIM_PRIVATE_H
#define MILL_SIM_PRIVATE_H

#include "engine/pinch.h"
#include "engine/schedule.h"
#include "millsim/sim.h"

struct mill_watch {
    double last;       /* [s] local time of the last event after which time had advanced */
    uint64_t standing; /* number of events since then */
    double since;      /* [s] local time at which the present millisecond began */
    uint64_t events;   /* number of events in this millisecond */
};

struct mill_sim_paranoid {
    struct mill_sim_checks checks;
    struct mill_plan due; /* the plan of the present event */
    uint32_t contacts;    /* of the ball of this event, before the event */
};

struct mill_sim {
    struct mill_world *world;
    struct mill_schedule *schedule;
    struct mill_pinches pinches;
    struct mill_watch watch;
    struct mill_sim_paranoid *paranoid; /* NULL: off */
    double now;                         /* [s] local */
    int observers;
    struct mill_observer *observer[8];
    struct mill_error *error; /* of the present call of mill_sim_run */
    enum mill_status status;
};

/* The checks of a paranoid run compare the plans and the effects of each event with brute force.
 * They write only their own counts. All return true if the check holds. If not, the sim's status is
 * MILL_FAILED and its error is "paranoid: ...". */

/* Before ball i's event at local time t: the event is not in the past, no plan is earlier, every
 * entry of the calendar has the time of its plan, and bodies that are due to meet touch. */
bool mill_sim_paranoid_before(struct mill_sim *sim, int32_t i, double t);

/* After that event: checks the balls that took part. Every thousand events, also the energy
 * account. */
bool mill_sim_paranoid_after(struct mill_sim *sim, int32_t i);

/* Checks all balls, the calendar and the account. fresh: all balls have been planned now. */
bool mill_sim_paranoid_all(struct mill_sim *sim, bool fresh);

/* Work of all motions = change of energy + dissipation, to 1e-9 of the energy turned over. */
bool mill_sim_paranoid_account(struct mill_sim *sim);

/* Checks the contact of a plan of ball i, if the plan is not stale: at its time the bodies touch
 * and do not move apart. */
bool mill_sim_paranoid_touch(struct mill_sim *sim, int32_t i, const struct mill_plan *plan);

/* Checks ball i against all other balls and all surfaces: no overlap now, and no contact before the
 * next event of either. fresh: ball i has been planned now, so its own plan must include all
 * contacts with balls of the cells around. touched: the surface that it has met now, or
 * MILL_NOBODY. */
bool mill_sim_paranoid_ball(struct mill_sim *sim, int32_t i, bool fresh, int32_t touched);

#endif
