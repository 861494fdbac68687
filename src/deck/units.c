/* Finds the SI factor of a unit and checks that the unit is of the wanted quantity. UDUNITS-2
 * parses the unit (its grammar and database: https://docs.unidata.ucar.edu/udunits/current/) and
 * converts it. Its own test is not strict enough: the radian is 1 there, so it would accept 16 Hz
 * for 16 rad/s, and 16 s for 1/16 Hz. So it must equal a multiple of the wanted one. */
#include "deck/units.h"

#include "deck/share.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <udunits2.h>

enum { LONGEST = 80, DATABASE = 1 << 20 /* [B] more than twice what reading needs */ };

struct mill_units {
    ut_system *system;
    ut_unit *radian, *rpm, *a_minute; /* the last: 1/min */
};

/* Adds a name to the database, if the database does not know it yet */
static bool add_name(ut_system *system, const char *name, const char *meaning)
{
    ut_unit *unit = ut_parse(system, meaning, UT_UTF8);
    const ut_status status = unit ? ut_map_symbol_to_unit(name, UT_ASCII, unit) : UT_PARSE;
    ut_free(unit);
    return status == UT_SUCCESS || status == UT_EXISTS;
}

enum mill_status mill_units_create(struct mill_units **units, struct mill_error *error)
{
    *units = NULL;
    ut_set_error_message_handler(ut_ignore);
    struct mill_units *made = calloc(1, sizeof *made);
    /* UDUNITS-2 crashes or exits if it runs out of memory while it reads */
    void *room = malloc(DATABASE);
    free(room);
    if (!made || !room) {
        free(made);
        return mill_error_set(error, MILL_FAILED, "out of memory");
    }
    const char *path = getenv("UDUNITS2_XML_PATH");
    char beside[MILL_SHARE_PATH];
    const bool ours = !path && mill_share_find("udunits/udunits2.xml", beside);
    made->system = ut_read_xml(ours ? beside : NULL);
    if (!made->system) {
        free(made);
        return mill_error_set(error, MILL_FAILED,
                              "cannot read the unit database of UDUNITS-2%s%.200s; install it "
                              "(Debian: libudunits2-data) or set UDUNITS2_XML_PATH to its "
                              "udunits2.xml",
                              path ? " at UDUNITS2_XML_PATH=" : "", path ? path : "");
    }
    made->radian = ut_parse(made->system, "rad", UT_UTF8);
    made->rpm = ut_parse(made->system, "rpm", UT_UTF8);
    made->a_minute = ut_parse(made->system, "1/min", UT_UTF8);
    if (!made->radian || !made->rpm || !made->a_minute ||
        !add_name(made->system, "deg", "degree") || !add_name(made->system, "rev", "revolution") ||
        !add_name(made->system, "U", "revolution") || !add_name(made->system, "RPM", "rpm") ||
        !add_name(made->system, "r", "revolution") || !add_name(made->system, "upm", "rpm")) {
        mill_units_free(made);
        return mill_error_set(error, MILL_FAILED, "cannot add units to the database of UDUNITS-2");
    }
    *units = made;
    return MILL_OK;
}

void mill_units_free(struct mill_units *units)
{
    if (!units)
        return;
    ut_free(units->radian);
    ut_free(units->rpm);
    ut_free(units->a_minute);
    ut_free_system(units->system);
    free(units);
}

/* UDUNITS also accepts numbers as factors ("mm 5" is 5 mm) and huge exponents. A deck's value has
 * only one number, in front of the unit. So digits in a unit may only follow a letter, '^', '**' or
 * their sign, two digits at most. The only exception is a 1 in front, as in 1/min. */
static bool digits_are_exponents(const char *unit)
{
    const bool inverse = unit[0] == '1' && unit[1] == '/';
    for (const char *p = unit + inverse; (p = strpbrk(p, "+-0123456789"));) {
        const bool sign = *p == '-' || *p == '+';
        const size_t digits = strspn(p + sign, "0123456789");
        const char before = p > unit ? p[-1] : ' ';
        const bool power = before == '^' || (before == '*' && p - unit > 1 && p[-2] == '*');
        if (digits < 1 || digits > 2 || !(isalpha((unsigned char)before) || power))
            return false;
        p += sign + digits;
    }
    return true;
}

static bool is_multiple(const ut_unit *unit, double factor, const ut_unit *base)
{
    ut_unit *multiple = ut_scale(factor, base);
    const bool same = multiple && ut_compare(unit, multiple) == 0;
    ut_free(multiple);
    return same;
}

/* Writes the unit with plain signs. Data sheets print other ones: a raised minus and one, a dash, a
 * minus sign, and "/min" without the one. */
static void make_plain(const char *unit, char out[2 * LONGEST])
{
    static const struct {
        const char *sign, *plain;
    } signs[] = {{"\xe2\x81\xbb\xc2\xb9", "-1"}, {"\xe2\x80\x93", "-"}, {"\xe2\x88\x92", "-"}};
    size_t length = 0;
    if (*unit == '/')
        out[length++] = '1';
    while (*unit) {
        const char *plain = NULL;
        for (size_t k = 0; !plain && k < sizeof signs / sizeof *signs; k++) {
            if (strncmp(unit, signs[k].sign, strlen(signs[k].sign)) != 0)
                continue;
            plain = signs[k].plain;
            unit += strlen(signs[k].sign);
        }
        if (plain)
            length += (size_t)snprintf(out + length, 3, "%s", plain);
        else
            out[length++] = *unit++;
    }
    out[length] = '\0';
}

enum mill_units_verdict mill_units_scale(const struct mill_units *units, const char *unit,
                                         const char *si, double *scale)
{
    char plain[2 * LONGEST] = "";
    if (strlen(unit) <= LONGEST)
        make_plain(unit, plain);
    ut_unit *got =
        *plain && digits_are_exponents(plain) ? ut_parse(units->system, plain, UT_UTF8) : NULL;
    if (!got)
        return MILL_UNITS_UNKNOWN;
    const bool angular = strstr(si, "rad") != NULL;
    ut_unit *want = ut_parse(units->system, si, UT_UTF8);
    ut_unit *other = (angular ? ut_divide : ut_multiply)(want, units->radian);
    if (strcmp(si, "rad/s") == 0 && ut_compare(got, units->a_minute) == 0) {
        ut_free(got);
        got = ut_clone(units->rpm);
    }
    cv_converter *convert = ut_get_converter(got, want);
    const double factor = convert ? cv_convert_double(convert, 1.0) : 0.0;
    enum mill_units_verdict verdict = MILL_UNITS_MISMATCH;
    if (factor > 0.0 && isfinite(factor) && is_multiple(got, factor, want)) {
        verdict = MILL_UNITS_GOOD;
        *scale = factor;
    } else if (factor > 0.0 && isfinite(factor) && is_multiple(got, factor, other)) {
        verdict = angular ? MILL_UNITS_NO_ANGLE : MILL_UNITS_ANGLE;
    }
    cv_free(convert);
    ut_free(other);
    ut_free(want);
    ut_free(got);
    return verdict;
}

const char *mill_units_known(const char *si, char *out, size_t size)
{
    (void)si, (void)out, (void)size;
    return "";
}
