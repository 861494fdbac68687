/* What the files of the run share. */
#ifndef MILL_RUN_PRIVATE_H
#define MILL_RUN_PRIVATE_H

#include "app/checkpoint.h"
#include "app/record.h"
#include "app/run.h"
#include "millsim/world.h"

#define MILL_RUN_SHOW_EVERY 0.25 /* [s] of wall time between two reports of progress */

/* One run from its begin to its end */
struct mill_run {
    const struct mill_deck *deck;
    const struct mill_run_options *options;
    struct mill_world *world;
    struct mill_sim *sim;
    struct mill_h5 *file;
    struct mill_observer *frames, *series, *log;
    struct mill_tally *tally;
    struct mill_checkpoint at; /* to go on from, where `resumes` */
    bool resumes;
    double started;               /* [s] of wall time */
    double due;                   /* [s] of wall time, the next checkpoint */
    struct mill_record_cost cost; /* of earlier legs of the run; checkpoints also of this one */
    bool saved;                   /* there is a checkpoint to come back to */
    bool unsaved;                 /* the last one failed */
    const char *note;             /* what --resume found, to be said once the file is ours */
};

/* [s] of wall time, from some moment */
double mill_run_clock(void);

/* The world of the deck; options->progress is told how far its start positions are. Owner: the
 * caller. */
enum mill_status mill_run_build(const struct mill_deck *deck,
                                const struct mill_run_options *options, struct mill_world **world,
                                struct mill_error *error);

/* What all legs of the run have cost up to now. */
struct mill_record_cost mill_run_cost(const struct mill_run *r);

/* Everything that is known now into the file; state: to go on from, or NULL. */
void mill_run_write(struct mill_run *r, const char *ended, struct mill_checkpoint_state *state);

/* MILL_FAILED: out of memory. */
enum mill_status mill_run_summarise(const struct mill_run *r, bool stopped,
                                    struct mill_error *error);

/* The file could not be written any more: adds what is not lost. */
void mill_run_explain(const struct mill_run *r, struct mill_error *error);

#endif
