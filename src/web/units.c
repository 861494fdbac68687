/* Units without the database of UDUNITS-2: the usual ones */
#include "deck/units.h"

#include <stdlib.h>

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

enum mill_units_verdict mill_units_scale(const struct mill_units *units, const char *unit,
                                         const char *si, double *scale)
{
    (void)units;
    return mill_units_usual(unit, si, scale) ? MILL_UNITS_GOOD : MILL_UNITS_UNKNOWN;
}
