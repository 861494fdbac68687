/* The container's shape, as its own frame sees it. */
#ifndef MILL_CONTAINER_H
#define MILL_CONTAINER_H

#include "millsim/world.h"

/* Is it a body, not a drum? */
bool mill_container_is_body(const struct mill_world *world);

/* [m] How far a point of the container's frame is from the nearest of a body's walls, < 0: outside.
 * It changes by no more than the point moves. normal: becomes the direction away from that wall. */
double mill_container_gap(const struct mill_world *world, vec3 point, vec3 *normal);

#endif
