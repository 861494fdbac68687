/* /VTKHDF: the frames as VTK, ParaView and F3D read them: balls, drum and turning rotor. It shows
 * what is stored under /particles/trajectory and stores none of it again. */
#ifndef MILL_VTKHDF_H
#define MILL_VTKHDF_H

#include "millsim/observer.h"
#include "millsim/world.h"
#include "store/h5.h"

/* Writes it for the frames that the observer (mill_frames_create) has stored so far; nothing where
 * there are none. */
void mill_vtkhdf_write(struct mill_h5 *file, const struct mill_deck *deck,
                       const struct mill_world *world, const struct mill_observer *frames);

/* Takes it away, if it is there: of a run that goes on, before frames are added or dropped. */
void mill_vtkhdf_remove(struct mill_h5 *file);

#endif
