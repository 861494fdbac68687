/* What does the window come to, and how is it told? Worked out from what the tally has gathered by
 * now, which stays as it is: a checkpoint may ask in the middle of a run, and the run goes on. One
 * function tells each group of "statistics", each number with its unit and meaning. */
#include "observe/sink.h"
#include "observe/tally.h"

#include <math.h>
#include <stdlib.h>

/* Power and torque by whole revolutions, from the batches since `from`. false: out of memory. */
static bool make_blocks(struct mill_tally_results *r, const struct mill_world *world, uint64_t from)
{
    const struct mill_precision *batches = &r->tally->batches;
    const size_t period = batches->at.period;
    const struct mill_account *account = &batches->accounts[from];
    r->block = period > 0 ? (double)period * batches->at.batch : (double)NAN;
    r->revolutions = period > 0 ? round(r->block * fabs(world->rotor_speed) / (2 * MILL_PI)) : 1;
    r->blocks = period > 0 && r->at.open ? (batches->at.batches - from) / period : 0;
    r->block_power = calloc(r->blocks + 1, sizeof *r->block_power);
    r->block_torque = calloc(r->blocks + 1, sizeof *r->block_torque);
    if (!r->block_power || !r->block_torque)
        return false;
    for (size_t k = 0; k < r->blocks; k++) {
        const struct mill_account *to = account + period;
        r->block_power[k] = (to->work - account->work) / r->block;
        r->block_torque[k] = (to->motion[0].impulse - account->motion[0].impulse) / r->block;
        account = to;
    }
    return true;
}

static void add(struct mill_tally_results *r, const struct mill_gathered *from)
{
    mill_tally_window_add(r->impacts, from->impacts, MILL_KINDS);
    mill_tally_window_add(r->strikes, from->strikes, MILL_KINDS);
    mill_energies_add(&r->energies, &from->energies);
    mill_maps_add(&r->maps, &from->maps);
    r->recontacts += from->recontacts;
}

/* The row of all, and the tangential speeds of all */
static void sum_rows(struct mill_speeds rows[MILL_TALLY_ROWS])
{
    for (int kind = 0; kind < MILL_KINDS; kind++)
        mill_tally_window_add(&rows[MILL_TALLY_ALL], &rows[kind], 1);
    for (int row = 0; row < MILL_TALLY_ROWS; row++)
        mill_spectrum_merge(&rows[row].tangential[0], &rows[row].tangential[1]);
}

/* Values over the whole window */
static void sum_account(struct mill_tally_results *r)
{
    const struct mill_account *from = &r->at.at_begin, *to = &r->at.at_end;
    struct mill_precision_known *known = &r->at.known;
    uint64_t floored[MILL_TALLY_ROWS] = {0}, impacts[MILL_TALLY_ROWS] = {0};
    uint64_t fast[MILL_TALLY_ROWS][MILL_WORLD_FAST] = {{0}};
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        floored[kind] = to->floored[kind] - from->floored[kind];
        impacts[kind] = to->collisions[kind] - from->collisions[kind];
        floored[MILL_TALLY_ALL] += floored[kind];
        impacts[MILL_TALLY_ALL] += impacts[kind];
        for (int i = 0; i < MILL_WORLD_FAST; i++) {
            fast[kind][i] = to->fast[kind][i] - from->fast[kind][i];
            fast[MILL_TALLY_ALL][i] += fast[kind][i];
        }
    }
    for (int row = 0; row < MILL_TALLY_ROWS; row++) {
        r->floor_share[row] =
            impacts[row] > 0 ? (double)floored[row] / (double)impacts[row] : (double)NAN;
        known->rate[row].value = mill_tally_per_second(r, (double)impacts[row]);
        for (int i = 0; i < MILL_WORLD_FAST; i++)
            known->fast[row][i].value = mill_tally_per_second(r, (double)fast[row][i]);
    }
    const double duration = r->duration > 0 ? r->duration : (double)NAN;
    r->pinch_power = (to->pinch_work - from->pinch_work) / duration;
    const struct mill_spectrum_grid *grid = &r->tally->grid;
    const struct mill_spectrum *all = &r->impacts[MILL_TALLY_ALL].normal;
    known->power.value = (to->work - from->work) / duration;
    known->torque.value = (to->motion[0].impulse - from->motion[0].impulse) / duration;
    known->median.value = mill_spectrum_quantile(grid, all, 0, 0.5);
    known->median_fast.value = mill_spectrum_quantile(grid, all, MILL_SPECTRUM_FAST, 0.5);
}

enum mill_status mill_tally_results_make(const struct mill_tally *tally,
                                         const struct mill_world *world, double t,
                                         struct mill_tally_results **out, struct mill_error *error)
{
    struct mill_tally_results *r = *out = calloc(1, sizeof *r);
    if (!r)
        return mill_error_set(error, MILL_FAILED, "out of memory for the results");
    r->tally = tally;
    r->at = tally->at;
    r->begin = tally->begin;
    if (!r->at.closed) {
        r->at.over = world->base + t;
        r->at.at_end = world->account;
    }
    if (!r->at.open)
        r->at.at_begin = r->at.at_end;
    const struct mill_precision *batches = &tally->batches;
    const uint64_t from = r->at.open ? mill_tally_window_find(tally, &r->at) : 0;
    const double asked = tally->precision;
    r->late =
        r->at.open ? batches->accounts[from + 9 * (batches->at.batches - from) / 10] : r->at.at_end;
    if (r->at.open && tally->search) {
        r->begin = batches->origin + (double)from * batches->at.batch;
        r->at.at_begin = batches->accounts[from];
    }
    r->reached = asked > 0 && r->at.settled && mill_precision_reached(&r->at.known, asked);
    r->duration = r->at.open ? fmax(0, r->at.over - r->begin) : 0;
    if (!mill_maps_like(&r->maps, &tally->gathered.maps) ||
        !mill_energies_like(&r->energies, &tally->gathered.energies) ||
        !make_blocks(r, world, from)) {
        mill_tally_results_free(r);
        *out = NULL;
        return mill_error_set(error, MILL_FAILED, "out of memory for the results");
    }
    add(r, &tally->gathered);
    const uint64_t portions = tally->search ? r->at.portions : 0;
    for (uint64_t i = portions > 0 ? from / r->at.length : 0; i < portions; i++)
        add(r, &tally->portion[i]);
    sum_rows(r->impacts);
    sum_rows(r->strikes);
    sum_account(r);
    return MILL_OK;
}

void mill_tally_results_free(struct mill_tally_results *results)
{
    if (!results)
        return;
    mill_maps_free(&results->maps);
    mill_energies_free(&results->energies);
    free(results->block_power);
    free(results->block_torque);
    free(results);
}

/* ---- telling ---- */

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
    sink->close(sink);
}

/* spectrum: all of them; fast: those with v_n >= 0.05 m/s, in the slots from `slot` up */
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

static void tell_rows(struct mill_sink *sink, const char *name, const struct mill_tally_results *r,
                      const struct mill_speeds speeds[MILL_TALLY_ROWS])
{
    const struct mill_spectrum_grid *grid = &r->tally->grid;
    sink->open(sink, name);
    for (int row = 0; row < MILL_TALLY_ROWS; row++) {
        const struct mill_spectrum *normal = &speeds[row].normal;
        const struct mill_spectrum_slot all = mill_spectrum_total(normal, 0);
        sink->open(sink, mill_tally_name(row));
        mill_tell_count(sink, "count", all.count, "how many within the duration");
        mill_tell_number(sink, "rate", mill_tally_per_second(r, (double)all.count), "s-1",
                         "count / duration");
        mill_tell_number(sink, "dissipated_power", mill_tally_per_second(r, all.dissipation), "W",
                         "energy dissipated / duration");
        tell_speed(sink, "normal_speed", grid, normal, normal, MILL_SPECTRUM_FAST);
        tell_speed(sink, "tangential_speed", grid, &speeds[row].tangential[0],
                   &speeds[row].tangential[1], 0);
        sink->close(sink);
    }
    sink->close(sink);
}

/* Of a cell: fields 0 and 1 of the impacts, 2 the solid fraction, 3..5 the mean velocity. room
 * [m^3]: of the cell, times the samples */
static double cell_value(const struct mill_map *map, size_t cell, double room, int field)
{
    const struct mill_map_hits *hits = &map->hits[cell];
    const struct mill_map_flow *flow = &map->flow[cell];
    if (field < 2)
        return field == 0 ? hits->speed : hits->dissipation;
    if (field == 2)
        return room > 0 ? flow->volume / room : (double)NAN;
    return flow->volume > 0 ? flow->flow[field - 3] / flow->volume : (double)NAN;
}

/* edges: names and meanings of those of either axis */
static void tell_map(struct mill_sink *sink, const char *name, const struct mill_map *map,
                     uint64_t samples, const char *const edges[2][2], const char *const velocity[3])
{
    static const char mean[] = "time-averaged velocity of the balls, weighted by their volume in "
                               "the cell; NaN where none ever was";
    const struct {
        const char *name, *unit, *meaning;
    } field[] = {
        {"normal_speed_sum", "m s-1", "sum of the normal speeds of these impacts"},
        {"dissipation", "J", "energy dissipated by these impacts"},
        {"solid_fraction", "1",
         "time-averaged volume of balls / volume of the cell inside the drum (shaft and blades not "
         "subtracted); NaN where the cell is outside"},
        {velocity[0], "m s-1", mean},
        {velocity[1], "m s-1", mean},
        {velocity[2], "m s-1", mean},
    };
    const size_t dims[2] = {(size_t)map->n[0], (size_t)map->n[1]}, cells = dims[0] * dims[1];
    double value[MILL_MAPS_MOST];
    uint64_t count[MILL_MAPS_MOST];
    sink->open(sink, name);
    for (int axis = 0; axis < 2; axis++) {
        for (int i = 0; i <= map->n[axis]; i++)
            value[i] = map->from[axis] + i * map->size[axis];
        mill_tell_array(sink, edges[axis][0], dims[axis] + 1, value, "m", edges[axis][1]);
    }
    for (size_t i = 0; i < cells; i++)
        count[i] = map->hits[i].count;
    sink->values(sink, "impact_count", MILL_H5_U64, 2, dims, count, "1", "impacts in the cell");
    for (int k = 0; k < 6; k++) {
        for (size_t i = 0; i < cells; i++)
            value[i] = cell_value(map, i, map->room[i] * (double)samples, k);
        sink->values(sink, field[k].name, MILL_H5_F64, 2, dims, value, field[k].unit,
                     field[k].meaning);
    }
    sink->close(sink);
}

static void tell_maps(struct mill_sink *sink, const struct mill_maps *maps)
{
    static const char *const yz[2][2] = {{"y_edges", "edges along y, the first index"},
                                         {"z_edges", "edges along z, the second index"}},
                             *const xr[2][2] = {{"x_edges", "edges along x, the first index"},
                                                {"r_edges", "edges in r, the second index"}},
                             *const xyz[3] = {"velocity_x", "velocity_y", "velocity_z"},
                             *const xrp[3] = {"velocity_x", "velocity_r", "velocity_phi"};
    sink->open(sink, "maps");
    mill_tell_count(sink, "samples", maps->samples,
                    "snapshots that the solid fraction and the mean velocity are averaged over");
    tell_map(sink, "cross_section", &maps->cross, maps->samples, yz, xyz);
    tell_map(sink, "axial", &maps->axial, maps->samples, xr, xrp);
    sink->close(sink);
}

static void tell_rotor(struct mill_sink *sink, const struct mill_tally_results *r)
{
    sink->open(sink, "rotor");
    static const char error[] = "its standard error, the same as in precision";
    const struct mill_precision_mean *power = &r->at.known.power, *torque = &r->at.known.torque;
    mill_tell_number(sink, "power", power->value, "W", "work of the rotor on the balls / duration");
    mill_tell_number(sink, "power_error", power->error, "W", error);
    mill_tell_number(sink, "pinch_power", r->pinch_power, "W",
                     "of it: work on balls pressed between a blade and others / duration");
    mill_tell_number(sink, "torque", torque->value, "N m",
                     "mean torque of the rotor on the balls about +x");
    mill_tell_number(sink, "torque_error", torque->error, "N m", error);
    mill_tell_count(sink, "blocks", r->blocks, "whole blocks within the duration");
    mill_tell_number(sink, "block_revolutions", r->revolutions, "1",
                     "revolutions of the rotor in a block");
    mill_tell_number(sink, "block_duration", r->block, "s",
                     "length of a block; NaN where no rotor turns");
    if (sink->full) {
        mill_tell_array(sink, "block_power", r->blocks, r->block_power, "W",
                        "mean power of each block");
        mill_tell_array(sink, "block_torque", r->blocks, r->block_torque, "N m",
                        "mean torque of each block");
    }
    sink->close(sink);
}

/* So many means in a row, as a group of arrays; 0: one, as numbers */
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
                    "1: settled, and the standard errors of median_above_50mm_s and rotor_power "
                    "are at most `asked` times their values (the power's only if the rotor does "
                    "any work)");
}

static void tell_precision(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const struct mill_precision_known *known = &r->at.known;
    sink->open(sink, "precision");
    tell_means(sink, "median", 0, &known->median, "m s-1", "median normal speed of all impacts");
    tell_means(sink, "median_above_50mm_s", 0, &known->median_fast, "m s-1",
               "median normal speed of all impacts at 0.05 m/s or more");
    tell_means(sink, "rotor_power", 0, &known->power, "W", "mean power of the rotor on the balls");
    tell_means(sink, "rotor_torque", 0, &known->torque, "N m",
               "mean torque of the rotor on the balls about +x");
    sink->open(sink, "rate");
    for (int row = 0; row < MILL_TALLY_ROWS; row++)
        tell_means(sink, mill_tally_name(row), 0, &known->rate[row], "s-1", "impacts per second");
    sink->close(sink);
    sink->open(sink, "fast_rate");
    for (int row = 0; row < MILL_TALLY_ROWS; row++)
        tell_means(sink, mill_tally_name(row), MILL_WORLD_FAST, known->fast[row], "s-1",
                   "impacts per second with a normal speed at or above each of the attribute "
                   "thresholds [m/s]");
    sink->close(sink);
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
                                        "end of the warm-up to the end"
                                      : "length of the window that the statistics cover: from "
                                        "run.sample_from to the end");
    if (!sink->full)
        mill_tell_array(sink, "quantile_levels", LEVELS, level, "1", "levels of the quantiles");
    tell_rows(sink, "impacts", r, r->impacts);
    tell_rows(sink, "strikes", r, r->strikes);
    sink->open(sink, "floor_share");
    for (int row = 0; row < MILL_TALLY_ROWS; row++)
        mill_tell_number(sink, mill_tally_name(row), r->floor_share[row], "1",
                         "share of the impacts at which the rebound floor acted; NaN without "
                         "impacts");
    sink->close(sink);
    if (sink->full) {
        mill_energies_tell(&r->energies, sink);
        tell_maps(sink, &r->maps);
    }
    tell_rotor(sink, r);
    tell_precision(sink, r);
    sink->close(sink);
}
