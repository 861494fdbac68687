/* Common parts of all bodies: a place in their motion's frame, bounds of their movement, and the
 * cells of the laboratory that they come near to. */
#ifndef MILL_BODY_H
#define MILL_BODY_H

#include "geometry/convex.h"
#include "geometry/shapes.h"

/* Every body, and every wall of one, starts with this. */
struct mill_bodied {
    struct mill_convex convex;
    struct mill_body is;
    struct mill_hull hull;
    bool rings;         /* it turns about a line at rest. In this case: */
    vec3 through, axis; /* [m], unit */
    vec3 towards;  /* unit: the body is within a strip that goes from the line in this direction;
                      0: it is all around the line */
    double across; /* [m] half of the strip's width */
    double near, beyond;      /* [m] minimum and maximum distance of its points from the line */
    double from, to;          /* [m] along the line */
    struct mill_reach places; /* all places that balls can reach */
    const struct mill_shape_type *of; /* the kind of body, for the one wall that draws it; else
                                         NULL */
};

/* Conversion between the body's own axes and its motion's frame */
static inline vec3 mill_body_turn_in(const struct mill_body *b, vec3 a)
{
    return vec3_make(vec3_dot(b->x, a), vec3_dot(b->y, a), vec3_dot(b->z, a));
}

static inline vec3 mill_body_turn_out(const struct mill_body *b, vec3 a)
{
    return vec3_axpy(vec3_axpy(vec3_scale(b->x, a.x), a.y, b->y), a.z, b->z);
}

static inline vec3 mill_body_in(const struct mill_body *b, vec3 place)
{
    return mill_body_turn_in(b, vec3_sub(place, b->centre));
}

static inline vec3 mill_body_out(const struct mill_body *b, vec3 place)
{
    return vec3_add(b->centre, mill_body_turn_out(b, place));
}

/* A round body is a core, grown by a distance. The core is a frustum, a line or a point on its
 * axis. A frustum that was shrunk by the rounding may end in a tip. */
struct mill_round_core {
    double from, to;  /* [m] along the axis; from > to: nothing of the core is left */
    double low, high; /* [m] its radii there */
    double grown;     /* [m] */
};
struct mill_round_core mill_round_core(const struct mill_shape_type *type,
                                       const struct mill_body *body);

/* Are centre and axes finite, and the axes unit, orthogonal and right-handed? */
bool mill_body_is_placed(const struct mill_body *body);

/* Fills the struct, except for `is`, which the caller has set. symmetry: an axis, in the body's own
 * frame, about which the surface can turn without a change; zero: none. ball: true if any direction
 * is such an axis. */
void mill_body_create(struct mill_bodied *b, const struct mill_chamber *chamber,
                      struct mill_hull hull, vec3 symmetry, bool ball);

/* `chart` of struct mill_shape_type for bodies with a shape of revolution, or without */
bool mill_body_chart_round(const struct mill_shape *shape, struct mill_pose *frame);
bool mill_body_chart_flat(const struct mill_shape *shape, struct mill_pose *frame);

/* reachable of struct mill_shape_type */
bool mill_body_reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius);

/* sector of struct mill_shape_type */
struct mill_sector mill_body_sector(const struct mill_shape *shape, vec3 lo, vec3 hi,
                                    double radius);

/* Reduces a box of the laboratory, which may be infinite, to the places that balls can reach */
void mill_body_clip(const struct mill_bodied *b, vec3 *lo, vec3 *hi);

/* Can a ball with its centre in the box [lo, hi] touch a part of the body that stays within the
 * given distances from the axis of the turn (ring[0..1]) and along it (ring[2..3])? */
bool mill_body_ring_meets(const struct mill_bodied *b, const double ring[4], vec3 lo, vec3 hi,
                          double radius);

/* A quick proof that the ball, within its travel, cannot come as near as `radius` to the hull */
static inline bool mill_body_is_far(const struct mill_bodied *b, const struct mill_flight *f,
                                    double radius)
{
    if (!(f->travel < (double)INFINITY))
        return false;
    const vec3 q = vec3_sub(f->place, b->is.centre);
    const double z = vec3_dot(q, b->is.z), beyond = fabs(z) - b->hull.half;
    const double far = b->hull.radius + radius + f->travel;
    const double square = vec3_dot(q, q) - z * z + (beyond > 0.0 ? beyond * beyond : 0.0);
    return square > far * far;
}

#endif
