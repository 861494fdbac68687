/* All observers of a run. One of them is a table and its line in observers.c; nobody else needs to
 * know which there are. */
#ifndef MILL_OBSERVERS_H
#define MILL_OBSERVERS_H

#include "millsim/sim.h"
#include "observe/observe.h"
#include "observe/sink.h"

enum { MILL_OBSERVERS = 8 }; /* at most */

/* One of the type. NULL: out of memory. Owner: the caller. */
struct mill_observer *mill_observers_one(const struct mill_observer_type *type,
                                         const struct mill_observe *asked,
                                         const struct mill_world *world, struct mill_error *error);
void mill_observers_free_one(struct mill_observer *observer);

struct mill_observers {
    int count;
    struct mill_observer *each[MILL_OBSERVERS];
};

/* Those that are asked for, in a world at t = 0. Free them in any case. */
enum mill_status mill_observers_create(const struct mill_observe *asked,
                                       const struct mill_world *world,
                                       struct mill_observers *observers, struct mill_error *error);
void mill_observers_free(struct mill_observers *observers);

/* Tells all their states; name: of the observer whose fields follow. */
void mill_observers_state(const struct mill_observers *observers, struct mill_state *state,
                          void (*name)(struct mill_state *state, const char *name));

/* They make what they write to and are called by the loop from now on. */
enum mill_status mill_observers_open(const struct mill_observers *observers,
                                     const struct mill_observe *asked, struct mill_h5 *file,
                                     struct mill_sim *sim, struct mill_error *error);

enum mill_status mill_observers_results(const struct mill_observers *observers,
                                        const struct mill_world *world, double t,
                                        struct mill_sink *sink, struct mill_error *error);

/* false: it was not to go on, and not all is added. */
bool mill_observers_finish(const struct mill_observers *observers, const struct mill_world *world,
                           const struct mill_going *going);

/* The one of this type, or NULL */
struct mill_observer *mill_observers_find(const struct mill_observers *observers,
                                          const struct mill_observer_type *type);

#endif
