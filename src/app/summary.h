/* What a run came to, for people (a table) and for programs (one JSON object). */
#ifndef MILL_SUMMARY_H
#define MILL_SUMMARY_H

#include "app/record.h"
#include "millsim/world.h"
#include "observe/observers.h"
#include "observe/tally.h"

#include <stdbool.h>
#include <stdio.h>

/* World and observers are those at facts->time. The caller asks `out` for errors. MILL_FAILED: out
 * of memory. */
enum mill_status mill_summary_write(FILE *out, bool json, const struct mill_world *world,
                                    const struct mill_observers *observers,
                                    const struct mill_facts *facts, struct mill_error *error);

/* How well the results are known by now: "median +- 1.3 %, power +- 0.9 %", "warming up", or ""
 * where run.precision is not asked for. */
enum { MILL_SUMMARY_KNOWN = 64 };
const char *mill_summary_known(char text[MILL_SUMMARY_KNOWN],
                               const struct mill_observers *observers);

/* ---- the two of them; results: of the tally among the observers ---- */

void mill_summary_print(FILE *out, const struct mill_world *world,
                        const struct mill_tally_results *results, const struct mill_facts *facts);
enum mill_status mill_summary_json(FILE *out, const struct mill_world *world,
                                   const struct mill_tally_results *results,
                                   const struct mill_observers *observers,
                                   const struct mill_facts *facts, struct mill_error *error);

/* ---- what both are made of ---- */

enum { MILL_SUMMARY_NOTES = 7, MILL_SUMMARY_NOTE = 256, MILL_SUMMARY_NUMBER = 32 };

/* What a reader of the numbers ought to know, one sentence each; returns how many. */
int mill_summary_notes(const struct mill_world *world, const struct mill_tally_results *r,
                       const struct mill_facts *facts,
                       char note[MILL_SUMMARY_NOTES][MILL_SUMMARY_NOTE]);

/* A line that says what was cut off and why the run ended; nothing where only its time could end
 * it.
 */
void mill_summary_end(FILE *out, const struct mill_tally_results *r,
                      const struct mill_facts *facts);

/* "12.34 mm/s": four significant digits and the prefix that fits; "-" for NaN. Returns `text`. */
const char *mill_summary_number(char text[MILL_SUMMARY_NUMBER], double value, const char *unit);

#endif
