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

#endif
