/* What was run, and how it went: /deck and /run; and its start as a file. */
#ifndef MILL_RECORD_H
#define MILL_RECORD_H

#include "base/profile.h"
#include "deck/deck.h"
#include "millsim/world.h"
#include "observe/sink.h"

#include <time.h>

/* What a run has used so far, in all its legs */
struct mill_record_cost {
    double wall, cpu;     /* [s] */
    double saving;        /* [s] of the wall time, spent on checkpoints */
    uint64_t checkpoints; /* taken */
};

/* How far the run is, or how it ended */
struct mill_facts {
    const char *status; /* "running", "complete", "stopped" (by a signal), "failed" */
    /* why it ended, where that is not always its time: "time", "precision", "max_collisions", or
     * "none" as long as it has not; else NULL */
    const char *ended_by;
    double time, local; /* [s] simulated time reached; the same in the world's local time */
    double end;         /* [s] run.time */
    struct mill_record_cost cost;
    double peak_memory;        /* [byte] */
    const char *deck, *output; /* paths as given */
    const char *version;       /* of millsim */
};

/* Sums over the whole run, t = `local` being now */
struct mill_totals {
    uint64_t contacts, anomalies;
    struct mill_energy energy;                   /* now */
    double dissipation, balance_error, turnover; /* [J]; the last: energy turned over */
};
struct mill_totals mill_record_add(const struct mill_world *world, double local);

/* The drum's cross-section; of a container that is a body the circle around it */
struct mill_profile mill_record_profile(const struct mill_deck *deck,
                                        const struct mill_world *world);

/* Writes what is known before the first event. /deck: every entry of the deck with all defaults as
 * a text /deck/SECTION/KEY, and the whole, a deck itself, as /deck/text. /run: version, compiler,
 * flags, libraries, command (the line, quoted), started (UTC, ISO 8601), status "running". */
void mill_record_start(struct mill_h5 *file, const struct mill_deck *deck, const char *command);

/* The first of these alone, for a run of another program; and the little of /run that such a file
 * has of millsim: status, time reached [s], impacts. */
void mill_record_deck(struct mill_h5 *file, const struct mill_deck *deck);
void mill_record_foreign(const struct mill_world *world, const char *status, double time,
                         struct mill_sink *sink);

/* Is the file's run of this deck? MILL_BAD_DECK with a line that names the first difference, or
 * MILL_FAILED when the file holds no deck. The interval of checkpoints and the folder of a start
 * file may differ. name: of the file, for messages. */
enum mill_status mill_record_compare(struct mill_h5 *file, const char *name,
                                     const struct mill_deck *deck, struct mill_error *error);

/* Tells how it went: what stands in /run, or a summary's "run". */
void mill_record_tell(const struct mill_world *world, const struct mill_facts *facts,
                      struct mill_sink *sink);

/* Writes the balls of a world at t = 0 to `path`, a start file that gives the same deck the same
 * balls to the last bit: behind one line of comment that names columns, units and `deck`. It is
 * there as a whole or not at all. MILL_BAD_DECK: it exists, and is not to be written over. */
enum mill_status mill_record_export(const struct mill_world *world, const char *deck,
                                    const char *path, bool over, struct mill_error *error);

/* Peak resident memory of this process [byte]. */
double mill_record_peak_memory(void);

/* [s]: CLOCK_MONOTONIC for wall time from some moment, CLOCK_PROCESS_CPUTIME_ID. */
double mill_record_clock(clockid_t clock);

#endif
