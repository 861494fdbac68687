/* The arcs of the wavy drum, shared by wavy.c (drum at rest) and wavy_moving.c */
#ifndef MILL_WAVY_H
#define MILL_WAVY_H

#include "base/elementary.h"
#include "base/profile.h"
#include "geometry/shapes.h"

/* An arc: outer (even number) or inner (odd number) */
struct mill_wavy_arc {
    double y, z;                 /* [m] its centre */
    double uy, uz;               /* unit direction from the axis to the centre */
    double edge_y[2], edge_z[2]; /* of outer arcs: normals of the lines to the inner centres
                                    before and after, towards the wedge */
};

struct mill_wavy {
    struct mill_bodied body;
    double radius;                    /* [m] of the arcs */
    double far;                       /* [m] bound of all coordinates y, z in the drum */
    double bore;                      /* [m] nothing of the wall is nearer to the axis */
    double angle;                     /* [rad] of arc 0 */
    double half_pitch;                /* [rad] between neighbouring arcs */
    struct mill_heading pitch;        /* of half_pitch */
    struct mill_motion_bounds bounds; /* of the motion, at the drum's centre, with its turning */
    bool overhangs;                   /* an outer arc's wedge is wider than 180 degrees */
    int arcs;
    struct mill_wavy_arc *arc;
    int sectors;       /* number of sectors of directions, at least four per pitch */
    int16_t *outer_at; /* for each sector, the outer arc in whose pitch it begins */
};

/* +1: balls meet it from inside (outer arcs), -1: from outside (inner arcs) */
static inline double mill_wavy_inward(int arc)
{
    return arc % 2 == 0 ? 1.0 : -1.0;
}

/* The number of an arc, for a number less than 2 * arcs: without a division */
static inline int mill_wavy_wrap(const struct mill_wavy *w, int arc)
{
    return arc < w->arcs ? arc : arc - w->arcs;
}

/* [m] Distance from an edge of the wedge; > 0: on the wedge's side */
static inline double mill_wavy_beyond(const struct mill_wavy_arc *a, int edge, double y, double z)
{
    return a->edge_y[edge] * (y - a->y) + a->edge_z[edge] * (z - a->z);
}

static inline double mill_wavy_distance(const struct mill_wavy_arc *a, double y, double z)
{
    return sqrt((y - a->y) * (y - a->y) + (z - a->z) * (z - a->z));
}

/* Is the place in the half turn after the arc's direction? */
static inline bool mill_wavy_is_after(const struct mill_wavy_arc *a, double y, double z)
{
    return z * a->uy - y * a->uz >= 0.0;
}

/* Sectors are equal parts of the square |y| + |z| = 1, counted from -y. No sector is wider than
 * half a pitch. */
static inline int mill_wavy_sector(const struct mill_wavy *w, double y, double z)
{
    const double sum = fabs(y) + fabs(z);
    if (!(sum > 0.0))
        return 0;
    const double along = z < 0.0 ? 1.0 + y / sum : 3.0 - y / sum; /* 0 .. 4 */
    const int k = (int)(0.25 * along * w->sectors);
    return k < w->sectors ? k : w->sectors - 1;
}

/* Arcs near a place in the drum */
struct mill_wavy_near {
    int arc;    /* the nearest one */
    int outer;  /* the outer arc in whose pitch the place is */
    int beside; /* the inner arc on the other side of the outer arc's ray */
};

static inline struct mill_wavy_near mill_wavy_nearest(const struct mill_wavy *w, double y, double z)
{
    int k = w->outer_at[mill_wavy_sector(w, y, z)];
    if (mill_wavy_is_after(&w->arc[k + 1], y, z))
        k = mill_wavy_wrap(w, k + 2);
    const struct mill_wavy_arc *outer = &w->arc[k];
    const bool after = mill_wavy_is_after(outer, y, z);
    const int next = k + 1, last = k > 0 ? k - 1 : w->arcs - 1;
    const bool in = mill_wavy_beyond(outer, after, y, z) > 0.0;
    return (struct mill_wavy_near){in ? k : after ? next : last, k, after ? last : next};
}

/* The contact with one arc, in the drum's frame */
static inline struct mill_contact mill_wavy_arc_contact(const struct mill_wavy *w, int arc,
                                                        vec3 centre, double radius)
{
    const struct mill_wavy_arc *a = &w->arc[arc];
    const double s = mill_wavy_inward(arc), d = mill_wavy_distance(a, centre.y, centre.z);
    /* at the centre of an outer arc any direction will do: take the direction from the axis */
    const double uy = d > 0.0 ? (centre.y - a->y) / d : a->uy;
    const double uz = d > 0.0 ? (centre.z - a->z) / d : a->uz;
    return (struct mill_contact){.normal = {0.0, -s * uy, -s * uz},
                                 .point = {centre.x, a->y + w->radius * uy, a->z + w->radius * uz},
                                 .gap = s * (w->radius - s * radius - d)};
}

/* next_contact of struct mill_shape_type, for a drum that moves */
struct mill_hit mill_wavy_moving_contact(const struct mill_wavy *w, const struct mill_flight *f,
                                         double radius, double now, double horizon);

#endif
