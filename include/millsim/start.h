/* From a setup to a world in which the balls stand where they start. */
#ifndef MILLSIM_START_H
#define MILLSIM_START_H

#include "millsim/setup.h"
#include "millsim/world.h"

/* Who is told, often, how far the start positions are: `done` of `all` balls. */
struct mill_start_watch {
    void (*tell)(void *self, const char *what, int32_t done, int32_t all);
    void *self;
};

/* Makes the world of a setup: motions, surfaces, species, and the balls, given ones checked for
 * speed and overlap, others placed at random without overlap by the seed. Nothing of the setup is
 * kept. watch and fault may be NULL; on a fault *world is NULL. Owner: the caller;
 * mill_world_free. */
enum mill_fault_code mill_start_world(const struct mill_setup *setup,
                                      const struct mill_start_watch *watch,
                                      struct mill_world **world, struct mill_fault *fault);

#endif
