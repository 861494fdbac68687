/* Surfaces that only have a kind of contact, one of each kind: a world with them has all kinds. */
#ifndef SURFACES_H
#define SURFACES_H

#include "geometry/body.h"

static inline void surfaces_draw_nothing(const struct mill_body *is, int wall, double flat,
                                         struct mill_mesh *mesh)
{
    (void)is, (void)wall, (void)flat, (void)mesh;
}

static inline struct mill_contact surfaces_far(const struct mill_shape *shape, vec3 centre,
                                               double radius, const struct mill_pose *pose)
{
    (void)shape, (void)centre, (void)radius, (void)pose;
    return (struct mill_contact){.gap = 1e3};
}

static inline void surfaces_give(struct mill_world *world)
{
    static const struct mill_shape_type type = {.contact = surfaces_far};
    static const struct mill_solid solid = {.outline = surfaces_draw_nothing};
    static struct mill_bodied surface[MILL_KINDS - 1];
    static struct mill_shape *shape[MILL_KINDS - 1];
    for (int k = 0; k < MILL_KINDS - 1; k++) {
        shape[k] = &surface[k].convex.base;
        *shape[k] = (struct mill_shape){
            .type = &type, .solid = &solid, .wall = MILL_SOLID_WHOLE, .kind = k + 1, .number = -1};
    }
    world->shape = shape;
    world->shapes = MILL_KINDS - 1;
}

#endif
