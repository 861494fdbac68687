/* Numbers of the summary as texts. */
#include "app/summary.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TEXT = MILL_SUMMARY_TEXT };

char *mill_summary_text_room(void)
{
    static char texts[8][TEXT];
    static unsigned turn;
    return texts[turn++ % 8];
}

/* Numbers of things and their rates have words: "M/s" would look like metres per second. */
static bool is_counted(const char *unit)
{
    return !*unit || strcmp(unit, "/s") == 0 || strcmp(unit, "/J") == 0;
}

bool mill_summary_text_fits(double value, const char *unit, struct mill_summary_scale *scale)
{
    static const char *const prefix[] = {"p", "n", "u", "m", "", "k", "M", "G", "T"};
    static const char *const word[] = {"", "thousand", "million", "billion", "trillion"};
    char digits[TEXT];
    if (isinf(value))
        return false;
    snprintf(digits, sizeof digits, "%.3e", value); /* round first: 999.96 becomes 1.000 k */
    const int exponent = value == 0 ? 0 : atoi(strchr(digits, 'e') + 1);
    if (exponent < -12 || exponent > 14)
        return false;
    int thousands = (exponent + 15) / 3 - 5; /* division rounded towards minus infinity */
    thousands = is_counted(unit) && thousands < 0 ? 0 : thousands;
    *scale = (struct mill_summary_scale){.one = pow(10, 3 * thousands),
                                         .prefix = is_counted(unit) ? word[thousands]
                                                                    : prefix[thousands + 4],
                                         .decimals = 3 - (exponent - 3 * thousands)};
    return true;
}

const char *mill_summary_text_si(double value, const char *unit)
{
    struct mill_summary_scale scale;
    char *text = mill_summary_text_room();
    if (isnan(value))
        snprintf(text, TEXT, "-");
    else if (value == 0)
        snprintf(text, TEXT, "0%s%s", *unit ? " " : "", unit);
    else if (!*unit && value < 1000 && value == floor(value)) /* a count */
        snprintf(text, TEXT, "%.0f", value);
    else if (!mill_summary_text_fits(value, unit, &scale))
        snprintf(text, TEXT, "%.3e %s", value, unit);
    else
        snprintf(text, TEXT, "%.*f%s%s%s", scale.decimals, value / scale.one,
                 *scale.prefix || *unit ? " " : "", scale.prefix, unit);
    return text;
}

const char *mill_summary_text_cell(double value, struct mill_summary_scale scale)
{
    const double least = pow(10, -scale.decimals), shown = value / scale.one;
    char *text = mill_summary_text_room();
    if (isnan(value))
        return "-";
    if (shown > 0 && shown < 0.5 * least)
        snprintf(text, TEXT, "<%.*f", scale.decimals, least);
    else
        snprintf(text, TEXT, "%.*f", scale.decimals, shown);
    return text;
}

void mill_summary_text_value(FILE *out, const struct mill_precision_mean *mean, const char *unit)
{
    struct mill_summary_scale scale;
    const double most = fmax(fabs(mean->value), mean->error);
    const bool known =
        !isnan(mean->value) && !isnan(mean->error) && mill_summary_text_fits(most, unit, &scale);
    while (known && mean->error > 0 && scale.decimals < 9 &&
           mean->error / scale.one < pow(10, -scale.decimals))
        scale.decimals++;
    if (known)
        fprintf(out, "%.*f +- %.*f %s%s", scale.decimals, mean->value / scale.one, scale.decimals,
                mean->error / scale.one, scale.prefix, unit);
    else
        fprintf(out, "%s", mill_summary_text_si(mean->value, unit));
}

void mill_summary_text_label(FILE *out, const char *label)
{
    fprintf(out, "%-*s ", MILL_SUMMARY_LABEL, label);
}
