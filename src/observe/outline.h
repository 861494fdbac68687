/* The shape of a mill as triangles, for pictures */
#ifndef MILL_OUTLINE_H
#define MILL_OUTLINE_H

#include "geometry/body.h"
#include "geometry/mesh.h"
#include "millsim/world.h"

/* Adds the triangles that this surface shows; none: another wall of the body shows them */
static inline void mill_outline_draw(const struct mill_shape *shape, double tolerance,
                                     struct mill_mesh *mesh)
{
    shape->solid->outline(mill_body_is(shape), shape->wall, tolerance, mesh);
}

/* The surfaces that one motion carries */
struct mill_outline {
    struct mill_mesh mesh; /* in the motion's frame */
    uint8_t *kind;   /* for each triangle: kind of contact of its surface, in observe/kinds.h */
    int32_t *number; /* for each triangle: number of the end wall, blade or copy; -1: only one */
};

/* Collects the triangles that balls can touch of every surface of the motion (NULL: what stands
 * still), or none. false: out of memory. The caller frees the outline in all cases. */
bool mill_outline_make(const struct mill_world *world, const struct mill_motion *motion,
                       struct mill_outline *outline);
void mill_outline_free(struct mill_outline *outline);

/* A pose as three rows of four: a point p of its frame is at row[:, :3] p + row[:, 3] */
void mill_outline_rows(const struct mill_pose *pose, double row[12]);

#endif
