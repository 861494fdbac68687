/* The state of a run in its own output file, as /checkpoint: what --resume goes on from. The file
 * is published as a whole, so state and results are always of one moment. */
#ifndef MILL_CHECKPOINT_H
#define MILL_CHECKPOINT_H

#include "frames.h"
#include "impactlog.h"
#include "millsim/sim.h"
#include "record.h"
#include "series.h"
#include "tally.h"

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

/* The state now, before anything is finished. NULL: out of memory. Owner: the caller. */
unsigned char *mill_checkpoint_take(const struct mill_checkpoint_parts *parts,
                                    const struct mill_record_cost *cost);

/* Writes /checkpoint. */
enum mill_status mill_checkpoint_write(const unsigned char *state, struct mill_h5 *file,
                                       struct mill_error *error);

/* Removes it, if there is one. */
enum mill_status mill_checkpoint_remove(struct mill_h5 *file, struct mill_error *error);

/* Reads and checks /checkpoint; `state` NULL and MILL_OK where the file has none. name: of the
 * file, for messages. Owner: the caller. */
enum mill_status mill_checkpoint_read(struct mill_h5 *file, const char *name, unsigned char **state,
                                      struct mill_error *error);

/* What the observers need to be resumed; then puts the state back into sim and tally, which are of
 * the same deck. */
struct mill_checkpoint mill_checkpoint_head(const unsigned char *state);
enum mill_status mill_checkpoint_load_sim(const unsigned char *state, struct mill_sim *sim,
                                          struct mill_error *error);
enum mill_status mill_checkpoint_load_tally(const unsigned char *state, struct mill_tally *tally,
                                            struct mill_error *error);

#endif
