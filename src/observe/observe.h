/* What the observers are asked for, as plain numbers: they do not depend on the deck. And what all
 * of them consist of. */
#ifndef MILL_OBSERVE_H
#define MILL_OBSERVE_H

#include "millsim/observer.h"
#include "millsim/state.h"
#include "observe/sink.h"

/* Coefficients of wear of one kind of contact; 0: not given */
struct mill_wear_law {
    double archard;  /* Archard's K */
    double hardness; /* [Pa] of the surface */
    double erosion;  /* [kg/J] Finnie's k */
};

struct mill_observe {
    double end; /* [s] end of the run */
    /* [s] statistics are gathered from here to the end; 0: see sample_found */
    double sample_from;
    bool sample_found;     /* true: the start of the statistics is found in the run */
    double precision;      /* relative standard error that ends the run; 0: not used */
    double max_collisions; /* number of collisions that ends the run; 0: not used */
    double strike_window;  /* [s] contacts of a pair closer in time than this are one strike */
    double frames;         /* [s] between stored states of the balls; 0: none */
    double series;         /* [s] between rows of the time series */
    int log_impacts;       /* 1: yes */
    double rotor_angle;    /* [rad] at t = 0 */
    /* [J] energy in the springs of contacts, for another program's run; NULL: no springs. The
     * series reads the number at every row. */
    const double *elastic;
    struct mill_wear_law wear[MILL_KINDS_MOST];
};

/* Time of event k of those that happen every `interval` [s] from 0 to `end`. INFINITY: there is no
 * such event. The last one may be later than the end of the run by a rounding error. */
static inline double mill_observe_due(double interval, double end, uint64_t k)
{
    const bool over = k > (uint64_t)floor(end / interval + 1e-9);
    return over ? (double)INFINITY : fmin((double)k * interval, end);
}

/* Called now and then during long work. `done` of `all` is done. on() returns false to stop the
 * work unfinished. */
struct mill_going {
    bool (*on)(void *self, double done, double all);
    void *self;
};

/* An observer of the program. A function may be NULL if there is nothing to do. */
struct mill_observing {
    /* first: what the event loop calls. Its name is also that of the group of the file that
     * contains the observer's state. */
    struct mill_observer_type type;
    size_t size; /* of its struct */

    /* ---- called outside of the loop, in this order ---- */

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

static inline const struct mill_observing *mill_observe_type(const struct mill_observer *observer)
{
    return (const struct mill_observing *)observer->type;
}

#endif
