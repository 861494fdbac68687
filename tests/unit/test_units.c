/* Units of measure: which are known, what factor they stand for, which are of another quantity. */
#include "deck/units.h"
#include "unit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct mill_units *units;

static void load(void)
{
    struct mill_error error = {""};
    ck_assert_msg(mill_units_create(&units, &error) == MILL_OK, "%s", error.text);
}

static void unload(void)
{
    mill_units_free(units);
}

static const struct factor {
    const char *unit, *si;
    double scale;
} factors[] = {
    {"m", "m", 1.0},
    {"mm", "m", 1e-3},
    {"inch", "m", 0.0254},
    {"min", "s", 60.0},
    {"us", "s", 1e-6},
    {"\xc2\xb5s", "s", 1e-6},
    {"rad", "rad", 1.0},
    {"deg", "rad", 0.017453292519943295},
    {"degree", "rad", 0.017453292519943295},
    {"rad/s", "rad/s", 1.0},
    {"rpm", "rad/s", 0.10471975511965977},
    {"rev/min", "rad/s", 0.10471975511965977},
    {"1/min", "rad/s", 0.10471975511965977},
    {"min-1", "rad/s", 0.10471975511965977},
    {"U/min", "rad/s", 0.10471975511965977},
    {"RPM", "rad/s", 0.10471975511965977},
    {"revolution/s", "rad/s", 6.283185307179586},
    {"kHz", "Hz", 1000.0},
    {"1/s", "Hz", 1.0},
    {"1/min", "Hz", 1 / 60.0},
    {"deg/s", "rad/s", 0.017453292519943295},
    {"km/h", "m/s", 1 / 3.6},
    {"m/s^2", "m/s^2", 1.0},
    {"m s-2", "m/s^2", 1.0},
    {"m.s**-2", "m/s^2", 1.0},
    {"gravity", "m/s^2", 9.80665},
    {"kg/m3", "kg/m^3", 1.0},
    {"g/cm^3", "kg/m^3", 1000.0},
    {"lb/ft^3", "kg/m^3", 16.018463373960138},
};

LOOP_TEST(a_known_unit_has_its_factor, COUNT(factors))
{
    const struct factor *f = &factors[_i];
    double scale = 0.0;
    ck_assert_int_eq(mill_units_scale(units, f->unit, f->si, &scale), MILL_UNITS_GOOD);
    ck_assert_double_eq_tol(scale, f->scale, 4e-16 * f->scale);
}

static const struct refusal {
    const char *unit, *si;
    enum mill_units_verdict verdict;
} refusals[] = {
    {"", "m", MILL_UNITS_UNKNOWN},
    {"mmm", "m", MILL_UNITS_UNKNOWN},
    {"mm 5", "m", MILL_UNITS_UNKNOWN},
    {"5 mm", "m", MILL_UNITS_UNKNOWN},
    {"mm.5", "m", MILL_UNITS_UNKNOWN},
    {"-mm", "m", MILL_UNITS_UNKNOWN},
    {"m^999", "m", MILL_UNITS_UNKNOWN},
    {"m^99999999999999999999", "m", MILL_UNITS_UNKNOWN},
    {"mm @ 5", "m", MILL_UNITS_UNKNOWN},
    {"s since 2000-01-01", "s", MILL_UNITS_UNKNOWN},
    {"\xff\xfe", "m", MILL_UNITS_UNKNOWN},
    {"s", "m", MILL_UNITS_MISMATCH},
    {"kg", "kg/m^3", MILL_UNITS_MISMATCH},
    {"rad m", "m", MILL_UNITS_ANGLE},
    {"rpm", "Hz", MILL_UNITS_ANGLE},
    {"rad/s", "Hz", MILL_UNITS_ANGLE},
    {"deg/s", "Hz", MILL_UNITS_ANGLE},
    {"s", "Hz", MILL_UNITS_MISMATCH},
    {"cpm", "Hz", MILL_UNITS_UNKNOWN},
    {"1", "m", MILL_UNITS_UNKNOWN},
    {"2/s", "Hz", MILL_UNITS_UNKNOWN},
    {"1/2", "1", MILL_UNITS_UNKNOWN},
    {"degC", "m", MILL_UNITS_MISMATCH},
    {"lg(re mm)", "m", MILL_UNITS_MISMATCH},
    {"mol/m^3", "kg/m^3", MILL_UNITS_MISMATCH},
    {"rad/s", "rad", MILL_UNITS_MISMATCH},
    {"Hz", "rad/s", MILL_UNITS_NO_ANGLE},
    {"s-1", "rad/s", MILL_UNITS_NO_ANGLE},
    {"1/s", "rad/s", MILL_UNITS_NO_ANGLE},
    {"1/h", "rad/s", MILL_UNITS_NO_ANGLE},
    {"%", "rad", MILL_UNITS_NO_ANGLE},
};

LOOP_TEST(another_unit_is_refused_and_leaves_the_factor_alone, COUNT(refusals))
{
    const struct refusal *r = &refusals[_i];
    double scale = 7.0;
    ck_assert_int_eq(mill_units_scale(units, r->unit, r->si, &scale), r->verdict);
    ck_assert(scale == 7.0);
}

TEST(millimetres_become_the_nearest_double)
{
    double scale = 0.0;
    char text[32];
    ck_assert_int_eq(mill_units_scale(units, "mm", "m", &scale), MILL_UNITS_GOOD);
    for (int tenths = 1; tenths < 20000; tenths++) {
        snprintf(text, sizeof text, "%d.%de-3", tenths / 10, tenths % 10);
        const double value = strtod(text, NULL);
        snprintf(text, sizeof text, "%d.%d", tenths / 10, tenths % 10);
        /* 0.1 itself is rounded before the division: at most one further rounding */
        if (tenths % 10 == 0)
            ck_assert(mill_units_convert(strtod(text, NULL), scale) == value);
        else
            ck_assert_double_eq_tol(mill_units_convert(strtod(text, NULL), scale), value,
                                    2.3e-16 * value);
    }
}

TEST(the_si_unit_keeps_every_bit)
{
    static const char *const si[] = {"m", "s", "rad", "m/s", "rad/s", "kg/m^3", "m/s^2"};
    srand(1);
    for (int n = 0; n < 7 * 1000; n++) {
        double scale = 0.0;
        const double value = (rand() - 1e9) * 1e-7 / (1 + rand() % 1000);
        ck_assert_int_eq(mill_units_scale(units, si[n % 7], si[n % 7], &scale), MILL_UNITS_GOOD);
        ck_assert(mill_units_convert(value, scale) == value);
    }
}

/* Every pair of a unit and an SI unit that the short list might know */
TEST(a_usual_unit_has_the_very_factor_of_the_database)
{
    static const char *const si[] = {"m",  "s",     "rad", "m/s", "rad/s", "kg/m^3",
                                     "Hz", "m/s^2", "kg",  "1",   "Pa"};
    static const char *const unit[] = {"mm",  "cm",   "inch",   "um",    "ms",  "us",
                                       "min", "g",    "deg",    "deg/s", "rpm", "1/min",
                                       "1/s", "mm/s", "g/cm^3", "%"};
    int known = 0;
    for (size_t i = 0; i < sizeof si / sizeof *si; i++) {
        double quick = 0.0, scale = 0.0;
        ck_assert(mill_units_usual(si[i], si[i], &quick));
        ck_assert_double_eq(quick, 1.0);
        for (size_t k = 0; k < sizeof unit / sizeof *unit; k++) {
            if (!mill_units_usual(unit[k], si[i], &quick))
                continue;
            known++;
            ck_assert_int_eq(mill_units_scale(units, unit[k], si[i], &scale), MILL_UNITS_GOOD);
            ck_assert_msg(quick == scale, "%s in %s: %a, not %a", unit[k], si[i], quick, scale);
        }
    }
    ck_assert_int_eq(known, 17);
    ck_assert(!mill_units_usual("fathom", "m", &(double){0.0}));
    ck_assert(!mill_units_usual("mm", "s", &(double){0.0}));
}

TEST(a_missing_database_is_named_with_the_mend)
{
    struct mill_units *none = NULL;
    struct mill_error error = {""};
    setenv("UDUNITS2_XML_PATH", "/nowhere/udunits2.xml", 1);
    ck_assert_int_eq(mill_units_create(&none, &error), MILL_FAILED);
    ck_assert_ptr_null(none);
    ck_assert_ptr_nonnull(strstr(error.text, "/nowhere/udunits2.xml"));
    ck_assert_ptr_nonnull(strstr(error.text, "libudunits2-data"));
}

int main(void)
{
    return unit_run_in("units", load, unload);
}
