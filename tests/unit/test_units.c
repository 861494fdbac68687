/* Units of measure: which are known, what factor they stand for, which are of another quantity. */
#include "deck/deck_private.h"
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

/* besides the usual units */
static const struct mill_units_row factors[] = {
    {"\xc2\xb5s", "s", 1e-6},
    {"degree", "rad", 0.017453292519943295},
    {"rev/min", "rad/s", 0.10471975511965977},
    {"min-1", "rad/s", 0.10471975511965977},
    {"RPM", "rad/s", 0.10471975511965977},
    {"revolution/s", "rad/s", 6.283185307179586},
    {"km/h", "m/s", 1 / 3.6},
    {"m s-2", "m/s^2", 1.0},
    {"m.s**-2", "m/s^2", 1.0},
    {"gravity", "m/s^2", 9.80665},
    {"kg/m3", "kg/m^3", 1.0},
    {"lb/ft^3", "kg/m^3", 16.018463373960138},
};

LOOP_TEST(a_known_unit_has_its_factor, COUNT(factors))
{
    const struct mill_units_row *f = &factors[_i];
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

TEST(a_usual_unit_has_the_very_factor_of_the_database)
{
    double scale = 0.0, usual = 0.0;
    for (const struct mill_units_row *row = mill_units_usual_rows; row->unit; row++) {
        if (strcmp(row->si, "critical") == 0) /* which the database does not know */
            continue;
        scale = strcmp(row->unit, "1") == 0; /* which is no unit */
        mill_units_scale(units, row->unit, row->si, &scale);
        ck_assert(mill_units_usual(row->unit, row->si, &usual));
        ck_assert_msg(usual == scale, "%s in %s: %a, not %a", row->unit, row->si, usual, scale);
    }
    ck_assert(!mill_units_usual("fathom", "m", &usual) && !mill_units_usual("mm", "s", &usual));
}

/* The studio has no database. */
TEST(every_unit_of_the_decks_table_is_a_usual_one)
{
    struct mill_units *none = NULL;
    struct mill_error error = {""};
    union {
        double number[3];
        long whole;
        const char *file;
    } value;
    setenv("UDUNITS2_XML_PATH", "/nowhere/udunits2.xml", 1);
    for (const struct mill_deck_block *b = mill_deck_table; b->title; b++)
        for (const struct mill_key *key = mill_deck_table_keys(b); key->name; key++) {
            struct mill_key one = *key;
            char wanted[120], *example = NULL;
            one.offset = 0;
            mill_deck_value_wanted(key, false, wanted, sizeof wanted);
            if (key->type != MILL_KEY_CHOICE && (example = strstr(wanted, "such as '"))) {
                example += strlen("such as '");
                example[strcspn(example, "'")] = '\0';
            }
            const char *texts[] = {key->preset, example};
            for (int k = 0; k < 2; k++)
                ck_assert_msg(!texts[k] ||
                                  mill_deck_value_read(&none, &one, texts[k], &value, &error) ||
                                  !strstr(error.text, "database"),
                              "[%s] %s = %s: %s", b->title, key->name, texts[k], error.text);
            ck_assert(!key->unit || mill_units_usual(key->unit, key->unit, value.number));
        }
    unsetenv("UDUNITS2_XML_PATH");
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
