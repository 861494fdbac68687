/* Writes the maps as the group "maps": values of all cells, and the edges of the cells. */
#include "observe/maps.h"
#include "observe/sink.h"

#include <math.h>

enum { LOSS = 1 };

/* Value of a cell: fields 0 and 1 are of the impacts, 2 is the solid fraction, 3..5 are the mean
 * velocity. room: [m^3] volume of the cell times the number of samples */
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

/* edges: names and meanings of the edges along both axes */
static void tell_map(struct mill_sink *sink, const char *name, const struct mill_map *map,
                     uint64_t samples, const char *const edges[2][2], const char *const velocity[3])
{
    static const char mean[] = "time-averaged velocity of the balls as seen from the container, "
                               "weighted by their volume in the cell; NaN where none ever was";
    const struct {
        const char *name, *unit, *meaning;
    } field[] = {
        {"normal_speed_sum", "m s-1", "sum of the normal speeds of these impacts"},
        {"dissipation", "J", "energy dissipated by these impacts"},
        {"solid_fraction", "1",
         "time-averaged volume of balls / volume of the cell inside the container (what stands in "
         "it "
         "is not subtracted); NaN where the cell is outside"},
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
        if (k == LOSS)
            mill_tell_part(sink);
    }
    sink->close(sink);
}

void mill_maps_tell(const struct mill_maps *maps, struct mill_sink *sink)
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
