/* A convex body on a motion, met from outside. The program works in the body's frame, in which the
 * body does not move. The gap of a ball is the distance of its centre from the body, less its
 * radius. This is exact for faces, edges and corners, but it is not a polynomial in time.
 *
 * The search for the first contact is certified. The distance to a convex body is convex, so along
 * a path the gap d obeys d'' >= -A, where A is a bound of the acceleration in the body's frame
 * (gravity, Coriolis, centrifugal and Euler parts, and the acceleration of the frame's origin).
 * From (d, d') the gap cannot be zero before t = (d' + sqrt(d'^2 + 2 A d)) / A. Steps to this time
 * never go past the first contact and converge to it quadratically.
 *
 * The function of each kind of body for its distance is inlined into the functions below. */
#ifndef MILLSIM_CONVEX_H
#define MILLSIM_CONVEX_H

#include "geometry/shape.h"

#include <assert.h>

/* [m/s] a closed gap that opens more slowly counts as closing; the rebound floor then parts them */
#define MILL_CONVEX_SLOWEST 1e-9
/* [m] extra gap after too many steps: a ball that glides has a gap, and steps, of almost zero */
#define MILL_CONVEX_CONCEDED 1e-13
/* [s] maximum length of a search, because the bound of the acceleration grows with it */
#define MILL_CONVEX_FARTHEST 1.0
enum {
    MILL_CONVEX_PATIENCE = 400, /* usual steps are one or two; then it uses the extra gap */
    MILL_CONVEX_MOST = 4000     /* steps before the search stops; a later event continues it */
};

/* A view function is inlined only if all functions that pass it on are inlined too. */
#define MILL_CONVEX_INLINE static inline __attribute__((always_inline))

/* Distance and direction from the body to a place */
struct mill_view {
    double d; /* [m] signed distance */
    vec3 n;   /* unit: direction from the body to the place */
};

/* Every convex body starts with this. */
struct mill_convex {
    struct mill_shape base;
    vec3 centre; /* [m] of the body, in its motion's frame */
    /* of the motion, at the centre; without a turn about an axis of revolution of the body */
    struct mill_motion_bounds bounds;
};

/* Place and normal in the body's frame */
typedef struct mill_view mill_convex_view_fn(const struct mill_convex *, vec3 place);

MILL_CONVEX_INLINE struct mill_view mill_convex_look(const struct mill_convex *c,
                                                     mill_convex_view_fn *view, vec3 r,
                                                     const struct mill_pose *pose)
{
    if (!c->base.motion)
        return view(c, r);
    struct mill_view k = view(c, mill_pose_in(pose, r));
    k.n = mill_pose_turn_out(pose, k.n);
    return k;
}

/* The movement of a ball relative to a body, at one time */
struct mill_seen {
    double acceleration; /* [m/s^2] maximum during `within` */
    double within;       /* [s] in this time the bound grows by at most half */
};

/* The acceleration in the body's frame has these parts: gravity, acceleration of the centre,
 * Coriolis, centrifugal and Euler. q, u: place and velocity relative to the centre [m], [m/s]; h:
 * time for which the bound is requested [s]. */
static inline struct mill_seen mill_convex_see_from(const struct mill_convex *c,
                                                    const struct mill_flight *f, vec3 q, vec3 u,
                                                    double h)
{
    const struct mill_motion_bounds *b = &c->bounds;
    /* normal to the axis of the turn */
    const double speed = vec3_norm(vec3_axpy(u, -vec3_dot(u, b->axis), b->axis));
    const double free = (f->pull + b->acceleration) * (1.0 + 1e-9), omega = b->turning;
    struct mill_seen seen = {.within = h};
    const double turning = omega * omega + b->spin_up;
    const double now = free + 2.0 * omega * speed + turning * vec3_norm(q) + 1e-9;
    const double growth = 2.0 * omega * free + turning * (vec3_norm(u) + free * h);
    if (growth * h > 0.5 * now)
        seen.within = 0.5 * now / growth;
    seen.acceleration = now + growth * seen.within;
    return seen;
}

static inline struct mill_seen mill_convex_see(const struct mill_convex *c,
                                               const struct mill_flight *f,
                                               const struct mill_pose *pose, vec3 r, vec3 v,
                                               double h)
{
    const vec3 centre = mill_pose_out(pose, c->centre);
    return mill_convex_see_from(c, f, vec3_sub(r, centre),
                                vec3_sub(v, mill_pose_velocity(pose, centre)), h);
}

/* A quick proof that a gap d with rate d1 stays open for h [s]: the same bounds with sums in place
 * of lengths need no root. Most searches end here, above all in dense charges. */
static inline bool mill_convex_stays_open(const struct mill_convex *c, const struct mill_flight *f,
                                          vec3 q, vec3 u, double h, double d, double d1)
{
    const struct mill_motion_bounds *b = &c->bounds;
    const double free = (f->pull + b->acceleration) * (1.0 + 1e-9), omega = b->turning;
    const double speed = fabs(u.x) + fabs(u.y) + fabs(u.z) + free * h;
    const double distance = fabs(q.x) + fabs(q.y) + fabs(q.z) + speed * h;
    const double a = free + 2.0 * omega * speed + (omega * omega + b->spin_up) * distance + 1e-9;
    return d > MILL_SHAPE_CLOSED && d + h * (d1 - 0.5 * a * h) > MILL_SHAPE_CLOSED;
}

/* [s] minimum time until a gap d (> 0, or almost) with rate d1 and acceleration <= a can be zero */
static inline double mill_convex_step(double d, double d1, double a, bool glides)
{
    if (d <= 0.0 && !glides)
        return d1 / a; /* overlapping but opening: it cannot close earlier */
    if (d1 < 0.0)
        return 2.0 * d / (sqrt(d1 * d1 + 2.0 * a * d) - d1);
    const double room = (d > 0.0 ? d : 0.0) + (glides ? MILL_CONVEX_CONCEDED : 0.0);
    return (d1 + sqrt(d1 * d1 + 2.0 * a * room)) / a;
}

/* What a search returns that has found nothing until its end */
static inline struct mill_hit mill_convex_none(double end, double horizon)
{
    return end < horizon ? (struct mill_hit){MILL_HIT_ASK_AGAIN, end} : mill_hit_at(INFINITY);
}

/* The end of a step: goes on to the time `next` before which there is no contact, given the rate of
 * the gap now. true: the search has ended with *hit. */
MILL_CONVEX_INLINE bool mill_convex_ends(double next, double rate, double horizon, double *t,
                                         struct mill_hit *hit)
{
    const double end = horizon < MILL_CONVEX_FARTHEST ? horizon : MILL_CONVEX_FARTHEST;
    if (next > end) {
        *hit = mill_convex_none(end, horizon);
        return true;
    }
    if (!(next > *t) && rate <= 0.0) { /* the contact is nearer than the resolution of t */
        *hit = (struct mill_hit){MILL_HIT_CONTACT, *t};
        return true;
    }
    *t = next > *t ? next : nextafter(*t, INFINITY);
    return false;
}

/* For a ball whose centre is in the body, as only a pinched ball's is: there is a contact while it
 * moves inwards. out: [m/s] how fast it moves out; a, longest: as seen; left: [s] of the search */
static inline struct mill_hit mill_convex_get_out(double out, double a, double longest, double left)
{
    if (out <= MILL_CONVEX_SLOWEST)
        return mill_hit_at(0.0);
    const double t = mill_least(out / a, longest);
    return t < left ? (struct mill_hit){MILL_HIT_ASK_AGAIN, t} : mill_hit_at(INFINITY);
}

/* next_contact of struct mill_shape_type. After a contact now the gap opens: steps lead away. */
MILL_CONVEX_INLINE struct mill_hit mill_convex_search(const struct mill_convex *c,
                                                      mill_convex_view_fn *view,
                                                      const struct mill_flight *f, double radius,
                                                      double now, double horizon)
{
    assert(horizon >= 0.0);
    const double end = horizon < MILL_CONVEX_FARTHEST ? horizon : MILL_CONVEX_FARTHEST;
    struct mill_hit hit = {MILL_HIT_NONE, INFINITY};
    const bool still = c->bounds.turning == 0.0 && c->bounds.speed == 0.0;
    double t = 0.0;
    for (int step = 0; step < MILL_CONVEX_MOST; step++) {
        const vec3 r = vec3_fly(f->r, f->v, f->g, t), v = vec3_axpy(f->v, t, f->g);
        const struct mill_pose pose = mill_shape_pose(&c->base, now + t);
        const struct mill_view k = mill_convex_look(c, view, r, &pose);
        const double d = k.d - radius;
        const double d1 = vec3_dot(k.n, vec3_sub(v, mill_pose_velocity(&pose, r)));
        if (still && d1 >= 0.0 && d >= -MILL_SHAPE_CLOSED && vec3_dot(k.n, f->g) >= 0.0)
            return hit; /* a plane at rest is between body and ball: the ball never comes nearer */
        if (d <= MILL_SHAPE_CLOSED && d1 <= MILL_CONVEX_SLOWEST)
            return (struct mill_hit){MILL_HIT_CONTACT, t};
        const bool glides = step >= MILL_CONVEX_PATIENCE && d > -MILL_SHAPE_CLOSED;
        const vec3 centre = mill_pose_out(&pose, c->centre), q = vec3_sub(r, centre);
        const vec3 u = vec3_sub(v, mill_pose_velocity(&pose, centre));
        double next = INFINITY;
        if (!mill_convex_stays_open(c, f, q, u, end - t, d, d1)) {
            const struct mill_seen seen = mill_convex_see_from(c, f, q, u, end - t);
            const double longest = seen.within < end - t ? seen.within : (double)INFINITY;
            next = t + mill_least(mill_convex_step(d, d1, seen.acceleration, glides), longest);
        }
        if (mill_convex_ends(next, d1, horizon, &t, &hit))
            return hit;
    }
    /* the ball makes many small hops along the body */
    return (struct mill_hit){MILL_HIT_ASK_AGAIN, t};
}

MILL_CONVEX_INLINE struct mill_contact mill_convex_contact(const struct mill_convex *c,
                                                           mill_convex_view_fn *view, vec3 centre,
                                                           double radius,
                                                           const struct mill_pose *pose)
{
    const struct mill_view k = mill_convex_look(c, view, centre, pose);
    return mill_shape_touch(centre, k.d, k.n, radius, pose);
}

#endif
