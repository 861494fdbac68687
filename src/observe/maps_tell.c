/* Writes the maps as the group "maps": values of all cells, and the edges of the cells. */
#include "observe/maps.h"

#include <math.h>

#define HITS(member) offsetof(struct mill_map_hits, member), 0, 0
#define FLOW(member) offsetof(struct mill_map_flow, member)

static const struct mill_sum hit_sum[] = {
    {"impact_count", "1", "impacts in the cell", MILL_H5_U64, HITS(count)},
    {"normal_speed_sum", "m s-1", "sum of the normal speeds of these impacts", MILL_H5_F64,
     HITS(speed)},
    {"dissipation", "J", "energy dissipated by these impacts", MILL_H5_F64, HITS(dissipation)}};
const struct mill_sums_list mill_maps_hits = {"hits", sizeof(struct mill_map_hits), 3, hit_sum};

/* What the file has are the means that follow */
static const struct mill_sum flow_sum[] = {
    {"volume", "m3", "volume of balls, of all samples", MILL_H5_F64, FLOW(volume), 0, 0},
    {"flow", "m4 s-1", "volume times velocity", MILL_H5_F64, FLOW(flow), 3, sizeof(double)}};
const struct mill_sums_list mill_maps_flow = {"flow", sizeof(struct mill_map_flow), 2, flow_sum};

/* Names of a map and of its coordinates */
static const struct words {
    const char *name, *edges[2], *along[2], *velocity[3];
} words[2] = {{"cross_section",
               {"y_edges", "z_edges"},
               {"edges along y, the first index", "edges along z, the second index"},
               {"velocity_x", "velocity_y", "velocity_z"}},
              {"axial",
               {"x_edges", "r_edges"},
               {"edges along x, the first index", "edges in r, the second index"},
               {"velocity_x", "velocity_r", "velocity_phi"}}};

/* Solid fraction (k = 0), or a component of the mean velocity (k = 1 to 3), of a cell. room: [m^3]
 * volume of the cell times the number of samples */
static double mean_of(const struct mill_map_flow *flow, double room, int k)
{
    if (k == 0)
        return room > 0 ? flow->volume / room : (double)NAN;
    return flow->volume > 0 ? flow->flow[k - 1] / flow->volume : (double)NAN;
}

static void tell_map(const struct mill_map *map, const struct words *of,
                     const struct mill_sums *hits, const struct mill_map_flow *flow,
                     const double *room, uint64_t samples, struct mill_sink *sink)
{
    const size_t dims[2] = {(size_t)map->n[0], (size_t)map->n[1]}, cells = dims[0] * dims[1];
    const struct mill_sums some = {hits->list, cells,
                                   (struct mill_map_hits *)hits->record + map->first};
    const struct mill_sums_view view = {.rank = 2, .dims = {dims[0], dims[1]}};
    double value[MILL_MAPS_MOST];
    sink->open(sink, of->name);
    for (int axis = 0; axis < 2; axis++) {
        for (int i = 0; i <= map->n[axis]; i++)
            value[i] = map->from[axis] + i * map->size[axis];
        mill_tell_array(sink, of->edges[axis], dims[axis] + 1, value, "m", of->along[axis]);
    }
    for (int k = 0; k < hits->list->count; k++)
        mill_sums_tell(&some, k, &view, sink);
    mill_tell_part(sink);
    for (int k = 0; k < 4; k++) {
        for (size_t i = 0; i < cells; i++)
            value[i] = mean_of(&flow[map->first + i], room[map->first + i] * (double)samples, k);
        sink->values(sink, k == 0 ? "solid_fraction" : of->velocity[k - 1], MILL_H5_F64, 2, dims,
                     value, k == 0 ? "1" : "m s-1",
                     k == 0 ? "time-averaged volume of balls / volume of the cell inside the "
                              "container (what stands in it is not subtracted); NaN where the "
                              "cell is outside"
                            : "time-averaged velocity of the balls as seen from the container, "
                              "weighted by their volume in the cell; NaN where none ever was");
    }
    sink->close(sink);
}

void mill_maps_tell(const struct mill_maps *maps, const struct mill_sums *hits,
                    const struct mill_map_flow *flow, uint64_t samples, struct mill_sink *sink)
{
    sink->open(sink, "maps");
    mill_tell_count(sink, "samples", samples,
                    "snapshots that the solid fraction and the mean velocity are averaged over");
    tell_map(&maps->cross, &words[0], hits, flow, maps->room, samples, sink);
    tell_map(&maps->axial, &words[1], hits, flow, maps->room, samples, sink);
    sink->close(sink);
}
