/* Observers gather results from the mill. The event loop calls them at impacts and at the times
 * that they request. They cannot change the world, so no output option changes the run. An observer
 * consists of one const table and its own struct, which begins with a struct mill_observer. */
#ifndef MILLSIM_OBSERVER_H
#define MILLSIM_OBSERVER_H

#include "millsim/world.h"

#include <stddef.h>

struct mill_impact {
    double time;           /* [s] simulated */
    int kind;              /* of the world's */
    int32_t ball, partner; /* the other ball (> ball), or the number of the blade, end wall or copy
                              of a body; else -1 */
    int16_t species, partner_species; /* of the ball; of the other ball, or -1 */
    vec3 position;                    /* [m] of the contact */
    vec3 normal, impulse;             /* unit, into the ball `ball`; [N s] given to this ball */
    /* [m/s] velocity of the ball's surface relative to the partner's surface, just before, in the
     * plane of contact */
    vec3 slip;
    double normal_speed, tangential_speed;  /* [m/s] just before */
    double dissipation, dissipation_normal; /* [J] */
    int32_t surface;    /* number of the shape that the ball met; -1: a ball, or not known */
    vec3 place, facing; /* [m], unit: position and normal in the frame of this shape's motion */
    bool slid;          /* the surfaces slid to the end of the contact: they did not stick */
    bool lasting;       /* one of the balls is pressed: a lasting contact, not a new impact */
};

struct mill_observer {
    const struct mill_observer_type *type;
    double next; /* [s] simulated time at which it wants its next sample; INFINITY: never */
};

struct mill_observe; /* the requested output, as plain numbers: src/observe/observe.h */
struct mill_h5;      /* the output file: src/store/h5.h */
struct mill_sink;    /* receives the results: src/observe/sink.h */
struct mill_going;   /* tells whether to continue long work: src/observe/observe.h */
struct mill_state;   /* millsim/state.h */

/* A function may be NULL if there is nothing to do. */
struct mill_observer_type {
    const char *name; /* of the group of the file that contains its state */
    size_t size;      /* of its struct */

    /* ---- called by the event loop. They return MILL_OK, a failure, or MILL_ENDED if the observer
     * has gathered enough: then the run ends here, all observers still get this event, and the
     * error's text holds the reason ---- */

    /* `impact` may be called on another thread, but never while another function of an observer
     * runs. It must not change `next`, nor read more of a world than shapes, motions and `base`. */
    enum mill_status (*impact)(struct mill_observer *, const struct mill_impact *,
                               struct mill_error *);
    /* A relief of this ball begins, or ends, at simulated time `time` [s]; as `impact`. */
    enum mill_status (*relief)(struct mill_observer *, int32_t ball, double time, bool begins,
                               struct mill_error *);
    /* The world is at simulated time `next` = world->base + t. The function must set `next` to a
     * later time. The sample includes every event before its time and no event at its time. */
    enum mill_status (*sample)(struct mill_observer *, const struct mill_world *, double t,
                               struct mill_error *);

    /* ---- called by the program outside of the loop, in this order ---- */

    /* Is this observer requested? NULL: always. */
    bool (*wanted)(const struct mill_observe *);
    /* Fills its struct, which is zero except for type and next = INFINITY. The world is at t = 0
     * and exists longer than the observer. The function must not keep a pointer to the request.
     * MILL_FAILED: out of memory; free is called in any case. */
    enum mill_status (*create)(struct mill_observer *, const struct mill_observe *,
                               const struct mill_world *, struct mill_error *);
    /* Saves or loads its state (millsim/state.h). */
    void (*state)(struct mill_observer *, struct mill_state *);
    /* Creates the datasets that it writes to, or continues after the rows that its state counts.
     * The file exists longer than the observer. */
    void (*open)(struct mill_observer *, const struct mill_observe *, struct mill_h5 *file,
                 const struct mill_world *);
    /* Reports the results so far, as if the run ended at local time t. The run may continue. A
     * result without memory: mill_sink_fail. */
    enum mill_status (*results)(const struct mill_observer *, const struct mill_world *, double t,
                                struct mill_sink *, struct mill_error *);
    /* Adds the data that only the file of a finished run has. The last argument can stop this long
     * work: the result is then false. NULL: never stop. */
    bool (*finish)(struct mill_observer *, const struct mill_world *, const struct mill_going *);
    /* Frees all that it allocated, except its struct. */
    void (*free)(struct mill_observer *);
};

#endif
