/* Before a run: which bodies run into each other or leave the container? */
#ifndef MILL_CLASH_H
#define MILL_CLASH_H

#include "millsim/setup.h"

/* Fills in the first clash of two surfaces on different motions, or the first surface that leaves
 * the container. The search covers one common period of both motions, or the setup's horizon where
 * they have no common period. Surfaces nearer than 1e-6 of their size touch. A body that turns
 * about its own axis of symmetry may pierce a body that stands still, or one that also turns about
 * its own axis of symmetry. The motions are at local time 0. false: out of memory.
 *
 * Surfaces on the rotor of a drum that does not move are not checked against the drum:
 * do_surfaces_fit has checked them. */
bool mill_clash_find(const struct mill_setup *setup, struct mill_motion *const *motion,
                     struct mill_fault *fault);

#endif
