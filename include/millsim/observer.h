/* What watches the mill. The loop calls observers at impacts and at the times they ask for; they
 * cannot change the world, so no output option changes the run. */
#ifndef MILLSIM_OBSERVER_H
#define MILLSIM_OBSERVER_H

#include "millsim/status.h"
#include "millsim/world.h"

struct mill_impact {
    double time; /* [s] simulated */
    enum mill_kind kind;
    int32_t ball;
    int32_t partner; /* the other ball (> ball), blade or end wall number, else -1 */
    vec3 position;   /* [m] of the contact */
    vec3 normal;     /* unit, into the ball `ball` */
    double normal_speed, tangential_speed;  /* [m/s] just before */
    double dissipation, dissipation_normal; /* [J] */
};

struct mill_observer {
    double next; /* [s] simulated time of the next sample it wants; INFINITY: none */
    /* NULL where impacts are not wanted */
    enum mill_status (*impact)(struct mill_observer *, const struct mill_impact *,
                               struct mill_error *);
    /* World at simulated time `next` = world->base + t; must move `next` on. NULL where next is
     * INFINITY. A sample sees every event before its time and none at it. */
    enum mill_status (*sample)(struct mill_observer *, const struct mill_world *, double t,
                               struct mill_error *);
};

#endif
