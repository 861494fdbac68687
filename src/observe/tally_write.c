/* How do the statistics look in the output file? One function per group of /statistics, each
 * dataset with its unit and description. */
#include "observe/tally.h"
#include "store/h5.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const double mill_tally_level[MILL_TALLY_LEVELS] = {0.01, 0.05, 0.1,  0.25, 0.5,
                                                    0.75, 0.9,  0.95, 0.99, 0.999};

enum { PATH = 160 };

static const char FIRST_EDGES[] = "/statistics/impacts/ball_ball/normal_speed/histogram/edges";

struct writer {
    const struct mill_tally *tally;
    struct mill_h5 *file;
};

/* "GROUP/NAME" */
static const char *join(char path[PATH], const char *group, const char *name)
{
    const int length = snprintf(path, PATH, "%s/%s", group, name);
    assert(length < PATH);
    (void)length;
    return path;
}

static void put(const struct writer *w, const char *group, const char *name, double value,
                const char *unit, const char *description)
{
    char path[PATH];
    mill_h5_write_double(w->file, join(path, group, name), value, unit, description);
}

static void put_array(const struct writer *w, const char *group, const char *name, size_t n,
                      const double *values, const char *unit, const char *description)
{
    char path[PATH];
    mill_h5_write(w->file, join(path, group, name), MILL_H5_F64, 1, &n, values, unit, description);
}

/* ---- spectra ---- */

static void write_histogram(const struct writer *w, const char *group,
                            const struct mill_spectrum *spectrum)
{
    const size_t n = MILL_SPECTRUM_BINS;
    const int top = MILL_SPECTRUM_BINS + 1;
    uint64_t count[MILL_SPECTRUM_BINS];
    double dissipation[MILL_SPECTRUM_BINS];
    char path[PATH];
    for (int i = 0; i < MILL_SPECTRUM_BINS; i++) {
        count[i] = spectrum->slot[i + 1].count;
        dissipation[i] = spectrum->slot[i + 1].dissipation;
    }
    join(path, group, "edges");
    if (mill_h5_exists(w->file, FIRST_EDGES))
        mill_h5_link(w->file, FIRST_EDGES, path);
    else
        put_array(w, group, "edges", n + 1, w->tally->grid.edge, "m s-1",
                  "edges of the bins, 20^(k/152) m/s with k = -760..380; bin i is edges[i] <= v < "
                  "edges[i+1]");
    join(path, group, "count");
    mill_h5_write(w->file, path, MILL_H5_U64, 1, &n, count, "1",
                  "how many fell into each bin; attributes underflow (zero included) and overflow: "
                  "how many lay outside");
    mill_h5_attribute(w->file, path, "underflow", MILL_H5_U64, 0, &spectrum->slot[0].count);
    mill_h5_attribute(w->file, path, "overflow", MILL_H5_U64, 0, &spectrum->slot[top].count);
    join(path, group, "dissipation");
    mill_h5_write(w->file, path, MILL_H5_F64, 1, &n, dissipation, "J",
                  "energy dissipated by those of each bin; attributes underflow and overflow: by "
                  "those outside");
    mill_h5_attribute(w->file, path, "underflow", MILL_H5_F64, 0, &spectrum->slot[0].dissipation);
    mill_h5_attribute(w->file, path, "overflow", MILL_H5_F64, 0, &spectrum->slot[top].dissipation);
}

static void write_quantiles(const struct writer *w, const char *group, const char *name,
                            const struct mill_spectrum *spectrum, int slot, const char *description)
{
    double value[MILL_TALLY_LEVELS];
    char path[PATH];
    for (int i = 0; i < MILL_TALLY_LEVELS; i++)
        value[i] = mill_spectrum_quantile(&w->tally->grid, spectrum, slot, mill_tally_level[i]);
    put_array(w, group, name, MILL_TALLY_LEVELS, value, "m s-1", description);
    mill_h5_attribute(w->file, join(path, group, name), "levels", MILL_H5_F64, MILL_TALLY_LEVELS,
                      mill_tally_level);
}

/* spectrum: all of them; fast: those with v_n >= 0.05 m/s, in the slots from `slot` up */
static void write_speed(const struct writer *w, const char *row, const char *name,
                        const struct mill_spectrum *spectrum, const struct mill_spectrum *fast,
                        int slot)
{
    const struct mill_spectrum_grid *grid = &w->tally->grid;
    char group[PATH], histogram[PATH];
    join(group, row, name);
    put(w, group, "mean", mill_spectrum_mean(spectrum), "m s-1",
        "mean, from the speeds themselves; NaN without impacts");
    put(w, group, "median", mill_spectrum_quantile(grid, spectrum, 0, 0.5), "m s-1",
        "median, log-linear within its bin; NaN without impacts");
    put(w, group, "median_above_50mm_s", mill_spectrum_quantile(grid, fast, slot, 0.5), "m s-1",
        "median over the impacts whose normal speed is 0.05 m/s or more");
    write_quantiles(w, group, "quantiles", spectrum, 0,
                    "quantiles at the attribute levels, log-linear within their bins");
    write_quantiles(w, group, "quantiles_above_50mm_s", fast, slot,
                    "quantiles over the impacts whose normal speed is 0.05 m/s or more");
    write_histogram(w, join(histogram, group, "histogram"), spectrum);
}

static void write_row(const struct writer *w, const char *group, int row,
                      const struct mill_speeds *speeds)
{
    const uint64_t count = mill_spectrum_count(&speeds->normal, 0);
    const double dissipation = mill_spectrum_dissipation(&speeds->normal, 0);
    struct mill_spectrum tangential;
    char path[PATH], member[PATH];
    join(path, group, mill_tally_name(row));
    mill_tally_tangential(speeds, &tangential);
    mill_h5_write_count(w->file, join(member, path, "count"), count,
                        "how many within the duration");
    put(w, path, "rate", mill_tally_per_second(w->tally, (double)count), "s-1", "count / duration");
    put(w, path, "dissipated_power", mill_tally_per_second(w->tally, dissipation), "W",
        "energy dissipated / duration");
    write_speed(w, path, "normal_speed", &speeds->normal, &speeds->normal, MILL_SPECTRUM_FAST);
    write_speed(w, path, "tangential_speed", &tangential, &speeds->tangential[1], 0);
}

/* ---- maps ---- */

static void write_edges(const struct writer *w, const char *group, const struct mill_map *map,
                        int axis, const char *name, const char *description)
{
    const int n = map->n[axis];
    double *edge = calloc((size_t)n + 1, sizeof *edge);
    if (!edge) {
        mill_h5_spend(w->file, "out of memory for the maps");
        return;
    }
    for (int i = 0; i <= n; i++)
        edge[i] = map->from[axis] + i * map->size[axis];
    put_array(w, group, name, (size_t)n + 1, edge, "m", description);
    free(edge);
}

/* value[cell] of a field: 0..2 of the impacts, 3 solid fraction, 4..6 mean velocity */
static double cell_value(const struct writer *w, const struct mill_map *map, int cell, int field)
{
    const struct mill_map_hits *hits = &map->hits[cell];
    const struct mill_map_flow *flow = &map->flow[cell];
    const double room = map->room[cell] * (double)w->tally->maps->samples;
    if (field == 0)
        return (double)hits->count;
    if (field == 1)
        return hits->speed;
    if (field == 2)
        return hits->dissipation;
    if (field == 3)
        return room > 0 ? flow->volume / room : (double)NAN;
    return flow->volume > 0 ? flow->flow[field - 4] / flow->volume : (double)NAN;
}

static void write_map(const struct writer *w, const char *group, const struct mill_map *map,
                      const char *const velocity[3])
{
    static const char mean[] = "time-averaged velocity of the balls, weighted by their volume in "
                               "the cell; NaN where none ever was";
    const struct {
        const char *name, *unit, *description;
    } field[7] = {
        {"impact_count", "1", "impacts in the cell"},
        {"normal_speed_sum", "m s-1", "sum of the normal speeds of these impacts"},
        {"dissipation", "J", "energy dissipated by these impacts"},
        {"solid_fraction", "1",
         "time-averaged volume of balls / volume of the cell inside the drum (shaft and blades not "
         "subtracted); NaN where the cell is outside"},
        {velocity[0], "m s-1", mean},
        {velocity[1], "m s-1", mean},
        {velocity[2], "m s-1", mean},
    };
    const size_t dims[2] = {(size_t)map->n[0], (size_t)map->n[1]};
    const int cells = map->n[0] * map->n[1];
    double *value = calloc((size_t)cells, sizeof *value);
    uint64_t *count = calloc((size_t)cells, sizeof *count);
    char path[PATH];
    for (int k = 0; value && count && k < 7; k++) {
        for (int i = 0; i < cells; i++) {
            value[i] = cell_value(w, map, i, k);
            count[i] = map->hits[i].count;
        }
        mill_h5_write(w->file, join(path, group, field[k].name), k == 0 ? MILL_H5_U64 : MILL_H5_F64,
                      2, dims, k == 0 ? (const void *)count : (const void *)value, field[k].unit,
                      field[k].description);
    }
    if (!value || !count)
        mill_h5_spend(w->file, "out of memory for the maps");
    free(value);
    free(count);
}

static void write_maps(const struct writer *w)
{
    static const char cross[] = "/statistics/maps/cross_section",
                      axial[] = "/statistics/maps/axial";
    static const char *const xyz[3] = {"velocity_x", "velocity_y", "velocity_z"};
    static const char *const xrp[3] = {"velocity_x", "velocity_r", "velocity_phi"};
    const struct mill_maps *maps = w->tally->maps;
    mill_h5_write_count(
        w->file, "/statistics/maps/samples", maps->samples,
        "snapshots that the solid fraction and the mean velocity are averaged over");
    write_edges(w, cross, &maps->cross, 0, "y_edges", "edges along y, the first index");
    write_edges(w, cross, &maps->cross, 1, "z_edges", "edges along z, the second index");
    write_map(w, cross, &maps->cross, xyz);
    write_edges(w, axial, &maps->axial, 0, "x_edges", "edges along x, the first index");
    write_edges(w, axial, &maps->axial, 1, "r_edges", "edges in r, the second index");
    write_map(w, axial, &maps->axial, xrp);
}

/* ---- rotor ---- */

static void write_rotor(const struct writer *w)
{
    static const char group[] = "/statistics/rotor";
    const struct mill_rotorstat *stat = &w->tally->rotor;
    const double block = stat->block < (double)INFINITY ? stat->block : (double)NAN;
    put(w, group, "power", mill_tally_power(w->tally), "W",
        "work of the rotor on the balls / duration");
    put(w, group, "power_error", mill_rotorstat_error(stat->power, stat->blocks), "W",
        "standard error of the mean power from the scatter of the blocks; NaN with fewer than two");
    put(w, group, "torque", mill_tally_torque(w->tally), "N m",
        "mean torque of the rotor on the balls about +x");
    put(w, group, "torque_error", mill_rotorstat_error(stat->torque, stat->blocks), "N m",
        "standard error of the mean torque from the scatter of the blocks; NaN with fewer than "
        "two");
    mill_h5_write_count(w->file, "/statistics/rotor/blocks", stat->blocks,
                        "whole blocks within the duration");
    put(w, group, "block_revolutions", stat->revolutions, "1",
        "revolutions of the rotor in a block");
    put(w, group, "block_duration", block, "s", "length of a block; NaN where no rotor turns");
    put_array(w, group, "block_power", stat->blocks, stat->power, "W", "mean power of each block");
    put_array(w, group, "block_torque", stat->blocks, stat->torque, "N m",
              "mean torque of each block");
}

/* ---- precision ---- */

static void write_mean(const struct writer *w, const char *name, double value, double error,
                       const char *unit, const char *description)
{
    char group[PATH];
    join(group, "/statistics/precision", name);
    put(w, group, "value", value, unit, description);
    put(w, group, "standard_error", error, unit,
        "its standard error, from batches and their memory; NaN where it is not known");
}

static void write_precision(const struct writer *w)
{
    static const char group[] = "/statistics/precision";
    const struct mill_tally *tally = w->tally;
    const struct mill_spectrum *all = &tally->impacts[MILL_TALLY_ALL].normal;
    write_mean(w, "median_above_50mm_s",
               mill_spectrum_quantile(&tally->grid, all, MILL_SPECTRUM_FAST, 0.5),
               tally->at.known.median.error, "m s-1",
               "median normal speed of all impacts at 0.05 m/s or more");
    write_mean(w, "rotor_power", mill_tally_power(tally), tally->at.known.power.error, "W",
               "mean power of the rotor on the balls");
    put(w, group, "asked", tally->precision, "1", "run.precision");
    put(w, group, "warm_up", tally->at.begin, "s",
        "time before the window, cut off: by MSER-5, or given as run.sample_from");
    put(w, group, "batch", tally->batches.at.batch, "s", "length of a batch");
    mill_h5_write_count(w->file, "/statistics/precision/batches", tally->at.known.batches,
                        "whole batches within the window");
    mill_h5_write_count(w->file, "/statistics/precision/settled", tally->at.settled,
                        "1: the start-up is over; 0: the best cut might lie in the second half of "
                        "the run, or the run is too short to tell");
    mill_h5_write_count(w->file, "/statistics/precision/reached", mill_tally_reached(tally),
                        "1: settled, and both standard errors are at most `asked` times "
                        "their values (the power's only if the rotor does any work)");
}

void mill_tally_write(const struct mill_tally *tally, struct mill_h5 *file)
{
    const struct writer w = {tally, file};
    mill_h5_remove(file, "/statistics");
    put(&w, "/statistics", "duration", tally->at.duration, "s",
        tally->search ? "length of the window that the statistics cover: from the end of the "
                        "warm-up to the end"
                      : "length of the window that the statistics cover: from run.sample_from "
                        "to the end");
    for (int row = 0; row < MILL_TALLY_ROWS; row++) {
        put(&w, "/statistics/floor_share", mill_tally_name(row), mill_tally_floor_share(tally, row),
            "1", "share of the impacts at which the rebound floor acted; NaN without impacts");
        write_row(&w, "/statistics/impacts", row, &tally->impacts[row]);
        write_row(&w, "/statistics/strikes", row, &tally->strikes[row]);
    }
    write_maps(&w);
    write_rotor(&w);
    if (tally->precision > 0)
        write_precision(&w);
}
