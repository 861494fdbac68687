/* Writes the statistics. One function writes each group; each number has its unit and meaning. */
#include "observe/sink.h"
#include "observe/tally.h"

#include <stdio.h>

#define SPEED(member, n) MILL_H5_F64, offsetof(struct mill_tally_speed, member), n, sizeof(double)

static const struct mill_sum speed_of[] = {
    {"mean", "m s-1", "mean, from the speeds themselves; NaN without impacts", SPEED(mean, 0)},
    {"median", "m s-1", "median, log-linear within its bin; NaN without impacts", SPEED(median, 0)},
    {"median_above_floor", "m s-1", "median over the impacts from statistics/above_floor on",
     SPEED(median_fast, 0)},
    {"quantiles", "m s-1", "quantiles at the attribute levels, log-linear within their bins",
     SPEED(quantile, MILL_TALLY_LEVELS)},
    {"quantiles_above_floor", "m s-1", "quantiles over the impacts from statistics/above_floor on",
     SPEED(quantile_fast, MILL_TALLY_LEVELS)}};
static const struct mill_sums_list list = {"speed", sizeof(struct mill_tally_speed), 5, speed_of};

/* Writes number k of the spectrum with what is outside of the bins as attributes. */
static void tell_bins(struct mill_sink *sink, const struct mill_spectrum *spectrum, int k)
{
    const struct mill_sums sums = {&mill_spectrum_sums, 1, (void *)spectrum};
    const struct mill_sums_view bins = {.first = 1, .n = MILL_SPECTRUM_BINS};
    const struct mill_sum *sum = &mill_spectrum_sums.sum[k];
    const char *below = (const char *)spectrum + sum->at;
    mill_sums_tell(&sums, k, &bins, sink);
    sink->attribute(sink, "underflow", sum->type, 0, below);
    sink->attribute(sink, "overflow", sum->type, 0, below + (MILL_SPECTRUM_SLOTS - 1) * sum->step);
}

static void tell_speed(struct mill_sink *sink, const char *name,
                       const struct mill_spectrum_grid *grid, const struct mill_tally_speed *speed,
                       const struct mill_spectrum *spectrum)
{
    const struct mill_sums sums = {&list, 1, (void *)speed};
    sink->open(sink, name);
    for (int k = 0; k < list.count; k++) {
        mill_sums_tell(&sums, k, &(struct mill_sums_view){0}, sink);
        if (sink->full && speed_of[k].n > 0)
            sink->attribute(sink, "levels", MILL_H5_F64, MILL_TALLY_LEVELS, mill_tally_level);
    }
    if (sink->full) {
        sink->open(sink, "histogram");
        sink->again(sink, "edges", MILL_SPECTRUM_BINS + 1, grid->edge, "m s-1",
                    "edges of the bins, 20^(k/152) m/s with k = -760..380; bin i is edges[i] <= v "
                    "< edges[i+1]");
        tell_bins(sink, spectrum, MILL_SPECTRUM_COUNT);
        tell_bins(sink, spectrum, MILL_SPECTRUM_DISSIPATION);
        mill_tell_part(sink);
        sink->close(sink);
    }
    sink->close(sink);
}

static void tell_rows(struct mill_sink *sink, const char *name, const struct mill_tally_results *r,
                      const struct mill_speeds *speeds, const struct mill_tally_row *rows)
{
    const struct mill_spectrum_grid *grid = &r->tally->grid;
    /* if only a part of each loss is known, the account gives all of it, but not for strikes */
    const bool whole = sink->part && rows == r->impacts;
    sink->open(sink, name);
    for (int n = 0; n <= r->kinds.count; n++) {
        const int kind = r->kinds.kind[n];
        const struct mill_tally_row *row = &rows[kind];
        sink->open(sink, r->kinds.name[n]);
        mill_tell_count(sink, "count", row->count, "how many within the duration");
        mill_tell_number(sink, "rate", row->rate, "s-1", "count / duration");
        mill_tell_number(sink, "dissipated_power",
                         whole ? r->at.known.loss[kind].value : row->power, "W",
                         "energy dissipated / duration");
        if (!whole)
            mill_tell_part(sink);
        tell_speed(sink, "normal_speed", grid, &row->normal, &speeds[kind].normal);
        tell_speed(sink, "tangential_speed", grid, &row->tangential, &speeds[kind].tangential[0]);
        sink->close(sink);
    }
    sink->close(sink);
}

static const char error[] = "its standard error, the same as in precision";

/* Writes power and torque of a motion with their errors. rotor: in the words for a rotor */
static void tell_motion(struct mill_sink *to, const struct mill_precision_known *is, int k,
                        bool rotor)
{
    static const char *const of_rotor[2] = {"work of the rotor on the balls / duration",
                                            "mean torque of the rotor on the balls about +x"};
    for (int i = 0; i < 2; i++) {
        const struct mill_precision_rate *of = &mill_precision_rates[MILL_PRECISION_POWER + i];
        const struct mill_spread_mean *mean = mill_precision_of(is, of, k);
        char name[32];
        snprintf(name, sizeof name, "%s_error", of->name);
        mill_tell_number(to, of->name, mean->value, of->unit, rotor ? of_rotor[i] : of->meaning);
        mill_tell_number(to, name, mean->error, of->unit, error);
    }
}

/* Writes the results of a rotor, of each motion, and of all together. */
static void tell_motions(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const struct mill_precision_known *known = &r->at.known;
    if (r->world->rotor >= 0) {
        sink->open(sink, "rotor");
        tell_motion(sink, known, r->world->rotor, true);
        mill_tell_number(sink, "pinch_power", r->world->motions == 1 ? r->pinch_power : (double)NAN,
                         "W",
                         "of it: work on balls pressed between a blade and others / duration; NaN: "
                         "not known, as other motions press balls too");
        sink->close(sink);
    }
    sink->open(sink, "motions");
    for (int k = 0; k < r->world->motions; k++) {
        sink->open(sink, r->world->motion_name[k]);
        tell_motion(sink, known, k, false);
        sink->close(sink);
    }
    sink->close(sink);
    sink->open(sink, "drive");
    mill_tell_number(sink, "power", known->drive.value, "W",
                     "work of all motions on the balls / duration");
    mill_tell_number(sink, "power_error", known->drive.error, "W", error);
    mill_tell_number(sink, "pinch_power", r->pinch_power, "W",
                     "of it: work on balls pressed between moving bodies and others / duration");
    sink->close(sink);
}

/* Writes means as a group of arrays; a single one as numbers. */
static void tell_means(struct mill_sink *sink, const char *name,
                       const struct mill_spread_mean *mean, size_t count, const char *unit,
                       const char *meaning)
{
    double value[3][MILL_WORLD_FAST];
    const int rank = count > 1;
    for (size_t i = 0; i < count; i++) {
        value[0][i] = mean[i].value;
        value[1][i] = mean[i].error;
        value[2][i] = mean[i].freedom;
    }
    sink->open(sink, name);
    sink->values(sink, "value", MILL_H5_F64, rank, &count, value[0], unit, meaning);
    if (rank > 0 && sink->full)
        sink->attribute(sink, "thresholds", MILL_H5_F64, MILL_WORLD_FAST, mill_world_fast);
    sink->values(sink, "standard_error", MILL_H5_F64, rank, &count, value[1], unit,
                 "its standard error, from the scatter of the starts (of fewer than four: of eight "
                 "pieces of each), widened by Student's t: value +- 1.96 times this is the "
                 "95 % interval; NaN: not known");
    sink->values(sink, "degrees_of_freedom", MILL_H5_F64, rank, &count, value[2], "1",
                 "of the standard error, for which it is widened; 0: none");
    sink->close(sink);
}

/* Writes a row of a rate. */
typedef void tell_row(struct mill_sink *sink, const struct mill_tally_results *r, const char *name,
                      const struct mill_precision_rate *rate, int row);

static void tell_mean(struct mill_sink *sink, const struct mill_tally_results *r, const char *name,
                      const struct mill_precision_rate *rate, int row)
{
    tell_means(sink, name, mill_precision_of(&r->at.known, rate, row), rate->width, rate->unit,
               rate->meaning);
}

/* Writes a rate: of the mill, of each motion, or of each kind and of all together. */
static void tell_rate(struct mill_sink *sink, const struct mill_tally_results *r, int which,
                      tell_row *tell)
{
    const struct mill_precision_rate *rate = &mill_precision_rates[which];
    const bool one = rate->each == MILL_PRECISION_ONE, kinds = rate->each == MILL_PRECISION_KIND;
    if (!one)
        sink->open(sink, rate->name);
    for (int n = 0; n < (one ? 1 : kinds ? r->kinds.count + 1 : r->world->motions); n++)
        tell(sink, r,
             one     ? rate->name
             : kinds ? r->kinds.name[n]
                     : r->world->motion_name[n],
             rate, kinds ? r->kinds.kind[n] : n);
    if (!one)
        sink->close(sink);
}

static void tell_precision(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const struct mill_precision_known *known = &r->at.known;
    const int rotor = r->world->rotor;
    const double asked = r->tally->asked.precision;
    static const char *const doubt[] = {
        [MILL_TALLY_KNOWN] = "none",
        [MILL_TALLY_ONE_START] = "one start",
        [MILL_TALLY_FIRST_OF_ALL] = "one start",
        [MILL_TALLY_FEW_STARTS] = "few starts",
        [MILL_TALLY_DRIFTS] = "not settled",
    };
    sink->open(sink, "precision");
    mill_tell_text(sink, "doubt", doubt[r->doubt],
                   "why no errors are given: none; one start, whose errors would be wrong; few "
                   "starts; not settled: the starts drift");
    tell_means(sink, "median", &known->median, 1, "m s-1", "median normal speed of all impacts");
    tell_means(sink, "median_above_floor", &known->median_fast, 1, "m s-1",
               "median normal speed of the impacts from above_floor on");
    tell_rate(sink, r, MILL_PRECISION_DRIVE, tell_mean);
    if (rotor >= 0) {
        tell_means(sink, "rotor_power", &known->motion_power[rotor], 1, "W",
                   "mean power of the rotor on the balls");
        tell_means(sink, "rotor_torque", &known->motion_torque[rotor], 1, "N m",
                   "mean torque of the rotor on the balls about +x");
    }
    for (int which = MILL_PRECISION_RATE; which < MILL_PRECISION_RATES; which++)
        tell_rate(sink, r, which, tell_mean);
    tell_means(sink, "hard_rate", &r->hard, 1, "s-1",
               "impacts per second of /statistics/hard_energy or more");
    tell_means(sink, "hard_per_joule", &r->hard_per_joule, 1, "J-1",
               "these impacts per work of all motions; its relative error is that of these impacts "
               "per power lost in impacts");
    mill_tell_number(sink, "batch", r->tally->batches.at.batch, "s", "length of a batch");
    mill_tell_count(sink, "batches", known->batches, "whole batches within the window");
    if (asked > 0 || r->tally->search) {
        mill_tell_number(sink, "warm_up", r->begin, "s",
                         "time before the window, cut off: by MSER-5, or given as run.sample_from");
        mill_tell_count(sink, "settled", r->at.settled,
                        "1: the start-up is over; 0: the best cut might lie in the second half of "
                        "the run, or the run is too short to tell");
    }
    if (asked > 0) {
        mill_tell_number(sink, "asked", asked, "1", "run.precision");
        mill_tell_count(sink, "reached", r->reached,
                        "1: settled, and the standard errors of median_above_floor and drive_power "
                        "are at most `asked` times their values (the power's only if the motions "
                        "do any work, the median's unless it is of rare slips)");
    }
    sink->close(sink);
}

/* Writes the charge of a mill that tumbles. */
static void tell_charge(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const struct mill_charge *c = &r->tally->charge;
    const struct mill_charge_sum *sum = &r->charge_sum;
    const struct mill_sums hits = {&mill_charge_hits, MILL_CHARGE_ANGLES, (void *)sum->hit};
    sink->open(sink, "charge");
    for (int i = 0; i < MILL_CHARGE_NUMBERS; i++)
        tell_means(sink, mill_charge_words[i][0], &r->charge[i], 1, mill_charge_words[i][1],
                   mill_charge_words[i][2]);
    mill_tell_number(sink, "layer", c->inner, "m",
                     "from here on, from the axis, balls are in the layer at the wall");
    mill_tell_array(sink, "occupancy", MILL_CHARGE_ANGLES, sum->layer, "kg",
                    "mass in this layer, of all samples, in bins of 2 degrees from -180 degrees "
                    "on");
    double edges[MILL_CHARGE_SIZES + 1];
    for (int k = 0; k <= MILL_CHARGE_SIZES; k++)
        edges[k] = ldexp(c->unit * (k % 2 ? sqrt(2) : 1), k / 2);
    const size_t dims[2] = {MILL_CHARGE_WIDE, MILL_CHARGE_SIZES};
    sink->open(sink, "liner");
    mill_sums_tell_all(&hits, sink);
    mill_tell_number(sink, "duration", sum->samples * (double)c->every * c->interval, "s",
                     "of these sums");
    mill_tell_array(sink, "edges", MILL_CHARGE_SIZES + 1, edges, "N s", "sizes of impacts");
    sink->values(sink, "sizes", MILL_H5_F64, 2, dims, sum->sizes, "N s",
                 "impulse on lifters by the size of the impact, in bins of 10 degrees");
    sink->close(sink);
    sink->close(sink);
}

/* Writes the numbers of the first start's charge over time, of whole periods. */
static void tell_charge_series(struct mill_sink *sink, const struct mill_tally *t)
{
    const uint64_t length = t->blocks.length, period = t->batches.at.period;
    const uint64_t many = period > length ? period / length : 1;
    const size_t rows = t->blocks.blocks / many;
    double now[MILL_CHARGE_NUMBERS], value[MILL_ENERGIES_BLOCKS], time[MILL_ENERGIES_BLOCKS];
    uint64_t step[MILL_ENERGIES_BLOCKS];
    sink->open(sink, "observables/charge"); /* two groups */
    for (int i = 0; i < MILL_CHARGE_NUMBERS; i++) {
        const char *const *word = mill_charge_words[i];
        for (size_t k = 0; k < rows; k++) {
            struct mill_charge_sum sum = {0};
            mill_charge_estimate(&t->charge, k * many, (k + 1) * many, &sum, now);
            value[k] = now[i];
            step[k] = (k + 1) * many * length;
            time[k] = t->batches.origin + (double)step[k] * t->batches.at.batch;
        }
        sink->open(sink, word[0]);
        sink->values(sink, "step", MILL_H5_U64, 1, &rows, step, "1", "batches since the first");
        mill_tell_array(sink, "time", rows, time, "s", "end of the time that the value is of");
        mill_tell_array(sink, "value", rows, value, word[1], word[2]);
        sink->close(sink);
    }
    sink->close(sink);
    sink->close(sink);
}

/* ---- the starts ---- */

static void tell_each(struct mill_sink *sink, const struct mill_tally_results *r, const char *name,
                      const struct mill_precision_rate *rate, int row)
{
    const struct mill_tally *t = r->tally;
    const size_t dims[2] = {(size_t)t->starts, rate->width};
    double value[MILL_PRECISION_STARTS * MILL_WORLD_FAST];
    for (size_t i = 0; i < dims[0] * rate->width; i++)
        value[i] = mill_precision_one(&t->start[i / rate->width]->batches, r->from,
                                      t->batches.at.batches, rate, row, i % rate->width);
    sink->values(sink, name, MILL_H5_F64, rate->width > 1 ? 2 : 1, dims, value, rate->unit,
                 rate->meaning);
    if (rate->width > 1)
        sink->attribute(sink, "thresholds", MILL_H5_F64, MILL_WORLD_FAST, mill_world_fast);
}

/* Mean energies of each start in its window, and its impacts by speed */
static void tell_gathered(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const size_t n = (size_t)r->tally->starts, dims[2] = {n, MILL_SPECTRUM_SLOTS};
    uint64_t seed[MILL_PRECISION_STARTS];
    uint64_t *speeds = mill_sink_room(sink, n * MILL_SPECTRUM_SLOTS, sizeof *speeds);
    double kinetic[MILL_PRECISION_STARTS], rotational[MILL_PRECISION_STARTS];
    for (size_t k = 0; speeds && k < n; k++) {
        const struct mill_tally *t = r->tally->start[k];
        const uint64_t portions = t->search ? t->at.portions : 0;
        struct mill_gathered_counts sum = *t->gathered.counts;
        for (uint64_t i = portions > 0 ? r->from / t->at.length : 0; i < portions; i++)
            mill_sums_add_records(r->sums.part[MILL_GATHERED_COUNTS].list, 1, &sum,
                                  t->portion[i].counts);
        seed[k] = t->seed;
        kinetic[k] = sum.kinetic / (double)sum.samples;
        rotational[k] = sum.rotational / (double)sum.samples;
        for (uint64_t b = r->from; b < t->batches.at.batches; b++)
            for (int i = 0; i < MILL_SPECTRUM_SLOTS; i++)
                speeds[k * MILL_SPECTRUM_SLOTS + (size_t)i] += t->batches.counts[b][i];
    }
    if (speeds) {
        sink->values(sink, "seed", MILL_H5_U64, 1, dims, seed, "1", "run.seed of each start");
        mill_tell_array(sink, "kinetic_energy", n, kinetic, "J", "mean over the window");
        mill_tell_array(sink, "rotational_energy", n, rotational, "J", "mean over the window");
        sink->values(sink, "speeds", MILL_H5_U64, 2, dims, speeds, "1",
                     "impacts of all kinds by normal speed: below the edges of a histogram of "
                     "speeds, in its bins, above them");
    }
    free(speeds);
}

/* Writes what errors of any sum or quotient can be computed from again. */
static void tell_starts(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const struct mill_precision *batches = &r->tally->batches;
    if (!sink->full || r->tally->starts < 2 || r->from >= batches->at.batches)
        return;
    sink->open(sink, "starts");
    mill_tell_number(sink, "begin", r->begin, "s", "of the window of each start");
    mill_tell_number(sink, "end", batches->origin + (double)batches->at.batches * batches->at.batch,
                     "s", "of its last whole batch: values of starts are up to here");
    tell_gathered(sink, r);
    for (int which = 0; which < MILL_PRECISION_RATES; which++)
        tell_rate(sink, r, which, tell_each);
    sink->close(sink);
}

void mill_tally_results_tell(const struct mill_tally_results *r, struct mill_sink *sink)
{
    const struct mill_tally *t = r->tally;
    const struct mill_gathered_plan *plan = &t->plan;
    const struct mill_gathered *sums = &r->sums;
    const struct mill_energies_blocks *blocks[MILL_PRECISION_STARTS];
    sink->open(sink, "statistics");
    mill_tell_count(sink, "starts", (uint64_t)t->starts,
                    "starts of the mill that the statistics are of");
    mill_tell_number(sink, "duration", r->duration, "s",
                     t->search ? "length of the window that the statistics cover: from the "
                                 "end of the start-up to the end"
                               : "length of the window that the statistics cover: from "
                                 "run.sample_from to the end");
    mill_tell_number(sink, "above_floor", r->above_floor, "m s-1",
                     "normal speed from which on impacts do not depend on the rebound floor: six "
                     "floors, at least 0.05 m/s");
    mill_tell_number(sink, "strike_window", t->pairs.window, "s",
                     "impacts of a pair within this time are one strike");
    mill_tell_number(sink, "hard_energy", r->is_hard.energy, "J",
                     isnan(t->asked.hard)
                         ? "above it falls half of the energy that impacts lose; such impacts are "
                           "hard"
                         : "impacts of this energy or more are hard");
    mill_tell_text(sink, "hard_by", mill_energies_sums.sum[r->is_hard.sort].name,
                   "which energy of an impact hard_energy is: its histogram in `energies`");
    if (!sink->full)
        mill_tell_array(sink, "quantile_levels", MILL_TALLY_LEVELS, mill_tally_level, "1",
                        "levels of the quantiles");
    tell_rows(sink, "impacts", r, sums->impacts, r->impacts);
    tell_rows(sink, "strikes", r, sums->strikes, r->strikes);
    sink->open(sink, "floor_share");
    for (int n = 0; n <= r->kinds.count; n++)
        mill_tell_number(sink, r->kinds.name[n],
                         sink->part ? (double)NAN : r->floor_share[r->kinds.kind[n]], "1",
                         "share of the impacts at which the rebound floor acted; NaN without "
                         "impacts");
    sink->close(sink);
    if (sink->full) {
        sink->open(sink, "energies");
        mill_energies_tell(&plan->energies, &sums->part[MILL_GATHERED_PAIRS], sink);
        for (int s = 0; s < t->starts; s++)
            blocks[s] = &t->start[s]->blocks;
        mill_energies_blocks_tell(blocks, t->starts, &plan->energies, &t->batches, r->from, sink);
        sink->close(sink);
        mill_maps_tell(&plan->maps, &sums->part[MILL_GATHERED_HITS], sums->flow,
                       sums->counts->samples, sink);
        if (!sink->part) /* another program's run: the surfaces that balls met are not known */
            mill_wear_tell(&plan->wear, sums->wear, sums->along, r->duration, t->asked.wear, sink);
    }
    tell_motions(sink, r);
    tell_precision(sink, r);
    if (t->charge.world)
        tell_charge(sink, r);
    sink->close(sink);
    if (t->charge.world && sink->full)
        tell_charge_series(sink, t);
    tell_starts(sink, r);
}
