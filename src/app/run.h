/* One run from a checked deck to a finished file and its summary. */
#ifndef MILLSIM_RUN_H
#define MILLSIM_RUN_H

#include "deck/deck.h"
#include "millsim/sim.h"
#include "millsim/status.h"

#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

struct mill_progress {
    double time, end; /* [s] simulated */
    uint64_t collisions;
    double wall; /* [s] of this leg */
    bool begins; /* the run stands here: rates count from now on */
    /* NULL, or the start is not ready: what is done for it, to `time` of `end` balls */
    const char *stage;
    const char *known; /* how well the results are known by now; NULL or "": nothing to be said */
};

struct mill_run_options {
    const char *output; /* path */
    bool force;
    bool resume; /* go on from the state in the output file; from the beginning where none is */
    bool quiet;
    const char *command; /* the command line, shell-quoted, for the record */
    const volatile sig_atomic_t *stop;
    volatile sig_atomic_t *begun; /* set to 1 once there are results to save; may be NULL */
    void (*progress)(void *self, const struct mill_progress *);
    void *self;
    void (*say)(const char *line); /* what --resume finds; may be NULL */
    FILE *summary;                 /* where the summary goes */
    bool json;
    /* NULL: not; else every step is checked against brute force, and this tells how often */
    struct mill_sim_checks *paranoid;
};

/* Runs the deck and writes options->output and the summary. Polls *stop and calls progress a few
 * times a second; MILL_STOPPED when *stop became non-zero: the file then holds everything up to
 * that moment, and the state to go on from. */
enum mill_status mill_run(const struct mill_deck *deck, const struct mill_run_options *options,
                          struct mill_error *error);

/* Makes the start state of the deck and writes it to options->output as a start file, over one that
 * is there only with options->force; runs nothing. Calls progress meanwhile. */
enum mill_status mill_run_export(const struct mill_deck *deck,
                                 const struct mill_run_options *options, struct mill_error *error);

#endif
