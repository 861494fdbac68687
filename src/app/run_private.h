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
    struct mill_observers observers;
    bool resumes;               /* there is a state to go on from */
    bool complete;              /* the end is reached, also where the file has yet to be finished */
    struct mill_error ended_by; /* what ended it: "time", or as an observer says */
    double started;             /* [s] of wall time */
    double due;                 /* [s] of wall time, the next checkpoint */
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

/* The state that the run can go on from into the file */
void mill_run_keep(const struct mill_run *r);

/* Everything that is known now into the file. status: of the run */
void mill_run_write(const struct mill_run *r, const char *status);

/* The run has ended, with `status`: everything into the file, which is published and closed, also
 * after a stop or a failure. A stopped run can go on. MILL_STOPPED: the run is complete and
 * published, and was stopped while more was added to the file. */
enum mill_status mill_run_conclude(struct mill_run *r, enum mill_status status,
                                   struct mill_error *error);

/* MILL_FAILED: out of memory. */
enum mill_status mill_run_summarise(const struct mill_run *r, struct mill_error *error);

/* The file could not be written any more: adds what is not lost. */
void mill_run_explain(const struct mill_run *r, struct mill_error *error);

#endif
