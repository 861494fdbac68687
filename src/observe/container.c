/* Finds the container's walls and the distance of a point from them. A drum has two kinds of walls,
 * the side and the end walls; a body has one. */
#include "observe/container.h"

#include "geometry/body.h"

#include <math.h>

static bool holds(const struct mill_shape *shape)
{
    return shape->type == &mill_wall_type ||
           (shape->type->hull && ((const struct mill_bodied *)shape)->is.inside);
}

bool mill_container_is_body(const struct mill_world *world)
{
    bool any = false, drum = false, wall = false;
    for (int k = 0; k < world->shapes; k++) {
        if (!holds(world->shape[k]))
            continue;
        any = true;
        drum = drum || world->shape[k]->kind == MILL_BALL_DRUM;
        wall = wall || world->shape[k]->kind == MILL_BALL_WALL;
    }
    return any && !(drum && wall);
}

double mill_container_gap(const struct mill_world *world, vec3 point, vec3 *normal)
{
    const struct mill_pose *frame = &world->container.frame;
    const vec3 place = mill_pose_out(frame, point); /* in the motion's frame */
    struct mill_contact nearest = {.gap = INFINITY};
    for (int k = 0; k < world->shapes; k++) {
        const struct mill_shape *shape = world->shape[k];
        if (!holds(shape))
            continue;
        const struct mill_contact c = shape->type->contact(shape, place, 0, &mill_pose_still);
        nearest = c.gap < nearest.gap ? c : nearest;
    }
    *normal = mill_pose_turn_in(frame, nearest.normal);
    return nearest.gap;
}
