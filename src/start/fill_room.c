/* The room that the surfaces leave to the balls, on a lattice of points over the drum's box: its
 * volume, and for each lattice cell the surfaces that a ball in it can touch. Distances change no
 * faster than the place does, so the distance from a cell's centre bounds it in the whole cell. */
#include "start/fill_private.h"

#include "base/elementary.h"

#include "geometry/shape.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#define POINTS 200000 /* of the lattice, about */
#define FEWEST 8      /* of them along each axis */
#define BLOCK 4       /* of them along each axis, looked at together */

static int32_t points_along(double length, double side)
{
    return (int32_t)fmin(fmax(ceil(length / side), FEWEST), POINTS);
}

/* Lays the lattice over a box: cubes, but for a drum that is flat or thin. */
static void lay_out(struct mill_fill_room *room, const double extent[3])
{
    double side = mill_elementary_cbrt(extent[0] * extent[1] * extent[2] / POINTS), points;
    do {
        points = 1.0;
        for (int axis = 0; axis < 3; axis++) {
            room->n[axis] = points_along(extent[axis], side);
            room->side[axis] = extent[axis] / room->n[axis];
            points *= room->n[axis];
        }
        side *= 1.25;
    } while (points > FEWEST * (double)POINTS);
}

static uint64_t *cell_at(const struct mill_fill_room *room, const int32_t cell[3])
{
    return &room->near[((int64_t)cell[0] * room->n[1] + cell[1]) * room->n[2] + cell[2]];
}

static vec3 centre_of(const struct mill_fill_room *room, const int32_t cell[3])
{
    return vec3_make(room->lo.x + (cell[0] + 0.5) * room->side[0],
                     room->lo.y + (cell[1] + 0.5) * room->side[1],
                     room->lo.z + (cell[2] + 0.5) * room->side[2]);
}

/* Notes for the cells from `first` to `last` whether that surface is nearer than `near` to their
 * centres, and which of these it does not hold. */
static void look_at(struct mill_fill_room *room, int shape, const int32_t first[3],
                    const int32_t last[3], double near, bool clear[BLOCK][BLOCK][BLOCK])
{
    const struct mill_shape *s = room->world->shape[shape];
    int32_t at[3];
    for (at[0] = first[0]; at[0] <= last[0]; at[0]++) {
        for (at[1] = first[1]; at[1] <= last[1]; at[1]++) {
            for (at[2] = first[2]; at[2] <= last[2]; at[2]++) {
                const double gap = mill_shape_gap(s, centre_of(room, at), 0.0, &room->pose[shape]);
                *cell_at(room, at) |= (uint64_t)(gap < near) << shape % 64;
                if (!(gap > 0.0))
                    clear[at[0] - first[0]][at[1] - first[1]][at[2] - first[2]] = false;
            }
        }
    }
}

/* The same for all surfaces, of which few are in reach of the block; how many centres are clear of
 * them all. */
static size_t look_around(struct mill_fill_room *room, const int32_t first[3], double near)
{
    const struct mill_world *w = room->world;
    bool clear[BLOCK][BLOCK][BLOCK];
    int32_t last[3];
    size_t inside = 1;
    for (int axis = 0; axis < 3; axis++) {
        const int32_t end = first[axis] + BLOCK;
        last[axis] = (end < room->n[axis] ? end : room->n[axis]) - 1;
        inside *= (size_t)(last[axis] - first[axis] + 1);
    }
    memset(clear, true, sizeof clear);
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_shape *s = w->shape[k];
        if (s->type->reachable(s, centre_of(room, first), centre_of(room, last), near))
            look_at(room, k, first, last, near, clear);
    }
    for (int i = 0; i < BLOCK * BLOCK * BLOCK; i++)
        inside -= !clear[i / BLOCK / BLOCK][i / BLOCK % BLOCK][i % BLOCK];
    return inside;
}

bool mill_fill_room_init(struct mill_fill_room *room, const struct mill_world *w, double reach)
{
    assert(reach > 0.0);
    const double extent[3] = {w->drum_length, 2.0 * w->drum_radius, 2.0 * w->drum_radius};
    double diagonal = 0.0;
    lay_out(room, extent);
    for (int axis = 0; axis < 3; axis++)
        diagonal += room->side[axis] * room->side[axis];
    const double near = reach * (1.0 + 2.0 * MILL_FILL_SPACING) + 0.501 * sqrt(diagonal);
    const size_t cells = (size_t)room->n[0] * (size_t)room->n[1] * (size_t)room->n[2];
    room->world = w;
    room->lo = vec3_make(-0.5 * extent[0], -0.5 * extent[1], -0.5 * extent[2]);
    room->near = calloc(cells, sizeof *room->near);
    room->pose = calloc((size_t)w->shapes, sizeof *room->pose);
    if (!room->near || !room->pose) {
        mill_fill_room_free(room);
        return false;
    }
    for (int k = 0; k < w->shapes; k++)
        room->pose[k] = mill_shape_pose(w->shape[k], 0.0);
    size_t inside = 0;
    int32_t from[3];
    for (from[0] = 0; from[0] < room->n[0]; from[0] += BLOCK) {
        for (from[1] = 0; from[1] < room->n[1]; from[1] += BLOCK) {
            for (from[2] = 0; from[2] < room->n[2]; from[2] += BLOCK)
                inside += look_around(room, from, near);
        }
    }
    room->volume = extent[0] * extent[1] * extent[2] * (double)inside / (double)cells;
    return true;
}

void mill_fill_room_free(struct mill_fill_room *room)
{
    free(room->near);
    free(room->pose);
    room->near = NULL;
    room->pose = NULL;
}

static int32_t along(double x, double side, int32_t n)
{
    const double cell = x / side, last = (double)(n - 1);
    return cell > 0.0 ? (int32_t)(cell < last ? cell : last) : 0;
}

static uint64_t shapes_near(const struct mill_fill_room *room, vec3 r)
{
    const int32_t cell[3] = {along(r.x - room->lo.x, room->side[0], room->n[0]),
                             along(r.y - room->lo.y, room->side[1], room->n[1]),
                             along(r.z - room->lo.z, room->side[2], room->n[2])};
    return *cell_at(room, cell);
}

bool mill_fill_room_clear(const struct mill_fill_room *room, vec3 r, double radius)
{
    const struct mill_world *w = room->world;
    const uint64_t mask = shapes_near(room, r);
    for (int k = 0; mask && k < w->shapes; k++) {
        if (mask >> k % 64 & 1 && !(mill_shape_gap(w->shape[k], r, radius, &room->pose[k]) > 0.0))
            return false;
    }
    return true;
}

bool mill_fill_room_push(const struct mill_fill_room *room, vec3 *r, double radius)
{
    const struct mill_world *w = room->world;
    const uint64_t mask = shapes_near(room, *r);
    bool moved = false;
    for (int k = 0; mask && k < w->shapes; k++) {
        if (!(mask >> k % 64 & 1))
            continue;
        const struct mill_contact c =
            w->shape[k]->type->contact(w->shape[k], *r, radius, &room->pose[k]);
        if (c.gap < MILL_FILL_CLOSE * radius) {
            *r = vec3_axpy(*r, MILL_FILL_SPACING * radius - c.gap, c.normal);
            moved = true;
        }
    }
    return moved;
}
