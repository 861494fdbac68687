/* What the observers are asked for, as plain numbers: they do not depend on the deck. */
#ifndef MILL_OBSERVE_H
#define MILL_OBSERVE_H

#include "millsim/kinds.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* Coefficients of wear of one kind of contact; 0: not given */
struct mill_wear_law {
    double archard;  /* Archard's K */
    double hardness; /* [Pa] of the surface */
    double erosion;  /* [kg/J] Finnie's k */
};

struct mill_observe {
    double end;            /* [s] end of the run */
    double sample_from;    /* [s] start of the statistics; 0: see sample_found */
    bool sample_found;     /* true: the start of the statistics is found in the run */
    double precision;      /* relative standard error that ends the run; 0: not used */
    long starts;           /* of the run */
    double max_collisions; /* number of collisions that ends the run; 0: not used */
    double strike_window;  /* [s] closer contacts of a pair are one strike; NaN: as a contact */
    double hard;           /* [J] impacts of this energy or more are hard; NaN: it is to be found */
    int hard_by;           /* one of MILL_ENERGIES_SORTS */
    double frames;         /* [s] between stored states of the balls; 0: none */
    double series;         /* [s] between rows of the time series */
    int log_impacts;       /* 1: yes */
    double rotor_angle;    /* [rad] at t = 0 */
    bool springs;          /* the run has contacts that store energy: there is a series of it */
    struct mill_wear_law wear[MILL_KINDS_MOST];
};

/* Time of event k of those that happen every `interval` [s] from 0 to `end`. INFINITY: there is no
 * such event. The last one may be later than the end of the run by a rounding error. */
static inline double mill_observe_due(double interval, double end, uint64_t k)
{
    const bool over = k > (uint64_t)floor(end / interval + 1e-9);
    return over ? (double)INFINITY : fmin((double)k * interval, end);
}

/* Called during long work, of which `done` of `all` is done. on() == false stops it unfinished. */
struct mill_going {
    bool (*on)(void *self, double done, double all);
    void *self;
};

#endif
