/* Distances between solids, and from solids to a container's walls: bounds that hold for certain.
 */
#ifndef MILL_CLASH_GAP_H
#define MILL_CLASH_GAP_H

#include "geometry/shape.h"
#include "start/clash_solid.h"

/* The distance is between these; <= 0: they touch, or it is not known better. They are so near to
 * each other that steps by the least one go on well, and to 2 % of `near`, below which nobody asks.
 */
struct mill_clash_gap {
    double least, most; /* [m] */
    long looks;         /* at parts and spheres */
};

/* Of two parts in one frame */
struct mill_clash_gap mill_clash_gap_parts(const struct mill_clash_part *a,
                                           const struct mill_clash_part *b, double near);

/* Of two solids; `a_in_b`: the pose of a's frame in b's */
struct mill_clash_gap mill_clash_gap_solids(const struct mill_clash_solid *a,
                                            const struct mill_clash_solid *b,
                                            const struct mill_pose *a_in_b, double near);

/* How far a solid is from a wall, < 0: beyond it by as much; the least of it to a tenth of `near`
 * or of itself. `in`: the pose of the solid's frame in that of the wall, whose axis is z. */
struct mill_clash_gap mill_clash_gap_wall(const struct mill_wall *wall,
                                          const struct mill_clash_solid *solid,
                                          const struct mill_pose *in, double near);

#endif
