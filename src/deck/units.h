/* Units of measure in decks, by UDUNITS-2 and a few names that its database lacks (deg, rev, U and
 * RPM). */
#ifndef MILL_UNITS_H
#define MILL_UNITS_H

#include "millsim/status.h"

struct mill_units; /* the unit database */

enum mill_units_verdict {
    MILL_UNITS_GOOD,
    MILL_UNITS_UNKNOWN,  /* no such unit, or not a unit at all */
    MILL_UNITS_MISMATCH, /* a unit, but of another quantity, or not a pure scale (degC, dB) */
    MILL_UNITS_NO_ANGLE, /* right but for the radian: Hz where rad/s is wanted, 1 where rad is */
    MILL_UNITS_ANGLE     /* the other way round: rpm where Hz is wanted */
};

/* Loads the database. MILL_FAILED when UDUNITS finds none or memory is short. Owner: the caller. */
enum mill_status mill_units_create(struct mill_units **units, struct mill_error *error);
void mill_units_free(struct mill_units *units);

/* The factor that takes a number in `unit` to SI unit `si` (both as UDUNITS writes them, `si` a
 * product of m, kg, s, Hz, rad, or "1"). *scale is set only for MILL_UNITS_GOOD. Angles are a
 * dimension of their own here: Hz and rad/s differ. As an angular speed 1/min is a turn a minute,
 * as on data sheets. */
enum mill_units_verdict mill_units_scale(const struct mill_units *units, const char *unit,
                                         const char *si, double *scale);

/* value * scale, rounded as decimal arithmetic would: 75 mm is the double nearest to 0.075. */
double mill_units_convert(double value, double scale);

#endif
