/* What a run came to, for people (a table) and for programs (one JSON object). */
#ifndef MILL_SUMMARY_H
#define MILL_SUMMARY_H

#include "deck/deck.h"
#include "millsim/world.h"
#include "observe/tally.h"

#include <stdbool.h>
#include <stdio.h>

struct mill_summary_facts {
    double wall;         /* [s] of all legs of the run */
    double cpu;          /* [s] of all legs of the run */
    double peak_memory;  /* [byte] */
    double time_reached; /* [s] simulated */
    const char *version; /* of millsim */
    const char *deck;    /* path as given */
    const char *output;  /* path of the file */
    bool stopped;        /* by a signal, before the end */
};

/* Both want the tally finished and the world as it is at facts->time_reached, and leave it to the
 * caller to ask `out` for errors. */
void mill_summary_print(FILE *out, const struct mill_deck *deck, const struct mill_world *world,
                        const struct mill_tally *tally, const struct mill_summary_facts *facts);
void mill_summary_json(FILE *out, const struct mill_deck *deck, const struct mill_world *world,
                       const struct mill_tally *tally, const struct mill_summary_facts *facts);

/* ---- what both are made of ---- */

/* Sums over the whole run. */
struct mill_summary_totals {
    uint64_t contacts;
    uint64_t anomalies;
    struct mill_energy energy; /* now */
    double dissipation;        /* [J] */
    double balance_error;      /* [J] */
    double turnover;           /* [J] energy turned over */
};

struct mill_summary_totals mill_summary_add(const struct mill_world *world,
                                            const struct mill_summary_facts *facts);

enum { MILL_SUMMARY_NOTES = 7, MILL_SUMMARY_NOTE = 256, MILL_SUMMARY_NUMBER = 32 };

/* What a reader of the numbers ought to know, one sentence each; returns how many. */
int mill_summary_notes(const struct mill_deck *deck, const struct mill_world *world,
                       const struct mill_tally *tally, const struct mill_summary_facts *facts,
                       char note[MILL_SUMMARY_NOTES][MILL_SUMMARY_NOTE]);

/* "median +- 1.3 %, power +- 0.9 %", "warming up", or "" where run.precision is not asked for. */
enum { MILL_SUMMARY_KNOWN = 64 };
const char *mill_summary_known(char text[MILL_SUMMARY_KNOWN], const struct mill_tally *tally);

/* A line that says what was cut off and why the run ended; nothing where only its time could end
 * it.
 */
void mill_summary_end(FILE *out, const struct mill_tally *tally,
                      const struct mill_summary_facts *facts);

/* "12.34 mm/s": four significant digits and the prefix that fits; "-" for NaN. Returns `text`. */
const char *mill_summary_number(char text[MILL_SUMMARY_NUMBER], double value, const char *unit);

#endif
