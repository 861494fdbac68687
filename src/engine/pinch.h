/* Pinches: between hard spheres, a ball that a moving body presses against something meets both in
 * infinitely many contacts. A stiff soft sphere has one contact instead, longer than an impact.
 *
 * So a ball is pressed if it meets moving bodies again and again, each time within the duration of
 * one impact after the last time, and this has lasted longer than one duration. The contacts of a
 * pressed ball no longer count as impacts, and their restitution is zero. After each, the ball
 * leaves the other body at a small speed, so that they do not become infinitely many.
 *
 * The program lets a pressed ball go in two cases: it has got more impulse within one duration than
 * any impact could give, where a soft ball would give way; or it is in a nip so narrow that it
 * slips on neither surface, where a soft ball rolls through and gives back the stored energy. */
#ifndef MILLSIM_PINCH_H
#define MILLSIM_PINCH_H

#include "base/memory.h"
#include "millsim/world.h"

struct mill_pinch {
    double since, last; /* [s] local time of the first and the last of these contacts */
    double impulse;     /* [N s] given in them; impulse older than one duration no longer counts */
    vec3 against;       /* normal of the last other surface met since then; zero: none */
    double friction;    /* coefficient on that surface */
};

struct mill_pinches {
    struct mill_pinch *ball; /* [balls]; NULL: no body can pinch */
    /* [balls] 1: its contacts have lasted longer than one duration; else 0. In a row of their own,
     * because each contact of two balls reads them. */
    unsigned char *held;
    double *duration; /* [s] of an impact at the bodies' maximum speed, by species */
    double *most;     /* [N s] a ball that gets more within one duration is let go, by species */
    double parting;   /* [m/s] minimum normal speed after a contact of a pressed ball */
};

/* False when out of memory */
bool mill_pinches_create(struct mill_pinches *pinches, const struct mill_world *world,
                         struct mill_memory_pool *memory);

/* Is ball i pressed at local time t? */
static inline bool mill_pinches_press(const struct mill_pinches *p, const struct mill_world *w,
                                      int32_t i, double t)
{
    return p->ball && p->held[i] && t - p->ball[i].last < p->duration[w->ball[i].species];
}

/* Call this when the record of ball i has been replaced. */
static inline void mill_pinches_hold(struct mill_pinches *p, const struct mill_world *w, int32_t i)
{
    const struct mill_pinch *b = &p->ball[i];
    p->held[i] = b->last - b->since > p->duration[w->ball[i].species];
}

/* Before ball i meets a body that can pinch. Returns how long it was pressed since the last [s]. */
double mill_pinches_meet(struct mill_pinches *p, const struct mill_world *w, int32_t i, double t);

/* Call this after the body has given ball i this impulse [N s] along the normal, with this
 * coefficient of friction. true: the ball is to be let go. */
bool mill_pinches_push(struct mill_pinches *pinches, const struct mill_world *world, int32_t i,
                       double impulse, vec3 normal, double friction);

/* Call this after ball i has met a surface that cannot pinch. */
static inline void mill_pinches_lean(struct mill_pinches *p, int i, vec3 normal, double friction)
{
    if (!p->ball)
        return;
    p->ball[i].against = normal;
    p->ball[i].friction = friction;
}

/* Call this when local time is reduced by `by` [s]. */
void mill_pinches_restart(struct mill_pinches *pinches, const struct mill_world *world, double by);

#endif
