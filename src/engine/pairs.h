/* The earliest contact of one ball with the balls in the cells around it */
#ifndef MILLSIM_PAIRS_H
#define MILLSIM_PAIRS_H

#include "engine/grids.h"
#include "millsim/world.h"

#define MILL_NOBODY (-1)

struct mill_pairs {
    const struct mill_ball *ball;
    const double *radius; /* [m] of each species */
    vec3 g;               /* [m/s^2] */
    /* buffers of one search, with room for all possible partners and MILL_PAIRS_ROOM more */
    int32_t *near, *kept;
    double *terms; /* of the quadratics: of each group of lanes b, then c, then the square */
};

#define MILL_PAIRS_ROOM 64

struct mill_pair {
    double dt;       /* [s] until they touch, INFINITY: never */
    int32_t partner; /* or MILL_NOBODY */
};

/* Looks for a contact of ball i that is earlier than best->dt. The time of ball i's record must be
 * the local time `now`. Of contacts at equal times, the one with the smaller ball is taken. Returns
 * the number of balls that it examined. All variants give the same bits. */
typedef int32_t mill_pairs_fn(const struct mill_pairs *pairs, int32_t i, double now,
                              const struct mill_grids_look *look, int looks,
                              struct mill_pair *best);

/* The fastest variant that this processor can run. */
mill_pairs_fn *mill_pairs_choose(void);

/* The variants by number, for tests; NULL after the last one that this processor can run */
mill_pairs_fn *mill_pairs_variant(int k, const char **name);

#endif
