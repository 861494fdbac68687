/* Before a run: can a drum have periodic ends? */
#ifndef MILL_ENDS_H
#define MILL_ENDS_H

#include "millsim/setup.h"

/* Fills in the first fault of a periodic drum (MILL_FAULT_SHORT to MILL_FAULT_END;
 * MILL_FAULT_MEMORY if out of memory), and returns whether there is none. A drum with end walls has
 * none of them. */
bool mill_ends_fit(const struct mill_setup *setup, struct mill_motion *const *motion,
                   struct mill_fault *fault);

#endif
