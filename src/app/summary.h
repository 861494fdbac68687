/* What a run came to, for people (a table) and for programs (one JSON object). */
#ifndef MILL_SUMMARY_H
#define MILL_SUMMARY_H

#include "app/record.h"
#include "millsim/world.h"
#include "observe/notes.h"
#include "observe/observers.h"
#include "observe/tally.h"

#include <stdbool.h>
#include <stdio.h>

struct mill_summary {
    FILE *out;
    const struct mill_world *world; /* world and observers are those at facts->time */
    const struct mill_observers *observers;
    const struct mill_facts *facts;
    /* ---- filled in ---- */
    struct mill_tally_results *results; /* of the tally among the observers */
    struct mill_notes notes;
};

/* The caller asks `out` for errors. MILL_FAILED: out of memory. */
enum mill_status mill_summary_write(struct mill_summary *s, bool json, struct mill_error *error);

/* For that, with its results and notes: the JSON object. */
enum mill_status mill_summary_json(const struct mill_summary *s, struct mill_error *error);

/* How well the results are known by now: "median +- 1.3 %, power +- 0.9 %", "warming up", or ""
 * where run.precision is not asked for. It stands until a number or two more are written. */
const char *mill_summary_known(const struct mill_observers *observers);

/* Is what comes now gathered? Not before run.sample_from, nor as long as the start-up that is to be
 * cut off is not over. */
bool mill_summary_samples(const struct mill_observers *observers);

/* "12.34 mm/s": four significant digits and the prefix that fits; "-" for NaN. It stands until some
 * more numbers are written: they take turns, so that one call of printf can have several. */
const char *mill_summary_si(double value, const char *unit);

#endif
