/* The event loop: it moves the world from one event to the next. */
#ifndef MILLSIM_SIM_H
#define MILLSIM_SIM_H

#include "millsim/observer.h"
#include "millsim/state.h"

#include <signal.h>

struct mill_sim;

/* The caller owns the world, which must exist longer than the sim. */
enum mill_status mill_sim_create(struct mill_world *world, struct mill_sim **sim,
                                 struct mill_error *error);
void mill_sim_free(struct mill_sim *sim);

/* Adds an observer, eight at most. Observers are called in the order in which they were added. The
 * caller owns them. An observer without `sample` gets no samples. */
enum mill_status mill_sim_observe(struct mill_sim *sim, struct mill_observer *observer);

/* From now on mill_sim_run uses so many threads at most. Results have the same bits for any number.
 * Short mills take fewer threads, and if there is no memory, or no thread can be started, one
 * thread does all the work. One thread also goes on alone where several are slower. */
void mill_sim_use_threads(struct mill_sim *sim, int threads);

/* Number of threads that mill_sim_run uses */
int mill_sim_threads(const struct mill_sim *sim);

/* Continues the run until one of these happens: simulated time `until` [s] is reached (samples due
 * exactly then are taken, MILL_OK); `budget` events are done, or a few more on several threads
 * (MILL_OK; mill_sim_time gives the time reached); *stop, if stop is not NULL, becomes non-zero
 * (MILL_STOPPED); an observer has gathered enough (MILL_ENDED) or fails; infinitely many contacts
 * would happen in a finite time (MILL_FAILED). The times at which a caller pauses the run do not
 * influence it. */
enum mill_status mill_sim_run(struct mill_sim *sim, double until, uint64_t budget,
                              const volatile sig_atomic_t *stop, struct mill_error *error);

/* Checks every ball now for overlaps with its neighbours and all surfaces. The deepest overlap and
 * the number of overlaps beyond 1e-9 m are added to the world's counts. The loop calls it 16 times
 * per simulated second. */
void mill_sim_audit(struct mill_sim *sim);

/* Saves or loads the state of sim and world: all data that the next event depends on. To load, use
 * a sim of the same deck that has not run. The state of another deck is refused without any change
 * of the sim. After any other failure the sim must not be used. */
void mill_sim_state(struct mill_sim *sim, struct mill_state *state);

/* How often each property was checked and found true */
struct mill_sim_checks {
    uint64_t events;      /* due now, the earliest of all, of bodies that touch */
    uint64_t entries;     /* of the calendar, compared with the plan of the ball */
    uint64_t predictions; /* plans of one ball, compared with brute force */
    uint64_t pairs;       /* of balls: no overlap now, no contact before the next event of either */
    uint64_t surfaces;    /* of a ball and a surface: no overlap, no earlier contact */
    uint64_t samples;     /* of gaps to surfaces until the next event */
    uint64_t quartics;    /* solved for contacts, compared with other solvers */
    uint64_t places;      /* balls that are in their cell */
    uint64_t accounts;    /* balances of the energy account */
};

/* Switches on (or off) checks by brute force of every event, and of the present state before this
 * function returns. They change nothing in the world. The first check that fails ends the run with
 * MILL_FAILED and one line "paranoid: ...". The cost of an event grows with the number of balls. */
enum mill_status mill_sim_paranoid(struct mill_sim *sim, bool on, struct mill_error *error);

/* Paranoid runs ask this solver as well, of each quartic. Call it before they are switched on. */
void mill_sim_use_opinion(struct mill_sim *sim, mill_poly_opinion_fn *second);

/* The checks made since they were switched on; all zero if they are off. */
struct mill_sim_checks mill_sim_checks(const struct mill_sim *sim);

const struct mill_world *mill_sim_world(const struct mill_sim *sim);
double mill_sim_time(const struct mill_sim *sim);       /* [s] simulated time reached */
double mill_sim_local_time(const struct mill_sim *sim); /* the same as local time */

#endif
