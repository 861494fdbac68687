/* The room that the surfaces leave to the balls, on a lattice of points over the drum's box: its
 * volume, and for each lattice cell the surfaces that a ball in it can touch. Distances change no
 * faster than the place does, so the distance from a cell's centre bounds it in the whole cell. */
#include "start/fill.h"

#include "base/elementary.h"
#include "geometry/shape.h"

#include <assert.h>
#include <stdlib.h>

/* Points of the lattice, about; the fewest along an axis; along each, looked at together */
enum { POINTS = 200000, FEWEST = 8, BLOCK = 4 };

/* Lays the lattice over a box: cubes, but for a drum that is flat or thin. */
static void lay_out(struct mill_fill_lattice *l, const double extent[3])
{
    double side = mill_elementary_cbrt(extent[0] * extent[1] * extent[2] / POINTS), points;
    do {
        points = 1.0;
        for (int axis = 0; axis < 3; axis++) {
            l->n[axis] = (int32_t)fmin(fmax(ceil(extent[axis] / side), FEWEST), POINTS);
            l->per_side[axis] = l->n[axis] / extent[axis];
            points *= l->n[axis];
        }
        side *= 1.25;
    } while (points > FEWEST * (double)POINTS);
    l->lo = vec3_make(-0.5 * extent[0], -0.5 * extent[1], -0.5 * extent[2]);
}

/* For the cells of the block that begins there, notes which surfaces are nearer than `near` to
 * their centres, few of which are in reach of the block; how many centres are clear of all
 * surfaces. */
static size_t look_around(struct mill_fill_room *room, const int32_t first[3], const double side[3],
                          double near)
{
    enum { MOST = BLOCK * BLOCK * BLOCK };
    const int32_t *n = room->lattice.n;
    const vec3 lo = room->lattice.lo;
    vec3 centre[MOST];
    uint64_t *cell[MOST];
    bool clear[MOST];
    int cells = 0;
    size_t inside = 0;
    for (int32_t x = first[0]; x < first[0] + BLOCK && x < n[0]; x++) {
        for (int32_t y = first[1]; y < first[1] + BLOCK && y < n[1]; y++) {
            for (int32_t z = first[2]; z < first[2] + BLOCK && z < n[2]; z++) {
                centre[cells] = vec3_make(lo.x + (x + 0.5) * side[0], lo.y + (y + 0.5) * side[1],
                                          lo.z + (z + 0.5) * side[2]);
                cell[cells] = &room->near[(x * n[1] + y) * n[2] + z];
                clear[cells++] = true;
            }
        }
    }
    for (int k = 0; k < room->world->shapes; k++) {
        const struct mill_shape *s = room->world->shape[k];
        if (!s->type->reachable(s, centre[0], centre[cells - 1], near))
            continue;
        for (int i = 0; i < cells; i++) {
            const double gap = s->type->gap(s, centre[i], 0.0, &room->pose[k]);
            *cell[i] |= (uint64_t)(gap < near) << k % 64;
            clear[i] = clear[i] && gap > 0.0;
        }
    }
    for (int i = 0; i < cells; i++)
        inside += clear[i];
    return inside;
}

bool mill_fill_room_init(struct mill_fill_room *room, const struct mill_world *w, double reach)
{
    assert(reach > 0.0);
    const double extent[3] = {w->drum_length, 2.0 * w->drum_radius, 2.0 * w->drum_radius};
    const int32_t *n = room->lattice.n;
    double side[3], square = 0.0;
    lay_out(&room->lattice, extent);
    for (int axis = 0; axis < 3; axis++) {
        side[axis] = extent[axis] / n[axis];
        square += side[axis] * side[axis];
    }
    const double near = reach * (1.0 + 2.0 * MILL_FILL_SPACING) + 0.501 * sqrt(square);
    const size_t cells = (size_t)n[0] * (size_t)n[1] * (size_t)n[2];
    room->world = w;
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
    for (from[0] = 0; from[0] < n[0]; from[0] += BLOCK) {
        for (from[1] = 0; from[1] < n[1]; from[1] += BLOCK) {
            for (from[2] = 0; from[2] < n[2]; from[2] += BLOCK)
                inside += look_around(room, from, side, near);
        }
    }
    room->volume = extent[0] * extent[1] * extent[2] * (double)inside / (double)cells;
    return true;
}

void mill_fill_room_free(struct mill_fill_room *room)
{
    free(room->near);
    free(room->pose);
}

bool mill_fill_room_clear(const struct mill_fill_room *room, vec3 r, double radius)
{
    const struct mill_world *w = room->world;
    const uint64_t mask = room->near[mill_fill_grids_cell(&room->lattice, r)];
    for (int k = 0; mask && k < w->shapes; k++) {
        if (mask >> k % 64 & 1 &&
            !(w->shape[k]->type->gap(w->shape[k], r, radius, &room->pose[k]) > 0.0))
            return false;
    }
    return true;
}

bool mill_fill_room_push(const struct mill_fill_room *room, vec3 *r, double radius)
{
    const struct mill_world *w = room->world;
    const uint64_t mask = room->near[mill_fill_grids_cell(&room->lattice, *r)];
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
