/* /VTKHDF: the frames as VTK, ParaView and F3D read them: the balls, what stands still, and what
 * each motion carries. It refers to the data in /particles/trajectory. */
#ifndef MILL_VTKHDF_H
#define MILL_VTKHDF_H

#include "millsim/world.h"
#include "observe/observe.h"
#include "store/h5.h"

/* Path of the poses of the motions in each frame, NAME/{centre,rotation}, H5MD elements with step
 * and time of the trajectory. A point p of the motion's frame is at centre + rotation p. */
#define MILL_VTKHDF_POSE "/observables/pose/"

/* Writes the first `frames` frames, whose poses are in the file. Writes nothing if there are none.
 * false: `going` has stopped it, and the group is incomplete. going NULL: do not stop. */
bool mill_vtkhdf_write(struct mill_h5 *file, const struct mill_observe *asked,
                       const struct mill_world *world, uint64_t frames,
                       const struct mill_going *going);

#endif
