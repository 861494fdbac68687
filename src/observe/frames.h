/* The ball states at output.frames, in H5MD 1.1: /h5md and /particles/trajectory. */
#ifndef MILL_FRAMES_H
#define MILL_FRAMES_H

#include "millsim/observer.h"
#include "store/h5.h"

/* What a checkpoint keeps: frames stored so far. */
struct mill_frames_state {
    uint64_t rows;
};

/* Makes the datasets and the observer that fills them; with output.frames = 0 only
 * what does not change (id, species, mass, diameter). Deck and file must outlive it. MILL_FAILED
 * when the file cannot be written or memory is short. Owner: the caller. */
enum mill_status mill_frames_create(struct mill_h5 *file, const struct mill_deck *deck,
                                    const struct mill_world *world, struct mill_observer **observer,
                                    struct mill_error *error);

/* The same for a run taken up again: rows after the state's are dropped. */
enum mill_status mill_frames_resume(struct mill_h5 *file, const struct mill_deck *deck,
                                    const struct mill_world *world,
                                    const struct mill_frames_state *state,
                                    struct mill_observer **observer, struct mill_error *error);

void mill_frames_save(const struct mill_observer *observer, struct mill_frames_state *state);

/* How many frames there are so far, and the simulated time of frame k [s]. */
uint64_t mill_frames_count(const struct mill_observer *observer);
double mill_frames_time(const struct mill_observer *observer, uint64_t k);

/* NULL is fine. */
void mill_frames_free(struct mill_observer *observer);

#endif
