/* What a run came to, for people (a table) and for programs (one JSON object). */
#ifndef MILL_SUMMARY_H
#define MILL_SUMMARY_H

#include "app/record.h"
#include "millsim/world.h"
#include "observe/tally.h"

#include <stdbool.h>
#include <stdio.h>

/* World and results are those at facts->time. The caller asks `out` for errors. */
void mill_summary_print(FILE *out, const struct mill_world *world,
                        const struct mill_tally_results *r, const struct mill_facts *facts);
void mill_summary_json(FILE *out, const struct mill_world *world,
                       const struct mill_tally_results *r, const struct mill_facts *facts);

/* ---- what both are made of ---- */

enum { MILL_SUMMARY_NOTES = 7, MILL_SUMMARY_NOTE = 256, MILL_SUMMARY_NUMBER = 32 };

/* What a reader of the numbers ought to know, one sentence each; returns how many. */
int mill_summary_notes(const struct mill_world *world, const struct mill_tally_results *r,
                       const struct mill_facts *facts,
                       char note[MILL_SUMMARY_NOTES][MILL_SUMMARY_NOTE]);

/* "median +- 1.3 %, power +- 0.9 %", "warming up", or "" where none is asked for (run.precision).
 */
enum { MILL_SUMMARY_KNOWN = 64 };
const char *mill_summary_known(char text[MILL_SUMMARY_KNOWN], double asked, bool settled,
                               const struct mill_precision_known *known);

/* A line that says what was cut off and why the run ended; nothing where only its time could end
 * it.
 */
void mill_summary_end(FILE *out, const struct mill_tally_results *r,
                      const struct mill_facts *facts);

/* "12.34 mm/s": four significant digits and the prefix that fits; "-" for NaN. Returns `text`. */
const char *mill_summary_number(char text[MILL_SUMMARY_NUMBER], double value, const char *unit);

#endif
