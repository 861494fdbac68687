/* The results of a run, for people (a table) and for programs (one JSON object) */
#ifndef MILL_SUMMARY_H
#define MILL_SUMMARY_H

#include "app/record.h"
#include "deck/deck.h"
#include "millsim/world.h"
#include "observe/notes.h"
#include "observe/observers.h"
#include "observe/tally.h"

struct mill_summary {
    FILE *out;
    const struct mill_world *world; /* world and observers must be in the state of facts->time */
    const struct mill_observers *observers;
    const struct mill_facts *facts;
    const struct mill_deck *deck; /* may be NULL */
    /* ---- filled in ---- */
    struct mill_tally_results *results; /* of the tally among the observers */
    struct mill_notes notes;
};

/* The caller checks `out` for errors. MILL_FAILED: out of memory. */
enum mill_status mill_summary_write(struct mill_summary *s, bool json, struct mill_error *error);

/* Prints the balls, how much of the mill they fill, how fast its surfaces move, and the contact
 * laws that follow from materials. deck: NULL if the laws are to be left out */
void mill_summary_mill(const struct mill_world *world, const struct mill_deck *deck, FILE *out);

/* Prints the impacts of the window by kind. */
void mill_summary_table(const struct mill_summary *s);

/* Accuracy of the results so far: "median +- 1.3 %, power +- 0.9 %", "warming up", or "" without
 * run.precision. The text is valid until a few more numbers are formatted. */
const char *mill_summary_known(const struct mill_observers *observers);

/* ---- numbers as texts, and lines ---- */

enum { MILL_SUMMARY_WIDTH = 80, MILL_SUMMARY_LABEL = 15 };

/* A short text, until eight more are made */
const char *mill_summary_text(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* "12.34 mm/s", "8.956 million/s": four significant digits with a suitable prefix; "-" for NaN */
const char *mill_summary_si(double value, const char *unit);

/* Mean and error, "8.213 +- 0.090 N m". An error that would be printed as 0 gets more digits. */
const char *mill_summary_mean(const struct mill_spread_mean *mean, const char *unit);

/* Prints a label at the left, or "" below it, and a text beside it. */
void mill_summary_line(FILE *out, const char *label, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
