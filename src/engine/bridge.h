/* Bridges: two balls between surfaces that slide past each other lock if friction holds them at an
 * angle. Rigid balls then jam, and the energy that a jam takes would be a number of the program.
 * Soft balls give way by a tenth of a millimetre: the pair rolls upright between the surfaces and
 * passes. It gives back the energy stored at the top, unless another ball takes part of it.
 *
 * The program therefore lets a pair give way when it has got more impulse within the duration of
 * an impact than a pair of steel balls would need to pass: from then on the two are without
 * friction, on each other and on surfaces, until they have not met for one duration. A wedge
 * without friction does not lock. For nips of one ball at a body that can pinch, see pinch.h. */
#ifndef MILLSIM_BRIDGE_H
#define MILLSIM_BRIDGE_H

#include "base/memory.h"
#include "millsim/world.h"

struct mill_shape;

struct mill_bridge { /* of one ball; times are local [s] */
    double touched;  /* its last contact with a surface that cannot pinch */
    double met;      /* its last contact with a ball between two surfaces */
    double last;     /* its last contact with the ball `partner` */
    double other;    /* its last contact with another ball */
    /* [N s] between surfaces; none older than one duration counts. INFINITY: it gives way */
    double impulse;
    vec3 normal; /* of that surface, into the ball */
    int32_t shape, partner;
};

struct mill_bridges {
    struct mill_bridge *ball; /* [balls]; NULL: all surfaces that cannot pinch have one motion */
    double *duration;         /* [s] of an impact at the speed of the fastest surface, by species */
    double speed;             /* [m/s] of this surface */
};

/* False when out of memory */
bool mill_bridges_create(struct mill_bridges *bridges, const struct mill_world *world,
                         struct mill_memory_pool *memory);

/* Does ball i give way at local time t? */
static inline bool mill_bridges_give(const struct mill_bridges *p, const struct mill_world *w,
                                     int32_t i, double t)
{
    return p->ball && p->ball[i].impulse == (double)INFINITY &&
           t - p->ball[i].met < p->duration[w->ball[i].species];
}

/* Call this when ball i meets a surface that cannot pinch, with this normal into the ball. */
void mill_bridges_touch(struct mill_bridges *p, int32_t i, int32_t shape, vec3 normal, double t);

/* Call this after ball i has given ball j this impulse [N s] along the normal from i to j. Returns
 * the work [J] that the surfaces can have done by it in a bridge; *gives: it begins to give way. */
double mill_bridges_push(struct mill_bridges *bridges, const struct mill_world *world, int32_t i,
                         int32_t j, vec3 normal, double impulse, double t, bool *gives);

/* Call this when local time is reduced by `by` [s]. */
void mill_bridges_restart(struct mill_bridges *bridges, const struct mill_world *world, double by);

#endif
