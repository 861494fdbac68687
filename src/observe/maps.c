/* Where do balls hit? The layout of the maps, and impacts counted at the point of contact. Where
 * the balls are on average: maps_sample.c. */
#include "observe/maps.h"

#include "observe/section.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
    RINGS = 30,
    FEWEST_SLICES = 4,
    LINE = 64 /* [B] of the cache */
};

/* Zeroed, and so placed that no element lies across two cache lines where its size allows. */
static void *make_cells(size_t cells, size_t size)
{
    void *room;
    if (posix_memalign(&room, LINE, cells * size) != 0)
        return NULL;
    return memset(room, 0, cells * size);
}

static bool map_init(struct mill_map *map, int n0, int n1)
{
    const size_t cells = (size_t)n0 * (size_t)n1;
    map->n[0] = n0;
    map->n[1] = n1;
    map->hits = make_cells(cells, sizeof *map->hits);
    map->flow = make_cells(cells, sizeof *map->flow);
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
    const int n = (int)fmin(fmax(slices, FEWEST_SLICES), MILL_MAPS_LONGEST);
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

static bool map_like(struct mill_map *map, const struct mill_map *as)
{
    const size_t cells = (size_t)as->n[0] * (size_t)as->n[1];
    *map = *as;
    map->room = NULL;
    map->hits = make_cells(cells, sizeof *map->hits);
    map->flow = make_cells(cells, sizeof *map->flow);
    return map->hits && map->flow;
}

struct mill_maps *mill_maps_like(const struct mill_maps *maps)
{
    struct mill_maps *like = calloc(1, sizeof *like);
    if (like && map_like(&like->cross, &maps->cross) && map_like(&like->axial, &maps->axial))
        return like;
    mill_maps_free(like);
    return NULL;
}

static void map_add(struct mill_map *into, const struct mill_map *from)
{
    for (int i = 0; i < into->n[0] * into->n[1]; i++) {
        into->hits[i].count += from->hits[i].count;
        into->hits[i].speed += from->hits[i].speed;
        into->hits[i].dissipation += from->hits[i].dissipation;
        into->flow[i].volume += from->flow[i].volume;
        for (int k = 0; k < 3; k++)
            into->flow[i].flow[k] += from->flow[i].flow[k];
    }
}

void mill_maps_add(struct mill_maps *into, const struct mill_maps *from)
{
    map_add(&into->cross, &from->cross);
    map_add(&into->axial, &from->axial);
    into->samples += from->samples;
}

static void map_clear(struct mill_map *map)
{
    const size_t cells = (size_t)map->n[0] * (size_t)map->n[1];
    memset(map->hits, 0, cells * sizeof *map->hits);
    memset(map->flow, 0, cells * sizeof *map->flow);
}

void mill_maps_clear(struct mill_maps *maps)
{
    map_clear(&maps->cross);
    map_clear(&maps->axial);
    maps->samples = 0;
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
