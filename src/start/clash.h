/* Before a run: which bodies run into each other or leave the container? */
#ifndef MILL_CLASH_H
#define MILL_CLASH_H

#include "millsim/setup.h"

/* Fills in the first clash of surfaces on different motions, or the first surface that leaves the
 * container, within a common period of both motions, or within the setup's horizon where they have
 * none. Nearer than 1e-6 of their size is a touch. What turns about its own axis of symmetry may
 * pierce what stands still, or what also turns about its own axis of symmetry. The motions are at
 * local time 0. false: out of memory.
 *
 * Surfaces on the rotor of a drum that stands are known to be within it (do_surfaces_fit). */
bool mill_clash_find(const struct mill_setup *setup, struct mill_motion *const *motion,
                     struct mill_fault *fault);

#endif
