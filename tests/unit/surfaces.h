/* Surfaces that only have a kind of contact, one of each kind: a world with them has all kinds. */
#ifndef SURFACES_H
#define SURFACES_H

#include "geometry/shape.h"

static inline void surfaces_draw_nothing(const struct mill_shape *shape,
                                         const struct mill_chamber *chamber, double flat,
                                         struct mill_mesh *mesh)
{
    (void)shape, (void)chamber, (void)flat, (void)mesh;
}

static inline struct mill_contact surfaces_far(const struct mill_shape *shape, vec3 centre,
                                               double radius, const struct mill_pose *pose)
{
    (void)shape, (void)centre, (void)radius, (void)pose;
    return (struct mill_contact){.gap = 1e3};
}

static inline void surfaces_give(struct mill_world *world)
{
    static const struct mill_shape_type type = {.contact = surfaces_far,
                                                .draw = surfaces_draw_nothing};
    static struct mill_shape surface[MILL_KINDS - 1], *shape[MILL_KINDS - 1];
    for (int k = 0; k < MILL_KINDS - 1; k++) {
        surface[k] = (struct mill_shape){.type = &type, .kind = k + 1, .number = -1};
        shape[k] = &surface[k];
    }
    world->shape = shape;
    world->shapes = MILL_KINDS - 1;
}

#endif
