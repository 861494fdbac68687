/* Every impact, one row each, one dataset a column, under /impacts: for output.impacts = all. */
#ifndef MILL_IMPACTLOG_H
#define MILL_IMPACTLOG_H

#include "millsim/observer.h"
#include "store/h5.h"

/* What a checkpoint keeps: impacts logged so far. */
struct mill_impactlog_state {
    uint64_t rows;
};

/* Makes the datasets and the observer that fills them. Deck and file must outlive it. MILL_FAILED
 * when the file cannot be written or memory is short. Owner: the caller. */
enum mill_status mill_impactlog_create(struct mill_h5 *file, const struct mill_deck *deck,
                                       const struct mill_world *world,
                                       struct mill_observer **observer, struct mill_error *error);

/* The same for a run taken up again: rows after the state's are dropped. */
enum mill_status mill_impactlog_resume(struct mill_h5 *file, const struct mill_deck *deck,
                                       const struct mill_world *world,
                                       const struct mill_impactlog_state *state,
                                       struct mill_observer **observer, struct mill_error *error);

void mill_impactlog_save(const struct mill_observer *observer, struct mill_impactlog_state *state);

/* Hands what is still gathered in memory to the file: at the end, at a stop and at checkpoints; the
 * observer goes on working. */
void mill_impactlog_finish(struct mill_observer *observer);

/* NULL is fine. */
void mill_impactlog_free(struct mill_observer *observer);

#endif
