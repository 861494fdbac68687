/* The summary for programs: one JSON object, SI units, every number to full precision, NaN and
 * infinity as null. What the keys mean: docs/file-format.md. */
#include "app/summary.h"

#include <math.h>

/* Where the next member goes: whether one stands before it, and how deep it is indented. */
struct json {
    FILE *out;
    bool first;
    int depth;
};

/* Bytes of the UTF-8 character that starts here; 0 when there is none (file names may hold
 * anything) */
static int character(const unsigned char *p)
{
    static const unsigned lowest[5] = {0, 0, 0x80, 0x800, 0x10000};
    const int bytes = *p < 0x80 ? 1 : *p >> 5 == 6 ? 2 : *p >> 4 == 14 ? 3 : *p >> 3 == 30 ? 4 : 0;
    if (bytes < 2)
        return bytes;
    unsigned code = *p & (0x7fu >> bytes);
    for (int i = 1; i < bytes; i++) {
        if (p[i] >> 6 != 2)
            return 0;
        code = code << 6 | (p[i] & 0x3fu);
    }
    const bool surrogate = code >> 11 == 0x1b;
    return code >= lowest[bytes] && code <= 0x10ffff && !surrogate ? bytes : 0;
}

static void text_value(struct json *json, const char *text)
{
    const unsigned char *p = (const unsigned char *)text;
    fputc('"', json->out);
    while (*p) {
        const int bytes = character(p);
        if (bytes == 0)
            fprintf(json->out, "\\ufffd");
        else if (*p == '"' || *p == '\\')
            fprintf(json->out, "\\%c", *p);
        else if (*p < 32 || *p == 127)
            fprintf(json->out, "\\u%04x", (unsigned)*p);
        else
            fwrite(p, 1, (size_t)bytes, json->out);
        p += bytes ? bytes : 1;
    }
    fputc('"', json->out);
}

static void number_value(struct json *json, double value)
{
    if (isfinite(value))
        fprintf(json->out, "%.17g", value);
    else
        fprintf(json->out, "null");
}

/* On to the next member; name: NULL within an array. */
static void next(struct json *json, const char *name)
{
    fprintf(json->out, "%s\n%*s", json->first ? "" : ",", 2 * json->depth, "");
    json->first = false;
    if (name) {
        text_value(json, name);
        fprintf(json->out, ": ");
    }
}

static void open_group(struct json *json, const char *name)
{
    next(json, name);
    fputc('{', json->out);
    json->first = true;
    json->depth++;
}

static void close_group(struct json *json)
{
    json->depth--;
    json->first = false;
    fprintf(json->out, "\n%*s}", 2 * json->depth, "");
}

static void number(struct json *json, const char *name, double value)
{
    next(json, name);
    number_value(json, value);
}

static void whole(struct json *json, const char *name, uint64_t value)
{
    next(json, name);
    fprintf(json->out, "%llu", (unsigned long long)value);
}

static void text(struct json *json, const char *name, const char *value)
{
    next(json, name);
    text_value(json, value);
}

static void numbers(struct json *json, const char *name, int n, const double *value)
{
    next(json, name);
    for (int i = 0; i < n; i++) {
        fprintf(json->out, i ? ", " : "[");
        number_value(json, value[i]);
    }
    fputc(']', json->out);
}

static void quantiles(struct json *json, const char *name, const struct mill_tally *tally,
                      const struct mill_spectrum *spectrum, int slot)
{
    double value[MILL_TALLY_LEVELS];
    for (int i = 0; i < MILL_TALLY_LEVELS; i++)
        value[i] = mill_spectrum_quantile(&tally->grid, spectrum, slot, mill_tally_level[i]);
    numbers(json, name, MILL_TALLY_LEVELS, value);
}

static void speed(struct json *json, const char *name, const struct mill_tally *tally,
                  const struct mill_spectrum *spectrum, const struct mill_spectrum *fast, int slot)
{
    open_group(json, name);
    number(json, "mean", mill_spectrum_mean(spectrum));
    number(json, "median", mill_spectrum_quantile(&tally->grid, spectrum, 0, 0.5));
    number(json, "median_above_50mm_s", mill_spectrum_quantile(&tally->grid, fast, slot, 0.5));
    quantiles(json, "quantiles", tally, spectrum, 0);
    quantiles(json, "quantiles_above_50mm_s", tally, fast, slot);
    close_group(json);
}

static void rows(struct json *json, const char *name, const struct mill_tally *tally,
                 const struct mill_speeds speeds[MILL_TALLY_ROWS])
{
    struct mill_spectrum tangential;
    open_group(json, name);
    for (int row = 0; row < MILL_TALLY_ROWS; row++) {
        const struct mill_spectrum *normal = &speeds[row].normal;
        const uint64_t count = mill_spectrum_count(normal, 0);
        const double loss = mill_spectrum_dissipation(normal, 0);
        mill_tally_tangential(&speeds[row], &tangential);
        open_group(json, mill_tally_name(row));
        whole(json, "count", count);
        number(json, "rate", mill_tally_per_second(tally, (double)count));
        number(json, "dissipated_power", mill_tally_per_second(tally, loss));
        speed(json, "normal_speed", tally, normal, normal, MILL_SPECTRUM_FAST);
        speed(json, "tangential_speed", tally, &tangential, &speeds[row].tangential[1], 0);
        close_group(json);
    }
    close_group(json);
}

static void mean(struct json *json, const char *name, double value, double error)
{
    open_group(json, name);
    number(json, "value", value);
    number(json, "standard_error", error);
    close_group(json);
}

static void precision(struct json *json, const struct mill_tally *tally)
{
    const struct mill_precision_known *known = &tally->at.known;
    const struct mill_spectrum *all = &tally->impacts[MILL_TALLY_ALL].normal;
    open_group(json, "precision");
    mean(json, "median_above_50mm_s",
         mill_spectrum_quantile(&tally->grid, all, MILL_SPECTRUM_FAST, 0.5), known->median.error);
    mean(json, "rotor_power", mill_tally_power(tally), known->power.error);
    number(json, "asked", tally->precision);
    number(json, "warm_up", tally->at.begin);
    number(json, "batch", tally->batches.at.batch);
    whole(json, "batches", known->batches);
    whole(json, "settled", tally->at.settled);
    whole(json, "reached", mill_tally_reached(tally));
    close_group(json);
}

static void statistics(struct json *json, const struct mill_tally *tally)
{
    const struct mill_rotorstat *stat = &tally->rotor;
    open_group(json, "statistics");
    number(json, "duration", tally->at.duration);
    numbers(json, "quantile_levels", MILL_TALLY_LEVELS, mill_tally_level);
    rows(json, "impacts", tally, tally->impacts);
    rows(json, "strikes", tally, tally->strikes);
    open_group(json, "floor_share");
    for (int row = 0; row < MILL_TALLY_ROWS; row++)
        number(json, mill_tally_name(row), mill_tally_floor_share(tally, row));
    close_group(json);
    open_group(json, "rotor");
    number(json, "power", mill_tally_power(tally));
    number(json, "power_error", mill_rotorstat_error(stat->power, stat->blocks));
    number(json, "torque", mill_tally_torque(tally));
    number(json, "torque_error", mill_rotorstat_error(stat->torque, stat->blocks));
    whole(json, "blocks", stat->blocks);
    number(json, "block_revolutions", stat->revolutions);
    number(json, "block_duration", stat->block);
    close_group(json);
    if (tally->precision > 0)
        precision(json, tally);
    close_group(json);
}

static void by_kind(struct json *json, const char *name, const uint64_t count[MILL_KINDS])
{
    open_group(json, name);
    for (int kind = 0; kind < MILL_KINDS; kind++)
        whole(json, mill_kind_name[kind], count[kind]);
    close_group(json);
}

static void run(struct json *json, const struct mill_world *world, const struct mill_tally *tally,
                const struct mill_summary_facts *facts)
{
    const char *by = mill_tally_ended_by(tally);
    const struct mill_summary_totals totals = mill_summary_add(world, facts);
    const double contacts = (double)totals.contacts;
    open_group(json, "run");
    if (by)
        text(json, "ended_by", facts->stopped ? "none" : by);
    by_kind(json, "collisions", world->account.collisions);
    by_kind(json, "floored", world->account.floored);
    number(json, "kinetic_energy", totals.energy.kinetic);
    number(json, "rotational_energy", totals.energy.rotational);
    number(json, "potential_energy", totals.energy.potential);
    number(json, "rotor_work", world->account.rotor_work);
    number(json, "dissipation", totals.dissipation);
    number(json, "energy_balance_error",
           totals.turnover > 0 ? totals.balance_error / totals.turnover : 0);
    number(json, "energy_turnover", totals.turnover);
    whole(json, "not_closing", world->counts.not_closing);
    whole(json, "reliefs", world->counts.reliefs);
    whole(json, "smoothed", world->counts.smoothed);
    whole(json, "overlaps", world->counts.overlaps);
    number(json, "largest_overlap", world->counts.largest_overlap);
    number(json, "wall_time", facts->wall);
    number(json, "cpu_time", facts->cpu);
    number(json, "peak_memory", facts->peak_memory);
    number(json, "contacts_per_cpu_second", facts->cpu > 0 ? contacts / facts->cpu : (double)NAN);
    number(json, "simulated_per_wall_second",
           facts->wall > 0 ? facts->time_reached / facts->wall : (double)NAN);
    close_group(json);
}

void mill_summary_json(FILE *out, const struct mill_deck *deck, const struct mill_world *world,
                       const struct mill_tally *tally, const struct mill_summary_facts *facts)
{
    struct json json = {out, true, 1};
    char note[MILL_SUMMARY_NOTES][MILL_SUMMARY_NOTE];
    const int notes = mill_summary_notes(deck, world, tally, facts, note);
    fputc('{', out);
    text(&json, "version", facts->version);
    text(&json, "deck", facts->deck);
    text(&json, "output", facts->output);
    next(&json, "stopped");
    fprintf(out, facts->stopped ? "true" : "false");
    number(&json, "time", facts->time_reached);
    number(&json, "sample_from", tally->at.begin);
    run(&json, world, tally, facts);
    statistics(&json, tally);
    next(&json, "notes");
    fputc('[', out);
    json.first = true;
    json.depth++;
    for (int i = 0; i < notes; i++) {
        next(&json, NULL);
        text_value(&json, note[i]);
    }
    fprintf(out, "]\n}\n");
}
