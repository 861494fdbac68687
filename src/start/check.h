/* Do the balls of a start overlap anything? */
#ifndef MILLSIM_CHECK_H
#define MILLSIM_CHECK_H

#include "millsim/setup.h"
#include "millsim/world.h"

/* Fills in the fault of the first ball that is too fast or overlaps a surface or another ball, or
 * where memory is short. */
enum mill_fault_code mill_check_start(const struct mill_world *world, struct mill_fault *fault);

#endif
