/* What the wavy drum's files share: its arcs. */
#ifndef MILL_WAVY_PRIVATE_H
#define MILL_WAVY_PRIVATE_H

#include "geometry/shape.h"

/* Outer (even) or inner (odd) */
struct arc {
    double y, z;                 /* [m] its centre */
    double uy, uz;               /* direction of that from the axis */
    double edge_y[2], edge_z[2]; /* outer ones: normals of the lines to the inner centres before and
                                    after, towards the wedge */
};

struct wavy {
    struct mill_shape base;
    double radius;               /* [m] of the arcs */
    double far;                  /* [m] bound of a coordinate in the drum */
    double angle;                /* [rad] of arc 0 */
    double half_pitch;           /* [rad] between an arc and the next */
    double cos_pitch, sin_pitch; /* of half_pitch */
    bool overhangs;              /* an outer arc's wedge is wider than 180 degrees */
    int arcs;
    struct arc *arc;
    int sectors;       /* of the directions, four or more to a pitch */
    int16_t *outer_at; /* the outer arc in whose pitch each begins */
};

/* +1: met from inside (outer arcs), -1: from outside (inner arcs) */
static inline double inward(int arc)
{
    return arc % 2 == 0 ? 1.0 : -1.0;
}

/* Of a number that is less than twice as large: no division */
static inline int wrap(const struct wavy *w, int arc)
{
    return arc < w->arcs ? arc : arc - w->arcs;
}

/* > 0: on the wedge's side of that edge [m] */
static inline double beyond_edge(const struct arc *a, int edge, double y, double z)
{
    return a->edge_y[edge] * (y - a->y) + a->edge_z[edge] * (z - a->z);
}

static inline double distance(const struct arc *a, double y, double z)
{
    return sqrt((y - a->y) * (y - a->y) + (z - a->z) * (z - a->z));
}

/* `parts` of struct mill_shape_type (wavy_reach.c) */
struct mill_span mill_wavy_parts(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius);

#endif
