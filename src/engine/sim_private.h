/* What the parts of the event loop (sim*.c) share; no other file includes this. */
#ifndef MILL_SIM_PRIVATE_H
#define MILL_SIM_PRIVATE_H

#include "engine/pinch.h"
#include "engine/schedule.h"
#include "millsim/sim.h"

struct mill_watch {
    double last;       /* [s] local time of the last event that counted as an advance */
    uint64_t standing; /* events since then */
    double since;      /* [s] local start of the present millisecond */
    uint64_t events;   /* in it */
};

struct mill_sim_paranoid {
    struct mill_sim_checks checks;
    struct mill_plan due; /* the plan of the event under way */
    uint32_t contacts;    /* of its ball, before it */
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
    struct mill_error *error; /* of the running mill_sim_run */
    enum mill_status status;
};

/* The checks of a paranoid run hold what was planned and what an event changed against brute force,
 * and write nothing but their own counts. All return true, or false, the sim's status being
 * MILL_FAILED then and its error "paranoid: ...". */

/* Before ball i's event at local time t: it is not in the past, no plan is earlier, every entry of
 * the calendar is its plan's, and bodies that shall meet do touch. */
bool mill_sim_paranoid_before(struct mill_sim *sim, int32_t i, double t);

/* After that event: the balls that took part. Each thousand events also the energy account. */
bool mill_sim_paranoid_after(struct mill_sim *sim, int32_t i);

/* All balls, the calendar and the account. fresh: all balls have been planned now. */
bool mill_sim_paranoid_all(struct mill_sim *sim, bool fresh);

/* Work of all motions = change of energy + dissipation, to 1e-9 of the energy turned over. */
bool mill_sim_paranoid_account(struct mill_sim *sim);

/* The contact that a plan of ball i ends with, if it is a sure one: the bodies touch then, and are
 * not parting. */
bool mill_sim_paranoid_touch(struct mill_sim *sim, int32_t i, const struct mill_plan *plan);

/* Ball i against all other balls and all surfaces: no overlap now, and no contact before the next
 * event of either. fresh: ball i has been planned now, so its own plan must know of all contacts
 * with balls of the cells around. touched: the surface it has just met, or MILL_NOBODY. */
bool mill_sim_paranoid_ball(struct mill_sim *sim, int32_t i, bool fresh, int32_t touched);

#endif
