/* The kinds of shape, and the surfaces of a mill. */
#ifndef MILLSIM_SHAPES_H
#define MILLSIM_SHAPES_H

#include "geometry/shape.h"
#include "millsim/setup.h"

/* The kinds of the drum's own surfaces, made from its profile and length only */
extern const struct mill_shape_type mill_cylinder_drum_type, mill_wavy_type, mill_plate_type;

/* One wall of a container that is a body */
struct mill_wall_of {
    const struct mill_body *body;
    struct mill_hull hull;
    struct mill_wall wall;
    const struct mill_shape_type *draws; /* the body's type, for one of its walls, which draws
                                            the body; else NULL */
};
extern const struct mill_shape_type mill_wall_type;

/* The kinds that a deck names in sections [TYPE.NAME]; the last entry is NULL */
extern const struct mill_shape_type *const mill_shapes_named[];

/* The keys of a blade. The first MILL_BLADE_PLACES keys give its place on the rotor. */
enum { MILL_BLADE_PLACES = 2 };
extern const struct mill_key mill_blade_key[];

/* The room of the setup's drum, for a drum at rest */
struct mill_chamber mill_shapes_chamber(const struct mill_setup_drum *drum);

/* The body of the setup that holds the balls, or NULL */
const struct mill_setup_surface *mill_shapes_container(const struct mill_setup *setup);

/* Creates the drum and end walls, if the setup has them, then the setup's surfaces:
 * *shapes[*count]. false: out of memory. Owner: the caller, in any case. */
bool mill_shapes_create(const struct mill_setup *setup, const struct mill_chamber *chamber,
                        struct mill_motion *const *motion, struct mill_shape ***shapes, int *count);
void mill_shapes_free(struct mill_shape **shapes, int count);

#endif
