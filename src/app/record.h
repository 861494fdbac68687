/* What was run and how it went (/deck and /run); also the start of a run as a file */
#ifndef MILL_RECORD_H
#define MILL_RECORD_H

#include "deck/deck.h"
#include "millsim/world.h"
#include "observe/sink.h"

#include <time.h>

/* What a run has used so far, including the parts before --resume */
struct mill_record_cost {
    double wall, cpu;     /* [s] */
    double saving;        /* [s] wall time spent on checkpoints */
    uint64_t checkpoints; /* number of checkpoints */
};

/* Sums over the whole run */
struct mill_totals {
    uint64_t contacts, anomalies;
    struct mill_energy energy;                   /* now */
    double dissipation, balance_error, turnover; /* [J] the error is relative to the turnover */
};

/* What another program says of its run (facts.c): numbers and texts with unit and meaning */
struct mill_facts_list {
    size_t count;
    struct mill_fact *fact;
};

/* Progress of a run, or how it ended */
struct mill_facts {
    const char *status;   /* "running", "complete", "stopped" (by a signal), "failed" */
    const char *ended_by; /* "time", "precision", "max_collisions", "none" as yet; NULL: by time */
    double time, local;   /* [s] simulated time reached; the same as local time of the world */
    struct mill_record_cost cost;
    int threads, starts;                   /* used by the run */
    struct mill_totals totals;             /* of all starts */
    double peak_memory;                    /* [byte] */
    const char *deck, *output;             /* paths as given */
    const char *version;                   /* of millsim */
    const struct mill_facts_list *foreign; /* of another program's run; NULL: it is millsim's own */
};

/* local: the present time of the world */
struct mill_totals mill_record_add(const struct mill_world *world, double local);

/* Writes what is known before the first event: /deck, and in /run version, compiler, flags,
 * libraries, command (the quoted line), started (UTC, ISO 8601), status "running". */
void mill_record_start(struct mill_h5 *file, const struct mill_deck *deck, const char *command);

/* Writes /deck, in place of an earlier one: every entry with all defaults as a text SECTION/KEY,
 * and the whole deck as `text`, which is itself a deck. */
void mill_record_deck(struct mill_h5 *file, const struct mill_deck *deck);

/* Compares the deck with that of the file's run. MILL_BAD_DECK: they differ; the error names where
 * first. MILL_FAILED: the file holds none. What does not change the run may differ: [powder],
 * [heat], values of [wear], checkpoints, threads, the folder of a start file. name: of the file */
enum mill_status mill_record_compare(struct mill_h5 *file, const char *name,
                                     const struct mill_deck *deck, struct mill_error *error);

/* Writes how the run went: the contents of /run, or "run" of a summary. Of another program's run
 * only what comes from millsim: status, time reached, impacts. */
void mill_record_tell(const struct mill_world *world, const struct mill_facts *facts,
                      struct mill_sink *sink);

/* Writes the balls of a world at t = 0 to `path`, as a start file that gives the same deck the same
 * balls to the last bit. A comment line with columns, units and `deck` comes first. The file
 * appears complete or not at all. MILL_BAD_DECK: the file exists, and `over` is false. */
enum mill_status mill_record_export(const struct mill_world *world, const char *deck,
                                    const char *path, bool over, struct mill_error *error);

/* Prints the name of a file; replaces control characters, as in messages: it stays on one line. */
void mill_record_name(FILE *out, const char *name);

/* Peak resident memory of this process [byte]. */
double mill_record_peak_memory(void);

/* [s] CLOCK_MONOTONIC: wall time since some moment; CLOCK_PROCESS_CPUTIME_ID: processor time */
double mill_record_clock(clockid_t clock);

/* ---- facts (facts.c) ---- */

#define MILL_FACTS_PART "normal" /* the part of the loss in a single impact that is known of it */

/* Adds a fact from a record: name, unit, meaning, type ("f8", "u8", "text"), each followed by a 0,
 * and the value. Replaces an earlier fact of this name. MILL_FAILED: the record is no fact. */
enum mill_status mill_facts_take(struct mill_facts_list *facts, const char *bytes, size_t length,
                                 struct mill_error *error);

/* The text of a fact, or "" */
const char *mill_facts_text(const struct mill_facts_list *facts, const char *name);

/* MILL_FAILED: a fact that every file needs is missing. */
enum mill_status mill_facts_check(const struct mill_facts_list *facts, struct mill_error *error);

/* Writes all facts to /run but that of one name. */
void mill_facts_write(const struct mill_facts_list *facts, struct mill_h5 *file, const char *but);
void mill_facts_free(struct mill_facts_list *facts);

#endif
