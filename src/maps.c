/* Where do balls hit, and where are they on average? Impacts are counted at the point of contact.
 * The solid fraction is gathered from snapshots: a ball is as large as a map's cell, so its volume
 * is spread over points of a cubic lattice within it, with their spacing chosen so that the second
 * moment of the ball, a^2/5 along each axis, is kept. In the axial map the lattice is turned so
 * that one of its axes is radial; then the points fall onto few distinct (x, r), which is what
 * makes this cheap. */
#include "maps.h"

#include "section.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum {
    RINGS = 30,
    FEWEST_SLICES = 4,
    MOST_SLICES = 400,
    POINTS = 32 /* (+-1, +-1, +-1) and the permutations of (+-3, +-1, +-1), in half spacings */
};

/* Half the spacing over the ball's radius. The mean square of one coordinate over the lattice is
 * (8 * 1 + 24 * 11 / 3) / 32 = 3 half spacings squared, that of a ball a^2 / 5. */
#define HALF_SPACING sqrt(1.0 / 15)

static bool map_init(struct mill_map *map, int n0, int n1)
{
    const size_t cells = (size_t)n0 * (size_t)n1;
    map->n[0] = n0;
    map->n[1] = n1;
    map->hits = calloc(cells, sizeof *map->hits);
    map->flow = calloc(cells, sizeof *map->flow);
    map->room = calloc(cells, sizeof *map->room);
    return map->hits && map->flow && map->room;
}

static void map_free(struct mill_map *map)
{
    free(map->hits);
    free(map->flow);
    free(map->room);
}

static void map_axis(struct mill_map *map, int axis, double from, double to)
{
    map->from[axis] = from;
    map->size[axis] = (to - from) / map->n[axis];
    map->per[axis] = map->n[axis] / (to - from);
}

static void lay_out(struct mill_maps *maps, const struct mill_world *world, double radius)
{
    struct mill_map *cross = &maps->cross, *axial = &maps->axial;
    const double half = world->drum_length / 2;
    map_axis(cross, 0, -radius, radius);
    map_axis(cross, 1, -radius, radius);
    mill_section_cells(world, radius, cross->n[0], cross->room);
    for (int cell = 0; cell < cross->n[0] * cross->n[1]; cell++)
        cross->room[cell] *= world->drum_length;

    map_axis(axial, 0, -half, half);
    map_axis(axial, 1, 0, radius);
    mill_section_rings(world, radius, RINGS, axial->room);
    for (int cell = axial->n[0] * RINGS - 1; cell >= 0; cell--)
        axial->room[cell] = axial->room[cell % RINGS] * axial->size[0];
}

enum mill_status mill_maps_create(const struct mill_world *world, struct mill_maps **maps,
                                  struct mill_error *error)
{
    const double radius = mill_section_radius(world);
    const double slices = round(world->drum_length / (radius / RINGS));
    const int n = (int)fmin(fmax(slices, FEWEST_SLICES), MOST_SLICES);
    *maps = calloc(1, sizeof **maps);
    if (!*maps || !map_init(&(*maps)->cross, 2 * RINGS, 2 * RINGS) ||
        !map_init(&(*maps)->axial, n, RINGS)) {
        mill_maps_free(*maps);
        *maps = NULL;
        return mill_error_set(error, MILL_FAILED, "out of memory for the maps");
    }
    lay_out(*maps, world, radius);
    return MILL_OK;
}

void mill_maps_free(struct mill_maps *maps)
{
    if (!maps)
        return;
    map_free(&maps->cross);
    map_free(&maps->axial);
    free(maps);
}

static void hit(struct mill_map *map, double a, double b, double normal_speed, double dissipation)
{
    const int cell = mill_maps_place(map, 0, a) * map->n[1] + mill_maps_place(map, 1, b);
    map->hits[cell].count++;
    map->hits[cell].speed += normal_speed;
    map->hits[cell].dissipation += dissipation;
}

void mill_maps_impact(struct mill_maps *maps, vec3 position, double normal_speed,
                      double dissipation)
{
    const double r = sqrt(position.y * position.y + position.z * position.z);
    hit(&maps->cross, position.y, position.z, normal_speed, dissipation);
    hit(&maps->axial, position.x, r, normal_speed, dissipation);
}

static void pour(struct mill_map_flow *cell, double volume, double u, double v, double w)
{
    cell->volume += volume;
    cell->flow[0] += volume * u;
    cell->flow[1] += volume * v;
    cell->flow[2] += volume * w;
}

/* The cells of the lattice's four planes -3, -1, 1, 3 across one axis */
static void planes(const struct mill_map *map, int axis, double centre, double h, int place[4])
{
    for (int j = 0; j < 4; j++)
        place[j] = mill_maps_place(map, axis, centre + (2 * j - 3) * h);
}

/* Seen along x the lattice is 12 places: four hold 4 points each, eight hold 2. */
static void pour_cross(struct mill_map *map, vec3 r, vec3 v, double h, double point)
{
    int row[4], column[4];
    planes(map, 0, r.y, h, row);
    planes(map, 1, r.z, h, column);
    for (int j = 0; j < 4; j++) {
        const bool outer = j == 0 || j == 3;
        for (int k = outer; k < 4 - outer; k++) {
            const bool inner = !outer && (k == 1 || k == 2);
            pour(&map->flow[row[j] * map->n[1] + column[k]], (inner ? 4 : 2) * point, v.x, v.y,
                 v.z);
        }
    }
}

/* The lattice's second axis is radial and its third azimuthal; points on either side of the radius
 * (k and -k) share their r and are taken together, so that their velocities' cross terms cancel. */
static void pour_axial(struct mill_map *map, vec3 r, vec3 v, double h, double point)
{
    const double radius = sqrt(r.y * r.y + r.z * r.z);
    const double c = radius > 0 ? r.y / radius : 1, s = radius > 0 ? r.z / radius : 0;
    const double out = v.y * c + v.z * s, around = v.z * c - v.y * s;
    int slice[4];
    planes(map, 0, r.x, h, slice);
    for (int k = 1; k <= 3; k += 2) {
        for (int j = k - 4; j <= 4 - k; j += 2) { /* -3..3 for k = 1, -1..1 for k = 3 */
            const double along = radius + j * h;
            const double there = sqrt(along * along + k * h * k * h);
            const double share = along / there;
            const int ring = mill_maps_place(map, 1, there);
            const int from = k + abs(j) == 2 ? 0 : 1;
            for (int i = from; i < 4 - from; i++)
                pour(&map->flow[slice[i] * map->n[1] + ring], 2 * point, v.x, out * share,
                     around * share);
        }
    }
}

void mill_maps_sample(struct mill_maps *maps, const struct mill_world *world, double t)
{
    for (int32_t i = 0; i < world->balls; i++) {
        const double a = world->species[world->ball[i].species].radius;
        const double point = 4 * MILL_PI / 3 * a * a * a / POINTS, h = a * HALF_SPACING;
        const vec3 r = mill_world_position(world, i, t), v = mill_world_velocity(world, i, t);
        pour_cross(&maps->cross, r, v, h, point);
        pour_axial(&maps->axial, r, v, h, point);
    }
    maps->samples++;
}
