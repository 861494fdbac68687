/* Units of measure in decks: those of UDUNITS-2, and deg, rev, U, r, RPM, upm */
#ifndef MILL_UNITS_H
#define MILL_UNITS_H

#include "millsim/status.h"

#include <stdbool.h>
#include <stddef.h>

struct mill_units; /* the unit database */

enum mill_units_verdict {
    MILL_UNITS_GOOD,
    MILL_UNITS_UNKNOWN, /* no such unit, or not a unit at all */
    /* a unit of another quantity, or one that is not a plain factor (degC, dB) */
    MILL_UNITS_MISMATCH,
    MILL_UNITS_NO_ANGLE, /* only the radian is missing: Hz instead of rad/s, or 1 instead of rad */
    MILL_UNITS_ANGLE     /* a radian too many: rpm instead of Hz */
};

/* Loads the database. MILL_FAILED: UDUNITS finds none, or out of memory. Owner: the caller. */
enum mill_status mill_units_create(struct mill_units **units, struct mill_error *error);
void mill_units_free(struct mill_units *units);

/* The units that most decks use, with their factors; the last row is empty. */
extern const struct mill_units_row {
    const char *unit, *si;
    double scale;
} mill_units_usual_rows[];

/* Finds the factor of one of them, without the database. false: ask the database. */
bool mill_units_usual(const char *unit, const char *si, double *scale);

/* For the message about an unknown unit: "; ..., ... are known" if only the usual ones are. */
const char *mill_units_known(const char *si, char *out, size_t size);

/* Finds the factor that converts a number in `unit` to the SI unit `si`. Both are in the notation
 * of UDUNITS; `si` is a product of m, kg, s, Hz, rad, or "1". *scale is set only for
 * MILL_UNITS_GOOD. Angles are a dimension of their own here, so that Hz and rad/s differ. For an
 * angular speed, 1/min means one turn per minute, as on data sheets. */
enum mill_units_verdict mill_units_scale(const struct mill_units *units, const char *unit,
                                         const char *si, double *scale);

/* value * scale, rounded as in decimal arithmetic: 75 mm becomes the double nearest to 0.075. */
double mill_units_convert(double value, double scale);

#endif
