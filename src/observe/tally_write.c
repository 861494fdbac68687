/* How are the statistics told? One function per group of "statistics", each number with its unit
 * and meaning. */
#include "observe/sink.h"
#include "observe/tally.h"

#include <math.h>
#include <stdlib.h>

const double mill_tally_level[MILL_TALLY_LEVELS] = {0.01, 0.05, 0.1,  0.25, 0.5,
                                                    0.75, 0.9,  0.95, 0.99, 0.999};

/* ---- spectra ---- */

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

static void tell_quantiles(struct mill_sink *sink, const char *name,
                           const struct mill_spectrum_grid *grid,
                           const struct mill_spectrum *spectrum, int slot, const char *meaning)
{
    double value[MILL_TALLY_LEVELS];
    for (int i = 0; i < MILL_TALLY_LEVELS; i++)
        value[i] = mill_spectrum_quantile(grid, spectrum, slot, mill_tally_level[i]);
    mill_tell_array(sink, name, MILL_TALLY_LEVELS, value, "m s-1", meaning);
    if (sink->full)
        sink->attribute(sink, "levels", MILL_H5_F64, MILL_TALLY_LEVELS, mill_tally_level);
}

/* spectrum: all of them; fast: those with v_n >= 0.05 m/s, in the slots from `slot` up */
static void tell_speed(struct mill_sink *sink, const char *name,
                       const struct mill_spectrum_grid *grid, const struct mill_spectrum *spectrum,
                       const struct mill_spectrum *fast, int slot)
{
    sink->open(sink, name);
    mill_tell_number(sink, "mean", mill_spectrum_mean(spectrum), "m s-1",
                     "mean, from the speeds themselves; NaN without impacts");
    mill_tell_number(sink, "median", mill_spectrum_quantile(grid, spectrum, 0, 0.5), "m s-1",
                     "median, log-linear within its bin; NaN without impacts");
    mill_tell_number(sink, "median_above_50mm_s", mill_spectrum_quantile(grid, fast, slot, 0.5),
                     "m s-1", "median over the impacts whose normal speed is 0.05 m/s or more");
    tell_quantiles(sink, "quantiles", grid, spectrum, 0,
                   "quantiles at the attribute levels, log-linear within their bins");
    tell_quantiles(sink, "quantiles_above_50mm_s", grid, fast, slot,
                   "quantiles over the impacts whose normal speed is 0.05 m/s or more");
    if (sink->full)
        tell_histogram(sink, grid, spectrum);
    sink->close(sink);
}

static void tell_rows(struct mill_sink *sink, const char *name, const struct mill_tally_results *r,
                      const struct mill_speeds speeds[MILL_TALLY_ROWS])
{
    const struct mill_spectrum_grid *grid = &r->tally->grid;
    struct mill_spectrum tangential;
    sink->open(sink, name);
    for (int row = 0; row < MILL_TALLY_ROWS; row++) {
        const struct mill_spectrum *normal = &speeds[row].normal;
        const uint64_t count = mill_spectrum_count(normal, 0);
        const double dissipation = mill_spectrum_dissipation(normal, 0);
        mill_tally_tangential(&speeds[row], &tangential);
        sink->open(sink, mill_tally_name(row));
        mill_tell_count(sink, "count", count, "how many within the duration");
        mill_tell_number(sink, "rate", mill_tally_per_second(r, (double)count), "s-1",
                         "count / duration");
        mill_tell_number(sink, "dissipated_power", mill_tally_per_second(r, dissipation), "W",
                         "energy dissipated / duration");
        tell_speed(sink, "normal_speed", grid, normal, normal, MILL_SPECTRUM_FAST);
        tell_speed(sink, "tangential_speed", grid, &tangential, &speeds[row].tangential[1], 0);
        sink->close(sink);
    }
    sink->close(sink);
}

static void tell_floor_share(struct mill_sink *sink, const struct mill_tally_results *r)
{
    sink->open(sink, "floor_share");
    for (int row = 0; row < MILL_TALLY_ROWS; row++)
        mill_tell_number(sink, mill_tally_name(row), mill_tally_floor_share(r, row), "1",
                         "share of the impacts at which the rebound floor acted; NaN without "
                         "impacts");
    sink->close(sink);
}

/* ---- maps ---- */

static void tell_edges(struct mill_sink *sink, const struct mill_map *map, int axis,
                       const char *name, const char *meaning)
{
    double edge[MILL_MAPS_LONGEST + 1];
    for (int i = 0; i <= map->n[axis]; i++)
        edge[i] = map->from[axis] + i * map->size[axis];
    mill_tell_array(sink, name, (size_t)map->n[axis] + 1, edge, "m", meaning);
}

/* Of a cell: fields 0 and 1 of the impacts, 2 the solid fraction, 3..5 the mean velocity. room
 * [m^3]: of the cell, times the samples */
static double cell_value(const struct mill_map *map, int cell, double room, int field)
{
    const struct mill_map_hits *hits = &map->hits[cell];
    const struct mill_map_flow *flow = &map->flow[cell];
    if (field < 2)
        return field == 0 ? hits->speed : hits->dissipation;
    if (field == 2)
        return room > 0 ? flow->volume / room : (double)NAN;
    return flow->volume > 0 ? flow->flow[field - 3] / flow->volume : (double)NAN;
}

/* room [m^3]: of each cell */
static bool tell_map(struct mill_sink *sink, const struct mill_map *map, const double *room,
                     uint64_t samples, const char *const velocity[3])
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
    double *value = malloc(cells * sizeof *value);
    uint64_t *count = malloc(cells * sizeof *count);
    const bool memory = value && count;
    for (size_t i = 0; memory && i < cells; i++)
        count[i] = map->hits[i].count;
    if (memory)
        sink->values(sink, "impact_count", MILL_H5_U64, 2, dims, count, "1", "impacts in the cell");
    for (int k = 0; memory && k < 6; k++) {
        for (size_t i = 0; i < cells; i++)
            value[i] = cell_value(map, (int)i, room[i] * (double)samples, k);
        sink->values(sink, field[k].name, MILL_H5_F64, 2, dims, value, field[k].unit,
                     field[k].meaning);
    }
    free(value);
    free(count);
    return memory;
}

static bool tell_maps(struct mill_sink *sink, const struct mill_tally_results *r)
{
    static const char *const xyz[3] = {"velocity_x", "velocity_y", "velocity_z"};
    static const char *const xrp[3] = {"velocity_x", "velocity_r", "velocity_phi"};
    const struct mill_map *cross = &r->maps->cross, *axial = &r->maps->axial;
    const struct mill_maps *own = r->tally->maps;
    sink->open(sink, "maps");
    mill_tell_count(sink, "samples", r->maps->samples,
                    "snapshots that the solid fraction and the mean velocity are averaged over");
    sink->open(sink, "cross_section");
    tell_edges(sink, cross, 0, "y_edges", "edges along y, the first index");
    tell_edges(sink, cross, 1, "z_edges", "edges along z, the second index");
    bool memory = tell_map(sink, cross, own->cross.room, r->maps->samples, xyz);
    sink->close(sink);
    sink->open(sink, "axial");
    tell_edges(sink, axial, 0, "x_edges", "edges along x, the first index");
    tell_edges(sink, axial, 1, "r_edges", "edges in r, the second index");
    memory = tell_map(sink, axial, own->axial.room, r->maps->samples, xrp) && memory;
    sink->close(sink);
    sink->close(sink);
    return memory;
}

/* ---- rotor ---- */

static void tell_rotor(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const struct mill_rotorstat *stat = &r->rotor;
    const double block = stat->block < (double)INFINITY ? stat->block : (double)NAN;
    sink->open(sink, "rotor");
    mill_tell_number(sink, "power", mill_tally_power(r), "W",
                     "work of the rotor on the balls / duration");
    mill_tell_number(sink, "power_error", mill_rotorstat_error(stat->power, stat->blocks), "W",
                     "standard error of the mean power from the scatter of the blocks; NaN with "
                     "fewer than two");
    mill_tell_number(sink, "torque", mill_tally_torque(r), "N m",
                     "mean torque of the rotor on the balls about +x");
    mill_tell_number(sink, "torque_error", mill_rotorstat_error(stat->torque, stat->blocks), "N m",
                     "standard error of the mean torque from the scatter of the blocks; NaN with "
                     "fewer than two");
    mill_tell_count(sink, "blocks", stat->blocks, "whole blocks within the duration");
    mill_tell_number(sink, "block_revolutions", stat->revolutions, "1",
                     "revolutions of the rotor in a block");
    mill_tell_number(sink, "block_duration", block, "s",
                     "length of a block; NaN where no rotor turns");
    if (sink->full) {
        mill_tell_array(sink, "block_power", stat->blocks, stat->power, "W",
                        "mean power of each block");
        mill_tell_array(sink, "block_torque", stat->blocks, stat->torque, "N m",
                        "mean torque of each block");
    }
    sink->close(sink);
}

/* ---- precision ---- */

static void tell_mean(struct mill_sink *sink, const char *name, double value, double error,
                      const char *unit, const char *meaning)
{
    sink->open(sink, name);
    mill_tell_number(sink, "value", value, unit, meaning);
    mill_tell_number(sink, "standard_error", error, unit,
                     "its standard error, from batches and their memory; NaN where it is not "
                     "known");
    sink->close(sink);
}

static void tell_precision(struct mill_sink *sink, const struct mill_tally_results *r)
{
    const struct mill_spectrum *all = &r->impacts[MILL_TALLY_ALL].normal;
    const double median = mill_spectrum_quantile(&r->tally->grid, all, MILL_SPECTRUM_FAST, 0.5);
    sink->open(sink, "precision");
    tell_mean(sink, "median_above_50mm_s", median, r->known.median.error, "m s-1",
              "median normal speed of all impacts at 0.05 m/s or more");
    tell_mean(sink, "rotor_power", mill_tally_power(r), r->known.power.error, "W",
              "mean power of the rotor on the balls");
    mill_tell_number(sink, "asked", r->tally->precision, "1", "run.precision");
    mill_tell_number(sink, "warm_up", r->begin, "s",
                     "time before the window, cut off: by MSER-5, or given as run.sample_from");
    mill_tell_number(sink, "batch", r->tally->batches.at.batch, "s", "length of a batch");
    mill_tell_count(sink, "batches", r->known.batches, "whole batches within the window");
    mill_tell_count(sink, "settled", r->settled,
                    "1: the start-up is over; 0: the best cut might lie in the second half of the "
                    "run, or the run is too short to tell");
    mill_tell_count(sink, "reached", mill_tally_reached(r),
                    "1: settled, and both standard errors are at most `asked` times their values "
                    "(the power's only if the rotor does any work)");
    sink->close(sink);
}

enum mill_status mill_tally_tell(const struct mill_tally_results *r, struct mill_sink *sink,
                                 struct mill_error *error)
{
    sink->open(sink, "statistics");
    mill_tell_number(sink, "duration", r->duration, "s",
                     r->tally->search ? "length of the window that the statistics cover: from the "
                                        "end of the warm-up to the end"
                                      : "length of the window that the statistics cover: from "
                                        "run.sample_from to the end");
    if (!sink->full)
        mill_tell_array(sink, "quantile_levels", MILL_TALLY_LEVELS, mill_tally_level, "1",
                        "levels of the quantiles");
    tell_rows(sink, "impacts", r, r->impacts);
    tell_rows(sink, "strikes", r, r->strikes);
    tell_floor_share(sink, r);
    const bool memory = !sink->full || tell_maps(sink, r);
    tell_rotor(sink, r);
    if (r->tally->precision > 0)
        tell_precision(sink, r);
    sink->close(sink);
    return memory ? MILL_OK : mill_error_set(error, MILL_FAILED, "out of memory for the maps");
}
