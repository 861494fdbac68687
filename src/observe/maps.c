/* Layout of the maps, and the counting of impacts at the point of contact; maps_sample.c adds the
 * balls. What is inside the drum is computed in closed form for a circle, else by the gap function
 * of the profile. Bodies also vary along their axis: see maps_room.c. */
#include "observe/maps.h"

#include "base/elementary.h"
#include "geometry/body.h"
#include "geometry/shape.h"

enum {
    RINGS = MILL_MAPS_RINGS,
    FEWEST_SLICES = 4,
    FEWEST_RINGS = 6,
    ANGLES = 720, /* directions in which a profile is measured; `towards` has them */
    SUBS = 32     /* sub-points of a cell or ring along each direction, a power of two */
};

/* ---- the drum's inner cross-section ---- */

static double gap_at(const struct mill_shape *drum, double y, double z)
{
    return mill_shape_gap(drum, vec3_make(0, y, z), 0, &mill_pose_still);
}

/* The gap at distance r from the axis, in a direction */
static double gap_towards(const struct mill_shape *drum, double r, struct mill_heading at)
{
    return gap_at(drum, r * at.cos, r * at.sin);
}

/* A contour that turns about its axis? Any place of the circle around it is at times within it. */
static bool is_turning_contour(const struct mill_world *world)
{
    bool contour = false;
    for (int i = 0; i < world->shapes; i++)
        contour = contour || (mill_body_is(world->shape[i])->inside &&
                              mill_body_is(world->shape[i])->corners > 0);
    return contour && world->container.mapped != world->container.motion;
}

/* The drum, if its cross-section is enough and no circle (within 1e-9 of its radius); or NULL */
static const struct mill_shape *odd_drum(const struct mill_world *world,
                                         const struct mill_heading *towards)
{
    const double radius = world->drum_radius;
    for (int i = 0; i < world->shapes && !is_turning_contour(world); i++) {
        const struct mill_shape *shape = world->shape[i];
        const bool mantle = mill_body_is(shape)->inside && shape->wall == 0;
        for (int k = 0; mantle && k < ANGLES; k++)
            if (!(fabs(gap_towards(shape, radius, towards[k])) < 1e-9 * radius))
                return shape;
    }
    return NULL;
}

/* Integral of sqrt(R^2 - y^2) from 0 to y */
static double under_arc(double radius, double y)
{
    const double s = fmin(1, y / radius);
    return 0.5 * radius * radius * (s * sqrt(1 - s * s) + mill_elementary_asin(s));
}

/* Area of cell (i, k) inside the circle; i and k count from the axis, both >= 0 */
static double inside_circle(double radius, double size, int i, int k)
{
    const double y0 = i * size, y1 = (i + 1) * size, z0 = k * size, z1 = (k + 1) * size;
    /* the whole width is inside up to this y */
    const double full = sqrt(fmax(0, radius * radius - z1 * z1));
    /* nothing is inside from this y on */
    const double none = sqrt(fmax(0, radius * radius - z0 * z0));
    const double a = fmin(fmax(full, y0), y1), b = fmin(fmax(none, a), y1);
    const double arc = under_arc(radius, b) - under_arc(radius, a) - z0 * (b - a);
    const double area = (a - y0) * (z1 - z0) + arc;
    /* a corner that touches the circle has no area */
    return area > 1e-9 * (y1 - y0) * (z1 - z0) ? area : 0;
}

/* How many of n x n points of a square, the centres of equal parts, are inside any profile. A
 * square that the wall does not reach needs one test, others are cut into four: a power of two. */
static int points_inside(const struct mill_shape *drum, double y0, double z0, double size, int n)
{
    const double gap = gap_at(drum, y0 + size / 2, z0 + size / 2);
    if (n == 1 || fabs(gap) > 0.71 * size)
        return gap > 0 ? n * n : 0;
    int inside = 0;
    for (int quarter = 0; quarter < 4; quarter++)
        inside += points_inside(drum, y0 + (quarter / 2 ? size / 2 : 0),
                                z0 + (quarter % 2 ? size / 2 : 0), size / 2, n / 2);
    return inside;
}

/* [m^2] Area of ring i inside the drum. Everything within `bore` of the axis is inside. */
static double ring_area(const struct mill_shape *drum, const struct mill_heading *towards,
                        double bore, double size, int i)
{
    double area = 0;
    for (int j = 0; j < SUBS; j++) { /* sub-rings of equal area */
        const double r0 = i * size, r1 = r0 + size;
        const double r = sqrt(r0 * r0 + (r1 * r1 - r0 * r0) * (j + 0.5) / SUBS);
        const bool whole = !drum || r < bore; /* the wall is farther from the axis */
        int inside = whole ? ANGLES : 0;
        for (int k = 0; !whole && k < ANGLES; k++)
            inside += gap_towards(drum, r, towards[k]) > 0;
        area += MILL_PI * (r1 * r1 - r0 * r0) / SUBS * inside / ANGLES;
    }
    return area;
}

/* ---- the maps ---- */

static void set_axis(struct mill_map *map, int axis, int n, double from, double to)
{
    map->n[axis] = n;
    map->from[axis] = from;
    map->size[axis] = (to - from) / n;
    map->per[axis] = n / (to - from);
}

/* In a jar with few large balls, cells must not be smaller than the distance of the points that a
 * ball is spread over, half its radius. Otherwise the maps would show these points. */
static int rings_of(const struct mill_world *world, double radius)
{
    double largest = 0;
    for (int k = 0; k < world->species_count; k++)
        largest = fmax(largest, world->species[k].radius);
    return (int)fmin(fmax(round(radius / (0.5 * largest)), FEWEST_RINGS), RINGS);
}

bool mill_maps_init(struct mill_maps *maps, const struct mill_world *world)
{
    const bool body = !world->container.drum && !is_turning_contour(world);
    struct mill_heading towards[ANGLES];
    for (int k = 0; k < ANGLES; k++)
        towards[k] = mill_elementary_heading(2 * MILL_PI * k / ANGLES);
    const struct mill_shape *drum = body ? NULL : odd_drum(world, towards);
    const double radius = world->drum_radius, half = world->drum_length / 2;
    const int rings = body ? rings_of(world, radius) : RINGS;
    const double wanted = round(world->drum_length / (radius / rings));
    const int slices = (int)fmin(fmax(wanted, FEWEST_SLICES), MILL_MAPS_LONGEST);
    *maps = (struct mill_maps){.axial.first = 4 * (size_t)(rings * rings)};
    set_axis(&maps->cross, 0, 2 * rings, -radius, radius);
    set_axis(&maps->cross, 1, 2 * rings, -radius, radius);
    set_axis(&maps->axial, 0, slices, -half, half);
    set_axis(&maps->axial, 1, rings, 0, radius);
    maps->cells = maps->axial.first + (size_t)(slices * rings);
    maps->room = calloc(maps->cells, sizeof *maps->room);
    if (!maps->room)
        return false;
    if (body) {
        mill_maps_room(maps, world);
        return true;
    }
    double *room = maps->room, size = maps->cross.size[0];
    for (int i = -RINGS; i < RINGS; i++) {
        for (int k = -RINGS; k < RINGS; k++) {
            /* the four quadrants are equal */
            const int p = i < 0 ? -1 - i : i, q = k < 0 ? -1 - k : k;
            const double y = (i + RINGS) * size - radius, z = (k + RINGS) * size - radius;
            const double area =
                drum ? size * size * points_inside(drum, y, z, size, SUBS) / (SUBS * SUBS)
                     : inside_circle(world->drum_radius, size, p, q);
            *room++ = area * world->drum_length;
        }
    }
    const double bore = drum ? gap_at(drum, 0, 0) : 0;
    const double slice = maps->axial.size[0], ring = maps->axial.size[1];
    for (int i = 0; i < maps->axial.n[0] * RINGS; i++)
        room[i] = i < RINGS ? ring_area(drum, towards, bore, ring, i) * slice : room[i - RINGS];
    return true;
}

void mill_maps_free(struct mill_maps *maps)
{
    free(maps->room);
}

static void hit(const struct mill_map *map, struct mill_map_hits *hits, double a, double b,
                const struct mill_impact *impact)
{
    hits += map->first;
    hits += mill_maps_place(map, 0, a) * map->n[1] + mill_maps_place(map, 1, b);
    hits->count += !impact->lasting;
    hits->speed += impact->lasting ? 0.0 : impact->normal_speed;
    hits->dissipation += impact->dissipation;
}

void mill_maps_impact(const struct mill_maps *maps, struct mill_map_hits *hits,
                      const struct mill_impact *impact, const vec3 *at)
{
    hit(&maps->cross, hits, at->y, at->z, impact);
    hit(&maps->axial, hits, at->x, sqrt(at->y * at->y + at->z * at->z), impact);
}

/* ---- telling ---- */

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

static void tell_map(const struct mill_map *map, const struct words *of,
                     const struct mill_sums *hits, const struct mill_map_flow *flow,
                     const double *room, uint64_t samples, struct mill_sink *sink)
{
    const size_t dims[2] = {(size_t)map->n[0], (size_t)map->n[1]}, cells = dims[0] * dims[1];
    const struct mill_sums some = {hits->list, cells,
                                   (struct mill_map_hits *)hits->record + map->first};
    const struct mill_sums_view view = {.rank = 2, .dims = {dims[0], dims[1]}};
    double *value = mill_sink_room(sink, MILL_MAPS_MOST, sizeof *value);
    if (!value)
        return;
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
        for (size_t i = 0; i < cells; i++) {
            const struct mill_map_flow *in = &flow[map->first + i];
            const double per = k == 0 ? room[map->first + i] * (double)samples : in->volume;
            value[i] = per > 0 ? (k == 0 ? in->volume : in->flow[k - 1]) / per : (double)NAN;
        }
        sink->values(sink, k == 0 ? "solid_fraction" : of->velocity[k - 1], MILL_H5_F64, 2, dims,
                     value, k == 0 ? "1" : "m s-1",
                     k == 0 ? "time-averaged volume of balls / volume of the cell inside the "
                              "container (what stands in it is not subtracted); NaN where the "
                              "cell is outside"
                            : "time-averaged velocity of the balls as seen from the container, "
                              "weighted by their volume in the cell; NaN where none ever was");
    }
    sink->close(sink);
    free(value);
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
