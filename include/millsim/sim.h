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
 * would happen in a finite time (MILL_FAILED). Pauses do not influence a run. */
enum mill_status mill_sim_run(struct mill_sim *sim, double until, uint64_t budget,
                              const volatile sig_atomic_t *stop, struct mill_error *error);

/* Checks every ball now for overlaps with balls and surfaces. The deepest one and the number of
 * those beyond 1e-9 m are added to the world's counts. The loop calls it 16 times a second. */
void mill_sim_audit(struct mill_sim *sim);

/* Saves or loads the state of sim and world: all data that the next event depends on. To load, use
 * a sim of the same deck that has not run. The state of another deck is refused without any change
 * of the sim. After any other failure the sim must not be used. */
void mill_sim_state(struct mill_sim *sim, struct mill_state *state);

const struct mill_world *mill_sim_world(const struct mill_sim *sim);
double mill_sim_time(const struct mill_sim *sim);       /* [s] simulated time reached */
double mill_sim_local_time(const struct mill_sim *sim); /* the same as local time */

#endif
