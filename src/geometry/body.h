/* Common parts of all bodies: a place in their motion's frame, bounds of their movement, and the
 * cells of the laboratory that they come near to. */
#ifndef MILL_BODY_H
#define MILL_BODY_H

#include "geometry/convex.h"
#include "geometry/solid.h"

/* Every surface starts with this. */
struct mill_bodied {
    struct mill_convex convex;
    struct mill_body is;
    struct mill_core core; /* of a convex body */
    struct mill_hull hull;
    vec3 along;         /* unit: direction of the hull's line */
    bool rings;         /* it turns about a line at rest. In this case: */
    vec3 through, axis; /* [m], unit */
    vec3 towards;  /* unit: it is within a strip from the line in this direction; 0: all around */
    double across; /* [m] half of the strip's width */
    double near, beyond;      /* [m] minimum and maximum distance of its points from the line */
    double from, to;          /* [m] along the line */
    struct mill_reach places; /* all places that balls can reach */
};

static inline const struct mill_body *mill_body_is(const struct mill_shape *shape)
{
    return &((const struct mill_bodied *)shape)->is;
}

/* Makes one surface of a body: wall number `wall` of a container, or all of it, with the members
 * that the caller has set (struct mill_shape, `is`). false: out of memory */
bool mill_body_create(struct mill_bodied *b, const struct mill_reach *places);

/* Wall number `wall` of a container, if it has one of this number */
struct mill_wall mill_body_wall(const struct mill_solid *solid, const struct mill_body *is,
                                int wall);

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
MILL_CONVEX_INLINE bool mill_body_is_far(const struct mill_bodied *b, const struct mill_flight *f,
                                         double radius)
{
    if (!(f->travel < (double)INFINITY))
        return false;
    const vec3 q = vec3_sub(f->place, b->is.centre);
    const double z = vec3_dot(q, b->along), beyond = fabs(z) - b->hull.half;
    const double far = b->hull.radius + radius + f->travel;
    const double square = vec3_dot(q, q) - z * z + (beyond > 0.0 ? beyond * beyond : 0.0);
    return square > far * far;
}

/* The surface of a convex body, met from outside: `VIEW` gives the distance (mill_convex_view_fn),
 * `IS_FAR` is a quick proof as above, `CREATE`: of struct mill_shape_type. */
#define MILL_BODY_SURFACE(TYPE, CREATE, VIEW, IS_FAR)                                              \
    static struct mill_hit next_contact(const struct mill_shape *shape,                            \
                                        const struct mill_flight *f, double radius, double now,    \
                                        double horizon, bool touching)                             \
    {                                                                                              \
        const struct mill_bodied *b = (const struct mill_bodied *)shape;                           \
        (void)touching;                                                                            \
        if (IS_FAR(b, f, radius))                                                                  \
            return mill_hit_at(INFINITY);                                                          \
        return mill_convex_search(&b->convex, VIEW, f, radius, now, horizon);                      \
    }                                                                                              \
    static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius, \
                                       const struct mill_pose *pose)                               \
    {                                                                                              \
        return mill_convex_contact((const struct mill_convex *)shape, VIEW, centre, radius, pose); \
    }                                                                                              \
    static const struct mill_shape_type surface = {.size = sizeof(TYPE),                           \
                                                   .create = CREATE,                               \
                                                   .next_contact = next_contact,                   \
                                                   .contact = contact,                             \
                                                   .reachable = mill_body_reachable,               \
                                                   .sector = mill_body_sector};

#endif
