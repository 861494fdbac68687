/* The results of a run, for people (a table) and for programs (one JSON object) */
#ifndef MILL_SUMMARY_H
#define MILL_SUMMARY_H

#include "app/record.h"
#include "deck/deck.h"
#include "millsim/world.h"
#include "observe/notes.h"
#include "observe/observers.h"
#include "observe/tally.h"

#include <stdbool.h>
#include <stdio.h>

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
 * laws that follow from materials; `lead` begins each line. deck: NULL if the laws are to be left
 * out */
void mill_summary_mill(const struct mill_world *world, const struct mill_deck *deck,
                       const char *lead, FILE *out);

/* [kg] of all balls */
double mill_summary_mass(const struct mill_world *world);

/* Prints the impacts of the window by kind. */
void mill_summary_table(const struct mill_summary *s);

/* Accuracy of the results so far: "median +- 1.3 %, power +- 0.9 %", "warming up", or "" without
 * run.precision. The text is valid until a few more numbers are formatted. */
const char *mill_summary_known(const struct mill_observers *observers);

/* Are statistics gathered now? Not before run.sample_from, and not during the start-up if it is to
 * be cut off. */
bool mill_summary_samples(const struct mill_observers *observers);

/* ---- numbers as texts, in a room that is used again after a few calls, and labels ---- */

enum { MILL_SUMMARY_WIDTH = 80, MILL_SUMMARY_LABEL = 15, MILL_SUMMARY_TEXT = 64 };

/* Format of a number with four significant digits: in units of `one`, with `decimals` decimals */
struct mill_summary_scale {
    double one;
    const char *prefix;
    int decimals;
};

/* A buffer for a short text; eight calls later it is used again */
char *mill_summary_text_room(void);

/* Sets the scale of a value; false: none fits. */
bool mill_summary_text_fits(double value, const char *unit, struct mill_summary_scale *scale);

/* "12.34 mm/s", "8.956 million/s": four significant digits with a suitable prefix; "-" for NaN */
const char *mill_summary_text_si(double value, const char *unit);

/* A value on the scale of its column; what rounds to 0 but is not 0 gets a "<". */
const char *mill_summary_text_cell(double value, struct mill_summary_scale scale);

/* Prints mean and error with the prefix of the larger one: "8.213 +- 0.090 N m". An error that
 * would be printed as 0 gets more digits. */
void mill_summary_text_value(FILE *out, const struct mill_precision_mean *mean, const char *unit);

/* A label at the left, or "" below it */
void mill_summary_text_label(FILE *out, const char *label);

#endif
