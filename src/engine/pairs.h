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

enum { MILL_PAIRS_ROOM = 64, MILL_PAIRS_TOGETHER = 2 };

struct mill_pair {
    double dt;       /* [s] until they touch, INFINITY: never */
    int32_t partner; /* or MILL_NOBODY */
};

struct mill_pairs_search {
    int32_t ball;
    int looks;
    struct mill_grids_look look[MILL_GRIDS_LOOKS]; /* [looks] where its partners may be */
    struct mill_pair best; /* the earliest known; the search replaces it by an earlier one */
};

/* Looks for the earliest contacts of one ball or of MILL_PAIRS_TOGETHER balls, which do not depend
 * on each other. The times of their records must be the local time `now`. Each search has buffers
 * of its own: pairs[together], search[together]. Of contacts at equal times, the one with the
 * smaller ball is taken. Returns how many balls it examined. All variants give the same bits. */
typedef int32_t mill_pairs_fn(const struct mill_pairs *pairs, struct mill_pairs_search *search,
                              int together, double now);

/* The fastest variant that this processor can run. */
mill_pairs_fn *mill_pairs_choose(void);

/* The variants by number, for tests; NULL after the last one that this processor can run */
mill_pairs_fn *mill_pairs_variant(int k, const char **name);

#endif
