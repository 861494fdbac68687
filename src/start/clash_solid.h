/* A body as the check for clashes uses it: convex parts in a tree of spheres. */
#ifndef MILL_CLASH_SOLID_H
#define MILL_CLASH_SOLID_H

#include "geometry/solid.h"

#include <stdint.h>

/* A sphere around everything in its part of the tree */
struct mill_clash_node {
    vec3 centre;
    double radius;       /* [m] */
    int32_t part;        /* number of a leaf's part; -1: an inner node */
    int32_t left, right; /* numbers of an inner node's two children */
};

struct mill_clash_solid {
    int surface; /* its number in the setup's list */
    int kind;    /* of contact */
    const struct mill_motion *motion;
    const struct mill_body *body;
    bool convex; /* false: the parts are the surface only, the inside is empty */
    /* turned: a body of revolution about `axis`. ball: one about any axis through its centre */
    bool turned, ball;
    vec3 axis; /* unit vector in its motion's frame */
    int32_t parts;
    struct mill_part *part;       /* in the motion's frame */
    struct mill_clash_node *node; /* [2 parts - 1], the first one is around all parts */
};

/* Surface number k of the setup. false: out of memory. The caller frees it in both cases. */
bool mill_clash_solid_init(struct mill_clash_solid *solid, const struct mill_setup *setup, int k,
                           struct mill_motion *const *motion);
void mill_clash_solid_free(struct mill_clash_solid *solid);

/* Is a point, given in the motion's frame of a solid that is not convex, inside of it? */
bool mill_clash_solid_holds(const struct mill_clash_solid *solid, vec3 place);

#endif
