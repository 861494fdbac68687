/* The state of a run in its own output file, as /checkpoint: what --resume goes on from. The file
 * is published as a whole, so state and results are always of one moment. */
#ifndef MILL_CHECKPOINT_H
#define MILL_CHECKPOINT_H

#include "app/record.h"
#include "base/parts.h"
#include "millsim/sim.h"
#include "observe/frames.h"
#include "observe/impactlog.h"
#include "observe/series.h"
#include "observe/tally.h"

/* What has a state; log may be NULL. */
struct mill_checkpoint_parts {
    struct mill_sim *sim;
    struct mill_tally *tally;
    struct mill_observer *frames, *series, *log;
};

/* What it begins with. */
struct mill_checkpoint {
    char magic[8];
    char version[64];  /* of the program that wrote it */
    uint64_t size;     /* [byte] all of it */
    uint64_t checksum; /* of all of it, this field as 0 */
    struct mill_record_cost cost;
    struct mill_frames_state frames;
    struct mill_series_state series;
    struct mill_impactlog_state log;
    uint64_t sim, tally; /* [byte] of their states, which follow */
};

/* A state as it stood at one moment: what audits and results change is copied, the arrays stay
 * where they are, so that no run needs memory for them twice. Good until the next mill_sim_run, and
 * not to be copied. */
struct mill_checkpoint_state {
    struct mill_checkpoint head;
    unsigned char *sim; /* the copies */
    struct mill_part part[1 + MILL_SIM_PARTS + MILL_TALLY_PARTS];
    size_t parts;
};

/* The state now. MILL_FAILED: out of memory. Release it in any case.
 */
enum mill_status mill_checkpoint_take(const struct mill_checkpoint_parts *parts,
                                      const struct mill_record_cost *cost,
                                      struct mill_checkpoint_state *state,
                                      struct mill_error *error);
void mill_checkpoint_release(struct mill_checkpoint_state *state);

/* Writes /checkpoint, part by part. */
void mill_checkpoint_write(struct mill_checkpoint_state *state, struct mill_h5 *file);

/* Removes it, if there is one. */
void mill_checkpoint_remove(struct mill_h5 *file);

/* Checks /checkpoint, all of it, and reads what it begins with, which the observers need to be
 * resumed; *found false and MILL_OK where the file has none. name: of the file, for messages. */
enum mill_status mill_checkpoint_read(struct mill_h5 *file, const char *name,
                                      struct mill_checkpoint *head, bool *found,
                                      struct mill_error *error);

/* Puts the state that begins with `head` back into sim and tally, which are of the same deck.
 * MILL_FAILED also where the file has another one by now. */
enum mill_status mill_checkpoint_load(struct mill_h5 *file, const char *name,
                                      const struct mill_checkpoint *head, struct mill_sim *sim,
                                      struct mill_tally *tally, struct mill_error *error);

#endif
