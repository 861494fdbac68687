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

const char *mill_summary_known(char text[MILL_SUMMARY_KNOWN], const struct mill_tally *tally)
{
    const struct mill_precision_known *known = &tally->at.known;
    text[0] = '\0';
    if (tally->precision == 0)
        return text;
    if (!tally->at.settled || !known->enough)
        return strcpy(text, "warming up");
    int used = say(text, MILL_SUMMARY_KNOWN, "median", &known->median);
    if (!known->idle && used < MILL_SUMMARY_KNOWN) {
        used += snprintf(text + used, MILL_SUMMARY_KNOWN - (size_t)used, ", ");
        if (used < MILL_SUMMARY_KNOWN)
            say(text + used, MILL_SUMMARY_KNOWN - (size_t)used, "power", &known->power);
    }
    return text;
}

/* Why it ended where it did; without the full stop */
static void say_end(FILE *out, const struct mill_tally *tally,
                    const struct mill_summary_facts *facts)
{
    char a[MILL_SUMMARY_NUMBER], b[MILL_SUMMARY_NUMBER], known[MILL_SUMMARY_KNOWN];
    mill_summary_number(a, facts->time_reached, "s");
    if (tally->at.ended == MILL_TALLY_PRECISION)
        fprintf(out, "ended at %s", a);
    else if (facts->stopped)
        fprintf(out, "stopped at %s", a);
    else if (tally->at.ended == MILL_TALLY_COLLISIONS)
        fprintf(out, "run.max_collisions = %s reached at %s",
                mill_summary_number(b, tally->collisions, ""), a);
    else
        fprintf(out, "run.time = %s reached", a);
    if (tally->precision == 0)
        return;
    if (!tally->at.settled || !tally->at.known.enough)
        fprintf(out, ": not settled, so neither median nor power is known");
    else
        fprintf(out, ": %s", mill_summary_known(known, tally));
    if (!mill_tally_reached(tally))
        fprintf(out, "; %.2g %% asked", 100 * tally->precision);
}

void mill_summary_end(FILE *out, const struct mill_tally *tally,
                      const struct mill_summary_facts *facts)
{
    char a[MILL_SUMMARY_NUMBER];
    if (tally->tick == 0)
        return;
    if (tally->search)
        fprintf(out, "cut the first %s (%s by MSER-5), ",
                mill_summary_number(a, tally->at.begin, "s"),
                tally->at.settled ? "warm-up" : "best cut");
    say_end(out, tally, facts);
    fprintf(out, "\n");
}
