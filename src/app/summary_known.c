/* How well are the results known, and what was cut off for it? Said of a run with run.precision. */
#include "app/summary.h"

#include <math.h>
#include <string.h>

/* Relative standard error; NaN: not known, or of nothing. */
static double relative(const struct mill_precision_mean *mean)
{
    return mean->value != 0 ? mean->error / fabs(mean->value) : (double)NAN;
}

/* "median +- 1.3 %" */
static int say(char *text, size_t room, const char *what, const struct mill_precision_mean *mean)
{
    const double error = relative(mean);
    if (isnan(error))
        return snprintf(text, room, "%s unknown", what);
    return snprintf(text, room, error < 10 ? "%s +- %.2g %%" : "%s +- %.0f %%", what, 100 * error);
}

static const char *say_known(char text[MILL_SUMMARY_KNOWN], double asked, bool settled,
                             const struct mill_precision_known *known)
{
    text[0] = '\0';
    if (asked == 0)
        return text;
    if (!settled || !known->enough)
        return strcpy(text, "warming up");
    int used = say(text, MILL_SUMMARY_KNOWN, "median", &known->median);
    if (!known->idle && used < MILL_SUMMARY_KNOWN) {
        used += snprintf(text + used, MILL_SUMMARY_KNOWN - (size_t)used, ", ");
        if (used < MILL_SUMMARY_KNOWN)
            say(text + used, MILL_SUMMARY_KNOWN - (size_t)used, "power", &known->power);
    }
    return text;
}

const char *mill_summary_known(char text[MILL_SUMMARY_KNOWN],
                               const struct mill_observers *observers)
{
    const struct mill_tally *tally =
        (const struct mill_tally *)mill_observers_find(observers, &mill_tally_type);
    return say_known(text, tally->precision, tally->at.settled, &tally->at.known);
}

/* Why it ended where it did; without the full stop */
static void say_end(FILE *out, const struct mill_tally_results *r, const struct mill_facts *facts)
{
    char a[MILL_SUMMARY_NUMBER], b[MILL_SUMMARY_NUMBER], known[MILL_SUMMARY_KNOWN];
    mill_summary_number(a, facts->time, "s");
    if (r->tally->at.ended == MILL_TALLY_PRECISION)
        fprintf(out, "ended at %s", a);
    else if (strcmp(facts->status, "stopped") == 0)
        fprintf(out, "stopped at %s", a);
    else if (r->tally->at.ended == MILL_TALLY_COLLISIONS)
        fprintf(out, "run.max_collisions = %s reached at %s",
                mill_summary_number(b, (double)r->tally->collisions, ""), a);
    else
        fprintf(out, "run.time = %s reached", a);
    if (r->tally->precision == 0)
        return;
    if (!r->settled || !r->known.enough)
        fprintf(out, ": not settled, so neither median nor power is known");
    else
        fprintf(out, ": %s", say_known(known, r->tally->precision, r->settled, &r->known));
    if (!mill_tally_reached(r))
        fprintf(out, "; %.2g %% asked", 100 * r->tally->precision);
}

void mill_summary_end(FILE *out, const struct mill_tally_results *r, const struct mill_facts *facts)
{
    char a[MILL_SUMMARY_NUMBER];
    if (r->tally->tick == 0)
        return;
    if (r->tally->search)
        fprintf(out, "cut the first %s (%s by MSER-5), ", mill_summary_number(a, r->begin, "s"),
                r->settled ? "warm-up" : "best cut");
    say_end(out, r, facts);
    fprintf(out, "\n");
}
