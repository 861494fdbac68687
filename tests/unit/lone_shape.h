/* One shape without a mill around it. */
#ifndef LONE_SHAPE_H
#define LONE_SHAPE_H

#include "geometry/shapes.h"

#include <stdlib.h>

/* NULL: out of memory. Owner: the caller; lone_shape_free. */
static inline struct mill_shape *lone_shape(const struct mill_shape *base, const void *form,
                                            const struct mill_chamber *chamber)
{
    struct mill_shape *shape = calloc(1, base->type->size);
    if (shape)
        *shape = *base;
    return shape && base->type->create(shape, form, chamber) ? shape : NULL;
}

static inline void lone_shape_free(struct mill_shape *shape)
{
    if (shape->type->free)
        shape->type->free(shape);
    free(shape);
}

#endif
