/* The wavy drum: arcs bulging outwards and inwards, as one surface. */
#ifndef MILLSIM_WAVY_H
#define MILLSIM_WAVY_H

#include "base/profile.h"
#include "geometry/shape.h"

/* A drum of this profile that stands still; its height is not 0. Its parts are its arcs: the outer
 * ones even, the inner ones odd, by rising angle from profile->angle on. NULL when out of memory.
 */
struct mill_shape *mill_wavy_create(const struct mill_profile *profile);

#endif
