/* First positions: random, without overlap. */
#ifndef MILLSIM_FILL_H
#define MILLSIM_FILL_H

#include "millsim/start.h"

/* Places all balls of the world (shapes and species are there, ball[i].species set) at random
 * without overlap with each other, or with any shape as it stands at the start, by the setup's
 * seed, and gives each the setup's speed in a random direction. watch may be NULL.
 * MILL_FAULT_NO_ROOM with the numbers that would fit when they do not. */
enum mill_fault_code mill_fill_random(const struct mill_setup *setup,
                                      const struct mill_start_watch *watch,
                                      struct mill_world *world, struct mill_fault *fault);

#endif
