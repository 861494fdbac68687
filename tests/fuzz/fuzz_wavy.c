/* When does a flying ball meet the wall of a wavy drum? Against a march along the gap, which is
 * written here from the arcs alone and moves on by a bound of its speed (Lipschitz): before the
 * time returned the ball is nowhere inside the wall, and at that time it touches and does not move
 * away; where none is returned it never is inside. Then the ball rebounds, and the same is asked of
 * its next flight, which begins at the wall. */
#include "../unit/lone_shape.h"
#include "../unit/parts.h"
#include "fuzz.h"

#include "base/profile.h"
#include "deck/deck_private.h"

#define TOLERANCE 1e-9 /* [m] the promise about overlaps */
#define TOUCHING 1e-12 /* [m] wider than what rounding leaves of a gap at a contact */
enum { MOST_BUCKLES = 257, MOST_MARCH = 1000, MOST_HOPS = 8 };

struct arc {
    double y, z, middle, half; /* centre [m], direction of its middle seen from there, half angle */
};

struct shot {
    struct mill_profile profile;
    struct arc arc[2 * MOST_BUCKLES];
    struct mill_flight flight;
    double radius, horizon;
    double restitution, floor;
    bool boxed; /* asks for the arcs in reach only */
    struct mill_shape *drum;
};

/* ---- the wall, once more ---- */

static struct arc arc_at(const struct mill_profile *p, int j)
{
    const double a = p->angle + j * MILL_PI / p->buckles;
    const double far = j % 2 ? p->inner : p->outer;
    const struct arc arc = {far * cos(a), far * sin(a), j % 2 ? a + MILL_PI : a,
                            j % 2 ? p->half_inner : p->half_outer};
    return arc;
}

/* Point of an arc at a share -1..1 of its half, and its normal into the drum */
static void wall_at(const struct mill_profile *p, int j, double share, vec3 *point, vec3 *normal)
{
    const struct arc arc = arc_at(p, j);
    const double a = arc.middle + share * arc.half, s = j % 2 ? 1.0 : -1.0;
    *point = vec3_make(0.0, arc.y + p->arc * cos(a), arc.z + p->arc * sin(a));
    *normal = vec3_make(0.0, s * cos(a), s * sin(a));
}

/* Distance of a place in the drum from the wall, < 0 outside: that of the nearest arc's nearest
 * point, all arcs asked, their ends included */
static double depth(const struct shot *s, vec3 r)
{
    const struct mill_profile *p = &s->profile;
    double best = INFINITY, found = 0.0;
    for (int j = 0; j < 2 * p->buckles; j++) {
        const struct arc arc = s->arc[j];
        const double y = r.y - arc.y, z = r.z - arc.z;
        if (fabs(sqrt(y * y + z * z) - p->arc) > best) /* all of its circle is farther */
            continue;
        const double a = remainder(atan2(z, y) - arc.middle, 2.0 * MILL_PI);
        const double held = arc.middle + fmax(-arc.half, fmin(arc.half, a));
        const double d = hypot(y - p->arc * cos(held), z - p->arc * sin(held));
        if (d < best) {
            best = d;
            found = (j % 2 ? 1.0 : -1.0) * (hypot(y, z) - p->arc);
            if (fabs(a) > arc.half) /* its end: nearest by rounding only */
                found = copysign(d, found);
        }
    }
    return found;
}

static vec3 place(const struct shot *s, double t)
{
    return vec3_fly(s->flight.r, s->flight.v, s->flight.g, t);
}

/* ---- from bytes ---- */

static struct mill_profile make_profile(struct fuzz_bytes *b)
{
    const double radius = fuzz_choice(b, 2) ? fuzz_log(b, 1e-3, 10.0) : 0.075;
    const int buckles =
        2 + (fuzz_choice(b, 8) ? fuzz_choice(b, 20) : fuzz_choice(b, MOST_BUCKLES - 1));
    const double highest = mill_deck_lining_highest(buckles, radius);
    const double overhang = fmin(highest, radius * sin(0.5 * MILL_PI / buckles));
    double height = 0.5 * overhang;
    switch (fuzz_choice(b, 4)) {
    case 1:
        height = overhang * fuzz_log(b, 1e-12, 1.0);
        break;
    case 2:
        height = highest * (1.0 - fuzz_log(b, 1e-12, 1.0));
        break;
    case 3:
        height = highest * fuzz_uniform(b, 0.0, 1.0);
        break;
    default:
        break;
    }
    return mill_profile_make(buckles, radius, fmax(height, 1e-13 * radius),
                             fuzz_choice(b, 2) ? fuzz_uniform(b, -7.0, 7.0) : 0.0);
}

/* A share of an arc: its end, its middle, near its end, anywhere */
static double share(struct fuzz_bytes *b)
{
    const double sign = fuzz_choice(b, 2) ? -1.0 : 1.0;
    const int k = fuzz_choice(b, 4);
    return sign * (k == 0   ? 1.0
                   : k == 1 ? 0.0
                   : k == 2 ? 1.0 - fuzz_log(b, 1e-16, 1.0)
                            : fuzz_uniform(b, 0.0, 1.0));
}

/* Centre of a ball that touches both inner arcs beside an outer one, as a wide one does that lies
 * before it. The normal is that of the first. */
static vec3 lodged_place(const struct shot *s, struct fuzz_bytes *b, vec3 *normal)
{
    const struct mill_profile *p = &s->profile;
    const int outer = 2 * fuzz_choice(b, p->buckles);
    const double at = p->angle + outer * MILL_PI / p->buckles, step = MILL_PI / p->buckles;
    const double reach = p->arc + s->radius, half = p->inner * sin(step);
    const double far = p->inner * cos(step) - sqrt(reach * reach - half * half);
    const vec3 r = vec3_make(0.0, far * cos(at), far * sin(at));
    const struct arc *arc = &s->arc[outer + 1];
    *normal = vec3_make(0.0, (r.y - arc->y) / reach, (r.z - arc->z) / reach);
    return r;
}

/* Centre of a ball that touches the wall somewhere, and the normal there */
static vec3 touching_place(const struct shot *s, struct fuzz_bytes *b, vec3 *normal)
{
    vec3 point;
    const double half = s->profile.inner * sin(MILL_PI / s->profile.buckles);
    if (fuzz_choice(b, 8) == 7 && s->profile.arc + s->radius > half)
        return lodged_place(s, b, normal);
    wall_at(&s->profile, fuzz_choice(b, 2 * s->profile.buckles), share(b), &point, normal);
    return vec3_axpy(point, s->radius, *normal);
}

static double ball_radius(const struct mill_profile *p, struct fuzz_bytes *b)
{
    const double bore = p->radius - p->height;
    switch (fuzz_choice(b, 4)) {
    case 1: /* nearly as wide as an arc, or hardly wider */
        return fmin(0.9 * bore,
                    p->arc * (1.0 + (fuzz_choice(b, 2) ? 1.0 : -1.0) * fuzz_log(b, 1e-16, 0.5)));
    case 2:
        return bore * fuzz_log(b, 1e-4, 0.9);
    default:
        return 0.3 * fmin(p->arc, bore);
    }
}

static void aim(struct shot *s, struct fuzz_bytes *b)
{
    const double speed = fuzz_choice(b, 5) ? fuzz_log(b, 1e-9, 1e3) : 0.0;
    vec3 n = {0.0, 0.0, 1.0};
    if (fuzz_choice(b, 3)) {
        s->flight.r = touching_place(s, b, &n);
        if (fuzz_choice(b, 2))
            s->flight.r = vec3_axpy(s->flight.r, fuzz_log(b, 1e-16, 1.0) * s->profile.radius, n);
    } else {
        const double a = fuzz_uniform(b, 0.0, 2.0 * MILL_PI);
        const double far = (s->profile.radius + s->profile.height) * fuzz_uniform(b, 0.0, 1.0);
        s->flight.r = vec3_make(0.0, far * cos(a), far * sin(a));
    }
    const double t = s->horizon * fuzz_log(b, 1e-6, 1.0);
    switch (fuzz_choice(b, 4)) {
    case 0:
        s->flight.v = vec3_scale(fuzz_direction(b), speed);
        break;
    case 1: /* along the wall, nearly */
        s->flight.v = vec3_scale(vec3_make(0.0, -n.z, n.y), fuzz_choice(b, 2) ? speed : -speed);
        s->flight.v = vec3_axpy(s->flight.v, speed * fuzz_log(b, 1e-16, 1.0), n);
        break;
    case 2: /* away from it, into it, or away from the axis */
        s->flight.v = vec3_scale(n, fuzz_choice(b, 2) ? speed : -speed);
        if (fuzz_choice(b, 4) == 3 && vec3_norm(s->flight.r) > 0.0)
            s->flight.v = vec3_scale(s->flight.r, speed / vec3_norm(s->flight.r));
        break;
    default: /* to arrive somewhere at the wall after t */
        s->flight.v = vec3_scale(vec3_sub(touching_place(s, b, &n), s->flight.r), 1.0 / t);
        s->flight.v = vec3_axpy(s->flight.v, -0.5 * t, s->flight.g);
        break;
    }
}

static struct shot make_shot(struct fuzz_bytes *b)
{
    struct shot s;
    memset(&s, 0, sizeof s);
    s.profile = make_profile(b);
    for (int j = 0; j < 2 * s.profile.buckles; j++)
        s.arc[j] = arc_at(&s.profile, j);
    s.radius = ball_radius(&s.profile, b);
    s.horizon = fuzz_choice(b, 2) ? fuzz_log(b, 1e-9, 0.0625) : 0.0625;
    s.flight.g = fuzz_choice(b, 2) ? vec3_scale(fuzz_direction(b),
                                                fuzz_choice(b, 2) ? 9.81 : fuzz_log(b, 1e-9, 1e3))
                                   : vec3_make(0.0, 0.0, fuzz_choice(b, 2) ? -9.81 : 0.0);
    s.restitution = 0.4 * fuzz_choice(b, 3);
    s.floor = fuzz_choice(b, 2) ? 0.0 : 5e-3;
    s.boxed = fuzz_choice(b, 2);
    aim(&s, b);
    return s;
}

static void show(const struct shot *s)
{
    const struct mill_profile *p = &s->profile;
    fprintf(stderr,
            "buckles %d radius %.17g height %.17g angle %.17g arc %.17g\n"
            "ball radius %.17g horizon %.17g restitution %g floor %g boxed %d\n"
            "r %.17g %.17g %.17g v %.17g %.17g %.17g g %.17g %.17g %.17g gap %g\n",
            p->buckles, p->radius, p->height, p->angle, p->arc, s->radius, s->horizon,
            s->restitution, s->floor, s->boxed, s->flight.r.x, s->flight.r.y, s->flight.r.z,
            s->flight.v.x, s->flight.v.y, s->flight.v.z, s->flight.g.x, s->flight.g.y,
            s->flight.g.z, depth(s, s->flight.r) - s->radius);
}

static void require(const struct shot *s, bool holds, const char *what, double x, double t)
{
    if (holds)
        return;
    show(s);
    fuzz_require(false, what, x, t);
}

/* ---- claims ---- */

/* The gap does not change faster than this within the horizon [m/s] */
static double fastest(const struct shot *s)
{
    return vec3_norm(s->flight.v) + vec3_norm(s->flight.g) * s->horizon + 1e-12;
}

static void check_outside(const struct shot *s, double until)
{
    const double v = fastest(s), small = 1e-14 * s->profile.radius;
    double t = 0.0;
    for (int step = 0; step < MOST_MARCH && t < until; step++) {
        const double d = depth(s, place(s, t)) - s->radius;
        require(s, d >= -TOLERANCE && d >= -fmax(0.01 * s->radius, small),
                "a gap of %g m at %.17g s, before any contact", d, t);
        t += fmax(d, 0.5 * TOLERANCE) / v;
    }
}

/* The wall's own words for where the ball is: the gap is the distance, the contact a contact */
static void check_wall(const struct shot *s, vec3 r)
{
    const double d = depth(s, r) - s->radius, small = 1e-13 * s->profile.radius;
    const struct mill_contact k = s->drum->type->contact(s->drum, r, s->radius, &mill_pose_still);
    require(s, fabs(mill_shape_gap(s->drum, r, s->radius, &mill_pose_still) - d) <= small,
            "the gap is not the distance %.17g (%g)", d, 0.0);
    require(s, fabs(k.gap - d) <= small, "a contact's gap is not the distance %.17g (%g)", d, 0.0);
    require(s, fabs(vec3_norm(k.normal) - 1.0) <= 1e-14, "a normal of %.17g (%g)",
            vec3_norm(k.normal), 0.0);
    require(s, fabs(depth(s, k.point)) <= small, "touches %g m off the wall (%g)",
            depth(s, k.point), 0.0);
    const vec3 there = vec3_axpy(k.point, s->radius + d, k.normal);
    require(s, vec3_norm(vec3_sub(there, r)) <= small, "a contact %g m off the ball (%g)",
            vec3_norm(vec3_sub(there, r)), 0.0);
}

/* Arcs in reach of a box in which the flight stays */
static struct mill_span in_reach(const struct shot *s)
{
    const double h = s->horizon, x = 1e-9 * s->profile.radius;
    const vec3 r = s->flight.r, v = s->flight.v, g = s->flight.g;
    const vec3 way = {fabs(v.x) * h + fabs(g.x) * h * h + x, fabs(v.y) * h + fabs(g.y) * h * h + x,
                      fabs(v.z) * h + fabs(g.z) * h * h + x};
    return s->drum->type->parts(s->drum, vec3_sub(r, way), vec3_add(r, way), s->radius);
}

/* Seconds until the next contact, INFINITY without one; checked */
static double contact_time(const struct shot *s, bool touching)
{
    struct mill_flight f = s->flight;
    struct mill_hit hit = mill_hit_at(INFINITY);
    f.pull = vec3_norm(f.g);
    f.slack = f.travel = INFINITY;
    if (s->boxed)
        f.parts = in_reach(s);
    if (!s->boxed || f.parts.count > 0) /* else nothing is in reach */
        hit = s->drum->type->next_contact(s->drum, &f, s->radius, 0.0, s->horizon, touching);
    require(s,
            hit.state == MILL_HIT_NONE
                ? isinf(hit.t)
                : hit.state == MILL_HIT_CONTACT && hit.t >= 0.0 && hit.t <= s->horizon,
            "%g is no time (%g)", hit.t, 0.0);
    check_outside(s, fmin(hit.t, s->horizon));
    return hit.t;
}

/* Brings the ball to its contact after t and lets it rebound. */
static void rebound(struct shot *s, double t)
{
    /* where an arc is hardly wider than the ball, its centre hardly leaves the arc's, and roundings
     * turn the normal */
    const double room = fabs(s->profile.arc - s->radius) / s->profile.radius;
    const double noise = 1e-9 + fastest(s) * (1e-12 + 1e-15 / fmax(room, 1e-15));
    const vec3 r = place(s, t), v = vec3_axpy(s->flight.v, t, s->flight.g);
    const double gap = depth(s, r) - s->radius;
    const struct mill_contact k = mill_shape_meet(s->drum, r, v, s->radius, &mill_pose_still);
    struct mill_contact other = k;
    s->drum->type->beside(s->drum, r, v, s->radius, &mill_pose_still,
                          &other); /* of two, whichever closes */
    const double closing = -vec3_dot(k.normal, v), beside = -vec3_dot(other.normal, v);
    require(s, gap <= TOUCHING, "a gap of %g m when due at %.17g s", gap, t);
    require(s, fmax(closing, beside) >= -noise, "closing by %g m/s when due at %.17g s", closing,
            t);
    const double after = fmax(s->restitution * fmax(closing, 0.0), s->floor);
    s->flight.r = r;
    s->flight.v = vec3_axpy(v, fmax(closing, 0.0) + after, k.normal);
    s->horizon -= t;
}

static void check_shot(struct shot *s)
{
    bool touching = false;
    for (int hop = 0; hop < MOST_HOPS && s->horizon > 0.0; hop++) {
        check_wall(s, s->flight.r);
        const double t = contact_time(s, touching);
        if (isinf(t))
            return;
        rebound(s, t);
        touching = true;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_bytes b = {data, size};
    for (int i = 0; i < 2 && (i == 0 || b.left > 0); i++) {
        struct shot s = make_shot(&b);
        /* a deck with such a ball is refused; */
        if (fabs(s.profile.arc - s.radius) <= 0.5e-11 * (s.profile.radius + s.profile.height))
            continue;
        /* within the wall there is nothing to know */
        if (!(depth(&s, s.flight.r) >= s.radius - 1e-15 * s.profile.radius))
            continue;
        const struct mill_setup_drum drum = {.radius = s.profile.radius,
                                             .length = 2.0 * s.profile.radius,
                                             .buckles = s.profile.buckles,
                                             .buckle_height = s.profile.height,
                                             .buckle_angle = s.profile.angle};
        const struct mill_body is = mill_setup_drum_body(&drum);
        const struct mill_reach places = drum_places(&drum);
        s.drum = lone_shape(&mill_prism_solid, &is, NULL, &places);
        fuzz_require(s.drum != NULL, "out of memory");
        if (fuzz_shown())
            show(&s);
        check_shot(&s);
        lone_shape_free(s.drum);
    }
    return 0;
}
