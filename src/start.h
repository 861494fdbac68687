/* First positions from a text file. */
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

#endif
