/* The event loop: jumps the world from one contact to the next. */
#ifndef MILLSIM_SIM_H
#define MILLSIM_SIM_H

#include "millsim/observer.h"
#include "millsim/state.h"

#include <signal.h>

struct mill_sim;

/* The world stays the caller's and must outlive the sim. */
enum mill_status mill_sim_create(struct mill_world *world, struct mill_sim **sim,
                                 struct mill_error *error);
void mill_sim_free(struct mill_sim *sim);

/* Observers, eight at most, are called in the order of their addition and stay the caller's. One
 * without `sample` is asked for none. */
enum mill_status mill_sim_observe(struct mill_sim *sim, struct mill_observer *observer);

/* Runs on to simulated time `until` [s] (samples due exactly then are taken), or for `budget`
 * events (MILL_OK as well: mill_sim_time tells how far it got), or until *stop (may be NULL)
 * becomes non-zero (MILL_STOPPED), or an observer has seen enough (MILL_ENDED) or fails, or time
 * stands still (MILL_FAILED). Where it pauses has no influence on the run. */
enum mill_status mill_sim_run(struct mill_sim *sim, double until, uint64_t budget,
                              const volatile sig_atomic_t *stop, struct mill_error *error);

/* Checks every ball against its neighbours and all surfaces, now; the deepest overlap and how many
 * are beyond 1e-9 m go to the world's counts. The loop does it 16 times a simulated second. */
void mill_sim_audit(struct mill_sim *sim);

/* Tells the state of sim and world: everything that the next event depends on. Loading wants a sim
 * of the same deck that has not run; the state of another deck is refused and does not touch it,
 * after any other failure the sim must not be used. */
void mill_sim_state(struct mill_sim *sim, struct mill_state *state);

/* How often each thing was checked, and held */
struct mill_sim_checks {
    uint64_t events;      /* due in time, the earliest of all, of bodies that do touch */
    uint64_t entries;     /* of the calendar, compared with the plan they stand for */
    uint64_t predictions; /* plans of one ball, compared with brute force */
    uint64_t pairs;       /* of balls: no overlap now, no contact before the next event of either */
    uint64_t surfaces;    /* of a ball and a surface: the same */
    uint64_t samples;     /* of gaps to surfaces until the next event */
    uint64_t places;      /* balls found in their cell */
    uint64_t accounts;    /* balances of the energy account */
};

/* Switches on (or off) the checks of every step against brute force: each event, and the state now,
 * before this returns. They change nothing in the world; the first that does not hold ends the run
 * with MILL_FAILED and one line "paranoid: ...". The cost of an event grows with the number of
 * balls. */
enum mill_status mill_sim_paranoid(struct mill_sim *sim, bool on, struct mill_error *error);

/* The checks made since they were switched on; all zero without. */
struct mill_sim_checks mill_sim_checks(const struct mill_sim *sim);

const struct mill_world *mill_sim_world(const struct mill_sim *sim);
double mill_sim_time(const struct mill_sim *sim);       /* [s] simulated time reached */
double mill_sim_local_time(const struct mill_sim *sim); /* the same as local time */

#endif
