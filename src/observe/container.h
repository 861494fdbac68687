/* The container's shape in its own frame */
#ifndef MILL_CONTAINER_H
#define MILL_CONTAINER_H

#include "geometry/shape.h"
#include "millsim/world.h"

/* The surfaces of a body that holds the balls */
struct mill_container_walls {
    const struct mill_pose *frame;
    int count;
    const struct mill_shape *wall[MILL_WALLS];
};

/* Is it a body, not a drum? */
bool mill_container_is_body(const struct mill_world *world);

struct mill_container_walls mill_container_find(const struct mill_world *world);

/* [m] Distance from a point of the container's frame to the nearest wall of a body; < 0: the point
 * is outside. When the point moves, the distance changes by no more than the point moves. normal:
 * set to the direction away from that wall. near: set to the walls that can be the nearest ones of
 * a point within `reach` [m] of this one. */
double mill_container_gap(const struct mill_container_walls *walls, vec3 point, double reach,
                          vec3 *normal, struct mill_container_walls *near);

#endif
