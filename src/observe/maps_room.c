/* How much of a cell is inside a container that is a body? A cell of the cross-section is a column
 * along the axis, a cell of the axial map is a ring. The gap is the distance to the nearest wall,
 * so a piece smaller than the gap is completely inside or outside. Other pieces are halved across
 * their longest side. Of the smallest pieces, the part that a flat wall would leave is counted. */
#include "observe/maps.h"

#include "base/elementary.h"
#include "geometry/body.h"

#define FINEST 1.0 /* relative to a cell's width: smaller pieces are not halved */

/* The walls of the container */
struct walls {
    const struct mill_pose *frame;
    int count;
    const struct mill_shape *wall[MILL_WALLS];
};

static struct walls walls_of(const struct mill_world *world)
{
    struct walls walls = {.frame = &world->container.frame, .count = 0};
    for (int k = 0; k < world->shapes; k++) {
        if (!mill_body_is(world->shape[k])->inside)
            continue;
        assert(walls.count < MILL_WALLS);
        walls.wall[walls.count++] = world->shape[k];
    }
    return walls;
}

/* [m] Distance from a point of the container's frame to the nearest wall; < 0: it is outside. It
 * changes by no more than the point moves. normal: set to the direction away from that wall. near:
 * set to the walls that can be the nearest ones of a point within `reach` [m] of this one. */
static double gap_of(const struct walls *w, vec3 p, double reach, vec3 *normal, struct walls *near)
{
    const vec3 place = mill_pose_out(w->frame, p); /* in the motion's frame */
    double gap[MILL_WALLS] = {0.0}, least = INFINITY;
    vec3 away = {0.0, 0.0, 0.0};
    for (int k = 0; k < w->count; k++) {
        const struct mill_shape *shape = w->wall[k];
        const struct mill_contact c = shape->type->contact(shape, place, 0, &mill_pose_still);
        gap[k] = c.gap;
        away = c.gap < least ? c.normal : away;
        least = mill_least(least, c.gap);
    }
    near->frame = w->frame;
    near->count = 0;
    for (int k = 0; k < w->count; k++)
        if (gap[k] <= least + 2.001 * reach)
            near->wall[near->count++] = w->wall[k];
    *normal = mill_pose_turn_in(w->frame, away);
    return least;
}

/* Two corners of a piece, along (x, y, z), or for a ring along (x, r, angle) */
struct piece {
    double lo[3], hi[3];
};

/* [m^3] volume of the piece inside the container */
static double inside(const struct walls *walls, const struct piece *piece, bool ring, double fine)
{
    double middle[3], side[3], all = 1;
    int longest = 0;
    for (int k = 0; k < 3; k++) {
        all *= piece->hi[k] - piece->lo[k];
        middle[k] = 0.5 * (piece->lo[k] + piece->hi[k]);
        side[k] = (piece->hi[k] - piece->lo[k]) * (ring && k == 2 ? piece->hi[1] : 1);
        longest = side[k] > side[longest] ? k : longest;
    }
    const struct mill_heading at =
        ring ? mill_elementary_heading(middle[2]) : (struct mill_heading){1, 0};
    const vec3 point = ring ? vec3_make(middle[0], middle[1] * at.cos, middle[1] * at.sin)
                            : vec3_make(middle[0], middle[1], middle[2]);
    vec3 n;
    struct walls near;
    const double reach = 0.5 * sqrt(side[0] * side[0] + side[1] * side[1] + side[2] * side[2]);
    const double gap = gap_of(walls, point, reach, &n, &near);
    all *= ring ? middle[1] : 1;
    if (fabs(gap) >= reach)
        return gap > 0 ? all : 0;
    if (side[longest] <= fine) {
        const double out = n.y * at.cos + n.z * at.sin, around = n.z * at.cos - n.y * at.sin;
        const double thick = fabs(n.x) * side[0] + fabs(out) * side[1] + fabs(around) * side[2];
        return all * fmin(fmax(0.5 + gap / thick, 0), 1);
    }
    struct piece half[2] = {*piece, *piece};
    half[0].hi[longest] = half[1].lo[longest] = middle[longest];
    return inside(&near, &half[0], ring, fine) + inside(&near, &half[1], ring, fine);
}

static double edge(const struct mill_map *map, int axis, int i)
{
    return map->from[axis] + i * map->size[axis];
}

void mill_maps_room(struct mill_maps *maps, const struct mill_world *world)
{
    const double half = 0.5 * world->drum_length, finest = FINEST * maps->cross.size[0];
    double *room = maps->room; /* of both maps */
    const struct walls walls = walls_of(world);
    for (int which = 0; which < 2; which++) {
        const bool ring = which == 1;
        const struct mill_map *map = ring ? &maps->axial : &maps->cross;
        for (int i = 0; i < map->n[0]; i++) {
            for (int k = 0; k < map->n[1]; k++) {
                const double a = edge(map, 0, i), b = edge(map, 0, i + 1);
                const double c = edge(map, 1, k), d = edge(map, 1, k + 1);
                const struct piece column = {{-half, a, c}, {half, b, d}};
                const struct piece about = {{a, c, -MILL_PI}, {b, d, MILL_PI}};
                *room++ = inside(&walls, ring ? &about : &column, ring, finest);
            }
        }
    }
}
