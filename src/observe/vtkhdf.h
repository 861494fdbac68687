/* /VTKHDF: the frames in the form that VTK, ParaView and F3D read: the balls, what stands still,
 * and what each motion carries. It refers to the data in /particles/trajectory and does not store
 * them again. */
#ifndef MILL_VTKHDF_H
#define MILL_VTKHDF_H

#include "geometry/mesh.h"
#include "millsim/world.h"
#include "observe/observe.h"
#include "store/h5.h"

/* Writes the first `frames` frames, whose poses are in the file (observe/poses.h). Writes nothing
 * if there are none. false: `going` has stopped it, and the group is incomplete. going NULL: do not
 * stop. */
bool mill_vtkhdf_write(struct mill_h5 *file, const struct mill_observe *asked,
                       const struct mill_world *world, uint64_t frames,
                       const struct mill_going *going);

/* The shape of a mill: the surfaces that one motion carries, as triangles */
struct mill_outline {
    struct mill_mesh mesh; /* in the motion's frame */
    uint8_t *kind;         /* for each triangle: kind of contact of its surface */
    int32_t *number; /* for each triangle: number of the end wall, blade or copy; -1: only one */
};

/* Collects the triangles that balls can touch of every surface of the motion (NULL: what stands
 * still). drum: its cross-section. There are no triangles if the motion carries nothing. false: out
 * of memory. The caller frees the outline in all cases. */
bool mill_vtkhdf_outline(const struct mill_profile *drum, const struct mill_world *world,
                         const struct mill_motion *motion, struct mill_outline *outline);
void mill_vtkhdf_outline_free(struct mill_outline *outline);

#endif
