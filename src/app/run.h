/* From a checked deck to a finished file and its summary: a run of millsim or another program */
#ifndef MILLSIM_RUN_H
#define MILLSIM_RUN_H

#include "app/command.h"
#include "app/progress.h"
#include "app/record.h"
#include "deck/deck.h"
#include "observe/observers.h"
#include "proof/paranoid.h"

/* What is to be run, and where output goes */
struct mill_run_order {
    const struct mill_command *asked;
    const struct mill_deck *deck;
    const volatile sig_atomic_t *stop;
    volatile sig_atomic_t *begun; /* set to 1 when there are results to save */
    struct mill_progress_display display;
    struct mill_start_watch watch; /* shows on it the tasks before the run */
    void (*say)(const char *line); /* called with a line on what --resume found */
    FILE *page;                    /* receives the summary */
    struct mill_error *error;
    struct mill_paranoid_checks checks; /* number of checks by --paranoid */
};

/* Runs the deck, shows progress a few times a second, writes output file and summary. MILL_STOPPED:
 * *stop became non-zero; the file holds all until then, and the state for --resume. */
enum mill_status mill_run(struct mill_run_order *order);

/* --digest: reads another program's run as a stream from standard input to its end and makes an
 * output file like that of millsim's own runs. MILL_BAD_DECK: the stream is of another mill, or is
 * no such stream; nothing is written. MILL_FAILED: it is cut off or contains impossible values; the
 * file then holds everything up to the last account. MILL_STOPPED: the same after a signal. */
enum mill_status mill_digest(struct mill_run_order *order);

/* Writes all results of either: those of the observers, and /run. */
void mill_run_write(struct mill_h5 *file, const struct mill_observers *observers,
                    const struct mill_world *world, const struct mill_facts *facts);

#endif
