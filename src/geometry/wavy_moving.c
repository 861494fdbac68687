/* A wavy drum that moves. In its own frame the gap to the wall is the gap to the nearest arc. Where
 * the nearest arc changes from an outer to an inner one, the gap has no kink, because the line
 * between the two centres is the normal of both. So the wall consists of smooth branches, one for
 * each inner arc with the halves of the outer arcs next to it, and the gap is the minimum over the
 * branches.
 *
 * For each branch nearby there is a bound of the time until it can close: its second derivative is
 * at least -(a + v^2 / s), where a and v are bounds of the ball's acceleration and speed relative
 * to the drum, and s is its distance from the centre of the outer arc. In addition, no gap changes
 * faster than the place; near the centre of an arc this bound is better. */
#include "geometry/convex.h"
#include "geometry/wavy.h"

/* A branch of the wall: the gap to it and how it changes */
struct branch {
    double gap, rate; /* [m], [m/s] */
};

/* The movement of a ball relative to the drum */
struct sight {
    vec3 r, u;                  /* [m], [m/s] */
    double speed, acceleration; /* maximum during `within` */
    double within;              /* [s] */
};

static struct sight look(const struct mill_wavy *w, const struct mill_flight *f, double now,
                         double t, double h)
{
    const struct mill_convex as = {.bounds = w->bounds};
    const vec3 r = vec3_fly(f->r, f->v, f->g, t), v = vec3_axpy(f->v, t, f->g);
    const struct mill_pose pose = mill_shape_pose(&w->body.convex.base, now + t);
    const struct mill_seen seen = mill_convex_see(&as, f, &pose, r, v, h);
    const vec3 u = mill_pose_turn_in(&pose, vec3_sub(v, mill_pose_velocity(&pose, r)));
    const double speed = vec3_norm(u), a = seen.acceleration;
    const double cap = 0.5 * mill_greatest(speed, sqrt(a * w->radius)) / a;
    const double within = mill_least(h, mill_least(cap, seen.within));
    return (struct sight){mill_pose_in(&pose, r), u, speed + a * within, a, within};
}

static struct branch branch_of(const struct mill_wavy *w, int arc, const struct sight *s,
                               double radius)
{
    const struct mill_contact k = mill_wavy_arc_contact(w, arc, s->r, radius);
    return (struct branch){k.gap, vec3_dot(s->u, k.normal)};
}

/* [s] A time in which no branch can close; *nearest: the branch with the smallest gap, or the one
 * that closes fastest if several are closed */
static double safe_time(const struct mill_wavy *w, const struct sight *s, double radius,
                        bool glides, struct branch *nearest)
{
    const struct mill_wavy_near near = mill_wavy_nearest(w, s->r.y, s->r.z);
    const int arc = near.arc, own = near.outer;
    const double away = mill_wavy_distance(&w->arc[own], s->r.y, s->r.z);
    const bool fits = w->radius > radius;
    const double bend = fits ? 2.0 * s->speed * s->speed / away : 0.0;
    const double a = s->acceleration + bend;
    /* at an outer arc, the branches on both sides are this arc; after them come the next ones */
    const int other[3] = {arc == own ? arc : near.beside, (own + 3) % w->arcs,
                          (own + w->arcs - 3) % w->arcs};
    *nearest = branch_of(w, arc, s, radius);
    double step = mill_convex_step(nearest->gap, nearest->rate, a, glides);
    for (int k = 0; k < 3; k++) {
        if (other[k] == arc)
            continue;
        const struct branch b = branch_of(w, other[k], s, radius);
        const double more = mill_convex_step(b.gap, b.rate, a, glides);
        /* if the ball touches both sides, the branch that it leaves does not limit the step */
        if (b.gap > MILL_SHAPE_CLOSED || b.rate < 0.0)
            step = mill_least(step, more);
        if (b.gap <= MILL_SHAPE_CLOSED && b.rate < nearest->rate)
            *nearest = b;
    }
    if (fits)
        step = mill_least(step, 0.5 * away / s->speed);
    return mill_greatest(step, nearest->gap / s->speed);
}

struct mill_hit mill_wavy_moving_contact(const struct mill_wavy *w, const struct mill_flight *f,
                                         double radius, double now, double horizon)
{
    const double end = horizon < MILL_CONVEX_FARTHEST ? horizon : MILL_CONVEX_FARTHEST;
    struct mill_hit hit;
    double t = 0.0;
    for (int step = 0; step < MILL_CONVEX_MOST; step++) {
        const struct sight s = look(w, f, now, t, end - t);
        struct branch b;
        const double safe = safe_time(w, &s, radius, step >= MILL_CONVEX_PATIENCE, &b);
        if (b.gap <= MILL_SHAPE_CLOSED && b.rate <= MILL_CONVEX_SLOWEST)
            return (struct mill_hit){MILL_HIT_CONTACT, t};
        const double next = t + mill_least(safe, s.within < end - t ? s.within : (double)INFINITY);
        if (mill_convex_ends(next, b.rate, horizon, &t, &hit))
            return hit;
    }
    return (struct mill_hit){MILL_HIT_ASK_AGAIN, t};
}
