/* When does a ball meet a contour?
 *
 * At rest, as a container: a flight is divided at the times at which it passes from places beside
 * one piece to places beside another one (quadratics). Within each, mill_poly_first_rise gives the
 * time at which the gap to the piece, a quartic, first closes. There is no time between the pieces,
 * so no contact at a joint is missed, for any rounding.
 *
 * In motion, and as a body: the search of convex.h for each piece. The distance of a line, of a
 * corner and of an arc that curves away from the balls is convex; the one of an arc that curves
 * around them has a second derivative of at least -v^2 / s, where s is the distance from the centre
 * of its circle. The plan of squares says which pieces are near, and how far the others are. */
#include "geometry/contour.h"

/* Fractions of a radius: a centre behind a piece by less than DEEP overlaps it; an arc that is
 * wider than the ball by less than SNUG is too narrow for it. */
#define DEEP 0.5
#define SNUG 1e-12

/* Does a ball of this radius not fit into the arc? Then it only meets what is beside the arc. */
static bool is_narrow(const struct mill_contour_piece *p, double radius)
{
    return 2.0 * p->bend * radius >= 1.0 - SNUG;
}

/* ---- places ---- */

/* A direction of the contour's own frame, in its motion's frame */
static vec3 turn_out(const struct mill_contour *c, double x, double y, double z)
{
    return c->plain ? vec3_make(z, x, y) : mill_body_turn_out(&c->body.is, vec3_make(x, y, z));
}

/* The nearest point: distance, < 0 in the solid, and the own direction from it to the balls */
struct nearest {
    double d;
    vec3 n;
    int piece;
};

static struct nearest find_nearest(const struct mill_contour *c, const struct mill_contour_spot *s)
{
    const struct mill_contour_nook nook = mill_contour_nook_at(c, s->x, s->y);
    struct mill_contour_view best = {.d = INFINITY}, end = best;
    int found = 0, ended = 0;
    for (int i = 0; i < nook.close; i++) {
        const int k = mill_contour_listed(c, nook, i);
        const struct mill_contour_view v = mill_contour_look(&c->piece[k], s->x, s->y);
        if (v.beside && fabs(v.d) < fabs(best.d)) {
            best = v;
            found = k;
        } else if (!v.beside && v.d < end.d) {
            end = v;
            ended = k;
        } else if (!v.beside && v.d <= end.d) {
            end.out += v.out; /* along both normals of a joint; behind a corner that points into the
                                 solid < 0 */
        }
    }
    if (end.d < fabs(best.d)) {
        const bool joint = fabs(best.d) - end.d <= SNUG * c->far; /* nearer by rounding only */
        const double side = (joint ? best.d : end.out) < 0.0 ? -1.0 : 1.0;
        best.d = side * end.d;
        best.nx = joint ? best.nx : side * end.nx;
        best.ny = joint ? best.ny : side * end.ny;
        found = joint ? found : ended;
    }
    struct nearest near = {best.d, {best.nx, best.ny, 0.0}, found};
    if (s->beyond != 0.0 && best.d <= 0.0) {
        near.d = fabs(s->beyond);
        near.n = vec3_make(0.0, 0.0, copysign(1.0, s->beyond));
    } else if (s->beyond != 0.0) {
        near.d = sqrt(best.d * best.d + s->beyond * s->beyond);
        near.n =
            vec3_make(best.nx * best.d / near.d, best.ny * best.d / near.d, s->beyond / near.d);
    }
    return near;
}

int mill_contour_nearest(const struct mill_contour *c, double x, double y)
{
    const struct mill_contour_spot s = {x, y, 0.0};
    return find_nearest(c, &s).piece;
}

/* The contact in a direction `n` of the own frame, at distance d [m] */
static struct mill_contact meet(const struct mill_contour *c, vec3 n, double d, vec3 centre,
                                double radius, const struct mill_pose *pose)
{
    const bool moves = c->body.convex.base.motion;
    const vec3 own = turn_out(c, n.x, n.y, n.z), none = {0.0, 0.0, 0.0};
    const vec3 normal = moves ? mill_pose_turn_out(pose, own) : own;
    const vec3 point = vec3_axpy(centre, -d, normal);
    return (struct mill_contact){normal, point, moves ? mill_pose_velocity(pose, point) : none,
                                 d - radius};
}

static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   const struct mill_pose *pose)
{
    const struct mill_contour *c = (const struct mill_contour *)shape;
    const struct mill_contour_spot s =
        mill_contour_spot_of(c, shape->motion ? mill_pose_in(pose, centre) : centre);
    const struct nearest near = find_nearest(c, &s);
    return meet(c, near.n, near.d, centre, radius, pose);
}

/* All places that the ball overlaps by more than `slack` less than nothing [m], each nearer than
 * the places around it; returns how many, `most` at most. In the rounding of a joint, one. */
static int find_places(const struct mill_contour *c, vec3 centre, double radius, double slack,
                       const struct mill_pose *pose, struct mill_contact *k, int most)
{
    const bool moves = c->body.convex.base.motion;
    const struct mill_contour_spot s =
        mill_contour_spot_of(c, moves ? mill_pose_in(pose, centre) : centre);
    const struct mill_contour_nook nook = mill_contour_nook_at(c, s.x, s.y);
    int found = 0;
    for (int i = 0; i < nook.count && found < most; i++) {
        const struct mill_contour_piece *p = &c->piece[mill_contour_listed(c, nook, i)];
        const struct mill_contour_view v = mill_contour_look(p, s.x, s.y);
        const double d = sqrt(v.d * v.d + s.beyond * s.beyond);
        if (v.beside && v.d > 0.0 && d < radius + slack && !is_narrow(p, radius))
            k[found++] = meet(c, vec3_make(v.nx * v.d / d, v.ny * v.d / d, s.beyond / d), d, centre,
                              radius, pose);
    }
    return found;
}

static int places(const struct mill_shape *shape, vec3 centre, double radius,
                  const struct mill_pose *pose, struct mill_contact *k, int most)
{
    const struct mill_contour *c = (const struct mill_contour *)shape;
    const int found = find_places(c, centre, radius, 0.0, pose, k, most);
    k[0] = found > 0 ? k[0] : contact(shape, centre, radius, pose);
    return found > 0 ? found : 1;
}

/* In a corner a ball touches several pieces: finds the one that it closes on fastest. */
static bool beside(const struct mill_shape *shape, vec3 centre, vec3 v, double radius,
                   const struct mill_pose *pose, struct mill_contact *k)
{
    enum { MOST = 8 };
    const struct mill_contour *c = (const struct mill_contour *)shape;
    struct mill_contact all[MOST];
    const int found = find_places(c, centre, radius, SNUG * c->far, pose, all, MOST);
    double fastest = 0.0;
    for (int i = 0; i < found; i++) {
        const double rate = vec3_dot(vec3_sub(v, all[i].velocity), all[i].normal);
        if (rate < fastest) {
            fastest = rate;
            *k = all[i];
        }
    }
    return fastest < 0.0;
}

/* ---- at rest ---- */

/* A flight in the plane of the contour: at t, (x, y) + (u, v) t + (g, h) t^2 / 2 */
struct course {
    double x, y, u, v, g, h;
};

static inline double along(const struct course *f, const double line[3], double part[2])
{
    part[0] = line[0] * f->u + line[1] * f->v;
    part[1] = 0.5 * (line[0] * f->g + line[1] * f->h);
    return mill_contour_past(line, f->x, f->y);
}

/* Adds the times in (0, end) at which the flight crosses a line, in ascending order. */
static int add_crossings(const struct course *f, const double line[3], double end, double *t, int n)
{
    double part[2], root[2];
    const double past = along(f, line, part);
    if (fabs(past) > end * (fabs(part[0]) + end * fabs(part[1])))
        return n;
    const int roots = mill_poly_quadratic(part[1], 0.5 * part[0], past, root);
    for (int i = 0; i < roots; i++) {
        if (!(root[i] > 0.0 && root[i] < end))
            continue;
        int at = n++;
        for (; at > 0 && t[at - 1] > root[i]; at--)
            t[at] = t[at - 1];
        t[at] = root[i];
    }
    return n;
}

static struct course at_time(const struct course *f, double t)
{
    const double x = f->x + t * (f->u + 0.5 * t * f->g), y = f->y + t * (f->v + 0.5 * t * f->h);
    return (struct course){x, y, f->u + t * f->g, f->v + t * f->h, f->g, f->h};
}

/* The gap to a piece as a polynomial that rises when the gap closes: radius - normal . q +
 * bend (q^2 - radius^2), of a corner radius^2 - q^2; false: the ball is behind the piece. */
static bool set_gap(const struct mill_contour_piece *p, const struct course *f, double radius,
                    double gap[5])
{
    const double x = f->x - p->x, y = f->y - p->y, b = p->bend, whole = p->half > 0.0;
    const double from = p->nx * x + p->ny * y - b * (x * x + y * y);
    gap[0] = radius * (whole - b * radius) - from;
    gap[1] = 2.0 * b * (x * f->u + y * f->v) - (p->nx * f->u + p->ny * f->v);
    gap[2] =
        b * (f->u * f->u + f->v * f->v + x * f->g + y * f->h) - 0.5 * (p->nx * f->g + p->ny * f->h);
    gap[3] = b * (f->u * f->g + f->v * f->h);
    gap[4] = 0.25 * b * (f->g * f->g + f->h * f->h);
    return whole > 0.0 && from < -DEEP * radius;
}

/* The first contact with one piece; touching: the ball touches it now */
static double piece_contact(const struct mill_contour_piece *p, const struct course *f,
                            double radius, double horizon, bool touching,
                            struct mill_poly_counts *counts)
{
    double t[6] = {0.0}, gap[5];
    int n = add_crossings(f, p->from, horizon, t + 1, 0);
    n = add_crossings(f, p->to, horizon, t + 1, n);
    t[n + 1] = horizon;
    for (int i = 0; i <= n; i++) {
        /* after the last crossing the side does not change, so any later time will do */
        const double within = t[i + 1] <= 1e9 ? 0.5 * (t[i] + t[i + 1]) : t[i] + 1.0;
        const struct course part = i == 0 ? *f : at_time(f, t[i]), middle = at_time(f, within);
        if (!mill_contour_is_beside(p, middle.x, middle.y) || set_gap(p, &part, radius, gap))
            continue;
        const double rise = mill_poly_first_rise(gap, t[i + 1] - t[i], touching && i == 0, counts);
        if (rise < (double)INFINITY)
            return t[i] + rise;
    }
    return INFINITY;
}

static struct mill_hit still_contact(const struct mill_contour *c, const struct mill_flight *f,
                                     double radius, double horizon, bool touching)
{
    struct course own = {f->r.y, f->r.z, f->v.y, f->v.z, f->g.y, f->g.z};
    const struct mill_body *is = &c->body.is;
    if (!c->plain) {
        const vec3 r = mill_body_in(is, f->r), v = mill_body_turn_in(is, f->v),
                   g = mill_body_turn_in(is, f->g);
        own = (struct course){r.x, r.y, v.x, v.y, g.x, g.y};
    }
    const double fall = 0.5 * horizon * (fabs(own.g) + fabs(own.h));
    const double way = horizon * (sqrt(own.u * own.u + own.v * own.v) + fall) * (1.0 + 1e-9);
    const double reach = radius + way + 1e-9 * c->far; /* more than all rounding errors */
    const int first = f->parts.first, count = f->parts.count > 0 ? f->parts.count : c->pieces;
    int touched = -1;
    double t = INFINITY;
    for (int i = 0; i < count; i++) {
        const int k = first + i < c->pieces ? first + i : first + i - c->pieces;
        const struct mill_contour_piece *p = &c->piece[k];
        if (is_narrow(p, radius) || mill_contour_is_out_of_reach(p, own.x, own.y, reach))
            continue;
        if (touching && touched < 0)
            touched = mill_contour_nearest(c, own.x, own.y);
        const double next =
            piece_contact(p, &own, radius, mill_least(t, horizon), k == touched, f->counts);
        t = mill_least(t, next);
    }
    return mill_hit_at(t);
}

/* ---- in motion ---- */

/* A ball relative to the contour, at one time */
struct sight {
    struct mill_contour_spot spot;
    vec3 u;                     /* [m/s] in the own frame */
    double speed, acceleration; /* the most during `within` [s] */
    double within;
};

static struct sight look(const struct mill_contour *c, const struct mill_flight *f, double radius,
                         double now, double t, double h)
{
    const vec3 r = vec3_fly(f->r, f->v, f->g, t), v = vec3_axpy(f->v, t, f->g);
    const struct mill_pose pose = mill_shape_pose(&c->body.convex.base, now + t);
    const struct mill_seen seen = mill_convex_see(&c->body.convex, f, &pose, r, v, h);
    const vec3 u = mill_pose_turn_in(&pose, vec3_sub(v, mill_pose_velocity(&pose, r)));
    const double speed = vec3_norm(u), a = seen.acceleration;
    const double cap = 0.5 * mill_greatest(speed, sqrt(a * radius)) / a;
    const double within = mill_least(h, mill_least(cap, seen.within));
    return (struct sight){mill_contour_spot_of(c, mill_pose_in(&pose, r)),
                          c->plain ? vec3_make(u.y, u.z, u.x) : mill_body_turn_in(&c->body.is, u),
                          speed + a * within, a, within};
}

/* What a search knows at one time */
struct found {
    double safe;  /* [s] a time in which nothing closes */
    double rate;  /* [m/s] of the gap that limits it */
    double least; /* [m] distance of the nearest piece */
    bool closed;
};

/* Takes one gap into account: of the ball's centre, at d > 0 [m] in the direction n. The centre of
 * its curvature is `away` [m]: while half of that is left, its second derivative is at least
 * -(acceleration + 2 speed^2 / away). */
static void take(struct found *f, const struct sight *s, double d, vec3 n, double radius,
                 double away, bool glides)
{
    const double gap = d - radius, rate = vec3_dot(s->u, n);
    const double a = s->acceleration + 2.0 * s->speed * s->speed / (away + 1e-12 * radius);
    const double step = mill_least(mill_convex_step(gap, rate, a, glides), 0.5 * away / s->speed);
    f->closed = f->closed || (gap <= MILL_SHAPE_CLOSED && rate <= MILL_CONVEX_SLOWEST);
    if (mill_greatest(step, gap / s->speed) < f->safe) {
        f->safe = mill_greatest(step, gap / s->speed);
        f->rate = rate;
    }
}

/* Takes a piece into account. */
static void take_piece(struct found *f, const struct mill_contour_piece *p, const struct sight *s,
                       double radius, bool glides)
{
    const struct mill_contour_view v = mill_contour_look(p, s->spot.x, s->spot.y);
    const double z = s->spot.beyond, plane = fabs(v.d), d = sqrt(plane * plane + z * z);
    const double side = v.d < 0.0 ? -1.0 : 1.0;
    if (is_narrow(p, radius))
        return;
    f->least = mill_least(f->least, d);
    if (mill_contour_is_behind(p, s->spot.x, s->spot.y)) {
        f->safe = mill_least(f->safe, mill_greatest(d - radius, 0.0) / s->speed);
        return;
    }
    const double share = side * plane / d;
    take(f, s, d, vec3_make(v.nx * share, v.ny * share, z / d), radius,
         p->bend > 0.0 ? v.straight / (2.0 * p->bend) : (double)INFINITY, glides);
}

/* A quick proof that a ball meets nothing in its window, whose path is straight but for the slack.
 * Where a piece curves away from the balls, the plane through its nearest point keeps them apart;
 * where it curves around them, a straight path is nearest to it at an end. */
static bool is_far(const struct mill_contour *c, const struct mill_flight *f, double radius)
{
    const double reach = radius + f->slack, most = radius + f->travel;
    const struct mill_contour_spot s = mill_contour_spot_of(c, f->place);
    const struct mill_contour_nook nook = mill_contour_nook_at(c, s.x, s.y);
    if (c->half < (double)INFINITY) /* its flat ends are not among the pieces */
        return find_nearest(c, &s).d > most;
    if ((double)nook.near > most || (double)nook.beyond <= most)
        return (double)nook.near > most;
    const vec3 u = vec3_scale(mill_pose_turn_in(f->pose, f->course), f->window),
               own = c->plain ? vec3_make(u.y, u.z, u.x) : mill_body_turn_in(&c->body.is, u);
    bool far = true;
    for (int i = 0; far && i < nook.count; i++) {
        const struct mill_contour_piece *p = &c->piece[mill_contour_listed(c, nook, i)];
        if (mill_contour_is_out_of_reach(p, s.x, s.y, most))
            continue;
        if (p->bend > 0.0) {
            far = 2.0 * p->bend * reach < 1.0 && mill_contour_is_before(p, s.x, s.y, reach) &&
                  mill_contour_is_before(p, s.x + own.x, s.y + own.y, reach);
        } else {
            const struct mill_contour_view v = mill_contour_look(p, s.x, s.y);
            far = !mill_contour_is_behind(p, s.x, s.y) &&
                  v.d + mill_least(v.nx * own.x + v.ny * own.y, 0.0) > reach;
        }
    }
    return far;
}

static struct mill_hit search(const struct mill_contour *c, const struct mill_flight *f,
                              double radius, double now, double horizon)
{
    const double end = horizon < MILL_CONVEX_FARTHEST ? horizon : MILL_CONVEX_FARTHEST;
    struct mill_hit hit = {MILL_HIT_NONE, INFINITY};
    double t = 0.0;
    if (f->travel < (double)INFINITY && end == horizon && is_far(c, f, radius))
        return hit;
    for (int step = 0; step < MILL_CONVEX_MOST; step++) {
        const struct sight s = look(c, f, radius, now, t, end - t);
        const struct mill_contour_nook nook = mill_contour_nook_at(c, s.spot.x, s.spot.y);
        const double z = s.spot.beyond, beyond = (double)nook.beyond;
        const double rest = sqrt(beyond * beyond + z * z) - radius;
        struct found found = {rest / s.speed, 0.0, INFINITY, false};
        const bool glides = step >= MILL_CONVEX_PATIENCE;
        const double reach = radius + s.speed * s.within + 1e-9 * c->far;
        for (int i = 0; i < nook.count; i++) {
            const struct mill_contour_piece *p = &c->piece[mill_contour_listed(c, nook, i)];
            if (!mill_contour_is_out_of_reach(p, s.spot.x, s.spot.y, reach))
                take_piece(&found, p, &s, radius, glides);
        }
        if (found.least < radius * (1.0 - DEEP) || z != 0.0) {
            const struct nearest near = find_nearest(c, &s.spot);
            if (near.d < 0.0)
                return mill_convex_get_out(vec3_dot(near.n, s.u), s.acceleration, s.within,
                                           end - t);
            if (fabs(near.n.z) == 1.0) /* it is over a flat end */
                take(&found, &s, near.d, near.n, radius, INFINITY, glides);
        }
        if (found.closed)
            return (struct mill_hit){MILL_HIT_CONTACT, t};
        const double next =
            t + mill_least(found.safe, s.within < end - t ? s.within : (double)INFINITY);
        if (mill_convex_ends(next, found.rate, horizon, &t, &hit))
            return hit;
    }
    return (struct mill_hit){MILL_HIT_ASK_AGAIN, t};
}

static struct mill_hit next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                                    double radius, double now, double horizon, bool touching)
{
    const struct mill_contour *c = (const struct mill_contour *)shape;
    if (shape->fixed && isinf(c->half))
        return still_contact(c, f, radius, horizon, touching);
    return search(c, f, radius, now, horizon);
}

const struct mill_shape_type mill_contour_surface = {.size = sizeof(struct mill_contour),
                                                     .create = mill_contour_create,
                                                     .free = mill_contour_free,
                                                     .next_contact = next_contact,
                                                     .contact = contact,
                                                     .reachable = mill_contour_reachable,
                                                     .beside = beside,
                                                     .places = places,
                                                     .parts = mill_contour_parts,
                                                     .sector = mill_body_sector};
