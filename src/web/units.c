/* Units without the database of UDUNITS-2: the usual ones */
#include "deck/units.h"

#include <stdlib.h>
#include <string.h>

struct mill_units {
    char none;
};

enum mill_status mill_units_create(struct mill_units **units, struct mill_error *error)
{
    *units = malloc(sizeof **units);
    return *units ? MILL_OK : mill_error_set(error, MILL_FAILED, "out of memory");
}

void mill_units_free(struct mill_units *units)
{
    free(units);
}

/* As UDUNITS-2 answers, if the unit is a usual one of any quantity */
enum mill_units_verdict mill_units_scale(const struct mill_units *units, const char *unit,
                                         const char *si, double *scale)
{
    static const char *const quantity[] = {"m",   "s",     "rad",    "kg",  "1",
                                           "m/s", "rad/s", "kg/m^3", "Hz",  "J",
                                           "K",   "Pa",    "m/s^2",  "W/K", "kg/J"};
    double other;
    (void)units;
    if (mill_units_usual(unit, si, scale))
        return MILL_UNITS_GOOD;
    if (strcmp(si, "rad/s") == 0 && mill_units_usual(unit, "Hz", &other))
        return MILL_UNITS_NO_ANGLE;
    if (strcmp(si, "Hz") == 0 && mill_units_usual(unit, "rad/s", &other))
        return MILL_UNITS_ANGLE;
    for (size_t k = 0; k < sizeof quantity / sizeof *quantity; k++)
        if (mill_units_usual(unit, quantity[k], &other))
            return MILL_UNITS_MISMATCH;
    return MILL_UNITS_UNKNOWN;
}
