/* Before a run: which bodies run into each other or leave the container? Do periodic ends fit? */
#ifndef MILL_CLASH_H
#define MILL_CLASH_H

#include "millsim/start.h"

/* The number that users know of surface k of the list: the drum, which is the first, has -1. */
static inline int mill_clash_number(const struct mill_setup *setup, int k)
{
    return k - (setup->drum.radius > 0.0);
}

/* Fills in the first clash of two surfaces on different motions, or the first surface that leaves
 * the container. The search covers one common period of both motions, or the setup's horizon if
 * there is none. Surfaces nearer than 1e-6 of their size touch. A body that turns about its own
 * axis of symmetry may pierce a body that stands still, or one that also turns about its own axis
 * of symmetry. The motions are at local time 0. watch may be NULL. false: out of memory. */
bool mill_clash_find(const struct mill_setup *setup, const struct mill_start_watch *watch,
                     struct mill_motion *const *motion, struct mill_fault *fault);

/* The first fault of a periodic drum (MILL_FAULT_SHORT to MILL_FAULT_END, or MILL_FAULT_MEMORY).
 * Returns whether there is none, as in a drum with end walls. */
bool mill_ends_fit(const struct mill_setup *s, struct mill_motion *const *m, struct mill_fault *f);

#endif
