/* Round surfaces about the x axis: the drum, met from inside, and the shaft, met from outside. */
#ifndef MILLSIM_CYLINDER_H
#define MILLSIM_CYLINDER_H

#include "geometry/shape.h"

/* radius [m]; the drum stands still. NULL when out of memory. */
struct mill_shape *mill_cylinder_drum(double radius);

/* radius [m]; its surface turns with the rotor at `speed` [rad/s]. NULL when out of memory. */
struct mill_shape *mill_cylinder_shaft(double radius, double speed);

#endif
