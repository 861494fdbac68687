/* A run, from a checked deck to a finished file and its summary */
#ifndef MILLSIM_RUN_H
#define MILLSIM_RUN_H

#include "app/command.h"
#include "app/progress.h"
#include "deck/deck.h"
#include "observe/observe.h"
#include "proof/paranoid.h"

#include <signal.h>

/* What is to be run, and where output goes */
struct mill_run_order {
    const struct mill_command *asked;
    const struct mill_deck *deck;
    const volatile sig_atomic_t *stop;
    volatile sig_atomic_t *begun; /* set to 1 when there are results to save */
    struct mill_progress_display display;
    void (*say)(const char *line); /* called with a line on what --resume found */
    FILE *page;                    /* receives the summary */
    struct mill_error *error;
    struct mill_paranoid_checks checks; /* number of checks by --paranoid */
};

/* Runs the deck, and writes the output file and the summary. A few times a second it checks *stop
 * and shows the progress. MILL_STOPPED: *stop became non-zero; the file then holds everything up to
 * that moment, and the state for --resume. */
enum mill_status mill_run(struct mill_run_order *order);

#endif
