/* The results of a run as a table of at most 100 columns for standard output: contacts by kind in
 * the sampled window, the rotor, energies, anomalies, cost. The last line is a short summary. */
#include "app/summary.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 100, LABEL = 18, ABOVE_1 = 1, TEXT = 64 }; /* mill_world_fast[1] is 1 m/s */

/* A buffer for a short text; eight calls later it is used again */
static char *room(void)
{
    static char texts[8][TEXT];
    static unsigned turn;
    return texts[turn++ % 8];
}

/* Format of a number with four significant digits: in units of `one`, with `decimals` decimals */
struct scale {
    double one;
    const char *prefix;
    int decimals;
};

static bool fits(double value, struct scale *scale)
{
    static const char *const prefix[] = {"p", "n", "u", "m", "", "k", "M", "G", "T"};
    char digits[TEXT];
    if (isinf(value))
        return false;
    snprintf(digits, sizeof digits, "%.3e", value); /* round first: 999.96 becomes 1.000 k */
    const int exponent = value == 0 ? 0 : atoi(strchr(digits, 'e') + 1);
    if (exponent < -12 || exponent > 14)
        return false;
    const int thousands = (exponent + 15) / 3 - 5; /* division rounded towards minus infinity */
    *scale = (struct scale){.one = pow(10, 3 * thousands),
                            .prefix = prefix[thousands + 4],
                            .decimals = 3 - (exponent - 3 * thousands)};
    return true;
}

const char *mill_summary_si(double value, const char *unit)
{
    struct scale scale;
    char *text = room();
    if (isnan(value))
        snprintf(text, TEXT, "-");
    else if (value == 0)
        snprintf(text, TEXT, "0%s%s", *unit ? " " : "", unit);
    else if (!*unit && value < 1000 && value == floor(value)) /* a count */
        snprintf(text, TEXT, "%.0f", value);
    else if (!fits(value, &scale))
        snprintf(text, TEXT, "%.3e %s", value, unit);
    else
        snprintf(text, TEXT, "%.*f%s%s%s", scale.decimals, value / scale.one,
                 *scale.prefix || *unit ? " " : "", scale.prefix, unit);
    return text;
}

/* ---- accuracy of the results: for runs with run.precision ---- */

/* "+- 1.3 %" */
static const char *error_of(const struct mill_precision_mean *mean)
{
    const double error = mean->value != 0 ? mean->error / fabs(mean->value) : (double)NAN;
    char *text = room();
    if (isnan(error)) /* not known, or the value is 0 */
        return "unknown";
    snprintf(text, TEXT, error < 10 ? "+- %.2g %%" : "+- %.0f %%", 100 * error);
    return text;
}

static const char *say_known(const struct mill_precision_known *known)
{
    char *text = room();
    snprintf(text, TEXT, "median %s%s%s", error_of(&known->median_fast),
             known->idle ? "" : ", power ", known->idle ? "" : error_of(&known->drive));
    return text;
}

const char *mill_summary_known(const struct mill_observers *observers)
{
    const struct mill_tally *tally =
        (const struct mill_tally *)mill_observers_find(observers, &mill_tally_type);
    if (tally->precision == 0)
        return "";
    return tally->at.settled && tally->at.known.enough ? say_known(&tally->at.known) : "start-up";
}

bool mill_summary_samples(const struct mill_observers *observers)
{
    const struct mill_tally *tally =
        (const struct mill_tally *)mill_observers_find(observers, &mill_tally_type);
    return tally->at.open && (!tally->search || tally->at.settled);
}

/* Prints what was cut off and why the run ended; nothing if only its time could end it. */
static void print_end(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    const char *time = mill_summary_si(s->facts->time, "s");
    if (r->tally->precision == 0 && r->tally->collisions == UINT64_MAX)
        return;
    if (r->tally->search)
        fprintf(s->out, "left out the first %s (%s by MSER-5), ", mill_summary_si(r->begin, "s"),
                r->at.settled ? "start-up" : "best guess of the start-up");
    if (r->tally->at.ended == MILL_TALLY_PRECISION)
        fprintf(s->out, "ended at %s", time);
    else if (strcmp(s->facts->status, "stopped") == 0)
        fprintf(s->out, "stopped at %s", time);
    else if (r->tally->at.ended == MILL_TALLY_COLLISIONS)
        fprintf(s->out, "run.max_collisions = %s reached at %s",
                mill_summary_si((double)r->tally->collisions, ""), time);
    else
        fprintf(s->out, "run.time = %s reached", time);
    if (r->tally->precision > 0)
        fprintf(s->out, ": %s",
                r->at.settled && r->at.known.enough ? say_known(&r->at.known)
                : r->at.settled ? "too short to know the errors of median and power"
                                : "the start-up is not over, so neither error is known");
    if (r->tally->precision > 0 && !r->reached)
        fprintf(s->out, "; requested: %.2g %%", 100 * r->tally->precision);
    fputc('\n', s->out);
}

/* ---- the table ---- */

/* name: width of the column for names */
static void print_row(FILE *out, const struct mill_tally_results *r, int row, int name)
{
    const struct mill_spectrum_grid *grid = &r->tally->grid;
    const struct mill_spectrum *normal = &r->impacts[row].normal;
    const struct mill_spectrum_slot all = mill_spectrum_total(normal, 0);
    const double share = r->floor_share[row];
    char floored[TEXT] = "-";
    if (!isnan(share))
        snprintf(floored, sizeof floored, "%.1f %%", 100 * share);
    fprintf(out, "%-*s %12llu %11s %12s %12s %12s %9s %11s\n", name, mill_tally_name(r, row),
            (unsigned long long)all.count,
            mill_summary_si(mill_tally_per_second(r, (double)all.count), "/s"),
            mill_summary_si(mill_spectrum_quantile(grid, normal, 0, 0.5), "m/s"),
            mill_summary_si(mill_spectrum_quantile(grid, normal, MILL_SPECTRUM_FAST, 0.5), "m/s"),
            mill_summary_si(mill_spectrum_mean(normal), "m/s"), floored,
            mill_summary_si(mill_tally_per_second(r, all.dissipation), "W"));
}

/* Is the row shown in the table? Kinds without contacts are left out. */
static bool is_shown(const struct mill_tally_results *r, int row)
{
    return row == r->all || mill_spectrum_total(&r->impacts[row].normal, 0).count > 0;
}

static void print_contacts(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    int name = 10; /* width of a kind's name */
    for (int row = 0; row <= r->all; row++)
        if (is_shown(r, row) && (int)strlen(mill_tally_name(r, row)) > name)
            name = (int)strlen(mill_tally_name(r, row));
    fprintf(s->out, "sampled for %s, from %s to %s\n", mill_summary_si(r->duration, "s"),
            mill_summary_si(r->begin, "s"), mill_summary_si(r->begin + r->duration, "s"));
    print_end(s);
    fprintf(s->out, "\n%-*s %12s %11s %12s %12s %12s %9s %11s\n", name, "", "", "", "median v_n",
            "median v_n", "mean v_n", "at the", "dissipated");
    fprintf(s->out, "%-*s %12s %11s %12s %12s %12s %9s %11s\n", name, "kind", "contacts", "rate",
            "of all", "> 50 mm/s", "of all", "floor", "power");
    for (int row = 0; row <= r->all; row++)
        if (is_shown(r, row))
            print_row(s->out, r, row, name);
    if (r->tally->pairs.window > 0) {
        const double strikes = (double)mill_spectrum_total(&r->strikes[r->all].normal, 0).count;
        fprintf(s->out, "%-*s %12.0f %11s  impacts of the same two bodies within %s count once\n",
                name, "strikes", strikes, mill_summary_si(mill_tally_per_second(r, strikes), "/s"),
                mill_summary_si(r->tally->pairs.window, "s"));
    }
    fputc('\n', s->out);
}

/* Prints mean and error with the prefix of the larger one: "8.213 +- 0.090 N m". An error that
 * would be printed as 0 gets more digits. */
static void print_value(FILE *out, const struct mill_precision_mean *mean, const char *unit)
{
    struct scale scale;
    const double most = fmax(fabs(mean->value), mean->error);
    const bool known = !isnan(mean->value) && !isnan(mean->error) && fits(most, &scale);
    while (known && mean->error > 0 && scale.decimals < 9 &&
           mean->error / scale.one < pow(10, -scale.decimals))
        scale.decimals++;
    if (known)
        fprintf(out, "%.*f +- %.*f %s%s", scale.decimals, mean->value / scale.one, scale.decimals,
                mean->error / scale.one, scale.prefix, unit);
    else
        fprintf(out, "%s", mill_summary_si(mean->value, unit));
}

static void print_mean(FILE *out, const char *label, const struct mill_precision_mean *mean,
                       const char *unit, const char *remark)
{
    fprintf(out, "%-*s ", LABEL, label);
    print_value(out, mean, unit);
    fprintf(out, "  (%s%s)\n", remark, isnan(mean->error) ? ": error not known" : "");
}

/* Prints what the motions do; for a single rotor in the words for a rotor */
static void print_drive(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    const struct mill_world *world = s->world;
    const struct mill_precision_known *known = &r->at.known;
    const bool rotor = world->motions == 1 && world->rotor == 0;
    const double times = r->duration / world->period;
    char turns[TEXT];
    const char *what = rotor ? "revolution" : "period";
    const int length =
        snprintf(turns, sizeof turns, "%.3g %s%s", times, what, fabs(times - 1) < 5e-3 ? "" : "s");
    if (isnan(known->drive.error) && times < MILL_PRECISION_PERIODS)
        snprintf(turns + length, sizeof turns - (size_t)length, ", %d needed",
                 MILL_PRECISION_PERIODS);
    print_mean(s->out, rotor ? "rotor power" : "drive power", &known->drive, "W", turns);
    if (rotor || (world->motions == 1 && !isnan(known->motion_torque[0].value)))
        print_mean(s->out, rotor ? "rotor torque" : "drive torque", &known->motion_torque[0], "N m",
                   turns);
    for (int k = 0; world->motions > 1 && k < world->motions; k++) {
        fprintf(s->out, "%-*s ", LABEL, world->motion_name[k]);
        print_value(s->out, &known->motion_power[k], "W");
        if (!isnan(known->motion_torque[k].value)) {
            fprintf(s->out, ", torque ");
            print_value(s->out, &known->motion_torque[k], "N m");
        }
        fputc('\n', s->out);
    }
    if (r->pinch_power > 0)
        fprintf(s->out, "%-*s %s of the power goes to balls that %s press\n", LABEL, "pinches",
                mill_summary_si(r->pinch_power, "W"),
                mill_notes_of_rotor(world) ? "blades" : "moving bodies");
}

static void print_means(const struct mill_summary *s)
{
    const struct mill_tally_results *r = s->results;
    const struct mill_precision_known *known = &r->at.known;
    if (s->world->period < (double)INFINITY)
        print_drive(s);
    print_mean(s->out, "median v_n", &known->median, "m/s", "all impacts");
    print_mean(s->out, "median v_n", &known->median_fast, "m/s", "impacts above 50 mm/s");
    print_mean(s->out, "rate", &known->fast[r->all][ABOVE_1], "/s", "impacts above 1 m/s");
}

static void print_anomalies(FILE *out, const struct mill_counts *counts, double balance_error)
{
    const struct {
        uint64_t count;
        const char *what;
    } list[] = {{counts->not_closing, "contacts with an opening gap"},
                {counts->reliefs, "pinched balls released"},
                {counts->smoothed, "contacts without friction"},
                {!isfinite(balance_error), "energies that are not numbers"},
                {counts->overlaps, "overlaps"}};
    const char *comma = "";
    fprintf(out, "%-*s ", LABEL, "anomalies");
    for (size_t i = 0; i < sizeof list / sizeof *list; i++)
        if (list[i].count > 0) {
            fprintf(out, "%s%s: %llu", comma, list[i].what, (unsigned long long)list[i].count);
            comma = ", ";
        }
    if (counts->overlaps > 0)
        fprintf(out, " (up to %s)", mill_summary_si(counts->largest_overlap, "m"));
    fprintf(out, *comma ? "\n" : "none\n");
}

static void print_state(const struct mill_summary *s, const struct mill_totals *totals)
{
    print_means(s);
    fprintf(s->out, "%-*s %s at the end, and %s in the balls' spin\n", LABEL, "kinetic energy",
            mill_summary_si(totals->energy.kinetic, "J"),
            mill_summary_si(totals->energy.rotational, "J"));
    fprintf(s->out, "%-*s %s of %s turned over", LABEL, "energy error",
            mill_summary_si(totals->balance_error, "J"), mill_summary_si(totals->turnover, "J"));
    if (totals->turnover > 0)
        fprintf(s->out, " (%.1e)", totals->balance_error / totals->turnover);
    fputc('\n', s->out);
    print_anomalies(s->out, &s->world->counts, totals->balance_error);
}

/* Prints a name of a file; replaces control characters, as in messages. */
static void print_name(FILE *out, const char *name)
{
    for (; *name; name++)
        fputc((unsigned char)*name < 32 || *name == 127 ? '?' : *name, out);
}

/* Prints "note: ...", with line breaks between words */
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

static void print_all(const struct mill_summary *s)
{
    const struct mill_facts *facts = s->facts;
    const struct mill_totals totals = mill_record_add(s->world, facts->local);
    const double wall = facts->cost.wall, cpu = facts->cost.cpu;
    print_contacts(s);
    print_state(s, &totals);
    fprintf(s->out, "%-*s %s contacts per CPU second, %.4g simulated s per wall s\n", LABEL,
            "speed", mill_summary_si(cpu > 0 ? (double)totals.contacts / cpu : (double)NAN, ""),
            wall > 0 ? facts->time / wall : (double)NAN);
    fprintf(s->out, "%-*s %s wall, %s CPU, %s memory at most\n", LABEL, "cost",
            mill_summary_si(wall, "s"), mill_summary_si(cpu, "s"),
            mill_summary_si(facts->peak_memory, "B"));
    fprintf(s->out, "%-*s ", LABEL, "output");
    print_name(s->out, facts->output);
    fputc('\n', s->out);
    for (int i = 0; i < s->notes.count; i++)
        if (s->notes.note[i].text[0])
            print_note(s->out, s->notes.note[i].text);
    fprintf(s->out, "\nmillsim %s ", facts->version);
    print_name(s->out, facts->deck);
    fprintf(s->out, ": %.6g s in %s wall, %s contacts, %s, ", facts->time,
            mill_summary_si(wall, "s"), mill_summary_si((double)totals.contacts, ""),
            mill_summary_si(facts->peak_memory, "B"));
    if (totals.anomalies > 0)
        fprintf(s->out, "%llu anomal%s\n", (unsigned long long)totals.anomalies,
                totals.anomalies == 1 ? "y" : "ies");
    else
        fprintf(s->out, "no anomalies\n");
}

enum mill_status mill_summary_write(struct mill_summary *s, bool json, struct mill_error *error)
{
    const struct mill_tally *tally =
        (const struct mill_tally *)mill_observers_find(s->observers, &mill_tally_type);
    enum mill_status status =
        mill_tally_results_make(tally, s->world, s->facts->local, &s->results, error);
    if (status != MILL_OK)
        return status;
    mill_notes_take(&s->notes, s->world, s->results, s->facts->local,
                    strcmp(s->facts->status, "stopped") == 0);
    if (json)
        status = mill_summary_json(s, error);
    else
        print_all(s);
    mill_tally_results_free(s->results);
    return status;
}
