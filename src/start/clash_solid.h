/* What the check for clashes sees of a surface: convex parts, each a core and how far it is grown,
 * in a tree of spheres. */
#ifndef MILL_CLASH_SOLID_H
#define MILL_CLASH_SOLID_H

#include "millsim/setup.h"

#include <stdint.h>

enum mill_clash_form { MILL_CLASH_BOX, MILL_CLASH_ROUND, MILL_CLASH_FACET };

struct mill_clash_part {
    enum mill_clash_form form;
    vec3 centre;      /* [m] */
    vec3 x, y, z;     /* unit; of a facet its corners, from the centre [m] */
    vec3 half;        /* [m] of a box's core; half.z of a frustum's */
    double low, high; /* [m] a frustum's radii at -half.z and half.z; a line, a point: 0 */
    double grown;     /* [m] the part reaches so far beyond its core */
    double around;    /* [m] nowhere farther from the centre than this */
};

/* A sphere around all that is below it */
struct mill_clash_node {
    vec3 centre;
    double radius;       /* [m] */
    int32_t part;        /* of a leaf; -1: there are two below it, */
    int32_t left, right; /* their numbers */
};

struct mill_clash_solid {
    int surface; /* its number in the setup's list */
    const struct mill_motion *motion;
    const struct mill_body *body; /* NULL: a blade or a shaft */
    bool mesh;                    /* its parts are its surface alone */
    bool turned, ball; /* a body of revolution about `axis`; about any axis through its centre */
    vec3 axis;         /* unit, in its motion's frame */
    int32_t parts;
    struct mill_clash_part *part; /* in the motion's frame */
    struct mill_clash_node *node; /* [2 parts - 1], the first around all */
};

/* Is it a surface that can run into another one: a body, a blade, a shaft? */
bool mill_clash_solid_is(const struct mill_setup_surface *surface);

/* Surface number k of the setup. false: out of memory. Owner: the caller, in any case. */
bool mill_clash_solid_init(struct mill_clash_solid *solid, const struct mill_setup *setup, int k,
                           struct mill_motion *const *motion);
void mill_clash_solid_free(struct mill_clash_solid *solid);

/* The part elsewhere: `to` is the pose of its frame. */
struct mill_clash_part mill_clash_solid_move(const struct mill_clash_part *part,
                                             const struct mill_pose *to);

/* The place of its core that is farthest in a direction */
vec3 mill_clash_solid_support(const struct mill_clash_part *part, vec3 way);

/* Is a place of the solid's motion's frame within its closed mesh? */
bool mill_clash_solid_holds(const struct mill_clash_solid *mesh, vec3 place);

#endif
