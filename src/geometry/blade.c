/* A rotating box blade. In the rotor's frame the box stands still and the gap is the distance of
 * the ball's centre to it less the radius: exact for faces, edges and corners, and not polynomial
 * in time. The first contact is found with a certificate: the distance to a convex body is a convex
 * function of place, so along a path the gap d obeys d'' >= -A, A a bound of the acceleration in
 * the rotor's frame (gravity, Coriolis and centrifugal parts). From (d, d') the gap cannot vanish
 * before t = (d' + sqrt(d'^2 + 2 A d)) / A; stepping there and asking again never overshoots the
 * first contact and converges quadratically on it. */
#include "geometry/blade.h"

#include "base/elementary.h"

#include "geometry/mesh.h"

#include <stdlib.h>

#define STILL                                                                                      \
    1e-9 /* [m/s] a closed gap that opens more slowly counts as closing: the floor lifts it */
#define PATIENCE 400    /* steps of one search; one or two are usual */
#define MOST_STEPS 4000 /* then it is to be asked again */
/* [m] what a search without patience concedes: a ball that glides along the blade, its gap next to
 * nothing, would go on by steps next to nothing */
#define CONCEDED 1e-13

struct blade {
    struct mill_shape base;
    double position, angle;        /* [m], [rad] in the rotor's frame */
    double half_w, half_s, half_h; /* [m] half width, half length (radial), half thickness */
    double cos_p, sin_p;           /* of the pitch */
    double cos_a, sin_a;           /* of the angle */
    double speed;                  /* [rad/s] */
    double reach_x, reach_rho; /* [m] extent along the axis from `position`, and from the axis */
    double reach_across;       /* [m] extent across the radial direction */
    double mill_radius;        /* [m] */
};

/* Where a ball's centre is as seen from the box */
struct view {
    double d; /* [m] signed distance to the box */
    vec3 n;   /* unit, world frame: from the box to the centre */
};

static double clamp_out(double q, double half)
{
    return q > half ? q - half : (q < -half ? q + half : 0.0);
}

/* Blade axes (w along the width, s radial, h along the thickness) to world */
static vec3 to_world(const struct blade *b, double c, double s, double w, double radial, double h)
{
    const double x = b->cos_p * w - b->sin_p * h;
    const double tangential = b->sin_p * w + b->cos_p * h;
    return vec3_make(x, c * radial - s * tangential, s * radial + c * tangential);
}

static struct view look(const struct blade *b, vec3 r, double turn)
{
    struct view k;
    const struct mill_heading at = mill_elementary_heading(b->angle + turn);
    const double c = at.cos, s = at.sin;
    const double x = r.x - b->position;
    const double radial = c * r.y + s * r.z - b->half_s;
    const double tangential = c * r.z - s * r.y;
    const double w = b->cos_p * x + b->sin_p * tangential;
    const double h = b->cos_p * tangential - b->sin_p * x;
    const double ow = clamp_out(w, b->half_w);
    const double os = clamp_out(radial, b->half_s);
    const double oh = clamp_out(h, b->half_h);
    const double square = ow * ow + os * os + oh * oh;
    if (square > 0.0) {
        k.d = sqrt(square);
        k.n = to_world(b, c, s, ow / k.d, os / k.d, oh / k.d);
        return k;
    }
    /* the centre is inside: only a pinched ball gets here; out through the nearest face */
    const double dw = fabs(w) - b->half_w, ds = fabs(radial) - b->half_s, dh = fabs(h) - b->half_h;
    k.d = fmax(dw, fmax(ds, dh));
    if (k.d == dw)
        k.n = to_world(b, c, s, w < 0.0 ? -1.0 : 1.0, 0.0, 0.0);
    else if (k.d == dh)
        k.n = to_world(b, c, s, 0.0, 0.0, h < 0.0 ? -1.0 : 1.0);
    else
        k.n = to_world(b, c, s, 0.0, radial < 0.0 ? -1.0 : 1.0, 0.0);
    return k;
}

/* Rate of the gap: normal velocity of the centre relative to the turning box */
static double rate(const struct blade *b, const struct view *k, vec3 r, vec3 v)
{
    return k->n.x * v.x + k->n.y * (v.y + b->speed * r.z) + k->n.z * (v.z - b->speed * r.y);
}

static double beyond(double q, double extent)
{
    const double out = fabs(q) - extent;
    return out > 0.0 ? out : 0.0;
}

/* Certainly no contact within h: most balls are too far from a box that holds the blade. In the
 * rotor's frame the box stands still, and the ball gets at most (|v| + A h / 2) h nearer. Square
 * roots are spared by larger bounds; the margin outweighs all rounding. An infinite h, or a turn
 * that is not known, rejects nothing. */
static bool out_of_reach(const struct blade *b, const struct mill_flight *f, double radius,
                         double h)
{
    const double margin = 1e-9 * b->mill_radius;
    const double fall_x = 0.5 * h * fabs(f->g.x);
    const double out_x = beyond(f->r.x - b->position, b->reach_x);
    if (out_x > radius + margin + h * (fabs(f->v.x) + fall_x))
        return true;
    const double c = f->heading.cos * b->cos_a - f->heading.sin * b->sin_a;
    const double s = f->heading.sin * b->cos_a + f->heading.cos * b->sin_a;
    const double out_s = beyond(c * f->r.y + s * f->r.z - b->half_s, b->half_s);
    const double out_h = beyond(c * f->r.z - s * f->r.y, b->reach_across);
    const double wy = f->v.y + b->speed * f->r.z, wz = f->v.z - b->speed * f->r.y;
    const double g = fabs(f->g.x) + fabs(f->g.y) + fabs(f->g.z), omega = fabs(b->speed);
    const double v_perp = fabs(f->v.y) + fabs(f->v.z) + g * h;
    const double a = g + omega * (2.0 * v_perp + omega * b->mill_radius);
    const double way = h * (sqrt(f->v.x * f->v.x + wy * wy + wz * wz) + 0.5 * h * a);
    const double reach = radius + margin + way * (1.0 + 1e-9);
    return out_x * out_x + out_s * out_s + out_h * out_h > reach * reach;
}

static double next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                           double radius, double turn, double horizon, bool touching)
{
    const struct blade *b = (const struct blade *)shape;
    if (out_of_reach(b, f, radius, horizon))
        return INFINITY;
    const double g = vec3_norm(f->g);
    const double omega = fabs(b->speed);
    (void)touching; /* a contact just resolved has its gap opening: the steps below leave it by
                       themselves */
    const double v_perp = sqrt(f->v.y * f->v.y + f->v.z * f->v.z) + g * horizon;
    /* |a| in the rotor's frame <= g + 2 Omega v + Omega^2 rho, v in the frame at rest */
    const double a = g + omega * (2.0 * v_perp + omega * b->mill_radius) + 1e-9;
    double t = 0.0;
    for (int step = 0; step < MOST_STEPS; step++) {
        const vec3 r = vec3_fly(f->r, f->v, f->g, t);
        const vec3 v = vec3_axpy(f->v, t, f->g);
        const struct view k = look(b, r, turn + b->speed * t);
        const double d = k.d - radius;
        const double d1 = rate(b, &k, r, v);
        if (omega == 0.0 && d1 >= 0.0 && d >= -MILL_SHAPE_CLOSED && vec3_dot(k.n, f->g) >= 0.0)
            return INFINITY; /* the plane between box and ball stands still: never nearer again */
        if (d <= MILL_SHAPE_CLOSED && d1 <= STILL)
            return t;
        const bool glides = step >= PATIENCE && d > -MILL_SHAPE_CLOSED;
        double dt;
        if (d <= 0.0 && !glides)
            dt = d1 / a; /* overlapping and opening: it cannot close before this */
        else if (d1 < 0.0)
            dt = 2.0 * d / (sqrt(d1 * d1 + 2.0 * a * d) - d1);
        else
            dt = (d1 + sqrt(d1 * d1 + 2.0 * a * (fmax(d, 0.0) + (glides ? CONCEDED : 0.0)))) / a;
        const double next = t + dt;
        if (next > horizon)
            return INFINITY;
        if (next > t)
            t = next;
        else if (d1 <= 0.0)
            return t; /* the contact is nearer than the clock can tell */
        else
            t = nextafter(t, INFINITY);
    }
    return -t; /* a ball that hops along the blade: certainly no contact before t */
}

static double gap(const struct mill_shape *shape, vec3 centre, double radius, double turn)
{
    const struct view k = look((const struct blade *)shape, centre, turn);
    return k.d - radius;
}

static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   double turn)
{
    const struct blade *b = (const struct blade *)shape;
    const struct view k = look(b, centre, turn);
    struct mill_contact out;
    out.normal = k.n;
    out.point = vec3_axpy(centre, -k.d, k.n);
    out.velocity = vec3_make(0.0, -b->speed * out.point.z, b->speed * out.point.y);
    out.gap = k.d - radius;
    return out;
}

static bool reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct blade *b = (const struct blade *)shape;
    const double far = radius * (1.0 + 1e-3) + 1e-6 * b->mill_radius;
    if (lo.x > b->position + b->reach_x + far || hi.x < b->position - b->reach_x - far)
        return false;
    const double y = lo.y > 0.0 ? lo.y : (hi.y < 0.0 ? hi.y : 0.0);
    const double z = lo.z > 0.0 ? lo.z : (hi.z < 0.0 ? hi.z : 0.0);
    return sqrt(y * y + z * z) <= b->reach_rho + far;
}

static void release(struct mill_shape *shape)
{
    free(shape);
}

/* All of the box, from the axis on: what is within the shaft is hidden there */
static void draw(const struct mill_shape *shape, const struct mill_chamber *chamber,
                 struct mill_mesh *mesh)
{
    const struct blade *b = (const struct blade *)shape;
    vec3 corner[8];
    (void)chamber;
    for (int i = 0; i < 8; i++) {
        const double w = i & 1 ? b->half_w : -b->half_w;
        const double radial = i & 2 ? 2.0 * b->half_s : 0.0;
        const double h = i & 4 ? b->half_h : -b->half_h;
        corner[i] = to_world(b, b->cos_a, b->sin_a, w, radial, h);
        corner[i].x += b->position;
    }
    mill_mesh_box(mesh, corner);
}

static const struct mill_shape_ops ops = {MILL_BALL_BLADE, next_contact, gap,  contact, reachable,
                                          release,         NULL,         NULL, draw};

struct mill_shape *mill_blade_create(const struct mill_deck_blade *spec, int number, double speed,
                                     double mill_radius)
{
    struct blade *b = calloc(1, sizeof *b);
    if (!b)
        return NULL;
    b->base.ops = &ops;
    b->base.number = number;
    b->base.turns = true;
    b->position = spec->position;
    b->angle = spec->angle;
    b->half_w = 0.5 * spec->width;
    b->half_s = 0.5 * spec->tip_radius;
    b->half_h = 0.5 * spec->thickness;
    const struct mill_heading angle = mill_elementary_heading(spec->angle);
    const struct mill_heading pitch = mill_elementary_heading(spec->pitch);
    b->cos_a = angle.cos;
    b->sin_a = angle.sin;
    b->cos_p = pitch.cos;
    b->sin_p = pitch.sin;
    b->speed = speed;
    b->mill_radius = mill_radius;
    b->reach_x = fabs(b->cos_p) * b->half_w + fabs(b->sin_p) * b->half_h;
    b->reach_across = fabs(b->sin_p) * b->half_w + fabs(b->cos_p) * b->half_h;
    b->reach_rho = sqrt(spec->tip_radius * spec->tip_radius + b->reach_across * b->reach_across);
    return &b->base;
}
