/* How one ball stands to many others: the quadratics of all candidates at once. */
#ifndef MILLSIM_RELATE_H
#define MILLSIM_RELATE_H

#include "millsim/world.h"

#define MILL_RELATE_LANES 4 /* candidates come in whole groups of so many */

/* What the candidates of one ball have in common */
struct mill_relate {
    const struct mill_ball *ball;
    const double *radius; /* [m] of each species */
    vec3 g;               /* [m/s^2] */
    double sum;           /* [m] of two radii where all balls are equal, else 0 */
};

/* For the n candidates near[0..n) of ball i, whose record must stand at local time `now`: with d and
 * u the relative position and velocity at `now` and s the sum of the radii, b = d.u (< 0: closing),
 * c = d.d - s^2 (< 0: overlapping) and square = b^2 - (u.u) c (> 0: they meet). Writes the numbers k
 * of those that are closing, will meet, and may do so before now + best to kept and returns how
 * many; b, c and square are set for all n. near must be padded with ball numbers, and all outputs
 * have room, up to the next multiple of MILL_RELATE_LANES and one group more. Every implementation
 * gives the same bits. */
typedef int32_t mill_relate_fn(const struct mill_relate *relate, int32_t i, double now, double best,
                               const int32_t *near, int32_t n, double *b, double *c, double *square,
                               int32_t *kept);

/* The fastest that this processor can run. */
mill_relate_fn *mill_relate_choose(void);

/* Each implementation by number, for tests: NULL beyond the last, and where this processor lacks
 * the instructions. */
mill_relate_fn *mill_relate_variant(int k, const char **name);

#endif
