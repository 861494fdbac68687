/* All observers of a run: each is a table of functions, and a line in observers.c alone. */
#ifndef MILL_OBSERVERS_H
#define MILL_OBSERVERS_H

#include "millsim/sim.h"
#include "observe/observe.h"
#include "observe/sink.h"

/* observe/tally.h */
struct mill_tally;
struct mill_tally_results;

/* An observer of the program. A function may be NULL if there is nothing to do. */
struct mill_observing {
    struct mill_observer_type type; /* first: for the loop; its state is saved under this name */
    size_t size;                    /* of its struct */

    /* ---- called outside of the loop, in this order ---- */

    bool (*wanted)(const struct mill_observe *); /* Is it requested? NULL: always */
    /* Fills its struct, zero except for type and next = INFINITY, in a world at t = 0 that outlives
     * it; keeps no pointer to the request. MILL_FAILED: out of memory; free is called all the same.
     * */
    enum mill_status (*create)(struct mill_observer *, const struct mill_observe *,
                               const struct mill_world *, struct mill_error *);
    void (*state)(struct mill_observer *, struct mill_state *); /* saves or loads its state */
    /* Creates its datasets in a file that outlives it, or continues after the rows of its state. */
    void (*open)(struct mill_observer *, const struct mill_observe *, struct mill_h5 *file,
                 const struct mill_world *);
    /* Reports results as if the run ended at local time t. Without memory: mill_sink_fail. */
    enum mill_status (*results)(const struct mill_observer *, const struct mill_world *, double t,
                                struct mill_sink *, struct mill_error *);
    /* Adds the data that only the file of a finished run has. The last argument can stop this long
     * work: the result is then false. NULL: never stop. */
    bool (*finish)(struct mill_observer *, const struct mill_world *, const struct mill_going *);
    void (*free)(struct mill_observer *); /* all that it allocated, except its struct */
};

static inline const struct mill_observing *mill_observe_type(const struct mill_observer *observer)
{
    return (const struct mill_observing *)observer->type;
}

enum { MILL_OBSERVERS = 8 }; /* maximum number */

static inline void mill_observers_free_one(struct mill_observer *observer)
{
    if (mill_observe_type(observer)->free)
        mill_observe_type(observer)->free(observer);
    free(observer);
}

/* Makes an observer of this type. NULL: out of memory. Owner: the caller. */
static inline struct mill_observer *mill_observers_one(const struct mill_observing *type,
                                                       const struct mill_observe *asked,
                                                       const struct mill_world *world,
                                                       struct mill_error *error)
{
    struct mill_observer *one = calloc(1, type->size);
    if (!one) {
        mill_error_set(error, MILL_FAILED, "out of memory for %s", type->type.name);
        return NULL;
    }
    *one = (struct mill_observer){&type->type, INFINITY};
    if (!type->create || type->create(one, asked, world, error) == MILL_OK)
        return one;
    mill_observers_free_one(one);
    return NULL;
}

struct mill_observers {
    int count;
    struct mill_observer *each[MILL_OBSERVERS];
};

/* Makes the observers asked for, in a world at t = 0. The caller frees them in all cases. */
enum mill_status mill_observers_create(const struct mill_observe *a, const struct mill_world *world,
                                       struct mill_observers *observers, struct mill_error *error);
void mill_observers_free(struct mill_observers *observers);

/* Saves or loads the states of all observers. name() is called before the fields of each. */
void mill_observers_state(const struct mill_observers *observers, struct mill_state *state,
                          void (*name)(struct mill_state *state, const char *name));

/* The observers make their datasets, and the loop calls them from now on. sim: NULL: none */
enum mill_status mill_observers_open(const struct mill_observers *observers,
                                     const struct mill_observe *asked, struct mill_h5 *file,
                                     const struct mill_world *world, struct mill_sim *sim,
                                     struct mill_error *error);

/* Reports all results, as if the run ended at local time t. *known: those of the statistics; NULL:
 * they are made. Owner: the caller, also after a failure; mill_tally_results_free(). */
enum mill_status mill_observers_results(const struct mill_observers *observers,
                                        const struct mill_world *world, double t,
                                        struct mill_sink *sink, struct mill_tally_results **known,
                                        struct mill_error *error);

/* Adds what only a finished file has. false: `going` has stopped it, and it is incomplete. */
bool mill_observers_finish(const struct mill_observers *observers, const struct mill_world *world,
                           const struct mill_going *going);

/* The one that gathers the statistics, which every run has */
const struct mill_tally *mill_observers_tally(const struct mill_observers *observers);

#endif
