/* One wall of a container: flat, or round and met from inside.
 *
 * A round wall (of a cylinder, cone, capsule or sphere) has the distance m, the contact radius,
 * from a core, which is a line or a point. q goes from its nearest point to the ball's centre. The
 * gap closes when f = m^2 - q^2 does. The second derivative of f is at least -2 (v^2 + m a), where
 * v and a are bounds of the ball's speed and acceleration relative to the wall. This includes the
 * curvature 1/m and needs no square root. Steps by this bound never pass the first contact and
 * converge quadratically to it, as for convex bodies. For a cone, m changes along the axis.
 *
 * For walls that do not move, or only turn about their own axis, closed forms are used. */
#include "geometry/body.h"

/* Fraction of a ball's radius: a ball nearer than this to a cone's tip is in the tip. */
#define TIP 1e-9

struct wall {
    struct mill_bodied body;
    struct mill_wall is;               /* in the motion's frame, if it is flat */
    vec3 point, normal;                /* in the laboratory, if it is flat and fixed */
    double cosine;                     /* of the angle between a cone's side and its axis */
    struct mill_pose pose;             /* of the body's own frame, if it is round and fixed */
    const struct mill_motion *carrier; /* the innermost motion that moves the centre */
};

/* ---- flat ---- */

MILL_CONVEX_INLINE struct mill_view view(const struct mill_convex *convex, vec3 place)
{
    const struct wall *w = (const struct wall *)convex;
    return (struct mill_view){vec3_dot(w->is.normal, vec3_sub(place, w->is.point)), w->is.normal};
}

/* ---- round ---- */

/* The place of a ball's centre relative to the core */
struct seat {
    double m;    /* [m] contact radius there */
    vec3 q;      /* [m] from the nearest point of the core */
    double away; /* [m] length of q */
};

/* q: from the body's centre; axis: the body's own axis; both in the same frame */
static struct seat seat_of(const struct wall *w, vec3 q, vec3 axis, double radius)
{
    const double z = vec3_dot(q, axis), half = w->is.half;
    const double core = z > half ? half : (z < -half ? -half : z);
    struct seat s = {.m = w->is.radius + w->is.slope * z - radius / w->cosine};
    s.q = vec3_axpy(q, -core, axis);
    s.away = vec3_norm(s.q);
    return s;
}

/* A ball relative to the body, in a frame that turns with its axis; this may be the laboratory. */
struct sight {
    vec3 q, u, axis; /* [m] from the centre, [m/s], unit */
    struct mill_seen seen;
};

static struct sight look(const struct wall *w, const struct mill_flight *f, double now, double t,
                         double h)
{
    const struct mill_convex *c = &w->body.convex;
    const vec3 r = vec3_fly(f->r, f->v, f->g, t), v = vec3_axpy(f->v, t, f->g);
    struct sight s;
    if (c->bounds.turning > 0.0) {
        const struct mill_pose pose = mill_shape_pose(&c->base, now + t);
        s.seen = mill_convex_see(c, f, &pose, r, v, h);
        s.q = vec3_sub(mill_pose_in(&pose, r), c->centre);
        s.u = mill_pose_turn_in(&pose, vec3_sub(v, mill_pose_velocity(&pose, r)));
        s.axis = w->body.is.z;
    } else {
        vec3 velocity;
        s.q = vec3_sub(r, mill_motion_point(w->carrier, now + t, c->centre, &velocity));
        s.u = vec3_sub(v, velocity);
        s.seen = mill_convex_see_from(c, f, s.q, s.u, h);
        s.axis = w->pose.x;
    }
    return s;
}

static double gap_of(const struct wall *w, const struct seat *s)
{
    return (s->m - s->away) * w->cosine;
}

/* [s] minimum time until f can be zero, with rate f1 and f'' >= -b */
static double step_of(double f, double f1, double b)
{
    if (f <= 0.0)
        return f1 / b;
    const double root = sqrt(f1 * f1 + 2.0 * b * f);
    return f1 < 0.0 ? 2.0 * f / (root - f1) : (f1 + root) / b;
}

static struct mill_hit search(const struct wall *w, const struct mill_flight *flight, double radius,
                              double now, double horizon)
{
    const double end = horizon < MILL_CONVEX_FARTHEST ? horizon : MILL_CONVEX_FARTHEST;
    struct mill_hit hit;
    const double slope = w->is.slope, lean = sqrt(1.0 + slope * slope);
    double t = 0.0;
    for (int step = 0; step < MILL_CONVEX_MOST; step++) {
        const struct sight at = look(w, flight, now, t, end - t);
        const struct seat s = seat_of(w, at.q, at.axis, radius);
        const double f = (s.m - s.away) * (s.m + s.away);
        const double f1 = 2.0 * (s.m * slope * vec3_dot(at.u, at.axis) - vec3_dot(at.u, s.q));
        const double gap = gap_of(w, &s), closing = 0.5 * f1 / s.m * w->cosine;
        if (gap <= MILL_SHAPE_CLOSED && closing <= MILL_CONVEX_SLOWEST)
            return (struct mill_hit){MILL_HIT_CONTACT, t};
        const double a = at.seen.acceleration,
                     free = sqrt(mill_greatest(s.m, 0.0) * a); /* beyond a tip, m < 0 */
        const double speed = vec3_norm(at.u);
        /* a time in which the speed grows by at most half of the larger of these two speeds */
        const double cap = mill_least(at.seen.within, 0.5 * mill_greatest(speed, free) / a);
        const double h = cap < end - t ? cap : end - t;
        const double most = speed + a * h, m = s.m + fabs(slope) * most * h;
        const bool glides = step >= MILL_CONVEX_PATIENCE && gap > -MILL_SHAPE_CLOSED;
        const double room = glides ? 2.0 * m * MILL_CONVEX_CONCEDED : 0.0;
        const double next =
            t + mill_least(step_of(f + room, f1, 2.0 * (most * most + m * a * lean)),
                           h < end - t ? h : (double)INFINITY);
        if (mill_convex_ends(next, f1, horizon, &t, &hit))
            return hit;
    }
    return (struct mill_hit){MILL_HIT_ASK_AGAIN, t}; /* many small hops along the wall */
}

static struct seat seat_at(const struct wall *w, vec3 centre, double radius,
                           const struct mill_pose *pose)
{
    const struct mill_body *is = &w->body.is;
    return seat_of(w, vec3_sub(mill_pose_in(pose, centre), is->centre), is->z, radius);
}

/* The contact with the wall in the direction `out` from the core, in the motion's frame */
static struct mill_contact meet(const struct wall *w, const struct seat *seat, vec3 out,
                                vec3 centre, double radius, const struct mill_pose *pose)
{
    const struct mill_body *is = &w->body.is;
    const vec3 inward = vec3_axpy(vec3_scale(out, -w->cosine), w->is.slope * w->cosine, is->z);
    const double gap = gap_of(w, seat);
    const vec3 n = mill_pose_turn_out(pose, inward), point = vec3_axpy(centre, -(gap + radius), n);
    return (struct mill_contact){n, point, mill_pose_velocity(pose, point), gap};
}

/* ---- both ---- */

static struct mill_hit next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                                    double radius, double now, double horizon, bool touching)
{
    const struct wall *w = (const struct wall *)shape;
    if (shape->fixed && w->is.flat) {
        const vec3 n = w->normal, r = vec3_sub(f->r, w->point);
        const double p[5] = {radius - vec3_dot(n, r), -vec3_dot(n, f->v), -0.5 * vec3_dot(n, f->g)};
        return mill_hit_at(mill_poly_first_rise(p, horizon, touching, NULL));
    }
    if (shape->fixed && w->is.slope == 0.0 && isinf(w->is.half)) {
        struct mill_flight seen = *f;
        seen.r = mill_pose_in(&w->pose, f->r);
        seen.v = mill_pose_turn_in(&w->pose, f->v);
        seen.g = mill_pose_turn_in(&w->pose, f->g);
        return mill_hit_at(
            mill_shape_circle(&seen, 0.0, 0.0, w->is.radius - radius, 1.0, horizon, touching));
    }
    if (w->is.flat)
        return mill_convex_search(&w->body.convex, view, f, radius, now, horizon);
    return search(w, f, radius, now, horizon);
}

static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   const struct mill_pose *pose)
{
    const struct wall *w = (const struct wall *)shape;
    if (w->is.flat)
        return mill_convex_contact(&w->body.convex, view, centre, radius, pose);
    const struct seat s = seat_at(w, centre, radius, pose);
    /* in the centre any direction will do */
    const vec3 out = s.away > 0.0 ? vec3_scale(s.q, 1.0 / s.away) : w->body.is.x;
    return meet(w, &s, out, centre, radius, pose);
}

/* A ball in the tip of a cone touches all around, and closes on the side towards which it moves */
static bool beside(const struct mill_shape *shape, vec3 centre, vec3 v, double radius,
                   const struct mill_pose *pose, struct mill_contact *k)
{
    const struct wall *w = (const struct wall *)shape;
    if (w->is.flat || w->is.slope == 0.0)
        return false;
    const struct seat s = seat_at(w, centre, radius, pose);
    const vec3 z = w->body.is.z;
    const vec3 u = mill_pose_turn_in(pose, vec3_sub(v, mill_pose_velocity(pose, centre)));
    const vec3 across = vec3_axpy(u, -vec3_dot(u, z), z);
    const double speed = vec3_norm(across);
    if (s.away > TIP * radius || s.m > TIP * radius || !(speed > 0.0))
        return false;
    *k = meet(w, &s, vec3_scale(across, 1.0 / speed), centre, radius, pose);
    return vec3_dot(vec3_sub(v, k->velocity), k->normal) < 0.0;
}

/* The corner of the box that is nearest to a fixed flat wall says whether a ball can touch it. */
static bool reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct wall *w = (const struct wall *)shape;
    const vec3 n = w->normal;
    if (!shape->fixed || !w->is.flat)
        return mill_body_reachable(shape, lo, hi, radius);
    mill_body_clip(&w->body, &lo, &hi);
    const vec3 near = {n.x > 0.0 ? lo.x : hi.x, n.y > 0.0 ? lo.y : hi.y, n.z > 0.0 ? lo.z : hi.z};
    return vec3_dot(n, vec3_sub(near, w->point)) <=
           radius * (1.0 + 1e-3) + 1e-6 * (w->body.hull.half + w->body.hull.radius);
}

static bool create(struct mill_shape *shape)
{
    struct wall *w = (struct wall *)shape;
    const struct mill_body *is = &w->body.is;
    w->is = mill_body_wall(shape->solid, is, shape->wall);
    w->cosine = 1.0 / sqrt(1.0 + w->is.slope * w->is.slope);
    const struct mill_pose at = mill_shape_pose(shape, 0.0);
    if (w->is.flat) {
        w->is.point = mill_body_out(is, w->is.point);
        w->is.normal = mill_body_turn_out(is, w->is.normal);
        w->point = mill_pose_out(&at, w->is.point);
        w->normal = mill_pose_turn_out(&at, w->is.normal);
        shape->fixed = shape->fixed || mill_motion_keeps(shape->motion, w->is.normal);
    } else {
        shape->hollow = w->is.radius;
        /* its x is the body's axis, as mill_shape_circle() requires */
        w->pose = (struct mill_pose){.place = mill_pose_out(&at, is->centre),
                                     .x = mill_pose_turn_out(&at, is->z),
                                     .y = mill_pose_turn_out(&at, is->x),
                                     .z = mill_pose_turn_out(&at, is->y)};
    }
    w->carrier = mill_motion_that_moves(shape->motion, is->centre);
    return true;
}

const struct mill_shape_type mill_wall_type = {
    sizeof(struct wall), create, NULL, next_contact, contact, reachable, .beside = beside};
