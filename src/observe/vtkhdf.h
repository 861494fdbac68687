/* /VTKHDF: the frames as VTK, ParaView and F3D read them: balls, drum and turning rotor. It shows
 * what is stored under /particles/trajectory and stores none of it again. */
#ifndef MILL_VTKHDF_H
#define MILL_VTKHDF_H

#include "millsim/world.h"
#include "observe/observe.h"
#include "store/h5.h"

/* Writes it for the first `frames` frames; nothing where there are none. false: it was not to go
 * on, and is left unfinished. */
bool mill_vtkhdf_write(struct mill_h5 *file, const struct mill_observe *asked,
                       const struct mill_world *world, uint64_t frames,
                       const struct mill_going *going);

/* Takes it away, if it is there: of a run that goes on, before frames are added or dropped. */
void mill_vtkhdf_remove(struct mill_h5 *file);

#endif
