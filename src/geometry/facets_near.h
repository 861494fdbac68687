/* A facet as the searches use it: a triangle in its motion's frame, its front towards the balls */
#ifndef MILL_FACETS_NEAR_H
#define MILL_FACETS_NEAR_H

#include "geometry/body.h"
#include "geometry/facets.h"

/* Corners a, a + ab, a + ac. The projection of a place a + q is a + (u.q) ab + (v.q) ac. */
struct mill_facets_flat {
    vec3 a, ab, ac; /* [m] */
    vec3 u, v;      /* [1/m] NAN of a facet without area */
    double per[3];  /* [1/m^2] 1 / (length of side 0 (ab), 1, 2 (ac))^2 */
};

/* Data to find on which side of the surface a place is */
struct mill_facets_side {
    vec3 normal;       /* unit, towards the balls */
    int32_t across[3]; /* the neighbouring facet at side k; < 0: see mill_facets_outwards() */
    int32_t corner[3]; /* numbers */
};

struct mill_facets {
    struct mill_bodied body;
    vec3 (*corner)[3]; /* [m] as given, in the body's own frame */
    struct mill_facets_tree tree;
    struct mill_facets_flat *flat; /* in the tree's order, as all members below */
    struct mill_facets_side *side;
    vec3 *at_corner; /* sum of the normals around a corner, weighted by angles; at the end, see
                        find_across() */
};

/* The part of a facet that is nearest: its inside, 1 + number of a side, 4 + number of a corner */
enum { MILL_FACETS_INSIDE = 0, MILL_FACETS_SIDE = 1, MILL_FACETS_CORNER = 4 };

/* The vector from the nearest point of the facet to `place` [m]; *part: where this point is. If the
 * place is outside of the facet's prism, the nearest point is on one of the sides that the place is
 * beyond. For a facet so thin that u and v are inexact, the result is exact to second order. */
static inline vec3 mill_facets_look(const struct mill_facets_flat *f, vec3 place, int *part)
{
    static const int end[3][2] = {{0, 1}, {1, 2}, {0, 2}}; /* corners of each side */
    const vec3 q = vec3_sub(place, f->a);
    const double u = vec3_dot(f->u, q), v = vec3_dot(f->v, q);
    const bool beyond[3] = {!(v >= 0.0), !(u + v <= 1.0), !(u >= 0.0)};
    vec3 best = vec3_axpy(vec3_axpy(q, -u, f->ab), -v, f->ac);
    double least = INFINITY;
    *part = MILL_FACETS_INSIDE;
    for (int k = 0; k < 3; k++) {
        if (!beyond[k])
            continue;
        const vec3 from = k == 1 ? vec3_sub(q, f->ab) : q;
        const vec3 way = k == 0 ? f->ab : k == 1 ? vec3_sub(f->ac, f->ab) : f->ac;
        const double share = vec3_dot(from, way) * f->per[k];
        const double along = share > 0.0 ? (share < 1.0 ? share : 1.0) : 0.0;
        const vec3 off = vec3_axpy(from, -along, way);
        const double square = vec3_dot(off, off);
        if (!(square < least))
            continue;
        best = off;
        least = square;
        *part = along <= 0.0   ? MILL_FACETS_CORNER + end[k][0]
                : along >= 1.0 ? MILL_FACETS_CORNER + end[k][1]
                               : MILL_FACETS_SIDE + k;
    }
    return best;
}

/* The nearest point of the mesh, for a given place */
struct mill_facets_near {
    int32_t facet;
    int part;
    vec3 way;    /* [m] from the point to the place */
    double d;    /* [m] length of way */
    bool behind; /* the place is behind the surface, where no balls are */
};

/* Finds the nearest facet within `within` [m] of a place of the motion's frame; false: none */
bool mill_facets_nearest(const struct mill_facets *m, vec3 place, double within,
                         struct mill_facets_near *near);

/* The direction from the surface towards the balls at this point; not of unit length */
vec3 mill_facets_outwards(const struct mill_facets *m, const struct mill_facets_near *near);

/* next_contact of struct mill_shape_type */
struct mill_hit mill_facets_search(const struct mill_facets *m, const struct mill_flight *flight,
                                   double radius, double now, double horizon);

#endif
