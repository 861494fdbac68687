/* The list of all observers, and the functions that call each of them. */
#include "observe/observers.h"

#include "observe/tally.h"

extern const struct mill_observing mill_reliefs_type, mill_frames_type, mill_series_type,
    mill_impactlog_type;

/* In the order in which the loop calls them */
static const struct mill_observing *const types[] = {&mill_tally_type, &mill_reliefs_type,
                                                     &mill_frames_type, &mill_series_type,
                                                     &mill_impactlog_type};
static const int all = sizeof types / sizeof types[0];

enum mill_status mill_observers_create(const struct mill_observe *asked,
                                       const struct mill_world *world,
                                       struct mill_observers *observers, struct mill_error *error)
{
    assert(all <= MILL_OBSERVERS);
    *observers = (struct mill_observers){0};
    for (int k = 0; k < all; k++) {
        if (types[k]->wanted && !types[k]->wanted(asked))
            continue;
        struct mill_observer *one = mill_observers_one(types[k], asked, world, error);
        if (!one)
            return MILL_FAILED;
        observers->each[observers->count++] = one;
    }
    return MILL_OK;
}

void mill_observers_free(struct mill_observers *observers)
{
    for (int k = 0; k < observers->count; k++)
        mill_observers_free_one(observers->each[k]);
    observers->count = 0;
}

void mill_observers_state(const struct mill_observers *observers, struct mill_state *state,
                          void (*name)(struct mill_state *state, const char *name))
{
    for (int k = 0; k < observers->count; k++) {
        struct mill_observer *one = observers->each[k];
        if (!mill_observe_type(one)->state)
            continue;
        name(state, one->type->name);
        mill_observe_type(one)->state(one, state);
    }
}

enum mill_status mill_observers_open(const struct mill_observers *observers,
                                     const struct mill_observe *asked, struct mill_h5 *file,
                                     const struct mill_world *world, struct mill_sim *sim,
                                     struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    for (int k = 0; k < observers->count && status == MILL_OK; k++) {
        struct mill_observer *one = observers->each[k];
        if (mill_observe_type(one)->open)
            mill_observe_type(one)->open(one, asked, file, world);
        status = sim ? mill_sim_observe(sim, one) : MILL_OK;
    }
    return status == MILL_OK ? mill_h5_status(file, error) : status;
}

enum mill_status mill_observers_results(const struct mill_observers *observers,
                                        const struct mill_world *world, double t,
                                        struct mill_sink *sink, struct mill_tally_results **known,
                                        struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    if (!*known)
        status = mill_tally_results_make(mill_observers_tally(observers), world, t, known, error);
    if (status == MILL_OK)
        mill_tally_results_tell(*known, sink);
    for (int k = 0; k < observers->count && status == MILL_OK; k++) {
        const struct mill_observer *one = observers->each[k];
        if (mill_observe_type(one)->results)
            status = mill_observe_type(one)->results(one, world, t, sink, error);
    }
    if (status == MILL_OK && sink->failed)
        status = mill_error_set(error, MILL_FAILED, "%s", sink->failed);
    return status;
}

bool mill_observers_finish(const struct mill_observers *observers, const struct mill_world *world,
                           const struct mill_going *going)
{
    for (int k = 0; k < observers->count; k++) {
        struct mill_observer *one = observers->each[k];
        if (mill_observe_type(one)->finish && !mill_observe_type(one)->finish(one, world, going))
            return false;
    }
    return true;
}

const struct mill_tally *mill_observers_tally(const struct mill_observers *observers)
{
    assert(observers->each[0]->type == &mill_tally_type.type);
    return (const struct mill_tally *)observers->each[0];
}
