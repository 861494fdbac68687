/* First positions from a text file, and into one. */
#ifndef MILLSIM_START_H
#define MILLSIM_START_H

#include "millsim/deck.h"
#include "millsim/status.h"
#include "millsim/world.h"

/* Reads deck->start, one ball a line: x y z [vx vy vz [wx wy wz]] in SI, # comments. Every fault
 * (too few or too many rows, not a number, a ball outside the mill or overlapping) is named with
 * file and line. watch may be NULL. */
enum mill_status mill_start_read(const struct mill_deck *deck, const struct mill_start_watch *watch,
                                 struct mill_world *world, struct mill_error *error);

/* Writes the balls of a world at t = 0 to `path`, a start file that gives the same deck the same
 * balls to the last bit: x y z vx vy vz, and wx wy wz where a ball spins, behind one line of
 * comment that names columns, units and `deck`. The file is there as a whole or not at all.
 * MILL_BAD_DECK: it exists, and is not to be written over. */
enum mill_status mill_start_write(const struct mill_world *world, const char *deck,
                                  const char *path, bool over, struct mill_error *error);

#endif
