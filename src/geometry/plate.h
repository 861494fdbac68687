/* The flat end walls. */
#ifndef MILLSIM_PLATE_H
#define MILLSIM_PLATE_H

#include "geometry/shape.h"

/* End wall `number`: 0 at x = -length/2, 1 at x = +length/2, met from inside. NULL when out of
 * memory. */
struct mill_shape *mill_plate_create(int number, double length);

#endif
