/* The ball states at output.frames, in H5MD 1.1: /h5md and /particles/trajectory; without frames
 * only what does not change (id, species, mass, diameter). A finished run gets /VTKHDF, too. */
#ifndef MILL_FRAMES_H
#define MILL_FRAMES_H

#include "millsim/observer.h"

extern const struct mill_observer_type mill_frames_type;

#endif
