/* One run from a checked deck to a finished file and its summary. */
#ifndef MILLSIM_RUN_H
#define MILLSIM_RUN_H

#include "app/command.h"
#include "app/progress.h"
#include "deck/deck.h"
#include "millsim/sim.h"
#include "observe/observe.h"

#include <signal.h>

/* What is to be run, and who is told */
struct mill_run_order {
    const struct mill_command *asked;
    const struct mill_deck *deck;
    const volatile sig_atomic_t *stop;
    volatile sig_atomic_t *begun; /* set to 1 once there are results to save */
    struct mill_progress_display display;
    void (*say)(const char *line); /* what --resume finds */
    FILE *page;                    /* where the summary goes */
    struct mill_error *error;
    struct mill_sim_checks checks; /* how often --paranoid has checked */
};

/* Runs the deck and writes the output file and the summary. Polls *stop and shows progress a few
 * times a second; MILL_STOPPED when *stop became non-zero: the file then holds everything up to
 * that moment, and the state to go on from. */
enum mill_status mill_run(struct mill_run_order *order);

/* What a deck asks of the observers of its mill */
struct mill_observe mill_run_observe(const struct mill_deck *deck, const struct mill_world *world);

#endif
