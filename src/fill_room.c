/* The room that the surfaces leave to the balls, on a lattice of points over the drum's box: its
 * volume, and for each lattice cell the surfaces that a ball in it can touch. Distances change no
 * faster than the place does, so the distance from a cell's centre bounds it in the whole cell. */
#include "fill_private.h"

#include "shape.h"

#include <stdlib.h>

#define POINTS 200000 /* of the lattice, about */
#define FEWEST 8      /* of them along each axis */

static int32_t points_along(double length, double side)
{
    return (int32_t)fmin(fmax(ceil(length / side), FEWEST), POINTS);
}

/* Lays the lattice over a box: cubes, but for a drum that is flat or thin. */
static void lay_out(struct mill_fill_room *room, const double extent[3])
{
    double side = cbrt(extent[0] * extent[1] * extent[2] / POINTS), points;
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

bool mill_fill_room_init(struct mill_fill_room *room, const struct mill_world *w, double reach)
{
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
    if (!room->near)
        return false;
    size_t inside = 0;
    for (size_t cell = 0; cell < cells; cell++) {
        const size_t nz = (size_t)room->n[2], ny = (size_t)room->n[1];
        const vec3 p = {room->lo.x + ((double)(cell / nz / ny) + 0.5) * room->side[0],
                        room->lo.y + ((double)(cell / nz % ny) + 0.5) * room->side[1],
                        room->lo.z + ((double)(cell % nz) + 0.5) * room->side[2]};
        double least = INFINITY;
        for (int k = 0; k < w->shapes; k++) {
            const double gap = w->shape[k]->ops->gap(w->shape[k], p, 0.0, w->turn);
            least = fmin(least, gap);
            room->near[cell] |= (uint64_t)(gap < near) << k % 64;
        }
        inside += least > 0.0;
    }
    room->volume = extent[0] * extent[1] * extent[2] * (double)inside / (double)cells;
    return true;
}

void mill_fill_room_free(struct mill_fill_room *room)
{
    free(room->near);
    room->near = NULL;
}

static int32_t along(double x, double side, int32_t n)
{
    const double cell = x / side, last = (double)(n - 1);
    return cell > 0.0 ? (int32_t)(cell < last ? cell : last) : 0;
}

static uint64_t shapes_near(const struct mill_fill_room *room, vec3 r)
{
    const int32_t ix = along(r.x - room->lo.x, room->side[0], room->n[0]);
    const int32_t iy = along(r.y - room->lo.y, room->side[1], room->n[1]);
    const int32_t iz = along(r.z - room->lo.z, room->side[2], room->n[2]);
    return room->near[((int64_t)ix * room->n[1] + iy) * room->n[2] + iz];
}

bool mill_fill_room_clear(const struct mill_fill_room *room, vec3 r, double radius)
{
    const struct mill_world *w = room->world;
    const uint64_t mask = shapes_near(room, r);
    for (int k = 0; mask && k < w->shapes; k++) {
        if (mask >> k % 64 & 1 && !(w->shape[k]->ops->gap(w->shape[k], r, radius, w->turn) > 0.0))
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
        const struct mill_contact c = w->shape[k]->ops->contact(w->shape[k], *r, radius, w->turn);
        if (c.gap < MILL_FILL_CLOSE * radius) {
            *r = vec3_axpy(*r, MILL_FILL_SPACING * radius - c.gap, c.normal);
            moved = true;
        }
    }
    return moved;
}
