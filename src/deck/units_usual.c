/* Units without the database of UDUNITS-2 */
#include "deck/units.h"

#include <math.h>
#include <string.h>

#define CLOSE 1e-15  /* a scale this near to a whole number n, or to 1/n, is taken as that */
#define LARGEST 1e15 /* largest whole number that is used like that; a double holds it exactly */

/* Reading the database of UDUNITS-2 takes ten times as long as reading a deck without it, and the
 * studio has none. The factors are those of UDUNITS-2, to the last bit. */
/* clang-format off */
const struct mill_units_row mill_units_usual_rows[] = {
    {"m", "m", 1.0}, {"mm", "m", 1e-3}, {"cm", "m", 1e-2}, {"inch", "m", 0.025400000000000002},
    {"in", "m", 0.025400000000000002}, {"um", "m", 1e-6}, {"nm", "m", 1.0000000000000001e-9},
    {"s", "s", 1.0}, {"ms", "s", 1e-3}, {"us", "s", 1e-6}, {"min", "s", 60.0}, {"h", "s", 3600.0},
    {"kg", "kg", 1.0}, {"g", "kg", 1e-3}, {"mg", "kg", 1e-6},
    {"rad", "rad", 1.0}, {"deg", "rad", 0.017453292519943295},
    {"rad/s", "rad/s", 1.0}, {"deg/s", "rad/s", 0.017453292519943295},
    {"rpm", "rad/s", 0.10471975511965977}, {"1/min", "rad/s", 0.10471975511965977},
    {"min^-1", "rad/s", 0.10471975511965977}, {"U/min", "rad/s", 0.10471975511965977},
    {"r/min", "rad/s", 0.10471975511965977},
    {"Hz", "Hz", 1.0}, {"kHz", "Hz", 1e3}, {"1/s", "Hz", 1.0},
    {"1/min", "Hz", 0.016666666666666666},
    {"m/s", "m/s", 1.0}, {"mm/s", "m/s", 1e-3},
    {"m/s^2", "m/s^2", 1.0}, {"kg/m^3", "kg/m^3", 1.0}, {"g/cm^3", "kg/m^3", 999.9999999999999},
    {"J", "J", 1.0}, {"kJ", "J", 1e3}, {"mJ", "J", 1e-3}, {"uJ", "J", 1e-6},
    {"Pa", "Pa", 1.0}, {"kPa", "Pa", 1e3}, {"MPa", "Pa", 1e6}, {"GPa", "Pa", 1e9},
    {"N/mm^2", "Pa", 1e6},
    {"K", "K", 1.0}, {"J/kg/K", "J/kg/K", 1.0}, {"J/(kg K)", "J/kg/K", 1.0},
    {"J/g/K", "J/kg/K", 1e3}, {"kJ/kg/K", "J/kg/K", 1e3},
    {"W/K", "W/K", 1.0}, {"mW/K", "W/K", 1e-3},
    {"kg/J", "kg/J", 1.0}, {"mg/J", "kg/J", 1e-6},
    {"kg/J/m", "kg/J/m", 1.0}, {"J m/kg", "J m/kg", 1.0}, {"1", "1", 1.0}, {"%", "1", 1e-2},
    {"critical", "critical", 1.0}, {"% critical", "critical", 1e-2},
    {NULL, NULL, 0.0}};
/* clang-format on */

bool mill_units_usual(const char *unit, const char *si, double *scale)
{
    const struct mill_units_row *row = mill_units_usual_rows;
    while (row->unit && (strcmp(unit, row->unit) != 0 || strcmp(si, row->si) != 0))
        row++;
    if (row->unit)
        *scale = row->scale;
    return row->unit != NULL;
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
