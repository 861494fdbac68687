/* Converts a value between text and SI number. Numbers are decimal, in the C locale. The unit is
 * everything after the number. Printing uses SI units, whose factor is exactly one, and the fewest
 * digits that read back to the same double. mill_deck_tell converts values without a deck: programs
 * around millsim need no table of keys and no reader of units. */
#include "deck/deck_private.h"

#include <assert.h>
#include <ctype.h>

#define SHORTEST 1e-9 /* length of a direction; a shorter one is zero */

/* What users call a quantity, and one example */
static const struct quantity {
    const char *unit, *name, *example;
    bool vector;
} quantities[] = {
    /* clang-format off */
    {"m", "a length", "75 mm", false}, {"s", "a time", "10 ms", false}, {"rad", "an angle", "30 deg", false},
    {"m/s", "a speed", "5 mm/s", false}, {"rad/s", "an angular speed", "1000 rpm", false},
    {"Hz", "a frequency", "25 Hz", false}, {"kg", "a mass", "22 kg", false},
    {"kg/m^3", "a density", "7800 kg/m^3", false}, {"J", "an energy", "1 mJ", false},
    {"K", "a temperature in kelvin", "293 K", false}, {"Pa", "a pressure", "8 GPa", false},
    {"J/kg/K", "a specific heat capacity", "460 J/kg/K", false},
    {"W/K", "a heat flow for each kelvin", "2 W/K", false},
    {"kg/J", "a mass for each joule", "1e-12 kg/J", false}, {"kg/J/m", "f_Mat", "0.9 kg/J/m", false},
    {"J m/kg", "x W_m,min", "0.1 J m/kg", false},
    {"m/s^2", "three numbers and a unit of acceleration", "0 0 -9.81 m/s^2", true},
    {"m", "three lengths in one unit", "60 20 10 mm", true}, {"rad", "three angles in one unit", "90 0 0 deg", true},
    {"", "three numbers, not all of them 0,", "0 0 1", true}, {"1", "a share", "1 %", false},
    {"critical", "a share of the critical speed", "70 % critical", false}, {NULL, "a plain number", "0.8", false}};
/* clang-format on */

/* Text after a number: " mm", or nothing. A fraction has no unit, or one such as %. */
static const char *unit_of(const struct mill_key *key)
{
    return key->unit && strcmp(key->unit, "1") != 0 ? key->unit : "";
}

const char *mill_deck_value_word(const struct mill_key *key, int n, int *length)
{
    const char *word = key->words;
    for (; word && n > 0; n--) {
        const char *bar = strchr(word, '|');
        word = bar ? bar + 1 : NULL;
    }
    *length = word ? (int)strcspn(word, "|") : 0;
    return word;
}

/* "'circle' or 'wavy'" */
static void print_words(const struct mill_key *key, char *out, size_t size)
{
    int length, next, used = 0;
    const char *word;
    for (int n = 0; (word = mill_deck_value_word(key, n, &length)) && used < (int)size; n++) {
        const char *apart = mill_deck_value_word(key, n + 1, &next) ? ", " : " or ";
        used += snprintf(out + used, size - (size_t)used, "%s'%.*s'", n ? apart : "", length, word);
    }
}

void mill_deck_value_wanted(const struct mill_key *key, bool with_unit, char *out, size_t size)
{
    const bool vector = key->type == MILL_KEY_VECTOR;
    const char *unit = vector && !key->unit ? "" : key->unit;
    const struct quantity *q = quantities;
    while (q->unit && (!unit || strcmp(q->unit, unit) != 0 || q->vector != vector))
        q++;
    with_unit = with_unit && key->type == MILL_KEY_NUMBER && *unit_of(key);
    if (key->unit_alone)
        snprintf(out, size, "a unit of length such as 'mm'");
    else if (key->type == MILL_KEY_WHOLE)
        snprintf(out, size, "a whole number such as '4000'");
    else if (key->type == MILL_KEY_CHOICE)
        print_words(key, out, size);
    else if (key->type == MILL_KEY_FILE && key->words)
        snprintf(out, size, "'%s' or the name of a file", key->words);
    else if (key->type == MILL_KEY_FILE || key->type == MILL_KEY_NAME)
        snprintf(out, size, "%s", key->type == MILL_KEY_FILE ? "the name of a file" : "a name");
    else
        snprintf(out, size, key->words ? "%s%s such as '%s', or '%s'" : "%s%s such as '%s'",
                 q->name, with_unit ? " with its unit" : "", q->example, key->words);
}

/* For numbers with commas: "; write 37.5 mm with a decimal point". A comma may also separate the
 * thousands of a whole number or the components of a vector. For fractions: "; write 9.525 mm". */
static void mend_number(const struct mill_key *key, const char *text, char *mend, size_t size)
{
    enum { LONG = 80 };
    const bool vector = key->type == MILL_KEY_VECTOR, whole = key->type == MILL_KEY_WHOLE;
    const char *comma = strchr(text, ',');
    char good[LONG + 1];
    size_t length = 0;
    double above, below;
    int used = 0;
    mend[0] = '\0';
    if (key->type == MILL_KEY_NUMBER && strlen(text) <= LONG &&
        sscanf(text, "%lf/%lf %n", &above, &below, &used) == 2 && below > 0.0 && used > 0)
        snprintf(mend, size, "; write %.9g%s%s", above / below, text[used] ? " " : "", text + used);
    if (!comma || strlen(text) > LONG || strchr(text, '.') || key->type > MILL_KEY_WHOLE)
        return;
    const char *blank = strpbrk(text, " \t");
    const bool apart = vector && (!blank || blank > strrchr(text, ',') || blank == comma + 1);
    for (const char *p = text; *p; p++) {
        if (*p == ',' && !isdigit((unsigned char)p[1]) && !apart)
            return;
        if (*p != ',' || !whole)
            good[length++] = *p != ',' ? *p : apart ? ' ' : '.';
    }
    good[length] = '\0';
    snprintf(mend, size, "; write %s%s", good,
             whole    ? ""
             : vector ? (apart ? " with blanks between the numbers" : " with decimal points")
                      : " with a decimal point");
}

static bool refuse(const struct mill_key *key, bool with_unit, const char *text, const char *remark,
                   struct mill_error *why)
{
    enum { LONG = 80 };
    char wanted[120], mend[160];
    mill_deck_value_wanted(key, with_unit, wanted, sizeof wanted);
    mend_number(key, text, mend, sizeof mend);
    if (!*text)
        mill_error_set(why, MILL_BAD_DECK, "expected %s, got nothing", wanted);
    else
        mill_error_set(why, MILL_BAD_DECK, "expected %s, got '%.*s%s'%s", wanted, LONG, text,
                       strlen(text) > LONG ? "..." : "", *mend ? mend : remark);
    return false;
}

/* strtod alone would take "0x1p3", "inf" and "nan" too. */
bool mill_deck_value_number(const char **at, double *value)
{
    const char *p = *at + (**at == '+' || **at == '-');
    if (!isdigit((unsigned char)p[*p == '.']) || (p[0] == '0' && (p[1] == 'x' || p[1] == 'X')))
        return false;
    char *end;
    *value = strtod(*at, &end);
    *at = end;
    return isfinite(*value);
}

/* The shortest decimal that reads back to the same double */
static void print_shortest(double value, char out[32])
{
    int digits = 1;
    snprintf(out, 32, "%.1g", value);
    while (digits < 17 && strtod(out, NULL) != value)
        snprintf(out, 32, "%.*g", ++digits, value);
    /* write 7800, not 7.8e+03 */
    const double size = fabs(value);
    if (strchr(out, 'e') && size >= 1.0 && size < 1e15)
        snprintf(out, 32, "%.*g", (int)floor(log10(size)) + 2, value);
}

static bool is_in_range(const struct mill_key *key, double value, const char *text,
                        struct mill_error *why)
{
    char lo[32], hi[32], limit[120];
    const char *unit = unit_of(key), *space = *unit ? " " : "";
    if ((key->above ? value > key->lo : value >= key->lo) && value <= key->hi)
        return true;
    print_shortest(key->lo, lo);
    print_shortest(key->hi, hi);
    if (value > key->hi &&
        (key->above || key->hi == MILL_KEY_LARGEST || key->type == MILL_KEY_VECTOR))
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

/* Reads the unit after the number(s) of `text`: sets *scale. */
static bool read_unit(struct mill_units **units, const struct mill_key *key, const char *text,
                      const char *unit, double *scale, struct mill_error *why)
{
    char remark[200] = "", known[120];
    *scale = 1.0;
    if (!*unit)
        return !*unit_of(key) || refuse(key, true, text, "", why);
    if (key->unit && mill_units_usual(unit, key->unit, scale))
        return true;
    if (key->unit && !*units && mill_units_create(units, why) != MILL_OK)
        return false;
    const char *si = key->unit ? key->unit : "";
    const bool turns = strcmp(si, "rad/s") == 0, cycles = strcmp(si, "Hz") == 0;
    const enum mill_units_verdict verdict =
        key->unit ? mill_units_scale(*units, unit, si, scale) : MILL_UNITS_MISMATCH;
    if (verdict == MILL_UNITS_GOOD)
        return true;
    if (unit[0] == 'l' && unit[1] == '/' && (turns || cycles))
        snprintf(remark, sizeof remark, " (the letter l; with the digit one: 1%.60s)", unit + 1);
    else if (strcmp(unit, "g") == 0 && strcmp(si, "m/s^2") == 0)
        snprintf(remark, sizeof remark,
                 " (g is the gram; the unit 'gravity' is 9.80665 m/s^2: write '%.*sgravity')",
                 (int)strlen(text) - 1, text);
    else if (verdict == MILL_UNITS_UNKNOWN)
        snprintf(remark, sizeof remark, " (unknown unit '%.60s'%s)", unit,
                 mill_units_known(si, known, sizeof known));
    else if (verdict == MILL_UNITS_NO_ANGLE)
        snprintf(remark, sizeof remark,
                 turns ? " (%.40s: turns or radians? write rpm or rad/s)"
                       : " (%.40s does not say which angle: rad, deg or revolutions)",
                 unit);
    else if (verdict == MILL_UNITS_ANGLE && cycles)
        snprintf(remark, sizeof remark,
                 " (%.40s is an angular speed; cycles are counted in Hz or 1/min)", unit);
    return refuse(key, *remark, text, remark, why);
}

/* A bound that is given in another unit differs in its last bits. */
static double at_bound(double value, double bound)
{
    return fabs(value - bound) <= 1e-15 * fabs(bound) ? bound : value;
}

static bool read_numbers(struct mill_units **units, const struct mill_key *key, const char *text,
                         int count, double *out, struct mill_error *why)
{
    const char *p = text;
    double value[3], scale;
    assert(count <= 3);
    for (int i = 0; i < count; i++) {
        const char *start = p + strspn(p, " \t");
        const bool apart = i == 0 || start > p;
        p = start;
        const bool at_unit = *p && !strchr("+-.0123456789", *p);
        if (key->unit_alone && at_unit) {
            value[i] = 1.0;
        } else if (i == 1 && key->one_for_all && at_unit) {
            value[1] = value[2] = value[0];
            break;
        } else if (!apart || !mill_deck_value_number(&p, &value[i])) {
            return refuse(key, true, text, "", why);
        }
    }
    if (!read_unit(units, key, text, p + strspn(p, " \t"), &scale, why))
        return false;
    for (int i = 0; i < count; i++) {
        value[i] = at_bound(at_bound(mill_units_convert(value[i], scale), key->lo), key->hi);
        if (!isfinite(value[i]))
            return refuse(key, true, text, " (too large)", why);
        /* for a vector the range limits the size of its components */
        if (!is_in_range(key, count > 1 && key->lo < 0.0 ? fabs(value[i]) : value[i], text, why))
            return false;
    }
    if (key->direction && !(vec3_norm(vec3_make(value[0], value[1], value[2])) > SHORTEST))
        return refuse(key, false, text, "", why);
    memcpy(out, value, (size_t)count * sizeof *out);
    return true;
}

/* Reads a whole number: digits, and a sign, so that the range refuses a negative one. */
static bool read_whole(const struct mill_key *key, const char *text, long *out,
                       struct mill_error *why)
{
    const char *digits = text + (*text == '-' || *text == '+');
    const size_t length = strspn(digits, "0123456789");
    if (length == 0 || digits[length])
        return refuse(key, false, text, "", why);
    *out = strtol(text, NULL, 10); /* on overflow: the nearest possible number */
    return is_in_range(key, (double)*out, text, why);
}

static bool read_word(const struct mill_key *key, const char *text, void *out,
                      struct mill_error *why)
{
    const char *word;
    int length, n = 0;
    while ((word = mill_deck_value_word(key, n, &length)) &&
           (strlen(text) != (size_t)length || strncmp(text, word, (size_t)length) != 0))
        n++;
    if (!*text || (key->type == MILL_KEY_CHOICE && !word))
        return refuse(key, false, text, "", why);
    if (key->type == MILL_KEY_CHOICE)
        *(int *)out = n;
    else
        *(const char **)out = word ? NULL : text;
    return true;
}

/* The key, or the one that it has for a value in another unit */
static const struct mill_key *key_for(const struct mill_key *key, const char *text)
{
    const size_t size = strlen(text), unit = key->also ? strlen(key->also->unit) : size;
    return unit < size && strcmp(text + size - unit, key->also->unit) == 0 ? key->also : key;
}

bool mill_deck_value_read(struct mill_units **units, const struct mill_key *key, const char *text,
                          void *form, struct mill_error *why)
{
    key = key_for(key, text);
    void *out = (char *)form + key->offset;
    if (key->type == MILL_KEY_VECTOR)
        return read_numbers(units, key, text, 3, out, why);
    if (key->type == MILL_KEY_NUMBER && key->words && strcmp(text, key->words) == 0) {
        *(double *)out = key->named;
        return true;
    }
    if (key->type == MILL_KEY_NUMBER) {
        const bool good = read_numbers(units, key, text, 1, out, why);
        if (good && key->factor > 0.0)
            *(double *)out *= key->factor;
        return good;
    }
    return key->type == MILL_KEY_WHOLE ? read_whole(key, text, out, why)
                                       : read_word(key, text, out, why);
}

void mill_deck_value_print(const struct mill_key *key, const void *form, char *out, size_t size)
{
    const void *where = (const char *)form + key->offset;
    const int numbers = key->type == MILL_KEY_VECTOR ? 3 : key->type == MILL_KEY_NUMBER;
    const char *word;
    char number[32];
    int length;
    if (numbers == 1 && isnan(*(const double *)where)) {
        snprintf(out, size, "%s", key->words);
        return;
    }
    for (int i = 0; i < numbers; i++) {
        print_shortest(((const double *)where)[i], number);
        const int used = snprintf(out, size, "%s%s", i > 0 ? " " : "", number);
        out += used;
        size -= (size_t)used;
    }
    if (numbers > 0)
        snprintf(out, size, "%s%s", *unit_of(key) ? " " : "", unit_of(key));
    else if (key->type == MILL_KEY_WHOLE)
        snprintf(out, size, "%ld", *(const long *)where);
    else if (key->type == MILL_KEY_CHOICE &&
             (word = mill_deck_value_word(key, *(const int *)where, &length)))
        snprintf(out, size, "%.*s", length, word);
    else if (*(const char *const *)where)
        mill_deck_parse_quote(*(const char *const *)where, out, size);
    else
        snprintf(out, size, "%s", key->words ? key->words : "");
}

static bool tell(const struct mill_deck_text *text, FILE *out)
{
    static const char *const key_type[] = {"number", "vector", "whole", "choice", "file", "name"};
    const struct mill_deck_section *section = text->section;
    const struct mill_deck_entry *entry = section->entry;
    const struct mill_key *row;
    struct mill_key key;
    union {
        double number;
        vec3 vector;
        long whole;
        int choice;
        const char *file;
    } value = {.file = NULL};
    struct mill_error why, first;
    char number[128] = "";
    bool good = false;
    /* the section's kind of motion or shape is not known: the first one that accepts the value */
    for (int n = 0; !good && (row = mill_deck_table_key(section->title, entry->key, n)); n++) {
        key = *key_for(row, entry->value);
        key.offset = 0;
        key.factor = 0.0; /* the value itself, not that of the key that it stands for */
        good = mill_deck_value_read(&text->reading->units, &key, entry->value, &value, &why);
        if (n == 0)
            first = why;
    }
    if (!good)
        return mill_deck_wrong(text, section->title, entry->key, "%s", first.text);
    const char *unit = key.unit ? key.unit : "1", *file = NULL;
    key.unit = NULL; /* the unit has a column of its own */
    if (key.type == MILL_KEY_FILE || key.type == MILL_KEY_NAME)
        file = value.file;
    if (!file)
        mill_deck_value_print(&key, &value, number, sizeof number);
    fprintf(out, "%s.%s\t%s\t%s\t%s\t%s\t%s%s%s\n", section->title, key.name, key_type[key.type],
            file ? file : number, unit, key.meaning, key.words ? key.words : "",
            key.known ? "|" : "", key.known ? key.known : "");
    return true;
}

enum mill_status mill_deck_tell(int count, const char *const *values, FILE *out,
                                struct mill_error *error)
{
    struct mill_memory_list memory = {.size = sizeof(void *)};
    struct mill_deck_reading reading = {.error = error, .memory = &memory};
    struct mill_deck_text text = {.reading = &reading};
    for (int i = 0; i < count && !reading.fault && !reading.over; i++) {
        text.section = NULL;
        mill_deck_parse(&text, NULL, 1, &values[i]);
        if (!reading.fault && !reading.over)
            tell(&text, out);
    }
    const enum mill_status status = mill_deck_faults_tell(&text, NULL);
    mill_units_free(reading.units);
    mill_deck_release(&memory);
    return status;
}
