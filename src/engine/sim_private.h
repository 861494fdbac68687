/* What the parts of the event loop (sim*.c) share; no other file includes this. */
#ifndef MILL_SIM_PRIVATE_H
#define MILL_SIM_PRIVATE_H

#include "engine/schedule.h"
#include "engine/sim_paranoid.h"
#include "millsim/sim.h"

/* [s] between restarts of local time; a power of two, so that the sum is exact */
#define MILL_SIM_EPOCH 0.0625

enum { MILL_SIM_OBSERVERS = 8 }; /* at most */

struct mill_pinch {
    double since;      /* [s] local */
    uint32_t contacts; /* the ball's count then */
    uint32_t blows;    /* of blades since */
};

struct mill_watch {
    double last;       /* [s] local time of the last event that counted as an advance */
    uint64_t standing; /* events since then */
    double since;      /* [s] local start of the present millisecond */
    uint64_t events;   /* in it */
};

struct mill_sim {
    struct mill_world *world;
    struct mill_schedule *schedule;
    struct mill_pinch *pinch;
    struct mill_watch watch;
    struct mill_sim_paranoid *paranoid; /* NULL: off */
    double now;                         /* [s] local */
    int observers;
    struct mill_observer *observer[MILL_SIM_OBSERVERS];
    struct mill_error *error; /* of the running mill_sim_run */
    enum mill_status status;
};

#endif
