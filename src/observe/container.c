/* Finds the container's walls and the distance of a point from them. A drum has two kinds of walls,
 * the side and the end walls; a body has one. */
#include "observe/container.h"

#include "geometry/body.h"

#include <assert.h>
#include <math.h>

static bool holds(const struct mill_shape *shape)
{
    return shape->type == &mill_wall_type ||
           (shape->type->hull && ((const struct mill_bodied *)shape)->is.inside);
}

struct mill_container_walls mill_container_find(const struct mill_world *world)
{
    struct mill_container_walls walls = {.frame = &world->container.frame, .count = 0};
    for (int k = 0; k < world->shapes; k++) {
        if (!holds(world->shape[k]))
            continue;
        assert(walls.count < MILL_WALLS);
        walls.wall[walls.count++] = world->shape[k];
    }
    return walls;
}

bool mill_container_is_body(const struct mill_world *world)
{
    const struct mill_container_walls walls = mill_container_find(world);
    bool drum = false, wall = false;
    for (int k = 0; k < walls.count; k++) {
        drum = drum || walls.wall[k]->kind == MILL_BALL_DRUM;
        wall = wall || walls.wall[k]->kind == MILL_BALL_WALL;
    }
    return walls.count > 0 && !(drum && wall);
}

double mill_container_gap(const struct mill_container_walls *walls, vec3 point, double reach,
                          vec3 *normal, struct mill_container_walls *near)
{
    const vec3 place = mill_pose_out(walls->frame, point); /* in the motion's frame */
    double gap[MILL_WALLS] = {0.0}, least = INFINITY;
    vec3 away = {0.0, 0.0, 0.0};
    for (int k = 0; k < walls->count; k++) {
        const struct mill_shape *shape = walls->wall[k];
        const struct mill_contact c = shape->type->contact(shape, place, 0, &mill_pose_still);
        gap[k] = c.gap;
        away = c.gap < least ? c.normal : away;
        least = mill_least(least, c.gap);
    }
    near->frame = walls->frame;
    near->count = 0;
    for (int k = 0; k < walls->count; k++)
        if (gap[k] <= least + 2.001 * reach)
            near->wall[near->count++] = walls->wall[k];
    *normal = mill_pose_turn_in(walls->frame, away);
    return least;
}
