/* What was run, and how it went: /deck and /run. */
#ifndef MILL_RECORD_H
#define MILL_RECORD_H

#include "millsim/world.h"
#include "store/h5.h"

/* What a run has used so far, in all its legs */
struct mill_record_cost {
    double wall, cpu;     /* [s] */
    double saving;        /* [s] of the wall time, spent on checkpoints */
    uint64_t checkpoints; /* taken */
};

struct mill_record_end {
    const char *status; /* "running", "complete", "stopped", "failed" */
    double time;        /* [s] simulated time reached */
    double local_time;  /* [s] the same in the world's local time */
    struct mill_record_cost cost;
    double peak_memory; /* [byte] */
    /* why it ended, where that is not always its time: "time", "precision", "max_collisions", or
     * "none" as long as it has not; else NULL */
    const char *ended_by;
};

/* Writes /deck: every entry of the deck with all defaults as a text /deck/SECTION/KEY, and the
 * whole, a deck itself, as /deck/text. */
void mill_record_deck(struct mill_h5 *file, const struct mill_deck *deck);

/* Is the file's run of this deck? MILL_BAD_DECK with a line that names the first difference, or
 * MILL_FAILED when the file holds no deck. The interval of checkpoints and the folder of a start
 * file may differ. name: of the file, for messages. */
enum mill_status mill_record_compare(struct mill_h5 *file, const char *name,
                                     const struct mill_deck *deck, struct mill_error *error);

/* Writes into /run what is known before the first event: version, compiler, flags, libraries,
 * command, started (UTC, ISO 8601), status "running". command: the command line, quoted. */
void mill_record_start(struct mill_h5 *file, const char *command);

/* Writes into /run how it went, replacing what an earlier call wrote: at checkpoints and at the
 * end. */
void mill_record_finish(struct mill_h5 *file, const struct mill_world *world,
                        const struct mill_record_end *end);

/* Peak resident memory of this process [byte], and processor time it has used [s]. */
double mill_record_peak_memory(void);
double mill_record_cpu_time(void);

#endif
