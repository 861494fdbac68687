/* Which SI factor does a unit stand for, and is it of the wanted quantity? UDUNITS-2 parses the
 * unit (its grammar and database: https://docs.unidata.ucar.edu/udunits/current/); a visitor then
 * collects the factor and the powers of m, kg, s and rad. UDUNITS' own test for convertibility is
 * not enough: to it the radian is just 1, so 16 Hz would pass for 16 rad/s. */
#include "deck/units.h"

#include <ctype.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <udunits2.h>

enum { BASES = 4, RADIAN = 3, LONGEST = 80 };
enum { DATABASE = 1 << 20 }; /* [B] more than twice what it takes to read it */
#define CLOSE 1e-15          /* of a scale to a whole number, or to one over it */
#define LARGEST 1e15         /* such a number that a double holds exactly */

struct mill_units {
    ut_system *system;
};

/* A unit taken apart: factor * m^p0 kg^p1 s^p2 rad^p3. */
struct factors {
    double factor;
    int power[BASES];
    bool pure; /* nothing but that: no offset, no logarithm, no other base unit */
};

static bool add_name(ut_system *system, const char *name, const char *meaning)
{
    ut_unit *known = ut_get_unit_by_symbol(system, name);
    if (known) {
        ut_free(known);
        return true;
    }
    ut_unit *unit = ut_parse(system, meaning, UT_UTF8);
    const bool ok = unit && ut_map_symbol_to_unit(name, UT_ASCII, unit) == UT_SUCCESS;
    ut_free(unit);
    return ok;
}

enum mill_status mill_units_create(struct mill_units **units, struct mill_error *error)
{
    *units = NULL;
    ut_set_error_message_handler(ut_ignore);
    struct mill_units *made = calloc(1, sizeof *made);
    /* UDUNITS-2 crashes or exits where memory ends while it reads */
    void *room = malloc(DATABASE);
    free(room);
    if (!made || !room) {
        free(made);
        return mill_error_set(error, MILL_FAILED, "out of memory");
    }
    made->system = ut_read_xml(NULL);
    if (!made->system) {
        const char *path = getenv("UDUNITS2_XML_PATH");
        mill_units_free(made);
        return mill_error_set(error, MILL_FAILED,
                              "cannot read the unit database of UDUNITS-2%s%.200s; install it "
                              "(Debian: libudunits2-data) or set UDUNITS2_XML_PATH to its "
                              "udunits2.xml",
                              path ? " at UDUNITS2_XML_PATH=" : "", path ? path : "");
    }
    if (!add_name(made->system, "deg", "degree") || !add_name(made->system, "rev", "revolution")) {
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
    if (units->system)
        ut_free_system(units->system);
    free(units);
}

static void add_base(struct factors *factors, const ut_unit *base, int power)
{
    static const char *const symbol[BASES] = {"m", "kg", "s", "rad"};
    const char *name = ut_get_symbol(base, UT_ASCII);
    int i = 0;
    while (i < BASES && (!name || strcmp(name, symbol[i]) != 0))
        i++;
    if (i < BASES)
        factors->power[i] += power;
    else
        factors->pure = false;
}

static ut_status visit_basic(const ut_unit *unit, void *self)
{
    add_base(self, unit, 1);
    return UT_SUCCESS;
}

static ut_status visit_product(const ut_unit *unit, int count, const ut_unit *const *bases,
                               const int *powers, void *self)
{
    (void)unit;
    for (int i = 0; i < count; i++)
        add_base(self, bases[i], powers[i]);
    return UT_SUCCESS;
}

static ut_status visit_galilean(const ut_unit *unit, double scale, const ut_unit *under,
                                double origin, void *self);

static ut_status visit_timestamp(const ut_unit *unit, const ut_unit *under, double origin,
                                 void *self)
{
    (void)unit;
    (void)under;
    (void)origin;
    ((struct factors *)self)->pure = false;
    return UT_SUCCESS;
}

static ut_status visit_logarithmic(const ut_unit *unit, double base, const ut_unit *reference,
                                   void *self)
{
    return visit_timestamp(unit, reference, base, self);
}

static const ut_visitor visitor = {
    .visit_basic = visit_basic,
    .visit_product = visit_product,
    .visit_galilean = visit_galilean,
    .visit_timestamp = visit_timestamp,
    .visit_logarithmic = visit_logarithmic,
};

static ut_status visit_galilean(const ut_unit *unit, double scale, const ut_unit *under,
                                double origin, void *self)
{
    struct factors *factors = self;
    (void)unit;
    factors->factor *= scale;
    if (origin != 0.0)
        factors->pure = false;
    return ut_accept_visitor(under, &visitor, self);
}

/* UDUNITS takes numbers as factors ("mm 5" is 5 mm) and huge exponents; a deck's value has one
 * number, in front. So digits may only follow a letter, '^', '**' or their sign, two of them at
 * most. */
static bool digits_are_exponents(const char *unit)
{
    int run = 0;
    for (const char *p = unit; *p; p++) {
        const unsigned char before = p == unit ? ' ' : (unsigned char)p[-1];
        if (!isdigit((unsigned char)*p)) {
            const bool sign = *p == '-' || *p == '+';
            if (sign && !isdigit((unsigned char)p[1]))
                return false;
            run = 0;
            continue;
        }
        const bool sign = before == '-' || before == '+';
        const unsigned char base = sign && p - unit >= 2 ? (unsigned char)p[-2] : before;
        const char *raise = p - sign - 2;
        const bool power = base == '^' || (base == '*' && raise >= unit && *raise == '*');
        if (++run > 2 || (run == 1 && !isalpha(base) && !power))
            return false;
    }
    return true;
}

static bool take_apart(const struct mill_units *units, const char *text, struct factors *factors)
{
    *factors = (struct factors){.factor = 1.0, .pure = true};
    if (!*text || strlen(text) > LONGEST || !digits_are_exponents(text))
        return false;
    ut_unit *unit = ut_parse(units->system, text, UT_UTF8);
    if (!unit)
        return false;
    if (ut_accept_visitor(unit, &visitor, factors) != UT_SUCCESS)
        factors->pure = false;
    ut_free(unit);
    return true;
}

enum mill_units_verdict mill_units_scale(const struct mill_units *units, const char *unit,
                                         const char *si, double *scale)
{
    struct factors got, want = {.factor = 1.0, .pure = true};
    if (!take_apart(units, unit, &got))
        return MILL_UNITS_UNKNOWN;
    if (strcmp(si, "1") != 0 && !take_apart(units, si, &want))
        return MILL_UNITS_UNKNOWN;
    if (!got.pure || !(got.factor > 0.0) || !isfinite(got.factor))
        return MILL_UNITS_MISMATCH;
    for (int i = 0; i < RADIAN; i++)
        if (got.power[i] != want.power[i])
            return MILL_UNITS_MISMATCH;
    if (got.power[RADIAN] != want.power[RADIAN])
        return got.power[RADIAN] == 0 ? MILL_UNITS_NO_ANGLE : MILL_UNITS_MISMATCH;
    *scale = got.factor / want.factor;
    return MILL_UNITS_GOOD;
}

/* Prefixes are powers of ten that a double below one cannot hold exactly: 0.001 is not a
 * thousandth, but 1000 is exact, so dividing by it rounds once. */
double mill_units_convert(double value, double scale)
{
    const bool small = scale < 1.0;
    const double whole = round(small ? 1.0 / scale : scale);
    if (!(whole < LARGEST) || fabs((small ? 1.0 / scale : scale) / whole - 1.0) > CLOSE)
        return value * scale;
    return small ? value / whole : value * whole;
}
