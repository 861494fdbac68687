/* Where in the mill do impacts happen, and how do the balls move there? Two maps in the container's
 * frame: `cross_section` (y, z) and `axial` (x, r), of impacts and of the time-averaged flow. */
#ifndef MILL_MAPS_H
#define MILL_MAPS_H

#include "millsim/observer.h"
#include "observe/sums.h"

/* Maximum number of cells along an axis; cells along r; maximum number of cells of a map */
enum { MILL_MAPS_LONGEST = 400, MILL_MAPS_RINGS = 30, MILL_MAPS_MOST = 400 * 30 };

struct mill_map_hits {
    uint64_t count;
    double speed;       /* [m/s] sum of v_n */
    double dissipation; /* [J] */
};

struct mill_map_flow {
    double volume;  /* [m^3] of balls, summed over the samples */
    double flow[3]; /* [m^4/s] volume times velocity: (x, y, z), or (x, r, phi) in the axial map */
};

extern const struct mill_sums_list mill_maps_hits, mill_maps_flow;

/* Equal cells [from, from + n size) in two coordinates. What is outside is counted in the outermost
 * cells. Index of cell (i, k): first + i * n[1] + k. */
struct mill_map {
    int n[2];
    double from[2], size[2]; /* [m] */
    double per[2];           /* [1/m] 1 / size */
    size_t first;            /* cell in the arrays of both maps */
};

/* The cells of both maps: those of `cross`, then those of `axial`. */
struct mill_maps {
    struct mill_map cross, axial;
    size_t cells;
    double *room; /* [m^3] volume of each cell inside the container */
};

/* Cells of size R/30 (2.5 mm in a drum of 75 mm), R of the drum or the cylinder around a body: 60 x
 * 60 in the cross-section, 30 rings. false: out of memory. The caller frees them in both cases. */
bool mill_maps_init(struct mill_maps *maps, const struct mill_world *world);
void mill_maps_free(struct mill_maps *maps);

/* Writes the group "maps" of so many samples of the flow. hits, flow: [cells] */
void mill_maps_tell(const struct mill_maps *maps, const struct mill_sums *hits,
                    const struct mill_map_flow *flow, uint64_t samples, struct mill_sink *sink);

/* For mill_maps_init() of a container that is a body: computes the volume of each cell inside it,
 * to a few thousandths of a cell, within a few tenths of a second. */
void mill_maps_room(struct mill_maps *maps, const struct mill_world *world);

/* Counts an impact at a place in the container's frame. Of a lasting contact only loss counts. */
void mill_maps_impact(const struct mill_maps *maps, struct mill_map_hits *hits,
                      const struct mill_impact *impact, const vec3 *at);

/* Adds the balls at local time t, so many times, each as 32 equal points inside it. */
void mill_maps_sample(const struct mill_maps *maps, struct mill_map_flow *flow,
                      const struct mill_world *world, double t, double times);

/* Index along one axis (0 or 1) of the cell that holds coordinate `at` [m]. */
static inline int mill_maps_place(const struct mill_map *map, int axis, double at)
{
    const int i = (int)((at - map->from[axis]) * map->per[axis]);
    return i < 0 ? 0 : i >= map->n[axis] ? map->n[axis] - 1 : i;
}

#endif
