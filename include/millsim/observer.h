/* Observers gather results from the mill. The event loop calls them at impacts and at the times
 * that they request. They cannot change the world, so no output option changes the run. An observer
 * consists of one const table and its own struct, which begins with a struct mill_observer. */
#ifndef MILLSIM_OBSERVER_H
#define MILLSIM_OBSERVER_H

#include "millsim/world.h"

struct mill_impact {
    double time;           /* [s] simulated */
    int kind;              /* of the world's */
    int32_t ball, partner; /* the other ball (> ball), the number of blade, end wall, copy; or -1 */
    int16_t species, partner_species; /* of the ball; of the other ball, or -1 */
    vec3 position;                    /* [m] of the contact */
    vec3 normal, impulse;             /* unit, into the ball `ball`; [N s] given to this ball */
    /* [m/s] velocity of the ball's surface relative to the partner's, just before, in the plane */
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

/* A function may be NULL if there is nothing to do. They return MILL_OK, a failure, or MILL_ENDED
 * if the observer has gathered enough: then the run ends here, all observers still get this event,
 * and the error's text holds the reason. */
struct mill_observer_type {
    const char *name;
    /* `impact` may be called on another thread, but never while another function of an observer
     * runs. It must not change `next`, nor read more of a world than shapes, motions and `base`. */
    enum mill_status (*impact)(struct mill_observer *, const struct mill_impact *,
                               struct mill_error *);
    /* The world is at simulated time `next` = world->base + t. The function must set `next` to a
     * later time. The sample includes every event before its time and no event at its time. */
    enum mill_status (*sample)(struct mill_observer *, const struct mill_world *, double t,
                               struct mill_error *);
    /* A relief of this ball begins, or ends, at simulated time `time` [s]; as `impact`. */
    enum mill_status (*relief)(struct mill_observer *, int32_t ball, double time, bool begins,
                               struct mill_error *);
};

#endif
