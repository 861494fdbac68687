/* What watches the mill. The loop calls observers at impacts and at the times they ask for; they
 * cannot change the world, so no output option changes the run. An observer is one const table, and
 * a struct of its own that begins with a struct mill_observer. */
#ifndef MILLSIM_OBSERVER_H
#define MILLSIM_OBSERVER_H

#include "millsim/world.h"

#include <stddef.h>

struct mill_impact {
    double time;           /* [s] simulated */
    int kind;              /* of the world's */
    int32_t ball, partner; /* the other ball (> ball); number of the blade, end wall or copy of a
                              body; else -1 */
    int16_t species, partner_species; /* of the ball; of the other ball, else -1 */
    vec3 position;                    /* [m] of the contact */
    vec3 normal, impulse;             /* unit, into the ball `ball`; [N s] given to it */
    vec3 slip; /* [m/s] of its surface relative to the partner's just before, along them */
    double normal_speed, tangential_speed;  /* [m/s] just before */
    double dissipation, dissipation_normal; /* [J] */
    bool lasting; /* one of the balls is pressed: the contact goes on, it is no new impact */
};

struct mill_observer {
    const struct mill_observer_type *type;
    double next; /* [s] simulated time of the next sample it wants; INFINITY: none */
};

struct mill_observe; /* what is asked for, as plain numbers: src/observe/observe.h */
struct mill_h5;      /* the output file: src/store/h5.h */
struct mill_sink;    /* who is told results: src/observe/sink.h */
struct mill_going;   /* whether to go on with what takes long: src/observe/observe.h */
struct mill_state;   /* millsim/state.h */

/* NULL where there is nothing to do. */
struct mill_observer_type {
    const char *name; /* of the group its state is kept in */
    size_t size;      /* of its struct */

    /* ---- called by the loop: MILL_OK; MILL_ENDED, and the reason as the error's text: it has seen
     * enough, and the run ends here, told to all observers; or a failure ---- */

    enum mill_status (*impact)(struct mill_observer *, const struct mill_impact *,
                               struct mill_error *);
    /* World at simulated time `next` = world->base + t; must move `next` on. A sample sees every
     * event before its time and none at it. */
    enum mill_status (*sample)(struct mill_observer *, const struct mill_world *, double t,
                               struct mill_error *);

    /* ---- called by the program around it, in this order ---- */

    /* Is it asked for? NULL: always. */
    bool (*wanted)(const struct mill_observe *);
    /* Fills its struct, of zeros but for type and next = INFINITY, for a world at t = 0, which
     * outlives it; what is asked for is not kept. MILL_FAILED: out of memory; freed in any case. */
    enum mill_status (*create)(struct mill_observer *, const struct mill_observe *,
                               const struct mill_world *, struct mill_error *);
    /* Tells its state, or takes up one that was saved. */
    void (*state)(struct mill_observer *, struct mill_state *);
    /* Makes what it writes to, or goes on behind what its state knows; the file outlives it. */
    void (*open)(struct mill_observer *, const struct mill_observe *, struct mill_h5 *file,
                 const struct mill_world *);
    /* What it has gathered by now comes to, as if the run ended at local time t; it goes on. */
    enum mill_status (*results)(const struct mill_observer *, const struct mill_world *, double t,
                                struct mill_sink *, struct mill_error *);
    /* Adds to the file what only that of a finished run has. false: it was not to go on; NULL: to
     * the end. */
    bool (*finish)(struct mill_observer *, const struct mill_world *, const struct mill_going *);
    /* Frees what it holds, besides its struct. */
    void (*free)(struct mill_observer *);
};

#endif
