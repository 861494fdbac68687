/* Bounds of the distance between two solids, and between a solid and a container's wall. The true
 * distance is always within the bounds. */
#ifndef MILL_CLASH_GAP_H
#define MILL_CLASH_GAP_H

#include "start/clash_solid.h"

/* The distance is between `least` and `most`. least <= 0: the solids touch, or the search ended
 * before it could show that they do not. The bounds are close enough that steps of length `least`
 * make progress; they need not be closer than 2 % of `near`, the distance at which solids count as
 * touching. */
struct mill_clash_gap {
    double least, most; /* [m] */
    long looks;         /* number of parts and spheres compared */
};

/* Of two parts in one frame */
struct mill_clash_gap mill_clash_gap_parts(const struct mill_part *a, const struct mill_part *b,
                                           double near);

/* Of two solids. `a_in_b`: the pose of a's frame in b's frame */
struct mill_clash_gap mill_clash_gap_solids(const struct mill_clash_solid *a,
                                            const struct mill_clash_solid *b,
                                            const struct mill_pose *a_in_b, double near);

/* Distance from a solid to a wall; < 0: the solid reaches beyond the wall by that much. `least` is
 * accurate to a tenth of `near` or of the distance itself. `in`: the pose of the solid's frame in
 * the wall's frame, whose axis is z. */
struct mill_clash_gap mill_clash_gap_wall(const struct mill_wall *wall,
                                          const struct mill_clash_solid *solid,
                                          const struct mill_pose *in, double near);

#endif
