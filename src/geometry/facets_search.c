/* The first time at which a ball meets a mesh. Each facet is a convex body, so the certificate of
 * convex.h is valid for each: its distance and the rate of this distance give a time before which
 * the ball cannot meet it. A search keeps this time of each facet that the ball can come near to,
 * and steps to the earliest one. Only facets that are due then are computed again.
 *
 * Facets that share the edge or corner that a ball meets have the same normal there: after the
 * impact the gaps to all of them open. */
#include "geometry/facets_near.h"

#include <assert.h>

/* Facets in the list of one search. If there are more, all in reach are computed at each step. */
enum { LISTED = 48 };
/* Fraction of a step: facets that are due this much later are computed in the same step. */
#define TOGETHER 0.25
/* Fraction of a radius: if a ball overlaps a facet by more, this is not due to rounding */
#define DEEP 1e-9

struct due {
    double t; /* [s] no contact with the facet before this time */
    int32_t facet;
};

struct search {
    const struct mill_facets *m;
    const struct mill_flight *flight;
    double radius, now, horizon;
    bool still, glides;
    /* the ball at one time, in the motion's frame: */
    double t;         /* [s] */
    vec3 place, v, g; /* [m], [m/s] relative to the frame, [m/s^2] */
    double a;         /* [m/s^2] bound of its acceleration during `longest` */
    double longest;   /* [s] INFINITY: until the end */
    double far;     /* [m^2] square of the distance beyond which it meets no facet before the end */
    double deepest; /* [m^2] square of the minimum distance of a facet */

    double reach, end;            /* [m], [s] of the present span, see begin_span() */
    struct mill_facets_walk walk; /* through the facets in reach during the span */
    bool seen;                    /* there are such facets */
    double next;                  /* [s] the earliest time at which a facet is due */
    bool all;                     /* the list contains all facets that are due before the end */
    int listed;
    struct due list[LISTED];
};

static void see(struct search *s, double t)
{
    const struct mill_convex *c = &s->m->body.convex;
    const struct mill_flight *f = s->flight;
    const vec3 r = vec3_fly(f->r, f->v, f->g, t), v = vec3_axpy(f->v, t, f->g);
    const struct mill_pose pose = mill_shape_pose(&c->base, s->now + t);
    const struct mill_seen seen = mill_convex_see(c, f, &pose, r, v, s->horizon - t);
    s->t = t;
    s->place = mill_pose_in(&pose, r);
    s->v = mill_pose_turn_in(&pose, vec3_sub(v, mill_pose_velocity(&pose, r)));
    s->g = s->still ? mill_pose_turn_in(&pose, f->g) : s->g;
    s->a = seen.acceleration;
    s->longest = seen.within < s->horizon - t ? seen.within : (double)INFINITY;
}

/* Begins a span at the present time. In a span the ball moves by at most `reach` [m], and only
 * facets within this distance are searched. */
static void begin_span(struct search *s)
{
    const double v = vec3_norm(s->v), left = s->horizon - s->t;
    const double h =
        mill_least(2.0 * s->reach / (v + sqrt(v * v + 2.0 * s->a * s->reach)), s->longest);
    s->end = h < left ? s->t + h : s->horizon;
    s->walk = mill_facets_set_out(&s->m->tree, s->place, s->radius + 1.001 * s->reach);
}

/* [s] The time before which the ball cannot meet the facet; not later than now: it meets it now. */
static double due(struct search *s, int32_t facet)
{
    int part;
    const vec3 way = mill_facets_look(&s->m->flat[facet], s->place, &part);
    const double square = vec3_dot(way, way);
    if (square > s->far) /* most */
        return INFINITY;
    const double distance = sqrt(square), d = distance - s->radius;
    const double d1 = distance > 0.0 ? vec3_dot(way, s->v) / distance : 0.0;
    s->deepest = mill_least(s->deepest, square);
    if (s->still && d1 >= 0.0 && d >= -MILL_SHAPE_CLOSED && vec3_dot(way, s->g) >= 0.0)
        return INFINITY; /* a plane at rest is between them: the ball never comes nearer */
    if (d <= MILL_SHAPE_CLOSED && d1 <= MILL_CONVEX_SLOWEST)
        return s->t;
    const bool glides = s->glides && d > -MILL_SHAPE_CLOSED;
    const double next = s->t + mill_least(mill_convex_step(d, d1, s->a, glides), s->longest);
    if (next > s->t)
        return next;
    /* the contact is nearer than the resolution of t */
    return d1 <= 0.0 ? s->t : nextafter(s->t, INFINITY);
}

static void find_far(struct search *s)
{
    const double h = s->end - s->t, far = s->radius + h * (vec3_norm(s->v) + 0.5 * s->a * h);
    s->far = s->longest >= h ? far * far * (1.0 + 1e-12) : (double)INFINITY;
}

/* Computes all facets in reach and lists those that are due before the end; true: one is met. */
static bool look_at_all(struct search *s)
{
    struct mill_facets_walk walk = s->walk;
    bool met = false;
    s->next = INFINITY;
    s->listed = 0;
    s->all = true;
    s->seen = false;
    find_far(s);
    for (int32_t k; (k = mill_facets_walk_on(&walk)) >= 0;) {
        const double t = due(s, k);
        met = met || t <= s->t;
        s->seen = true;
        if (t > s->end)
            continue;
        s->next = mill_least(s->next, t);
        if (s->listed < LISTED)
            s->list[s->listed++] = (struct due){t, k};
        else
            s->all = false;
    }
    return met;
}

/* Computes the facets due until `by` and keeps those due before the end; true: one is met. */
static bool look_at_due(struct search *s, double by)
{
    int kept = 0;
    bool met = false;
    s->next = INFINITY;
    find_far(s);
    for (int i = 0; i < s->listed; i++) {
        struct due one = s->list[i];
        if (one.t <= by) {
            one.t = due(s, one.facet);
            met = met || one.t <= s->t;
        }
        if (one.t > s->end)
            continue;
        s->next = mill_least(s->next, one.t);
        s->list[kept++] = one;
    }
    s->listed = kept;
    return met;
}

/* The search itself, after the state at the start is computed and the first span has begun */
static struct mill_hit go_on(struct search *s, struct mill_hit none)
{
    bool met = look_at_all(s);
    if (s->deepest < s->radius * s->radius * (1.0 - DEEP)) {
        struct mill_facets_near near;
        if (mill_facets_nearest(s->m, s->place, s->radius, &near) && near.behind)
            return mill_convex_get_out(near.d > 0.0 ? -vec3_dot(near.way, s->v) / near.d : 0.0,
                                       s->a, s->longest, s->horizon);
    }
    for (int step = 1; !met && step < MILL_CONVEX_MOST; step++) {
        s->glides = step >= MILL_CONVEX_PATIENCE;
        if (s->next <= s->end) {
            const double by = s->next + TOGETHER * (s->next - s->t);
            see(s, s->next);
            met = s->all ? look_at_due(s, by) : look_at_all(s);
        } else if (s->end < s->horizon) {
            s->reach = s->seen ? s->radius : 2.0 * s->reach;
            see(s, s->end);
            begin_span(s);
            met = look_at_all(s);
        } else {
            return none;
        }
    }
    /* not met: the ball makes many small hops along the body */
    return (struct mill_hit){met ? MILL_HIT_CONTACT : MILL_HIT_ASK_AGAIN, s->t};
}

struct mill_hit mill_facets_search(const struct mill_facets *m, const struct mill_flight *flight,
                                   double radius, double now, double horizon)
{
    assert(horizon >= 0.0);
    const struct mill_motion_bounds *b = &m->body.convex.bounds;
    const double end = horizon < MILL_CONVEX_FARTHEST ? horizon : MILL_CONVEX_FARTHEST;
    const struct mill_hit none = mill_convex_none(end, horizon);
    struct search s; /* its list is filled only as far as it is used */
    s.m = m;
    s.flight = flight;
    s.radius = s.reach = radius;
    s.now = now;
    s.horizon = s.end = end;
    s.still = b->turning == 0.0 && b->speed == 0.0;
    s.glides = false;
    s.deepest = INFINITY;
    if (flight->travel < (double)INFINITY) {
        s.walk = mill_facets_set_out(&m->tree, flight->place, radius + flight->travel);
        if (mill_facets_walk_on(&s.walk) < 0)
            return none;
        s.walk.next--; /* a walk from here on includes this facet and all others */
    }
    see(&s, 0.0);
    if (!(flight->travel <= radius))
        begin_span(&s);
    return go_on(&s, none);
}
