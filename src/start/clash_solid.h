/* A body for the check for clashes: convex parts, in a tree if many; gaps of two; how it moves */
#ifndef MILL_CLASH_SOLID_H
#define MILL_CLASH_SOLID_H

#include "geometry/facets.h"
#include "geometry/solid.h"

/* A sphere around one part of a solid, or around all parts in a box of its tree */
struct mill_clash_ball {
    vec3 centre;
    double radius;     /* [m] */
    int32_t part, box; /* number of the part; -1: of the node of the tree */
};

struct mill_clash_solid {
    int surface; /* its number in the setup's list */
    int kind;    /* of contact */
    const struct mill_motion *motion;
    const struct mill_solid *solid; /* if not convex, the parts are only the surface of it */
    const struct mill_body *body;
    vec3 axis; /* unit vector in its motion's frame */
    int32_t parts;
    struct mill_part *part;       /* in the motion's frame */
    struct mill_facets_tree tree; /* of several parts, which are facets */
    struct mill_clash_ball all;   /* around all parts */
};

/* Surface number k of the setup. false: out of memory. The caller frees it in both cases. */
bool mill_clash_solid_init(struct mill_clash_solid *solid, const struct mill_setup *setup, int k,
                           struct mill_motion *const *motion);
void mill_clash_solid_free(struct mill_clash_solid *solid);

/* Divides the contents of a box. */
void mill_clash_solid_halves(const struct mill_clash_solid *solid,
                             const struct mill_clash_ball *ball, struct mill_clash_ball half[2]);

/* Is a point, given in the motion's frame of a solid that is not convex, inside of it? */
bool mill_clash_solid_holds(const struct mill_clash_solid *solid, vec3 place);

/* ---- gaps (clash_gap.c) ---- */

/* Bounds of the distance between two solids, and between a solid and a container's wall: it is
 * between `least` and `most`. least <= 0: they touch, or the search ended before it could show that
 * they do not. Users are told `least`, so it is within 10 % of `most`, or they differ by 2 % of
 * `near`, at which solids count as touching. looks: number of parts and spheres compared */

/* Of two parts in one frame */
struct mill_part_gap mill_clash_gap_parts(const struct mill_part *a, const struct mill_part *b,
                                          double near);

/* Of two solids. `a_in_b`: the pose of a's frame in b's frame */
struct mill_part_gap mill_clash_gap_solids(const struct mill_clash_solid *a,
                                           const struct mill_clash_solid *b,
                                           const struct mill_pose *a_in_b, double near);

/* Distance from a solid to a wall; < 0: so far the solid reaches beyond it. The bounds are
 * as close as those of mill_part_to_wall. `in`: the solid's frame in the wall's, whose axis is z */
struct mill_part_gap mill_clash_gap_wall(const struct mill_wall *wall,
                                         const struct mill_clash_solid *solid,
                                         const struct mill_pose *in, double near);

#endif
