/* Units without the database of UDUNITS-2: the usual ones */
#include "deck/units.h"

#include <stdio.h>
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
    double other;
    (void)units;
    if (mill_units_usual(unit, si, scale))
        return MILL_UNITS_GOOD;
    if (strcmp(si, "rad/s") == 0 && mill_units_usual(unit, "Hz", &other))
        return MILL_UNITS_NO_ANGLE;
    if (strcmp(si, "Hz") == 0 && mill_units_usual(unit, "rad/s", &other))
        return MILL_UNITS_ANGLE;
    const struct mill_units_row *row = mill_units_usual_rows;
    while (row->unit && strcmp(unit, row->unit) != 0)
        row++;
    return row->unit ? MILL_UNITS_MISMATCH : MILL_UNITS_UNKNOWN;
}

const char *mill_units_known(const char *si, char *out, size_t size)
{
    const char *apart = "; the studio knows ";
    size_t used = 0;
    for (const struct mill_units_row *row = mill_units_usual_rows; row->unit; row++)
        if (strcmp(si, row->si) == 0 && used < size) {
            used += (size_t)snprintf(out + used, size - used, "%s%s", apart, row->unit);
            apart = ", ";
        }
    return out;
}
