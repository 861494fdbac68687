/* Time series at output.series: energies, rotor, losses and counts, under /observables. */
#ifndef MILL_SERIES_H
#define MILL_SERIES_H

#include "millsim/observer.h"
#include "store/h5.h"

/* What a checkpoint keeps: rows so far, and the rotor's angular impulse at the last of them. */
struct mill_series_state {
    uint64_t rows;
    double rotor_impulse; /* [N m s] */
};

/* Makes the datasets and the observer that fills them. Deck and file must outlive it. MILL_FAILED
 * when the file cannot be written or memory is short. Owner: the caller. */
enum mill_status mill_series_create(struct mill_h5 *file, const struct mill_deck *deck,
                                    const struct mill_world *world, struct mill_observer **observer,
                                    struct mill_error *error);

/* The same for a run taken up again: rows after the state's are dropped. */
enum mill_status mill_series_resume(struct mill_h5 *file, const struct mill_deck *deck,
                                    const struct mill_world *world,
                                    const struct mill_series_state *state,
                                    struct mill_observer **observer, struct mill_error *error);

void mill_series_save(const struct mill_observer *observer, struct mill_series_state *state);

/* NULL is fine. */
void mill_series_free(struct mill_observer *observer);

#endif
