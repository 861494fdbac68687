/* /VTKHDF: the frames as VTK, ParaView and F3D read them: balls, what stands still, and what each
 * motion carries. It shows what is stored under /particles/trajectory and stores none of it again.
 */
#ifndef MILL_VTKHDF_H
#define MILL_VTKHDF_H

#include "geometry/mesh.h"
#include "millsim/world.h"
#include "observe/observe.h"
#include "store/h5.h"

/* Writes it for the first `frames` frames, whose poses the file holds (observe/poses.h); nothing
 * where there are none. false: it was not to go on, and is left unfinished; going NULL: to the end.
 */
bool mill_vtkhdf_write(struct mill_h5 *file, const struct mill_observe *asked,
                       const struct mill_world *world, uint64_t frames,
                       const struct mill_going *going);

/* What a mill looks like: its surfaces as triangles, those that one motion carries. */
struct mill_outline {
    struct mill_mesh mesh; /* in the motion's frame */
    uint8_t *kind;         /* of each triangle: of the contacts of balls that meet it */
    int32_t *number; /* of each triangle: of the end wall, blade or copy, -1 where there is one */
};

/* Asks every surface of the motion (NULL: what stands still) what balls can see of it. drum: its
 * cross-section. No triangles where it carries nothing. false: out of memory; free it in any case.
 */
bool mill_vtkhdf_outline(const struct mill_profile *drum, const struct mill_world *world,
                         const struct mill_motion *motion, struct mill_outline *outline);
void mill_vtkhdf_outline_free(struct mill_outline *outline);

#endif
