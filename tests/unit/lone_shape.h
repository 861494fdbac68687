/* One surface without a mill around it: all of a body, or a container's first wall. */
#ifndef LONE_SHAPE_H
#define LONE_SHAPE_H

#include "geometry/shapes.h"

#include <stdlib.h>

/* motion: may be NULL. NULL: out of memory. Owner: the caller; lone_shape_free. */
static inline struct mill_shape *lone_shape(const struct mill_solid *solid,
                                            const struct mill_body *is,
                                            const struct mill_motion *motion,
                                            const struct mill_reach *places)
{
    const int part = is->inside && solid->walls ? 0 : MILL_SOLID_WHOLE;
    const struct mill_wall wall = mill_body_wall(solid, is, part);
    const struct mill_shape_type *type = part < 0 ? solid->surface : wall.own;
    struct mill_bodied *b = calloc(1, (type ? type : &mill_wall_type)->size);
    if (!b)
        return NULL;
    b->is = *is;
    b->convex.base = (struct mill_shape){
        .type = type ? type : &mill_wall_type, .solid = solid, .wall = part, .motion = motion};
    return mill_body_create(b, places) ? &b->convex.base : NULL;
}

static inline void lone_shape_free(struct mill_shape *shape)
{
    if (shape->type->free)
        shape->type->free(shape);
    free(shape);
}

#endif
