/* The surfaces of a mill. */
#ifndef MILLSIM_SHAPES_H
#define MILLSIM_SHAPES_H

#include "geometry/body.h"

/* A wall of a container */
extern const struct mill_shape_type mill_wall_type;

/* support of the core of bodies of revolution */
vec3 mill_round_support(const struct mill_core *core, vec3 way);

/* Solid number i [0..] of those that a deck can name; NULL: the end */
const struct mill_solid *mill_shapes_solid(int i);

/* The surface of the setup that holds the balls, or NULL */
const struct mill_setup_surface *mill_shapes_container(const struct mill_setup *setup);

/* Creates the surfaces of the setup, of a container each wall: *shapes[*count]. places: all places
 * that balls can reach. false: out of memory. Owner: the caller, in any case. */
bool mill_shapes_create(const struct mill_setup *setup, const struct mill_reach *places,
                        struct mill_motion *const *motion, struct mill_shape ***shapes, int *count);
void mill_shapes_free(struct mill_shape **shapes, int count);

#endif
