/* Units without the database of UDUNITS-2 */
#include "deck/units.h"

#include <math.h>
#include <string.h>

#define CLOSE 1e-15  /* a scale this near to a whole number n, or to 1/n, is taken as that */
#define LARGEST 1e15 /* largest whole number that is used like that; a double holds it exactly */

/* The SI unit itself, and a few others with the factors that UDUNITS-2 gives, to the last bit.
 * Reading its database takes ten times as long as reading a deck without it. */
bool mill_units_usual(const char *unit, const char *si, double *scale)
{
    static const struct {
        const char *unit, *si;
        double scale;
    } usual[] = {
        {"mm", "m", 1e-3},
        {"cm", "m", 1e-2},
        {"inch", "m", 0.025400000000000002},
        {"um", "m", 1e-6},
        {"ms", "s", 1e-3},
        {"us", "s", 1e-6},
        {"min", "s", 60.0},
        {"g", "kg", 1e-3},
        {"deg", "rad", 0.017453292519943295},
        {"deg/s", "rad/s", 0.017453292519943295},
        {"rpm", "rad/s", 0.10471975511965977},
        {"1/min", "rad/s", 0.10471975511965977},
        {"1/min", "Hz", 0.016666666666666666},
        {"1/s", "Hz", 1.0},
        {"mm/s", "m/s", 1e-3},
        {"g/cm^3", "kg/m^3", 999.9999999999999},
        {"%", "1", 1e-2},
    };
    const bool same = strcmp(unit, si) == 0;
    if (same)
        *scale = 1.0;
    for (size_t k = 0; !same && k < sizeof usual / sizeof *usual; k++)
        if (strcmp(unit, usual[k].unit) == 0 && strcmp(si, usual[k].si) == 0) {
            *scale = usual[k].scale;
            return true;
        }
    return same;
}

/* Prefixes are powers of ten that a double below one cannot hold exactly: 0.001 is not a
 * thousandth, but 1000 is exact, so dividing by it rounds once. */
double mill_units_convert(double value, double scale)
{
    const bool small = scale < 1.0;
    const double factor = small ? 1.0 / scale : scale, whole = round(factor);
    if (!(whole < LARGEST) || fabs(factor / whole - 1.0) > CLOSE)
        return value * scale;
    return small ? value / whole : value * whole;
}
