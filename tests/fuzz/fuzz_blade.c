/* When does a flying ball meet a turning blade? Against a march along the gap that uses nothing but
 * a bound of its speed (Lipschitz): before the time returned the ball is nowhere inside the blade,
 * and at that time it touches and does not move away; where none is returned it never is inside. A
 * search may give up, and says so; then nothing may have happened before. */
#include "../unit/lone_shape.h"
#include "../unit/parts.h"
#include "fuzz.h"

#define TOLERANCE 1e-9 /* [m] the promise about overlaps */
#define TOUCHING 1e-12 /* [m] wider than what rounding leaves of a gap at a contact */
enum { MOST_MARCH = 20000, MOST_ASKED = 50 };

struct shot {
    struct mill_blade spec;
    double omega, turn;
    struct mill_flight flight;
    double radius, horizon, mill_radius;
    struct mill_motion *rotor;
    struct mill_shape *blade;
};

static double gap_at(const struct shot *s, double t)
{
    const vec3 r = vec3_fly(s->flight.r, s->flight.v, s->flight.g, t);
    const struct mill_pose pose = mill_shape_pose(s->blade, t);
    return mill_shape_gap(s->blade, r, s->radius, &pose);
}

/* The distance to the box, by a way of its own: the nearest point of the box by clamping in its own
 * axes, written as rotations of the place instead of the box */
static double distance_at(const struct shot *s, double t)
{
    const vec3 r = vec3_fly(s->flight.r, s->flight.v, s->flight.g, t);
    const double a = s->spec.angle + s->turn + s->omega * t, p = s->spec.pitch;
    const double x = r.x - s->spec.position, y = r.y * cos(a) + r.z * sin(a),
                 z = r.z * cos(a) - r.y * sin(a);
    const double q[3] = {x * cos(p) + z * sin(p), y, z * cos(p) - x * sin(p)};
    const double lo[3] = {-0.5 * s->spec.width, 0.0, -0.5 * s->spec.thickness};
    const double hi[3] = {0.5 * s->spec.width, s->spec.tip_radius, 0.5 * s->spec.thickness};
    double square = 0.0;
    for (int k = 0; k < 3; k++) {
        const double out = q[k] - fmin(fmax(q[k], lo[k]), hi[k]);
        square += out * out;
    }
    return sqrt(square);
}

/* ---- from bytes ---- */

static double dimension(struct fuzz_bytes *b, double scale)
{
    return scale * (fuzz_choice(b, 2) ? fuzz_log(b, 1e-5, 1.0) : 0.1);
}

static vec3 blade_point(const struct shot *s, struct fuzz_bytes *b)
{
    static const double at[4] = {-0.5, 0.5, 0.0, 0.25};
    const double w = s->spec.width * at[fuzz_choice(b, 4)];
    const double h = s->spec.thickness * at[fuzz_choice(b, 4)];
    const double radial = s->spec.tip_radius * (fuzz_choice(b, 3) ? fuzz_uniform(b, 0, 1) : 1.0);
    const double p = s->spec.pitch, a = s->spec.angle + s->turn;
    const double x = cos(p) * w - sin(p) * h, z = sin(p) * w + cos(p) * h;
    return vec3_make(s->spec.position + x, radial * cos(a) - z * sin(a),
                     radial * sin(a) + z * cos(a));
}

static void aim(struct shot *s, struct fuzz_bytes *b)
{
    const double speed = fuzz_choice(b, 5) ? fuzz_log(b, 1e-9, 1e3) : 0.0;
    const int how = fuzz_choice(b, 4);
    if (how < 2) { /* touching, or nearly, somewhere on the blade */
        const vec3 n = fuzz_direction(b);
        const double off = how ? fuzz_log(b, 1e-16, 1.0) * s->mill_radius : 0.0;
        s->flight.r = vec3_axpy(blade_point(s, b), s->radius + off, n);
        s->flight.v = vec3_scale(fuzz_choice(b, 2) ? fuzz_direction(b) : n,
                                 fuzz_choice(b, 2) ? speed : -speed);
        /* with the blade's own speed there */
        if (fuzz_choice(b, 2))
            s->flight.v = vec3_add(
                s->flight.v, vec3_make(0.0, -s->omega * s->flight.r.z, s->omega * s->flight.r.y));
        return;
    }
    const double a = fuzz_uniform(b, 0.0, 2.0 * MILL_PI);
    const double far = s->mill_radius * sqrt(fuzz_uniform(b, 0.0, 1.0));
    s->flight.r =
        vec3_make(s->mill_radius * fuzz_uniform(b, -1.0, 1.0), far * cos(a), far * sin(a));
    s->flight.v = vec3_scale(fuzz_direction(b), speed);
}

static struct shot make_shot(struct fuzz_bytes *b)
{
    struct shot s;
    memset(&s, 0, sizeof s);
    s.mill_radius = fuzz_choice(b, 2) ? fuzz_log(b, 1e-3, 10.0) : 0.075;
    s.spec.tip_radius = s.mill_radius * (fuzz_choice(b, 2) ? fuzz_uniform(b, 0.01, 0.99) : 0.9);
    s.spec.width = dimension(b, s.mill_radius);
    s.spec.thickness = dimension(b, s.mill_radius);
    s.spec.pitch = fuzz_choice(b, 2) ? fuzz_uniform(b, -7.0, 7.0) : 0.0;
    s.spec.angle = fuzz_choice(b, 2) ? fuzz_uniform(b, -7.0, 7.0) : 0.0;
    s.spec.position = fuzz_choice(b, 2) ? s.mill_radius * fuzz_uniform(b, -1.0, 1.0) : 0.0;
    s.turn = fuzz_choice(b, 2) ? fuzz_uniform(b, -7.0, 7.0) : 0.0;
    s.omega = fuzz_choice(b, 4) ? fuzz_log(b, 1e-9, 1e4) * (fuzz_choice(b, 2) ? -1.0 : 1.0) : 0.0;
    s.radius = dimension(b, s.mill_radius);
    s.horizon = fuzz_choice(b, 2) ? fuzz_log(b, 1e-9, 0.0625) : 0.0625;
    s.flight.g = fuzz_choice(b, 2) ? vec3_scale(fuzz_direction(b),
                                                fuzz_choice(b, 2) ? 9.81 : fuzz_log(b, 1e-9, 1e3))
                                   : vec3_make(0.0, 0.0, fuzz_choice(b, 2) ? -9.81 : 0.0);
    aim(&s, b);
    return s;
}

static void open_blade(struct shot *s)
{
    const struct mill_turn turn = {.axis = {1.0, 0.0, 0.0}, .speed = s->omega, .angle = s->turn};
    const struct mill_setup_drum drum = {.radius = s->mill_radius, .length = 4.0 * s->mill_radius};
    const struct mill_reach places = drum_places(&drum);
    const struct mill_body box = mill_setup_blade(&s->spec);
    s->rotor = mill_turn_type.create(&turn);
    s->blade = lone_shape(&mill_box_solid, &box, s->rotor, &places);
    fuzz_require(s->rotor && s->blade, "out of memory");
}

/* The search knows balls inside the drum only: it is asked no further than one stays in it. */
static bool stay_inside(struct shot *s)
{
    const double far = hypot(s->flight.r.y, s->flight.r.z), g = vec3_norm(s->flight.g);
    const double v = hypot(s->flight.v.y, s->flight.v.z) + g * s->horizon;
    if (!(far < s->mill_radius))
        return false;
    if (v > 0.0)
        s->horizon = fmin(s->horizon, (s->mill_radius - far) / v);
    return s->horizon > 0.0;
}

static void show(const struct shot *s)
{
    fprintf(stderr,
            "tip %.17g width %.17g thickness %.17g pitch %.17g angle %.17g position %.17g\n"
            "omega %.17g turn %.17g ball radius %.17g horizon %.17g mill radius %.17g\n"
            "r %.17g %.17g %.17g v %.17g %.17g %.17g g %.17g %.17g %.17g gap %g\n",
            s->spec.tip_radius, s->spec.width, s->spec.thickness, s->spec.pitch, s->spec.angle,
            s->spec.position, s->omega, s->turn, s->radius, s->horizon, s->mill_radius,
            s->flight.r.x, s->flight.r.y, s->flight.r.z, s->flight.v.x, s->flight.v.y,
            s->flight.v.z, s->flight.g.x, s->flight.g.y, s->flight.g.z, gap_at(s, 0.0));
}

/* ---- claims ---- */

/* No gap changes faster than this [m/s] */
static double fastest(const struct shot *s)
{
    const double v = vec3_norm(s->flight.v) + vec3_norm(s->flight.g) * s->horizon;
    return v + fabs(s->omega) * s->mill_radius + 1e-12;
}

/* Marches from `from` to `until`; the ball was outside at `from`. */
static void check_outside(const struct shot *s, double from, double until)
{
    const double v = fastest(s);
    double t = from;
    for (int step = 0; step < MOST_MARCH && t < until; step++) {
        const double d = distance_at(s, t) - s->radius;
        if (d < -TOLERANCE || (d < -0.01 * s->radius))
            show(s);
        fuzz_require(d >= -TOLERANCE && d >= -0.01 * s->radius,
                     "%g m inside the blade at %.17g s, before %.17g s", -d, t, until);
        /* where the gap is nearly closed, what sinks in by half the tolerance at most */
        t += fmax(d, 0.5 * TOLERANCE) / v;
    }
}

/* Normal speed of the ball towards the blade's surface */
static double closing(const struct shot *s, double t)
{
    const vec3 r = vec3_fly(s->flight.r, s->flight.v, s->flight.g, t);
    const vec3 v = vec3_axpy(s->flight.v, t, s->flight.g);
    const struct mill_pose pose = mill_shape_pose(s->blade, t);
    const struct mill_contact c = s->blade->type->contact(s->blade, r, s->radius, &pose);
    return -vec3_dot(c.normal, vec3_sub(v, c.velocity));
}

static void check_contact(const struct shot *s, double t)
{
    const double moving = closing(s, t), noise = 1e-9 + 1e-12 * fastest(s);
    const double gap = gap_at(s, t);
    fuzz_require(gap <= TOUCHING, "due at %.17g s with a gap of %g m", t, gap);
    if (!(moving >= -noise))
        show(s);
    fuzz_require(moving >= -noise, "due at %.17g s, but opening by %g m/s", t, -moving);
}

static void check_shot(const struct shot *s)
{
    const bool outside = gap_at(s, 0.0) >= -1e-12;
    double t = 0.0;
    fuzz_require(fabs(gap_at(s, 0.0) + s->radius - distance_at(s, 0.0)) <= 1e-12 * s->mill_radius ||
                     distance_at(s, 0.0) == 0.0,
                 "the gap is not the distance");
    for (int asked = 0; asked < MOST_ASKED; asked++) {
        const struct mill_flight from = {.r = vec3_fly(s->flight.r, s->flight.v, s->flight.g, t),
                                         .v = vec3_axpy(s->flight.v, t, s->flight.g),
                                         .g = s->flight.g,
                                         .pull = vec3_norm(s->flight.g),
                                         .slack = (double)INFINITY,
                                         .travel = (double)INFINITY};
        const struct mill_hit hit =
            s->blade->type->next_contact(s->blade, &from, s->radius, t, s->horizon - t, false);
        const bool none = hit.state == MILL_HIT_NONE;
        fuzz_require(none ? isinf(hit.t) : hit.t >= 0.0 && hit.t <= s->horizon - t, "%g is no time",
                     hit.t);
        const double until = none ? s->horizon : t + hit.t;
        if (outside)
            check_outside(s, t, until);
        if (hit.state == MILL_HIT_CONTACT)
            check_contact(s, until);
        if (hit.state != MILL_HIT_ASK_AGAIN)
            return;
        fuzz_require(until > t, "asked again where it began");
        t = until;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_bytes b = {data, size};
    for (int i = 0; i < 3 && (i == 0 || b.left > 0); i++) {
        struct shot s = make_shot(&b);
        if (!stay_inside(&s))
            continue;
        open_blade(&s);
        if (fuzz_shown())
            show(&s);
        check_shot(&s);
        lone_shape_free(s.blade);
        free(s.rotor);
    }
    return 0;
}
