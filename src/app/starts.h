/* The starts of a run: the same mill with other seeds, side by side on the cores that there are.
 * The first one is the run as it would be alone; of the others only the statistics are gathered. */
#ifndef MILL_STARTS_H
#define MILL_STARTS_H

#include "app/record.h"
#include "deck/deck.h"
#include "engine/crew.h"
#include "observe/observers.h"
#include "observe/tally.h"

struct mill_starts_one {
    unsigned long seed;
    struct mill_world *world;
    struct mill_sim *sim;
    struct mill_observers observers;
    double reached; /* [s] simulated time until which nothing is left to do */
    uint64_t slice; /* events between two looks at the clock */
    enum mill_status status;
    struct mill_error error;
};

/* Until when and how many; plain numbers, which a checkpoint stores as they are */
struct mill_starts_plan {
    double until; /* [s] simulated time */
    uint64_t count;
    bool known; /* run.precision is reached: nothing is left to do */
};

struct mill_starts {
    const struct mill_deck *deck;
    struct mill_starts_plan plan;
    int count;    /* that are made */
    double least; /* [s] window of starts that may become more */
    struct mill_starts_one one[MILL_PRECISION_STARTS];
    struct mill_crew *crew; /* NULL: one thread does all */
    int workers;            /* threads */
    /* ---- of the present round ---- */
    double due; /* [s] clock */
    const volatile sig_atomic_t *stop;
    int next; /* the start that the next free thread takes */
};

/* Makes the starts of a deck, at t = 0. The caller frees them in all cases. watch may be NULL.
 * Their plan ends with the deck's end; with run.precision before it. */
enum mill_status mill_starts_make(struct mill_starts *starts, const struct mill_deck *deck,
                                  const struct mill_start_watch *watch, struct mill_error *error);
void mill_starts_free(struct mill_starts *starts);

/* Makes the starts that the plan has beyond those that are made. */
enum mill_status mill_starts_grow(struct mill_starts *starts, struct mill_error *error);

/* Continues all starts as planned, for some `wall` [s]. MILL_OK: all are there, or the wall time is
 * over. MILL_STOPPED, MILL_ENDED and MILL_FAILED: as mill_sim_run. */
enum mill_status mill_starts_go(struct mill_starts *starts, double wall,
                                const volatile sig_atomic_t *stop, struct mill_error *error);

/* If all starts have done what is planned, it plans more: with run.precision longer starts or more
 * of them, whichever makes the errors smaller. false: nothing is left to do. */
bool mill_starts_extend(struct mill_starts *starts);

/* Tells the statistics of the first start which others are as far as it: results are of these. */
void mill_starts_join(struct mill_starts *starts);

/* The world of the first start, with accounts and counts of all; it owns nothing. *totals: sums */
struct mill_world mill_starts_sum(const struct mill_starts *starts, struct mill_totals *totals);

/* ---- their state in the output file (checkpoint.c), from which --resume continues: the datasets
 * /checkpoint/OWNER/FIELD. The file is published as a whole, so state and results always belong to
 * the same moment. The state is never held twice: it is written from where it is in memory ---- */
void mill_checkpoint_write(struct mill_starts *starts, struct mill_record_cost *cost,
                           struct mill_h5 *file);

/* Removes the state, if there is one. */
void mill_checkpoint_remove(struct mill_h5 *file);

/* *found: the file has a state. MILL_FAILED: of another build. name: of the file, for messages */
enum mill_status mill_checkpoint_find(struct mill_h5 *file, const char *name, bool *found,
                                      struct mill_error *error);

/* Loads the state into starts of the same deck that have not run, and must not after a failure. */
enum mill_status mill_checkpoint_load(struct mill_starts *starts, struct mill_record_cost *cost,
                                      struct mill_h5 *file, const char *name,
                                      struct mill_error *error);

#endif
