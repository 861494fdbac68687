/* The event loop: jumps the world from one contact to the next. */
#ifndef MILLSIM_SIM_H
#define MILLSIM_SIM_H

#include "millsim/observer.h"
#include "millsim/status.h"
#include "millsim/world.h"

#include <signal.h>

struct mill_sim;

/* The world stays the caller's and must outlive the sim. */
enum mill_status mill_sim_create(struct mill_world *world, struct mill_sim **sim,
                                 struct mill_error *error);
void mill_sim_free(struct mill_sim *sim);

/* Observers are called in the order of their addition and stay the caller's. */
enum mill_status mill_sim_observe(struct mill_sim *sim, struct mill_observer *observer);

/* Runs on to simulated time `until` [s] (samples due exactly then are taken), or for `budget`
 * events, or until *stop (may be NULL) becomes non-zero (MILL_STOPPED), or an observer fails, or
 * time stands still (MILL_FAILED). Where it pauses has no influence on the run. */
enum mill_status mill_sim_run(struct mill_sim *sim, double until, uint64_t budget,
                              const volatile sig_atomic_t *stop, struct mill_error *error);

/* Checks every ball against its neighbours and all surfaces, now; the deepest overlap and how many
 * are beyond 1e-9 m go to the world's counts. The loop does it 16 times a simulated second. */
void mill_sim_audit(struct mill_sim *sim);

/* The state of sim and world as one run of bytes, for a run that is interrupted and goes on to the
 * same bits. Load into a sim of the same deck, before it runs. The bytes are good for the same
 * program only; MILL_FAILED when they are of another deck or damaged. */
size_t mill_sim_state_size(const struct mill_sim *sim);
void mill_sim_save(const struct mill_sim *sim, unsigned char *state);
enum mill_status mill_sim_load(struct mill_sim *sim, const unsigned char *state, size_t size,
                               struct mill_error *error);

/* Simulated time reached [s]; local time of the same. */
double mill_sim_time(const struct mill_sim *sim);
double mill_sim_local_time(const struct mill_sim *sim);

#endif
