/* Writes the statistics. One function writes each group; each number has its unit and meaning. */
#include "observe/sink.h"
#include "observe/tally.h"

#include <math.h>

/* Levels of the quantiles */
static const double level[] = {0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 0.999};
enum { LEVELS = sizeof level / sizeof *level, MEDIAN = 4 };

static void tell_histogram(struct mill_sink *sink, const struct mill_spectrum_grid *grid,
                           const struct mill_spectrum *spectrum)
{
    const struct mill_spectrum_slot *below = &spectrum->slot[0];
    const struct mill_spectrum_slot *beyond = &spectrum->slot[MILL_SPECTRUM_BINS + 1];
    const size_t n = MILL_SPECTRUM_BINS;
    uint64_t count[MILL_SPECTRUM_BINS];
    double dissipation[MILL_SPECTRUM_BINS];
    for (int i = 0; i < MILL_SPECTRUM_BINS; i++) {
        count[i] = spectrum->slot[i + 1].count;
        dissipation[i] = spectrum->slot[i + 1].dissipation;
    }
    sink->open(sink, "histogram");
    sink->again(sink, "edges", n + 1, grid->edge, "m s-1",
                "edges of the bins, 20^(k/152) m/s with k = -760..380; bin i is edges[i] <= v < "
                "edges[i+1]");
    sink->values(sink, "count", MILL_H5_U64, 1, &n, count, "1",
                 "how many fell into each bin; attributes underflow (zero included) and overflow: "
                 "how many lay outside");
    sink->attribute(sink, "underflow", MILL_H5_U64, 0, &below->count);
    sink->attribute(sink, "overflow", MILL_H5_U64, 0, &beyond->count);
    mill_tell_array(sink, "dissipation", n, dissipation, "J",
                    "energy dissipated by those of each bin; attributes underflow and overflow: by "
                    "those outside");
    sink->attribute(sink, "underflow", MILL_H5_F64, 0, &below->dissipation);
    sink->attribute(sink, "overflow", MILL_H5_F64, 0, &beyond->dissipation);
    mill_tell_part(sink);
    sink->close(sink);
}

/* spectrum: all impacts; fast: those with v_n >= 0.05 m/s, in the slots from `slot` up */
static void tell_speed(struct mill_sink *sink, const char *name,
                       const struct mill_spectrum_grid *grid, const struct mill_spectrum *spectrum,
                       const struct mill_spectrum *fast, int slot)
{
    double all[LEVELS], above[LEVELS];
    for (int i = 0; i < LEVELS; i++) {
        all[i] = mill_spectrum_quantile(grid, spectrum, 0, level[i]);
        above[i] = mill_spectrum_quantile(grid, fast, slot, level[i]);
    }
    sink->open(sink, name);
    mill_tell_number(sink, "mean", mill_spectrum_mean(spectrum), "m s-1",
                     "mean, from the speeds themselves; NaN without impacts");
    mill_tell_number(sink, "median", all[MEDIAN], "m s-1",
                     "median, log-linear within its bin; NaN without impacts");
    mill_tell_number(sink, "median_above_50mm_s", above[MEDIAN], "m s-1",
                     "median over the impacts whose normal speed is 0.05 m/s or more");
    mill_tell_array(sink, "quantiles", LEVELS, all, "m s-1",
                    "quantiles at the attribute levels, log-linear within their bins");
    if (sink->full)
        sink->attribute(sink, "levels", MILL_H5_F64, LEVELS, level);
    mill_tell_array(sink, "quantiles_above_50mm_s", LEVELS, above, "m s-1",
                    "quantiles over the impacts whose normal speed is 0.05 m/s or more");
    if (sink->full) {
        sink->attribute(sink, "levels", MILL_H5_F64, LEVELS, level);
        tell_histogram(sink, grid, spectrum);
    }
    sink->close(sink);
}

/* [W] Power lost in the impacts of a row. If only a part of each loss is known, the account gives
 * the total loss of impacts; for strikes it cannot. */
static void tell_power(struct mill_sink *sink, const struct mill_tally_results *r,
                       const struct mill_speeds *speeds, int row, double dissipation)
{
    const bool whole = sink->part && speeds == r->impacts;
    for (int kind = 0; whole && kind < r->all; kind++) {
        dissipation = kind == 0 ? 0 : dissipation;
        if (row == kind || row == r->all)
            dissipation += r->at.at_end.dissipation[kind] - r->at.at_begin.dissipation[kind];
    }
    mill_tell_number(sink, "dissipated_power", mill_tally_per_second(r, dissipation), "W",
                     "energy dissipated / duration");
    if (!whole)
        mill_tell_part(sink);
}

static void tell_rows(struct mill_sink *sink, const char *name, const struct mill_tally_results *r,
                      const struct mill_speeds *speeds)
{
    const struct mill_spectrum_grid *grid = &r->tally->grid;
    sink->open(sink, name);
    for (int row = 0; row <= r->all; row++) {
        const struct mill_spectrum *normal = &speeds[row].normal;
        const struct mill_spectrum_slot all = mill_spectrum_total(normal, 0);
        sink->open(sink, mill_tally_name(r, row));
        mill_tell_count(sink, "count", all.count, "how many within the duration");
        mill_tell_number(sink, "rate", mill_tally_per_second(r, (double)all.count), "s-1",
                         "count / duration");
        tell_power(sink, r, speeds, row, all.dissipation);
        tell_speed(sink, "normal_speed", grid, normal, normal, MILL_SPECTRUM_FAST);
        tell_speed(sink, "tangential_speed", grid, &speeds[row].tangential[0],
                   &speeds[row].tangential[1], 0);
        sink->close(sink);
    }
    sink->close(sink);
}

static const char error[] = "its standard error, the same as in precision";

/* If there are other motions too, it is not known which of them pressed the balls. */
static void tell_rotor(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const bool alone = r->world->motions == 1 && r->world->rotor == 0;
    const double pinched = r->world->rotor < 0 ? 0 * r->pinch_power : (double)NAN;
    sink->open(sink, "rotor");
    const struct mill_precision_mean *power = &r->at.known.power, *torque = &r->at.known.torque;
    mill_tell_number(sink, "power", power->value, "W", "work of the rotor on the balls / duration");
    mill_tell_number(sink, "power_error", power->error, "W", error);
    mill_tell_number(sink, "pinch_power", alone ? r->pinch_power : pinched, "W",
                     "of it: work on balls pressed between a blade and others / duration; NaN: not "
                     "known, as other motions press balls too");
    mill_tell_number(sink, "torque", torque->value, "N m",
                     "mean torque of the rotor on the balls about +x");
    mill_tell_number(sink, "torque_error", torque->error, "N m", error);
    mill_tell_count(sink, "blocks", r->blocks, "whole blocks within the duration");
    mill_tell_number(sink, "block_revolutions", r->revolutions, "1",
                     "revolutions of the rotor in a block");
    mill_tell_number(sink, "block_duration", r->block, "s",
                     "length of a block, whole periods of all motions; NaN where no rotor turns");
    if (sink->full) {
        mill_tell_array(sink, "block_power", r->blocks, r->block_power, "W",
                        "mean power of each block");
        mill_tell_array(sink, "block_torque", r->blocks, r->block_torque, "N m",
                        "mean torque of each block");
    }
    sink->close(sink);
}

/* Writes the results of each motion, and of all together. */
static void tell_motions(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const struct mill_precision_known *known = &r->at.known;
    sink->open(sink, "motions");
    for (int k = 0; k < r->world->motions; k++) {
        const struct mill_precision_mean *power = &known->motion_power[k];
        const struct mill_precision_mean *torque = &known->motion_torque[k];
        sink->open(sink, r->world->motion_name[k]);
        mill_tell_number(sink, "power", power->value, "W",
                         "work on the balls by this motion's own velocity / duration");
        mill_tell_number(sink, "power_error", power->error, "W",
                         "its standard error, from batches of the motions' period");
        mill_tell_number(sink, "torque", torque->value, "N m",
                         "mean torque on the balls about the motion's own axis; NaN: it has none");
        mill_tell_number(sink, "torque_error", torque->error, "N m",
                         "its standard error, from batches of the motions' period");
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

/* Writes `count` means as a group of arrays; count 0: a single one, as numbers. */
static void tell_means(struct mill_sink *sink, const char *name, size_t count,
                       const struct mill_precision_mean *mean, const char *unit,
                       const char *meaning)
{
    double value[3][MILL_WORLD_FAST];
    const int rank = count > 0;
    for (size_t i = 0; i < (count > 0 ? count : 1); i++) {
        value[0][i] = mean[i].value;
        value[1][i] = mean[i].error;
        value[2][i] = mean[i].freedom;
    }
    sink->open(sink, name);
    sink->values(sink, "value", MILL_H5_F64, rank, &count, value[0], unit, meaning);
    if (rank > 0 && sink->full)
        sink->attribute(sink, "thresholds", MILL_H5_F64, MILL_WORLD_FAST, mill_world_fast);
    sink->values(sink, "standard_error", MILL_H5_F64, rank, &count, value[1], unit,
                 "its standard error, from batches and their memory, widened by Student's t: value "
                 "+- 1.96 times this is the 95 % interval; NaN: too few batches");
    sink->values(sink, "degrees_of_freedom", MILL_H5_F64, rank, &count, value[2], "1",
                 "of the standard error, for which it is widened; 0: none");
    sink->close(sink);
}

static void tell_asked(struct mill_sink *sink, const struct mill_tally_results *r)
{
    mill_tell_number(sink, "asked", r->tally->precision, "1", "run.precision");
    mill_tell_number(sink, "warm_up", r->begin, "s",
                     "time before the window, cut off: by MSER-5, or given as run.sample_from");
    mill_tell_count(sink, "settled", r->at.settled,
                    "1: the start-up is over; 0: the best cut might lie in the second half of the "
                    "run, or the run is too short to tell");
    mill_tell_count(sink, "reached", r->reached,
                    "1: settled, and the standard errors of median_above_50mm_s and drive_power "
                    "are at most `asked` times their values (the power's only if the motions do "
                    "any work)");
}

static void tell_precision(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const struct mill_precision_known *known = &r->at.known;
    sink->open(sink, "precision");
    tell_means(sink, "median", 0, &known->median, "m s-1", "median normal speed of all impacts");
    tell_means(sink, "median_above_50mm_s", 0, &known->median_fast, "m s-1",
               "median normal speed of all impacts at 0.05 m/s or more");
    tell_means(sink, "drive_power", 0, &known->drive, "W",
               "mean power of all motions on the balls");
    tell_means(sink, "rotor_power", 0, &known->power, "W", "mean power of the rotor on the balls");
    tell_means(sink, "rotor_torque", 0, &known->torque, "N m",
               "mean torque of the rotor on the balls about +x");
    sink->open(sink, "rate");
    for (int row = 0; row <= r->all; row++)
        tell_means(sink, mill_tally_name(r, row), 0, &known->rate[row], "s-1",
                   "impacts per second");
    sink->close(sink);
    sink->open(sink, "fast_rate");
    for (int row = 0; row <= r->all; row++)
        tell_means(sink, mill_tally_name(r, row), MILL_WORLD_FAST, known->fast[row], "s-1",
                   "impacts per second with a normal speed at or above each of the attribute "
                   "thresholds [m/s]");
    sink->close(sink);
    tell_means(sink, "rate_above_1mJ", 0, &r->hard, "s-1",
               "impacts per second with a normal energy, m* v_n^2 / 2, of 1 mJ or more");
    tell_means(sink, "above_1mJ_per_joule", 0, &r->hard_per_joule, "J-1",
               "these impacts per work of all motions; its relative error is that of these impacts "
               "per power lost in impacts");
    static const struct {
        const char *name, *meaning;
    } losses[] = {{"dissipated_power", "power lost in impacts"},
                  {"dissipated_power_normal", "its normal part"}};
    for (size_t i = 0; i < 2; i++) {
        sink->open(sink, losses[i].name);
        for (int row = 0; row <= r->all; row++)
            tell_means(sink, mill_tally_name(r, row), 0,
                       i == 0 ? &known->loss[row] : &known->loss_normal[row], "W",
                       losses[i].meaning);
        sink->close(sink);
    }
    mill_tell_number(sink, "batch", r->tally->batches.at.batch, "s", "length of a batch");
    mill_tell_count(sink, "batches", known->batches, "whole batches within the window");
    if (r->tally->precision > 0)
        tell_asked(sink, r);
    sink->close(sink);
}

void mill_tally_results_tell(const struct mill_tally_results *r, struct mill_sink *sink)
{
    sink->open(sink, "statistics");
    mill_tell_number(sink, "duration", r->duration, "s",
                     r->tally->search ? "length of the window that the statistics cover: from the "
                                        "end of the start-up to the end"
                                      : "length of the window that the statistics cover: from "
                                        "run.sample_from to the end");
    if (!sink->full)
        mill_tell_array(sink, "quantile_levels", LEVELS, level, "1", "levels of the quantiles");
    tell_rows(sink, "impacts", r, r->impacts);
    tell_rows(sink, "strikes", r, r->strikes);
    sink->open(sink, "floor_share");
    for (int row = 0; row <= r->all; row++)
        mill_tell_number(sink, mill_tally_name(r, row),
                         sink->part ? (double)NAN : r->floor_share[row], "1",
                         "share of the impacts at which the rebound floor acted; NaN without "
                         "impacts");
    sink->close(sink);
    if (sink->full) {
        sink->open(sink, "energies");
        mill_energies_tell(&r->energies, &r->world->kinds, sink);
        mill_energies_blocks_tell(&r->tally->blocks, &r->energies, &r->world->kinds, r->from,
                                  r->tally->batches.at.period, r->tally->batches.at.batch, sink);
        sink->close(sink);
        mill_maps_tell(&r->maps, sink);
        if (!sink->part) /* another program's run: the surfaces that balls met are not known */
            mill_wear_tell(&r->wear, r->duration, r->tally->law, sink);
    }
    tell_rotor(sink, r);
    tell_motions(sink, r);
    tell_precision(sink, r);
    sink->close(sink);
}
