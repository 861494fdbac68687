/* Makes a world from a setup, with the balls at their start positions. */
#ifndef MILLSIM_START_H
#define MILLSIM_START_H

#include "millsim/setup.h"
#include "millsim/world.h"

/* Share that the balls fill in a heap: bulk density over density */
#define MILL_START_PACKING 0.6

/* Receives frequent reports of the progress: `done` of `all` balls have a start position. */
struct mill_start_watch {
    void (*tell)(void *self, const char *what, int32_t done, int32_t all);
    void *self;
};

/* Makes the world of a setup. Given balls are checked for speed and overlap. Otherwise the seed
 * places them at random without overlap. The world keeps no pointer to the setup. watch and fault
 * may be NULL. On a fault *world is NULL. Owner: the caller; mill_world_free. */
enum mill_fault_code mill_start_world(const struct mill_setup *setup,
                                      const struct mill_start_watch *watch,
                                      struct mill_world **world, struct mill_fault *fault);

/* [m^3] The free volume at t = 0, whatever time the world has reached: the container without the
 * shaft, the blades and the bodies in it. Balls do not count. It is measured in boxes, with a 128th
 * of the cube root of the volume around the container as sides. Error: below 0.1 % of the
 * container's volume for parts thicker than such a box (1.1 mm in a drum of 150 mm); of thinner
 * parts it is at most their own volume. It takes 0.03 to 0.1 s. -1: out of memory. */
double mill_start_free_volume(const struct mill_world *world);

/* The same for a setup whose balls are not known yet: nothing about balls is read. Sets *volume, or
 * returns what is wrong with the drum or the bodies. */
enum mill_fault_code mill_start_free_volume_of(const struct mill_setup *setup, double *volume);

#endif
