/* A rotating blade: a box fixed to the rotor. */
#ifndef MILLSIM_BLADE_H
#define MILLSIM_BLADE_H

#include "geometry/shape.h"
#include "millsim/deck.h"

/* Blade `number` of a rotor that turns at `speed` [rad/s]; mill_radius: no ball's centre is ever
 * farther from the axis [m]. NULL when out of memory. */
struct mill_shape *mill_blade_create(const struct mill_deck_blade *spec, int number, double speed,
                                     double mill_radius);

#endif
