/* What did the run come to? A table of at most 100 columns for standard output: contacts by kind
 * over the sampled window, the rotor, the energies, the anomalies, the cost; last one line that
 * says it all. */
#include "app/summary.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 100, LABEL = 18, FEW_BLOCKS = 8 };

/* How a number of four significant digits is written: times 1000^-thousands, with these decimals.
 */
struct scale {
    int thousands, decimals;
};

static bool fits(double value, struct scale *scale)
{
    char digits[MILL_SUMMARY_NUMBER];
    if (isinf(value))
        return false;
    snprintf(digits, sizeof digits, "%.3e", value); /* rounded first: 999.96 is 1.000 k */
    const int exponent = value == 0 ? 0 : atoi(strchr(digits, 'e') + 1);
    scale->thousands = (exponent + 15) / 3 - 5; /* rounded down, from -15 up */
    scale->decimals = 3 - (exponent - 3 * scale->thousands);
    return exponent >= -12 && exponent <= 14;
}

/* " kW": a blank, the prefix, the unit; nothing where there is neither */
static const char *scaled_unit(char text[MILL_SUMMARY_NUMBER], struct scale scale, const char *unit)
{
    static const char *const prefix[] = {"p", "n", "u", "m", "", "k", "M", "G", "T"};
    const char *sign = prefix[scale.thousands + 4];
    snprintf(text, MILL_SUMMARY_NUMBER, "%s%s%s", *sign || *unit ? " " : "", sign, unit);
    return text;
}

const char *mill_summary_number(char text[MILL_SUMMARY_NUMBER], double value, const char *unit)
{
    struct scale scale;
    char tail[MILL_SUMMARY_NUMBER];
    if (isnan(value))
        snprintf(text, MILL_SUMMARY_NUMBER, "-");
    else if (value == 0)
        snprintf(text, MILL_SUMMARY_NUMBER, "0%s%s", *unit ? " " : "", unit);
    else if (!*unit && value < 1000 && value == floor(value)) /* a count */
        snprintf(text, MILL_SUMMARY_NUMBER, "%.0f", value);
    else if (!fits(value, &scale))
        snprintf(text, MILL_SUMMARY_NUMBER, "%.3e %s", value, unit);
    else
        snprintf(text, MILL_SUMMARY_NUMBER, "%.*f%.12s", scale.decimals,
                 value / pow(10, 3 * scale.thousands), scaled_unit(tail, scale, unit));
    return text;
}

/* ---- how well the results are known: said of a run with run.precision ---- */

/* Relative standard error; NaN: not known, or of nothing. */
static double relative(const struct mill_precision_mean *mean)
{
    return mean->value != 0 ? mean->error / fabs(mean->value) : (double)NAN;
}

/* "median +- 1.3 %" */
static int say_error(char *text, size_t room, const char *what,
                     const struct mill_precision_mean *mean)
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
    int used = say_error(text, MILL_SUMMARY_KNOWN, "median", &known->median);
    if (!known->idle && used < MILL_SUMMARY_KNOWN) {
        used += snprintf(text + used, MILL_SUMMARY_KNOWN - (size_t)used, ", ");
        if (used < MILL_SUMMARY_KNOWN)
            say_error(text + used, MILL_SUMMARY_KNOWN - (size_t)used, "power", &known->power);
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
    if (!r->at.settled || !r->at.known.enough)
        fprintf(out, ": not settled, so neither median nor power is known");
    else
        fprintf(out, ": %s", say_known(known, r->tally->precision, r->at.settled, &r->at.known));
    if (!r->reached)
        fprintf(out, "; %.2g %% asked", 100 * r->tally->precision);
}

/* A line that says what was cut off and why the run ended; nothing where only its time could end
 * it. */
static void print_end(FILE *out, const struct mill_tally_results *r, const struct mill_facts *facts)
{
    char a[MILL_SUMMARY_NUMBER];
    if (r->tally->tick == 0)
        return;
    if (r->tally->search)
        fprintf(out, "cut the first %s (%s by MSER-5), ", mill_summary_number(a, r->begin, "s"),
                r->at.settled ? "warm-up" : "best cut");
    say_end(out, r, facts);
    fprintf(out, "\n");
}

/* ---- the table ---- */

static void print_row(FILE *out, const struct mill_tally_results *r, int row)
{
    const struct mill_spectrum *normal = &r->impacts[row].normal;
    const uint64_t count = mill_spectrum_total(normal, 0).count;
    const double power = mill_tally_per_second(r, mill_spectrum_total(normal, 0).dissipation);
    const double share = r->floor_share[row];
    char a[MILL_SUMMARY_NUMBER], b[MILL_SUMMARY_NUMBER], c[MILL_SUMMARY_NUMBER];
    char d[MILL_SUMMARY_NUMBER], e[MILL_SUMMARY_NUMBER], f[MILL_SUMMARY_NUMBER] = "-";
    if (!isnan(share))
        snprintf(f, sizeof f, "%.1f %%", 100 * share);
    fprintf(out, "%-10s %12llu %11s %12s %12s %12s %9s %11s\n", mill_tally_name(row),
            (unsigned long long)count,
            mill_summary_number(a, mill_tally_per_second(r, (double)count), "/s"),
            mill_summary_number(b, mill_spectrum_quantile(&r->tally->grid, normal, 0, 0.5), "m/s"),
            mill_summary_number(
                c, mill_spectrum_quantile(&r->tally->grid, normal, MILL_SPECTRUM_FAST, 0.5), "m/s"),
            mill_summary_number(d, mill_spectrum_mean(normal), "m/s"), f,
            mill_summary_number(e, power, "W"));
}

static void print_contacts(FILE *out, const struct mill_tally_results *r,
                           const struct mill_facts *facts)
{
    char a[MILL_SUMMARY_NUMBER], b[MILL_SUMMARY_NUMBER], c[MILL_SUMMARY_NUMBER];
    const double duration = r->duration;
    fprintf(out, "sampled for %s, from %s to %s\n", mill_summary_number(a, duration, "s"),
            mill_summary_number(b, r->begin, "s"),
            mill_summary_number(c, r->begin + duration, "s"));
    print_end(out, r, facts);
    fputc('\n', out);
    fprintf(out, "%-10s %12s %11s %12s %12s %12s %9s %11s\n", "", "", "", "median v_n",
            "median v_n", "mean v_n", "at the", "dissipated");
    fprintf(out, "%-10s %12s %11s %12s %12s %12s %9s %11s\n", "kind", "contacts", "rate", "of all",
            "> 50 mm/s", "of all", "floor", "power");
    for (int row = 0; row < MILL_TALLY_ROWS; row++)
        if (row == MILL_TALLY_ALL || mill_spectrum_total(&r->impacts[row].normal, 0).count > 0)
            print_row(out, r, row);
    if (r->tally->pairs.window > 0) {
        const double strikes =
            (double)mill_spectrum_total(&r->strikes[MILL_TALLY_ALL].normal, 0).count;
        fprintf(out, "%-10s %12.0f %11s  when re-contacts of a pair within %s are merged\n",
                "strikes", strikes, mill_summary_number(a, mill_tally_per_second(r, strikes), "/s"),
                mill_summary_number(b, r->tally->pairs.window, "s"));
    }
    fputc('\n', out);
}

/* The mean and its error on one scale: "8.213 +- 0.090 N m" */
static void print_mean(FILE *out, const char *label, double mean, double error, const char *unit,
                       const struct mill_tally_results *r)
{
    struct scale scale;
    char text[MILL_SUMMARY_NUMBER];
    const double revolutions = (double)r->blocks * r->revolutions;
    fprintf(out, "%-*s ", LABEL, label);
    if (!isnan(mean) && !isnan(error) && fits(mean, &scale)) {
        const double one = pow(10, 3 * scale.thousands);
        fprintf(out, "%.*f +- %.*f%s", scale.decimals, mean / one, scale.decimals, error / one,
                scaled_unit(text, scale, unit));
    } else {
        fprintf(out, "%s", mill_summary_number(text, mean, unit));
    }
    const char *remark = "";
    if (isnan(error))
        remark = ": too few for an error";
    else if (r->blocks < FEW_BLOCKS)
        remark = ": the error is rough";
    fprintf(out, "  (%.0f whole revolution%s%s)\n", revolutions, revolutions == 1 ? "" : "s",
            remark);
}

static void print_anomalies(FILE *out, const struct mill_world *world,
                            const struct mill_totals *totals)
{
    const struct mill_counts *counts = &world->counts;
    char a[MILL_SUMMARY_NUMBER];
    fprintf(out, "%-*s ", LABEL, "anomalies");
    if (totals->anomalies == 0) {
        fprintf(out, "none\n");
        return;
    }
    const struct {
        uint64_t count;
        const char *what;
    } list[] = {{counts->not_closing, "contacts found opening"},
                {counts->reliefs, "pinched balls let go"},
                {counts->smoothed, "contacts made smooth"},
                {!isfinite(totals->balance_error), "energies that are no numbers"},
                {counts->overlaps, "overlaps"}};
    const char *comma = "";
    for (size_t i = 0; i < sizeof list / sizeof *list; i++)
        if (list[i].count > 0) {
            fprintf(out, "%s%s: %llu", comma, list[i].what, (unsigned long long)list[i].count);
            comma = ", ";
        }
    if (counts->overlaps > 0)
        fprintf(out, " (up to %s)", mill_summary_number(a, counts->largest_overlap, "m"));
    fputc('\n', out);
}

static void print_state(FILE *out, const struct mill_world *world,
                        const struct mill_tally_results *r, const struct mill_totals *totals)
{
    char a[MILL_SUMMARY_NUMBER], b[MILL_SUMMARY_NUMBER];
    if (world->rotor_speed != 0) {
        print_mean(out, "rotor power", r->power, r->power_error, "W", r);
        print_mean(out, "rotor torque", r->torque, r->torque_error, "N m", r);
    }
    fprintf(out, "%-*s %s at the end, and %s in the balls' spin\n", LABEL, "kinetic energy",
            mill_summary_number(a, totals->energy.kinetic, "J"),
            mill_summary_number(b, totals->energy.rotational, "J"));
    fprintf(out, "%-*s %s of %s turned over", LABEL, "energy error",
            mill_summary_number(a, totals->balance_error, "J"),
            mill_summary_number(b, totals->turnover, "J"));
    if (totals->turnover > 0)
        fprintf(out, " (%.1e)", totals->balance_error / totals->turnover);
    fputc('\n', out);
    print_anomalies(out, world, totals);
}

/* Of a file, which may hold anything: control characters are replaced, as in messages. */
static void print_name(FILE *out, const char *name)
{
    for (; *name; name++)
        fputc((unsigned char)*name < 32 || *name == 127 ? '?' : *name, out);
}

static void print_cost(FILE *out, const struct mill_facts *facts, uint64_t contacts)
{
    char a[MILL_SUMMARY_NUMBER], b[MILL_SUMMARY_NUMBER], c[MILL_SUMMARY_NUMBER];
    const double per_cpu = facts->cost.cpu > 0 ? (double)contacts / facts->cost.cpu : (double)NAN;
    const double per_wall = facts->cost.wall > 0 ? facts->time / facts->cost.wall : (double)NAN;
    fprintf(out, "%-*s %s contacts per CPU second, %.4g simulated s per wall s\n", LABEL, "speed",
            mill_summary_number(a, per_cpu, ""), per_wall);
    fprintf(out, "%-*s %s wall, %s CPU, %s memory at most\n", LABEL, "cost",
            mill_summary_number(a, facts->cost.wall, "s"),
            mill_summary_number(b, facts->cost.cpu, "s"),
            mill_summary_number(c, facts->peak_memory, "B"));
    fprintf(out, "%-*s ", LABEL, "output");
    print_name(out, facts->output);
    fputc('\n', out);
}

/* "note: ...", broken between words */
static void print_note(FILE *out, const char *text)
{
    int column = fprintf(out, "note:");
    while (*text) {
        const int word = (int)strcspn(text, " ");
        if (column + 1 + word > WIDTH)
            column = fprintf(out, "\n     ") - 1;
        column += fprintf(out, " %.*s", word, text);
        text += word;
        text += strspn(text, " ");
    }
    fputc('\n', out);
}

static void print_all(FILE *out, const struct mill_world *world, const struct mill_tally_results *r,
                      const struct mill_facts *facts)
{
    const struct mill_totals totals = mill_record_add(world, facts->local);
    char note[MILL_SUMMARY_NOTES][MILL_SUMMARY_NOTE];
    char a[MILL_SUMMARY_NUMBER], b[MILL_SUMMARY_NUMBER], c[MILL_SUMMARY_NUMBER];
    const int notes = mill_summary_notes(world, r, facts, note);
    print_contacts(out, r, facts);
    print_state(out, world, r, &totals);
    print_cost(out, facts, totals.contacts);
    for (int i = 0; i < notes; i++)
        print_note(out, note[i]);
    fprintf(out, "\nmillsim %s ", facts->version);
    print_name(out, facts->deck);
    fprintf(out, ": %.6g s in %s wall, %s contacts, %s, ", facts->time,
            mill_summary_number(a, facts->cost.wall, "s"),
            mill_summary_number(b, (double)totals.contacts, ""),
            mill_summary_number(c, facts->peak_memory, "B"));
    if (totals.anomalies > 0)
        fprintf(out, "%llu anomalies\n", (unsigned long long)totals.anomalies);
    else
        fprintf(out, "no anomalies\n");
}

enum mill_status mill_summary_write(FILE *out, bool json, const struct mill_world *world,
                                    const struct mill_observers *observers,
                                    const struct mill_facts *facts, struct mill_error *error)
{
    const struct mill_observer *tally = mill_observers_find(observers, &mill_tally_type);
    struct mill_tally_results *results;
    enum mill_status status = mill_tally_results_make((const struct mill_tally *)tally, world,
                                                      facts->local, &results, error);
    if (status == MILL_OK && json)
        status = mill_summary_json(out, world, results, observers, facts, error);
    else if (status == MILL_OK)
        print_all(out, world, results, facts);
    mill_tally_results_free(results);
    return status;
}
