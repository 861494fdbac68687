/* Numbers of the summary as texts, in a room that is used again after a few calls, and labels */
#ifndef MILL_SUMMARY_TEXT_H
#define MILL_SUMMARY_TEXT_H

#include "observe/precision.h"

#include <stdio.h>

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
