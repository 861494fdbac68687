/* A value as text and as an SI number, both ways. Numbers are decimal, in the C locale; the unit is
 * everything behind the number. Printing uses the fewest digits that read back to the same double
 * and SI units, whose factor is exactly one. */
#include "deck/deck_private.h"

#include <assert.h>
#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What users call a quantity, and one example */
static const struct quantity {
    const char *unit, *name, *example;
} quantities[] = {
    {"m", "a length", "75 mm"},
    {"s", "a time", "10 ms"},
    {"rad", "an angle", "30 deg"},
    {"m/s", "a speed", "5 mm/s"},
    {"rad/s", "an angular speed", "1000 rpm"},
    {"kg/m^3", "a density", "7800 kg/m^3"},
    {"m/s^2", "three numbers and a unit of acceleration", "0 0 -9.81 m/s^2"},
    {"1", "a share", "1 %"},
    {NULL, "a plain number", "0.8"},
};

static const struct quantity *quantity_of(const struct mill_key *key)
{
    const struct quantity *q = quantities;
    while (q->unit && (!key->unit || strcmp(q->unit, key->unit) != 0))
        q++;
    return q;
}

/* A share stands for itself or has a unit such as %. */
static bool is_share(const struct mill_key *key)
{
    return key->unit && strcmp(key->unit, "1") == 0;
}

/* As it stands behind a number: " mm", or nothing. */
static const char *unit_of(const struct mill_key *key)
{
    return key->unit && !is_share(key) ? key->unit : "";
}

void mill_deck_value_wanted(const struct mill_key *key, bool with_unit, char *out, size_t size)
{
    const struct quantity *q = quantity_of(key);
    switch (key->type) {
    case MILL_KEY_NUMBER:
    case MILL_KEY_VECTOR:
        snprintf(out, size, "%s%s such as '%s'", q->name,
                 with_unit && key->type == MILL_KEY_NUMBER && *unit_of(key) ? " with its unit" : "",
                 q->example);
        break;
    case MILL_KEY_WHOLE:
        snprintf(out, size, "a whole number such as '4000'");
        break;
    case MILL_KEY_CHOICE:
        snprintf(out, size, "'%.*s' or '%s'", (int)strcspn(key->words, "|"), key->words,
                 strchr(key->words, '|') + 1);
        break;
    case MILL_KEY_FILE:
        snprintf(out, size, "'%s' or the name of a file", key->words);
        break;
    }
}

static bool refuse(const struct mill_key *key, bool with_unit, const char *text, const char *remark,
                   struct mill_error *why)
{
    enum { LONG = 80 };
    char wanted[120];
    mill_deck_value_wanted(key, with_unit, wanted, sizeof wanted);
    if (!*text)
        mill_error_set(why, MILL_BAD_DECK, "expected %s, got nothing", wanted);
    else
        mill_error_set(why, MILL_BAD_DECK, "expected %s, got '%.*s%s'%s", wanted, LONG, text,
                       strlen(text) > LONG ? "..." : "", remark);
    return false;
}

/* Reads a decimal number at *at and moves on. strtod alone would take "0x1p3", "inf" and "nan" too.
 */
static bool read_number(const char **at, double *value)
{
    const char *p = *at;
    p += *p == '+' || *p == '-';
    const char *digits = *p == '.' ? p + 1 : p;
    if (!isdigit((unsigned char)*digits) || (p[0] == '0' && (p[1] == 'x' || p[1] == 'X')))
        return false;
    char *end;
    *value = strtod(*at, &end);
    *at = end;
    return isfinite(*value);
}

static bool in_range(const struct mill_key *key, double value)
{
    return (key->above ? value > key->lo : value >= key->lo) && value <= key->hi;
}

static bool refuse_range(const struct mill_key *key, double value, const char *text,
                         struct mill_error *why)
{
    char lo[32], hi[32], limit[120];
    const char *unit = unit_of(key), *space = *unit ? " " : "";
    mill_deck_value_shortest(key->lo, lo);
    if (key->type == MILL_KEY_WHOLE)
        snprintf(hi, sizeof hi, "%.0f", key->hi);
    else
        mill_deck_value_shortest(key->hi, hi);
    if (value > key->hi && (key->above || key->hi == MILL_KEY_LARGEST))
        snprintf(limit, sizeof limit, "at most %s%s%s", hi, space, unit);
    else if (key->above)
        snprintf(limit, sizeof limit, "greater than %s%s%s", lo, space, unit);
    else if (key->hi == MILL_KEY_LARGEST)
        snprintf(limit, sizeof limit, "at least %s%s%s", lo, space, unit);
    else
        snprintf(limit, sizeof limit, "between %s and %s%s%s", lo, hi, space, unit);
    mill_error_set(why, MILL_BAD_DECK, "must be %s, got '%.80s'", limit, text);
    return false;
}

/* The unit behind the number(s) of `text`: sets *scale. */
static bool read_unit(const struct mill_units *units, const struct mill_key *key, const char *text,
                      const char *unit, double *scale, struct mill_error *why)
{
    *scale = 1.0;
    if (!key->unit)
        return !*unit || refuse(key, false, text, "", why);
    if (!*unit)
        return is_share(key) || refuse(key, true, text, "", why);
    char remark[120];
    switch (mill_units_scale(units, unit, key->unit, scale)) {
    case MILL_UNITS_GOOD:
        return true;
    case MILL_UNITS_UNKNOWN:
        snprintf(remark, sizeof remark, " (unknown unit '%.60s')", unit);
        return refuse(key, true, text, remark, why);
    case MILL_UNITS_NO_ANGLE:
        snprintf(remark, sizeof remark,
                 " (%.40s does not say which angle: rad, deg or revolutions)", unit);
        return refuse(key, true, text, remark, why);
    case MILL_UNITS_MISMATCH:
        break;
    }
    return refuse(key, false, text, "", why);
}

static const char *skip_space(const char *p)
{
    return p + strspn(p, " \t");
}

/* Reads `count` numbers and the unit behind them. */
static bool read_numbers(const struct mill_units *units, const struct mill_key *key,
                         const char *text, int count, double *out, struct mill_error *why)
{
    const char *p = text;
    double value[3], scale;
    assert(count <= 3);
    for (int i = 0; i < count; i++) {
        const char *start = skip_space(p);
        const bool apart = i == 0 || start > p;
        p = start;
        if (!apart || !read_number(&p, &value[i]))
            return refuse(key, true, text, "", why);
    }
    if (!read_unit(units, key, text, skip_space(p), &scale, why))
        return false;
    for (int i = 0; i < count; i++) {
        value[i] = mill_units_convert(value[i], scale);
        if (!isfinite(value[i]))
            return refuse(key, true, text, " (too large)", why);
        if (!in_range(key, value[i]))
            return refuse_range(key, count > 1 ? fabs(value[i]) : value[i], text, why);
    }
    memcpy(out, value, (size_t)count * sizeof *out);
    return true;
}

/* Whole numbers: digits, and a sign for those that may be below zero by mistake. */
static bool read_whole(const struct mill_key *key, const char *text, long *out,
                       struct mill_error *why)
{
    const char *digits = text + (*text == '-' || *text == '+');
    const size_t length = strspn(digits, "0123456789");
    if (length == 0 || digits[length])
        return refuse(key, false, text, "", why);
    errno = 0;
    char *end;
    const long value = strtol(text, &end, 10);
    if (errno == ERANGE || !in_range(key, (double)value))
        return refuse_range(key, (double)value, text, why);
    *out = value;
    return true;
}

static bool read_choice(const struct mill_key *key, const char *text, bool *out,
                        struct mill_error *why)
{
    const size_t first = strcspn(key->words, "|");
    const bool is_first = strlen(text) == first && strncmp(text, key->words, first) == 0;
    if (!is_first && strcmp(text, key->words + first + 1) != 0)
        return refuse(key, false, text, "", why);
    *out = !is_first;
    return true;
}

static bool read_file_name(const struct mill_key *key, const char *text, char **out,
                           struct mill_error *why)
{
    if (!*text)
        return refuse(key, false, text, "", why);
    free(*out);
    *out = NULL;
    if (strcmp(text, key->words) == 0)
        return true;
    *out = strdup(text);
    if (!*out)
        mill_error_set(why, MILL_FAILED, "out of memory");
    return *out;
}

bool mill_deck_value_read(const struct mill_units *units, const struct mill_key *key,
                          const char *text, void *form, struct mill_error *why)
{
    void *out = (char *)form + key->offset;
    switch (key->type) {
    case MILL_KEY_NUMBER:
        return read_numbers(units, key, text, 1, out, why);
    case MILL_KEY_VECTOR:
        return read_numbers(units, key, text, 3, out, why);
    case MILL_KEY_WHOLE:
        return read_whole(key, text, out, why);
    case MILL_KEY_CHOICE:
        return read_choice(key, text, out, why);
    case MILL_KEY_FILE:
        break;
    }
    return read_file_name(key, text, out, why);
}

void mill_deck_value_shortest(double value, char out[32])
{
    int digits = 1;
    snprintf(out, 32, "%.1g", value);
    while (digits < 17 && strtod(out, NULL) != value)
        snprintf(out, 32, "%.*g", ++digits, value);
    /* 7800 rather than 7.8e+03 */
    const double size = fabs(value);
    if (strchr(out, 'e') && size >= 1.0 && size < 1e15)
        snprintf(out, 32, "%.*g", (int)floor(log10(size)) + 2, value);
}

void mill_deck_value_print(const struct mill_key *key, const void *form, char *out, size_t size)
{
    const void *where = (const char *)form + key->offset;
    const char *unit = unit_of(key), *space = *unit ? " " : "";
    char a[32], b[32], c[32];
    switch (key->type) {
    case MILL_KEY_NUMBER:
        mill_deck_value_shortest(*(const double *)where, a);
        snprintf(out, size, "%s%s%s", a, space, unit);
        break;
    case MILL_KEY_VECTOR:
        mill_deck_value_shortest(((const vec3 *)where)->x, a);
        mill_deck_value_shortest(((const vec3 *)where)->y, b);
        mill_deck_value_shortest(((const vec3 *)where)->z, c);
        snprintf(out, size, "%s %s %s%s%s", a, b, c, space, unit);
        break;
    case MILL_KEY_WHOLE:
        snprintf(out, size, "%ld", *(const long *)where);
        break;
    case MILL_KEY_CHOICE:
        if (*(const bool *)where)
            snprintf(out, size, "%s", strchr(key->words, '|') + 1);
        else
            snprintf(out, size, "%.*s", (int)strcspn(key->words, "|"), key->words);
        break;
    case MILL_KEY_FILE:
        if (*(char *const *)where)
            mill_deck_parse_quote(*(char *const *)where, out, size);
        else
            snprintf(out, size, "%s", key->words);
        break;
    }
}
