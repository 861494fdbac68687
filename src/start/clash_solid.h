/* A surface as the check for clashes uses it: convex parts in a tree of spheres. A part is a core
 * plus all points within a given distance of the core. */
#ifndef MILL_CLASH_SOLID_H
#define MILL_CLASH_SOLID_H

#include "millsim/setup.h"

#include <stdint.h>

enum mill_clash_form { MILL_CLASH_BOX, MILL_CLASH_ROUND, MILL_CLASH_FACET };

struct mill_clash_part {
    enum mill_clash_form form;
    vec3 centre;      /* [m] */
    vec3 x, y, z;     /* unit vectors; of a facet its corners, relative to the centre [m] */
    vec3 half;        /* [m] half the sides of a box's core; only half.z of a frustum's core */
    double low, high; /* [m] a frustum's radii at -half.z and half.z; 0 for a line or a point */
    double grown;     /* [m] the part extends this far beyond its core */
    double around;    /* [m] no point of the part is farther from the centre */
};

/* A sphere around everything in its part of the tree */
struct mill_clash_node {
    vec3 centre;
    double radius;       /* [m] */
    int32_t part;        /* number of a leaf's part; -1: an inner node */
    int32_t left, right; /* numbers of an inner node's two children */
};

struct mill_clash_solid {
    int surface; /* its number in the setup's list */
    const struct mill_motion *motion;
    const struct mill_body *body; /* NULL for a blade or a shaft */
    bool mesh;                    /* true: the parts are the surface only, the inside is empty */
    /* turned: a body of revolution about `axis`. ball: one about any axis through its centre */
    bool turned, ball;
    vec3 axis; /* unit vector in its motion's frame */
    int32_t parts;
    struct mill_clash_part *part; /* in the motion's frame */
    struct mill_clash_node *node; /* [2 parts - 1], the first one is around all parts */
};

/* Is it a surface that can run into another one: a body, a blade, a shaft? */
bool mill_clash_solid_is(const struct mill_setup_surface *surface);

/* Surface number k of the setup. false: out of memory. The caller frees it in both cases. */
bool mill_clash_solid_init(struct mill_clash_solid *solid, const struct mill_setup *setup, int k,
                           struct mill_motion *const *motion);
void mill_clash_solid_free(struct mill_clash_solid *solid);

/* Returns the part in another frame. `to`: the pose of the part's frame in that frame. */
struct mill_clash_part mill_clash_solid_move(const struct mill_clash_part *part,
                                             const struct mill_pose *to);

/* The point of the part's core that is farthest in the direction `way` */
vec3 mill_clash_solid_support(const struct mill_clash_part *part, vec3 way);

/* [m] The largest distance of the surface's points from the x axis of its motion's frame. The
 * surface is a body. -1: out of memory */
double mill_clash_solid_reach(const struct mill_setup_surface *surface);

/* Is a point, given in the mesh's motion's frame, inside this closed mesh? */
bool mill_clash_solid_holds(const struct mill_clash_solid *mesh, vec3 place);

#endif
