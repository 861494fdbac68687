/* A start state as a file. */
#ifndef MILL_START_WRITE_H
#define MILL_START_WRITE_H

#include "millsim/status.h"
#include "millsim/world.h"

#include <stdbool.h>

/* Writes the balls of a world at t = 0 to `path`, a start file that gives the same deck the same
 * balls to the last bit: x y z vx vy vz, and wx wy wz where a ball spins, behind one line of
 * comment that names columns, units and `deck`. The file is there as a whole or not at all.
 * MILL_BAD_DECK: it exists, and is not to be written over. */
enum mill_status mill_start_write(const struct mill_world *world, const char *deck,
                                  const char *path, bool over, struct mill_error *error);

#endif
