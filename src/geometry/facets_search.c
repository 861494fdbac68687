/* When a ball first meets a mesh. Each facet is a convex body, so convex.h's certificate holds for
 * each: from its distance and the rate of that it cannot be met before a certain time. A search
 * keeps that time for every facet that the ball can come near to, and goes on to the first of them;
 * only facets whose time has come are looked at again. So the first contact with any of them is
 * found, as for one convex body, and a facet that is out of reach costs one look. Facets that share
 * the edge or corner that a ball meets have one normal there: after the impact the gaps to all of
 * them open. */
#include "geometry/facets_near.h"

#include <assert.h>

enum { LISTED = 48 /* facets in one search; of more all in reach are looked at each time */ };
/* Of a step: facets that are due so much later are looked at in the same one. */
#define TOGETHER 0.25
/* Of a radius: a facet nearer than this to a ball's surface is no contact of rounding */
#define DEEP 1e-9

struct due {
    double t; /* [s] the facet cannot be met before */
    int32_t facet;
};

struct search {
    const struct mill_facets *m;
    const struct mill_flight *flight;
    double radius, now, end;
    bool still, glides;
    /* the ball at one moment, in the motion's frame: */
    double t;                     /* [s] */
    vec3 place, v, g;             /* [m], [m/s] relative to the frame, [m/s^2] */
    double a;                     /* [m/s^2] bound of its acceleration, for: */
    double longest;               /* [s] INFINITY: to the end */
    double deepest;               /* [m] least distance of a facet */
    struct mill_facets_walk walk; /* through those in reach */
    double next;                  /* [s] the first time at which one is due */
    bool all;                     /* the list holds all that are due before the end */
    int listed;
    struct due list[LISTED];
};

/* Sees the ball at time t. */
static struct mill_pose see(struct search *s, double t)
{
    const struct mill_convex *c = &s->m->body.convex;
    const struct mill_flight *f = s->flight;
    const vec3 r = vec3_fly(f->r, f->v, f->g, t), v = vec3_axpy(f->v, t, f->g);
    const struct mill_pose pose = mill_shape_pose(&c->base, s->now + t);
    const struct mill_seen seen = mill_convex_see(c, f, &pose, r, v, s->end - t);
    s->t = t;
    s->place = mill_pose_in(&pose, r);
    s->v = mill_pose_turn_in(&pose, vec3_sub(v, mill_pose_velocity(&pose, r)));
    s->g = s->still ? mill_pose_turn_in(&pose, f->g) : s->g;
    s->a = seen.acceleration;
    s->longest = seen.within < s->end - t ? seen.within : (double)INFINITY;
    return pose;
}

/* [m] that the ball gets, at most, from where it is seen until the end: its acceleration grows no
 * faster than it does in mill_convex_see(). */
static double travel(const struct search *s, const struct mill_pose *pose)
{
    const struct mill_convex *c = &s->m->body.convex;
    const struct mill_motion_bounds *b = &c->bounds;
    const struct mill_flight *f = s->flight;
    const struct mill_seen seen = mill_convex_see(c, f, pose, f->r, f->v, 0.0);
    const vec3 u = vec3_sub(f->v, mill_pose_velocity(pose, mill_pose_out(pose, c->centre)));
    const double h = s->end, free = (f->pull + b->acceleration) * (1.0 + 1e-9);
    const double turning = b->turning * b->turning + b->spin_up;
    const double growth = 2.0 * b->turning * free + turning * (vec3_norm(u) + free * h);
    return h * (vec3_norm(s->v) + h * (0.5 * seen.acceleration + h * growth / 6.0)) * (1.0 + 1e-9);
}

/* [s] before which the ball cannot meet the facet; not after now: it does. */
static double due(struct search *s, int32_t facet)
{
    int part;
    const vec3 way = mill_facets_look(&s->m->flat[facet], s->place, &part);
    const double distance = vec3_norm(way), d = distance - s->radius;
    const double d1 = distance > 0.0 ? vec3_dot(way, s->v) / distance : 0.0;
    s->deepest = mill_least(s->deepest, distance);
    if (s->still && d1 >= 0.0 && d >= -MILL_SHAPE_CLOSED && vec3_dot(way, s->g) >= 0.0)
        return INFINITY; /* the plane between facet and ball stands still: never nearer again */
    if (d <= MILL_SHAPE_CLOSED && d1 <= MILL_CONVEX_SLOWEST)
        return s->t;
    const bool glides = s->glides && d > -MILL_SHAPE_CLOSED;
    const double next = s->t + mill_least(mill_convex_step(d, d1, s->a, glides), s->longest);
    if (next > s->t)
        return next;
    return d1 <= 0.0 ? s->t : nextafter(s->t, INFINITY); /* nearer than the clock can tell */
}

/* Looks at all facets in reach and lists those that are due before the end; true: one is met. */
static bool look_at_all(struct search *s)
{
    struct mill_facets_walk walk = s->walk;
    bool met = false;
    s->next = INFINITY;
    s->listed = 0;
    s->all = true;
    for (int32_t k; (k = mill_facets_walk_on(&walk)) >= 0;) {
        const double t = due(s, k);
        met = met || t <= s->t;
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

/* Looks at those that are due by `by` and keeps on the list what is due before the end. */
static bool look_at_due(struct search *s, double by)
{
    int kept = 0;
    bool met = false;
    s->next = INFINITY;
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

/* A ball whose centre has got behind the surface: only a pinched one does. It is met while it goes
 * on inwards. */
static struct mill_hit get_out(const struct search *s, const struct mill_facets_near *near)
{
    const double out = near->d > 0.0 ? -vec3_dot(near->way, s->v) / near->d : 0.0;
    if (out <= MILL_CONVEX_SLOWEST)
        return (struct mill_hit){MILL_HIT_CONTACT, 0.0};
    const double t = mill_least(out / s->a, s->longest);
    return t < s->end ? (struct mill_hit){MILL_HIT_ASK_AGAIN, t}
                      : (struct mill_hit){MILL_HIT_NONE, INFINITY};
}

/* From the moment that is seen on */
static struct mill_hit go_on(struct search *s, struct mill_hit none)
{
    const struct mill_facets *m = s->m;
    bool met = look_at_all(s);
    if (s->deepest < s->radius * (1.0 - DEEP)) {
        struct mill_facets_near near;
        if (mill_facets_nearest(m, s->place, s->radius, &near) && near.behind)
            return get_out(s, &near);
    }
    for (int step = 1; !met && step < MILL_CONVEX_MOST; step++) {
        if (!(s->next <= s->end))
            return none;
        const double by = s->next + TOGETHER * (s->next - s->t);
        s->glides = step >= MILL_CONVEX_PATIENCE;
        see(s, s->next);
        met = s->all ? look_at_due(s, by) : look_at_all(s);
    }
    /* not met: a ball that hops along the body */
    return (struct mill_hit){met ? MILL_HIT_CONTACT : MILL_HIT_ASK_AGAIN, s->t};
}

struct mill_hit mill_facets_search(const struct mill_facets *m, const struct mill_flight *flight,
                                   double radius, double now, double horizon)
{
    assert(horizon >= 0.0);
    const struct mill_motion_bounds *b = &m->body.convex.bounds;
    struct search s;
    s.m = m;
    s.flight = flight;
    s.radius = radius;
    s.now = now;
    s.end = horizon < MILL_CONVEX_FARTHEST ? horizon : MILL_CONVEX_FARTHEST;
    s.still = b->turning == 0.0 && b->speed == 0.0;
    s.glides = false;
    s.deepest = INFINITY;
    const struct mill_hit none = s.end < horizon ? (struct mill_hit){MILL_HIT_ASK_AGAIN, s.end}
                                                 : (struct mill_hit){MILL_HIT_NONE, INFINITY};
    const bool known = flight->travel < (double)INFINITY;
    if (known) {
        s.walk = mill_facets_set_out(&m->tree, flight->place, radius + flight->travel);
        if (mill_facets_walk_on(&s.walk) < 0)
            return none;
        s.walk.next--; /* a walk from here on goes through it, and all others */
    }
    const struct mill_pose pose = see(&s, 0.0);
    if (!known)
        s.walk = mill_facets_set_out(&m->tree, s.place, radius + travel(&s, &pose));
    return go_on(&s, none);
}
