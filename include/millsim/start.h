/* Makes a world from a setup, with the balls at their start positions. */
#ifndef MILLSIM_START_H
#define MILLSIM_START_H

#include "millsim/setup.h"
#include "millsim/world.h"

/* Receives frequent reports of the progress: `done` of `all` balls have a start position. */
struct mill_start_watch {
    void (*tell)(void *self, const char *what, int32_t done, int32_t all);
    void *self;
};

/* Makes the world of a setup: motions, surfaces, species and balls. Given balls are checked for
 * speed and overlap. Otherwise balls are placed at random without overlap; the seed decides where.
 * The world keeps no pointer to the setup. watch and fault may be NULL. On a fault *world is NULL.
 * Owner: the caller; mill_world_free. */
enum mill_fault_code mill_start_world(const struct mill_setup *setup,
                                      const struct mill_start_watch *watch,
                                      struct mill_world **world, struct mill_fault *fault);

#endif
