/* Pinches: a ball that a moving body presses against something meets both without end. A stiff soft
 * sphere does not: what outlasts an impact is no rebound any more but one contact that goes on. So
 * it is here. A ball that meets such bodies again and again, each time within the duration of an
 * impact since the last, is pressed as soon as this has lasted longer than one. Its contacts then
 * are no impacts of their own and have no restitution; it parts from other bodies just fast enough
 * not to meet them without end. A ball that is given more within that duration than any impact
 * could is let go: a soft one would give way. So is one in a nip so narrow that it slips on neither
 * surface: a rigid one would jam, a soft one rolls through and gives back what it has stored. */
#ifndef MILLSIM_PINCH_H
#define MILLSIM_PINCH_H

#include "millsim/world.h"

struct mill_pinch {
    double since, last; /* [s] local: first and last of those contacts */
    double impulse;     /* [N s] given in them; what lies a duration back counts no more */
    vec3 against;       /* normal of the last other surface met since then; zero: none */
    double friction;    /* on that surface */
};

struct mill_pinches {
    struct mill_pinch *ball; /* [balls]; NULL: nothing pinches */
    double *duration;        /* [s] of an impact at the bodies' greatest speed, by species */
    double *most;            /* [N s] more than this within it lets a ball go, by species */
    double parting;          /* [m/s] least normal speed after a contact of a pressed ball */
};

/* False when out of memory */
bool mill_pinches_create(struct mill_pinches *pinches, const struct mill_world *world);
void mill_pinches_free(struct mill_pinches *pinches);

/* Is ball i pressed at local time t? */
static inline bool mill_pinches_press(const struct mill_pinches *p, const struct mill_world *w,
                                      int32_t i, double t)
{
    if (!p->ball)
        return false;
    const struct mill_pinch *b = &p->ball[i];
    const double duration = p->duration[w->ball[i].species];
    return b->last - b->since > duration && t - b->last < duration;
}

/* A body that pinches is about to meet ball i. */
void mill_pinches_meet(struct mill_pinches *pinches, struct mill_world *world, int32_t i, double t);

/* It has given the ball this impulse [N s] along the normal, with this coefficient of friction. Is
 * the ball to be let go? */
bool mill_pinches_push(struct mill_pinches *pinches, const struct mill_world *world, int32_t i,
                       double impulse, vec3 normal, double friction);

/* Ball i has met a surface that does not pinch. */
static inline void mill_pinches_lean(struct mill_pinches *p, int32_t i, vec3 normal,
                                     double friction)
{
    if (!p->ball)
        return;
    p->ball[i].against = normal;
    p->ball[i].friction = friction;
}

/* Local time goes back by this [s]. */
void mill_pinches_restart(struct mill_pinches *pinches, int32_t balls, double by);

#endif
