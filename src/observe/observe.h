/* What is asked of the observers, as plain numbers: they know no deck. */
#ifndef MILL_OBSERVE_H
#define MILL_OBSERVE_H

#include "base/profile.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

struct mill_observe {
    double end;            /* [s] of the run */
    double sample_from;    /* [s] statistics are gathered from here to the end; 0 where: */
    bool sample_found;     /* the begin is to be found */
    double precision;      /* relative standard error that ends the run; 0: none does */
    double max_collisions; /* that end the run; 0: no number does */
    double strike_window;  /* [s] contacts of a pair closer in time than this are one strike */
    double frames;         /* [s] between stored states of the balls; 0: none */
    double series;         /* [s] between rows of the time series */
    bool log_impacts;
    double rotor_angle;       /* [rad] at t = 0 */
    const double *elastic;    /* [J] in the springs of contacts, of another program's run; NULL: no
                                 springs. The series reads it at every row. */
    struct mill_profile drum; /* its cross-section, or the circle around a body, for pictures */
};

/* Of what happens every `interval` [s] from 0 to `end`: time k; INFINITY: there is none. The last
 * may lie a rounding error behind the end of the run. */
static inline double mill_observe_due(double interval, double end, uint64_t k)
{
    const bool over = k > (uint64_t)floor(end / interval + 1e-9);
    return over ? (double)INFINITY : fmin((double)k * interval, end);
}

/* Asked now and then by what takes long, of which `done` of `all` is done. false: to be left
 * unfinished. */
struct mill_going {
    bool (*on)(void *self, double done, double all);
    void *self;
};

#endif
