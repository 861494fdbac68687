/* What the files of the run share. */
#ifndef MILL_RUN_PRIVATE_H
#define MILL_RUN_PRIVATE_H

#include "millsim/world.h"
#include "run.h"

#define MILL_RUN_SHOW_EVERY 0.25 /* [s] of wall time between two reports of progress */

/* [s] of wall time, from some moment */
double mill_run_clock(void);

/* The world of the deck; options->progress is told how far its start positions are. Owner: the
 * caller. */
enum mill_status mill_run_build(const struct mill_deck *deck,
                                const struct mill_run_options *options, struct mill_world **world,
                                struct mill_error *error);

#endif
