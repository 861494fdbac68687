/* One contract for all shapes, checked from their gap alone: a contact is the first time at which
 * the gap is closed and closing. Random flights through a mill with a drum, end walls, shaft and
 * one blade; blades of many sizes, places and pitches, rotors of both directions and at rest. */
#include "shape_fixture.h"

#include <float.h>

#define CLOSED 1e-12 /* [m] */

static const char *const name[SHAPES] = {"drum", "wall 0", "wall 1", "shaft", "blade"};

static void random_mill(uint64_t *seed, struct mill *m)
{
    static const double pitches[] = {0.0,  PI / 6, -PI / 6, PI / 4, PI / 2, -PI / 2,
                                     1e-9, 3.0,    PI,      -2.0,   0.3,    -0.01};
    static const double speeds[] = {0.0, 0.0, 1e-6, 6.0, -6.0, 105.0, -105.0, 400.0, -400.0};
    const struct mill_blade blade = {
        .position = uniform(seed, -0.04, 0.04),
        .angle = uniform(seed, -10.0, 10.0),
        .tip_radius = uniform(seed, 0.02, 0.068),
        .width = log_uniform(seed, 1e-3, 0.03),
        .thickness = log_uniform(seed, 1e-3, 0.02),
        .pitch = pitches[below(seed, 12)],
    };
    mill_build(m, &blade, speeds[below(seed, 9)], uniform(seed, -2.0 * PI, 2.0 * PI));
}

static double least_gap(const struct mill *m, vec3 r, double radius, double t)
{
    double least = INFINITY;
    for (int k = 0; k < SHAPES; k++)
        least = fmin(least, gap_of(m->shape[k], r, radius, t));
    return least;
}

/* A ball inside the mill, clear of all shapes; some balls start close to shape k. */
static struct flight random_flight(uint64_t *seed, const struct mill *m, int k)
{
    struct flight f;
    const double near = uniform(seed, 0.0, 1.0) < 0.5 ? 3e-3 : HUGE_VAL;
    f.radius = log_uniform(seed, 2e-4, 5e-3);
    f.now = uniform(seed, 0.0, 0.06);
    static const vec3 corner[2] = {{-0.06, -0.075, -0.075}, {0.06, 0.075, 0.075}};
    double gap;
    do {
        f.path.r = point_in(seed, corner[0], corner[1]);
        gap = gap_of(m->shape[k], f.path.r, f.radius, f.now);
    } while (gap > near || least_gap(m, f.path.r, f.radius, f.now) < 0.0);
    const double speed = uniform(seed, 0.0, 1.0);
    f.path.v = vec3_scale(direction(seed), speed < 0.1   ? 0.0
                                           : speed < 0.3 ? log_uniform(seed, 1e-4, 1e-1)
                                                         : uniform(seed, 0.0, 10.0));
    const double pull = uniform(seed, 0.0, 1.0);
    f.path.g = pull < 0.2   ? nought
               : pull < 0.4 ? vec3_make(0.0, 0.0, -9.81)
               : pull < 0.5 ? vec3_make(9.81, 0.0, 0.0)
                            : vec3_scale(direction(seed), uniform(seed, 0.0, 20.0));
    return f;
}

/* Shapes may rely on a ball that is inside the mill: the time up to which it is. */
static double time_inside(const struct flight *f, double wanted)
{
    for (int i = 1; i <= 1000; i++) {
        const vec3 r = vec3_fly(f->path.r, f->path.v, f->path.g, wanted * i / 1000);
        if (r.y * r.y + r.z * r.z > drum_radius * drum_radius || fabs(r.x) > drum_length)
            return wanted * (i - 1) / 1000;
    }
    return wanted;
}

static double random_horizon(uint64_t *seed, const struct flight *f)
{
    return time_inside(f, log_uniform(seed, 1e-6, 0.06));
}

/* The ball at its contact, thrown back with a share of its approach speed. Every other one is made
 * to hop: slow along the surface and pulled towards it. */
static struct flight reflect(uint64_t *seed, const struct mill *m, int k, const struct flight *f,
                             double t, struct mill_contact *c)
{
    struct flight out = later(f, t);
    *c = contact_of(m->shape[k], out.path.r, f->radius, out.now);
    const double u_n = vec3_dot(vec3_sub(out.path.v, c->velocity), c->normal);
    double rebound = fmax(uniform(seed, 0.0, 1.0) * fmax(-u_n, 0.0), 5e-3);
    if (uniform(seed, 0.0, 1.0) < 0.5) {
        out.path.v = vec3_axpy(c->velocity, log_uniform(seed, 1e-3, 1.0), direction(seed));
        out.path.g = vec3_axpy(vec3_scale(direction(seed), uniform(seed, 0.0, 2.0)),
                               -uniform(seed, 0.0, 20.0), c->normal);
        rebound = log_uniform(seed, 5e-3, 0.1);
    }
    const double v_n = vec3_dot(vec3_sub(out.path.v, c->velocity), c->normal);
    out.path.v = vec3_axpy(out.path.v, rebound - v_n, c->normal);
    return out;
}

/* A gap that opens at speed u cannot be closed again before 2 u / (this). The contact may move
 * along a curved wall, which adds the last term. */
static double greatest_pull(const struct mill *m, const struct flight *f)
{
    const double v = vec3_norm(f->path.v), w = fabs(m->omega);
    return vec3_norm(f->path.g) + w * (2.0 * v + w * drum_radius) +
           v * v / (drum_radius - f->radius);
}

LOOP_TEST(the_first_contact_is_closed_closing_and_nothing_comes_before_it, SHAPES)
{
    uint64_t seed = 100 + (uint64_t)_i;
    int found = 0, none = 0, give_ups = 0;
    for (int i = 0; i < unit_draws(6000); i++) {
        struct mill m;
        random_mill(&seed, &m);
        const struct flight f = random_flight(&seed, &m, _i);
        const double horizon = random_horizon(&seed, &f);
        const double t = first_contact(m.shape[_i], &f, horizon, false, &give_ups);
        const double missed = first_below(m.shape[_i], &f, fmin(t, horizon), CLOSED);
        ck_assert_msg(isinf(missed), "%s, flight %d: gap %g at %.17g, before the contact at %.17g",
                      name[_i], i, gap_at(m.shape[_i], &f, missed), missed, t);
        if (isinf(t)) {
            none++;
        } else {
            found++;
            ck_assert_double_ge(gap_at(m.shape[_i], &f, t), -CLOSED);
            ck_assert_msg(gap_rate(m.shape[_i], &f, t) < 1e-6, "%s, flight %d: gap opens by %g m/s",
                          name[_i], i, gap_rate(m.shape[_i], &f, t));
        }
        mill_demolish(&m);
    }
    ck_assert_int_gt(found, unit_draws(300));
    ck_assert_int_gt(none, unit_draws(300));
    ck_assert_int_eq(give_ups, 0);
}

SLOW_TEST(a_resolved_contact_does_not_come_back_at_once_and_the_next_is_not_missed, SHAPES)
{
    uint64_t seed = 200 + (uint64_t)_i;
    int again = 0, flights = 0, give_ups = 0;
    for (int i = 0; i < unit_draws(3000); i++) {
        struct mill m;
        struct mill_contact c;
        random_mill(&seed, &m);
        struct flight f = random_flight(&seed, &m, _i);
        double horizon = random_horizon(&seed, &f);
        double t = first_contact(m.shape[_i], &f, horizon, false, NULL);
        for (int hop = 0; hop < 5 && t <= horizon; hop++) {
            f = reflect(&seed, &m, _i, &f, t, &c);
            horizon = time_inside(&f, uniform(&seed, 0.0, 0.06));
            const double opening = vec3_dot(vec3_sub(f.path.v, c.velocity), c.normal);
            t = first_contact(m.shape[_i], &f, horizon, true, &give_ups);
            ck_assert_msg(t > opening / greatest_pull(&m, &f),
                          "%s, flight %d: opening at %g m/s, back after %g s", name[_i], i, opening,
                          t);
            const double missed = first_below(m.shape[_i], &f, fmin(t, horizon), CLOSED);
            ck_assert_msg(isinf(missed), "%s, flight %d: gap %g at %.17g, the contact at %.17g",
                          name[_i], i, gap_at(m.shape[_i], &f, missed), missed, t);
            flights++;
            again += !isinf(t);
        }
        mill_demolish(&m);
    }
    ck_assert_int_gt(flights, unit_draws(300));
    ck_assert_int_gt(again, unit_draws(100));
    ck_assert_int_lt(give_ups, 5 + flights / 1000);
}

/* The same contact asked for again, in windows that end just after and just before it. */
static void ask_around(const struct mill_shape *s, const struct flight *f, double t, bool touching)
{
    for (double share = 1e-9; share < 1e-2; share *= 10.0) {
        const double more = t * (1.0 + share), less = t * (1.0 - share);
        ck_assert_double_eq_tol(ask(s, f, more, touching).t, t, 1e-12 * t);
        ck_assert_int_eq(ask(s, f, less, touching).state, MILL_HIT_NONE);
    }
}

/* The blade's search has a tolerance of its own. */
LOOP_TEST(a_contact_is_found_in_a_window_that_ends_just_after_it_and_in_no_shorter_one, BLADE)
{
    uint64_t seed = 800 + (uint64_t)_i;
    int first = 0, later = 0;
    for (int i = 0; i < unit_draws(6000); i++) {
        struct mill m;
        struct mill_contact c;
        random_mill(&seed, &m);
        struct flight f = random_flight(&seed, &m, _i);
        double t = first_contact(m.shape[_i], &f, random_horizon(&seed, &f), false, NULL);
        if (!isinf(t)) {
            ask_around(m.shape[_i], &f, t, false);
            f = reflect(&seed, &m, _i, &f, t, &c);
            t = first_contact(m.shape[_i], &f, time_inside(&f, 0.06), true, NULL);
            first++;
            if (!isinf(t)) {
                ask_around(m.shape[_i], &f, t, true);
                later++;
            }
        }
        mill_demolish(&m);
    }
    ck_assert_int_gt(first, unit_draws(300));
    ck_assert_int_gt(later, unit_draws(100));
}

static const struct mill_blade plain_blade = {.tip_radius = 0.06, .width = 0.01, .thickness = 0.01};

LOOP_TEST(a_straight_flight_meets_an_end_wall_at_the_end_of_the_window_to_the_last_bit, 2)
{
    uint64_t seed = 900 + (uint64_t)_i;
    struct mill m;
    int within = 0, beyond = 0;
    mill_build(&m, &plain_blade, 100.0, 0.0);
    const struct mill_shape *s = m.shape[WALL_0 + _i];
    for (int i = 0; i < unit_draws(20000); i++) {
        struct flight f = {.radius = 0.0025};
        f.path.r = vec3_make(uniform(&seed, -0.05, 0.05), 0.01, 0.02);
        f.path.v = vec3_scale(direction(&seed), 3.0);
        f.path.v.x = (_i == 0 ? -1.0 : 1.0) * log_uniform(&seed, 1e-3, 10.0);
        f.path.g = vec3_make(0.0, 0.0, -9.81);
        const double away = gap_at(s, &f, 0.0);
        for (int ulps = -1; ulps <= 1; ulps++) {
            const double horizon = away / fabs(f.path.v.x) * (1.0 + ulps * DBL_EPSILON);
            const struct mill_hit hit = ask(s, &f, horizon, false);
            const bool arrives = fma(horizon, fabs(f.path.v.x), -away) >= 0.0; /* rounded once */
            ck_assert_int_eq(hit.t <= horizon, arrives);
            ck_assert_int_eq(hit.state, arrives ? MILL_HIT_CONTACT : MILL_HIT_NONE);
            within += arrives;
            beyond += !arrives;
        }
    }
    ck_assert_int_gt(within, unit_draws(10000));
    ck_assert_int_gt(beyond, unit_draws(10000));
    mill_demolish(&m);
}

/* But on the blade, which has no polynomial. */
LOOP_TEST(a_hop_below_the_rounding_of_a_position_takes_its_full_time, BLADE)
{
    static const vec3 up[SHAPES] = {
        {0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}, {-1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}};
    struct mill m;
    mill_build(&m, &plain_blade, 100.0, 0.0);
    const double a = 0.0025, v = 1e-9, g = 9.81; /* rises by 5e-20 m */
    const vec3 on[SHAPES] = {{0.0, 0.0, -drum_radius + a},
                             {-0.5 * drum_length + a, 0.01, 0.02},
                             {0.5 * drum_length - a, 0.01, 0.02},
                             {0.0, 0.0, shaft_radius + a}};
    for (int side = -1; side <= 1; side++) {
        struct flight f = {.radius = a};
        f.path.r = vec3_axpy(on[_i], side * 1e-17, up[_i]);
        f.path.v = vec3_scale(up[_i], v);
        f.path.g = vec3_scale(up[_i], -g);
        ck_assert_double_eq_tol(ask(m.shape[_i], &f, 0.01, true).t, 2.0 * v / g, 1e-6 * v / g);
    }
    mill_demolish(&m);
}

/* A ball put a little into the shape, with a normal speed of `rate` relative to it; false where
 * that is not possible. */
static bool sink(const struct mill_shape *s, struct flight *f, double depth, double rate)
{
    struct mill_contact c = contact_of(s, f->path.r, f->radius, f->now);
    f->path.r = vec3_axpy(f->path.r, -(c.gap + depth), c.normal);
    c = contact_of(s, f->path.r, f->radius, f->now);
    const double u_n = vec3_dot(vec3_sub(f->path.v, c.velocity), c.normal);
    f->path.v = vec3_axpy(f->path.v, rate - u_n, c.normal);
    return fabs(c.gap + depth) < 1e-3 * depth;
}

LOOP_TEST(overlapping_and_closing_is_a_contact_now, SHAPES)
{
    uint64_t seed = 300 + (uint64_t)_i;
    int tried = 0;
    for (int i = 0; i < unit_draws(3000); i++) {
        struct mill m;
        random_mill(&seed, &m);
        struct flight f = random_flight(&seed, &m, _i);
        if (sink(m.shape[_i], &f, log_uniform(&seed, 1e-13, 1e-4),
                 -log_uniform(&seed, 1e-4, 10.0))) {
            ck_assert_double_eq(ask(m.shape[_i], &f, 1e-3, false).t, 0.0);
            tried++;
        }
        mill_demolish(&m);
    }
    ck_assert_int_gt(tried, unit_draws(1500));
}

/* Where the gap is closed and closing for certain, before t. */
static bool closes_before(const struct mill_shape *s, const struct flight *f, double t)
{
    double last = gap_at(s, f, 0.0);
    for (int i = 1; i < 3000; i++) {
        const double d = gap_at(s, f, t * i / 3000);
        if (d < last - 1e-15 && d < -CLOSED)
            return true;
        last = d;
    }
    return false;
}

SLOW_TEST(overlapping_and_opening_is_a_contact_only_when_it_closes_again, SHAPES)
{
    uint64_t seed = 400 + (uint64_t)_i;
    int again = 0, inside = 0;
    for (int i = 0; i < unit_draws(6000); i++) {
        struct mill m;
        random_mill(&seed, &m);
        struct flight f = random_flight(&seed, &m, _i);
        if (sink(m.shape[_i], &f, log_uniform(&seed, 1e-13, 1e-5), log_uniform(&seed, 1e-3, 1.0))) {
            const double until = time_inside(&f, 0.02);
            const double t = first_contact(m.shape[_i], &f, until, false, NULL);
            ck_assert_double_gt(t, 0.0);
            ck_assert_msg(!closes_before(m.shape[_i], &f, fmin(t, until)),
                          "%s, flight %d, before %g", name[_i], i, t);
            if (!isinf(t)) {
                again++;
                inside += gap_at(m.shape[_i], &f, t) < -CLOSED;
                ck_assert_double_lt(gap_rate(m.shape[_i], &f, t), 1e-6);
            }
        }
        mill_demolish(&m);
    }
    ck_assert_int_gt(again, unit_draws(30));
    ck_assert_int_gt(inside, unit_draws(3)); /* turned back before they were out */
}

static vec3 gradient(const struct mill_shape *s, vec3 r, double radius, double t)
{
    static const vec3 e[3] = {{1e-8, 0.0, 0.0}, {0.0, 1e-8, 0.0}, {0.0, 0.0, 1e-8}};
    double g[3];
    for (int k = 0; k < 3; k++)
        g[k] = gap_of(s, vec3_add(r, e[k]), radius, t) - gap_of(s, vec3_sub(r, e[k]), radius, t);
    return vec3_scale(vec3_make(g[0], g[1], g[2]), 1.0 / 2e-8);
}

LOOP_TEST(the_contact_s_normal_is_the_gap_s_gradient_and_its_point_lies_on_the_surface, SHAPES)
{
    uint64_t seed = 500 + (uint64_t)_i;
    for (int i = 0; i < unit_draws(3000); i++) {
        struct mill m;
        random_mill(&seed, &m);
        struct flight f = random_flight(&seed, &m, _i);
        const struct mill_shape *s = m.shape[_i];
        if (i % 3 == 0)
            sink(m.shape[_i], &f, uniform(&seed, 0.0, 0.5) * f.radius, 0.0);
        const struct mill_contact c = contact_of(s, f.path.r, f.radius, f.now);
        const vec3 slope = gradient(s, f.path.r, f.radius, f.now);
        const vec3 arm = vec3_sub(f.path.r, c.point);
        ck_assert_double_eq(c.gap, gap_of(s, f.path.r, f.radius, f.now));
        ck_assert_double_eq_tol(vec3_norm(c.normal), 1.0, 1e-14);
        ck_assert_double_lt(vec3_norm(vec3_sub(c.normal, slope)), 1e-5);
        ck_assert_double_eq_tol(vec3_norm(arm), f.radius + c.gap, 1e-15);
        ck_assert_double_gt(vec3_dot(arm, c.normal), 0.0);
        ck_assert_double_eq_tol(gap_of(s, c.point, 0.0, f.now), 0.0, 1e-15);
        mill_demolish(&m);
    }
}

LOOP_TEST(the_surface_moves_as_the_gap_says_and_turns_about_the_axis, SHAPES)
{
    uint64_t seed = 600 + (uint64_t)_i;
    for (int i = 0; i < unit_draws(3000); i++) {
        struct mill m;
        random_mill(&seed, &m);
        const struct flight f = random_flight(&seed, &m, _i);
        const struct mill_shape *s = m.shape[_i];
        const struct mill_contact c = contact_of(s, f.path.r, f.radius, f.now);
        const double omega = s->motion ? m.omega : 0.0;
        const double h = 1e-8 / fmax(fabs(omega), 1.0); /* [s] */
        const double rate =
            (gap_of(s, f.path.r, f.radius, f.now + h) - gap_of(s, f.path.r, f.radius, f.now - h)) /
            (2.0 * h);
        ck_assert_int_eq(s->motion != NULL, _i == SHAFT || _i == BLADE);
        ck_assert_double_eq_tol(vec3_dot(c.velocity, c.normal), -rate,
                                1e-6 * (1.0 + fabs(omega) * drum_radius));
        ck_assert_double_eq(c.velocity.x, 0.0);
        ck_assert_double_eq_tol(c.velocity.y, -omega * c.point.z, 1e-15);
        ck_assert_double_eq_tol(c.velocity.z, omega * c.point.y, 1e-15);
        if (!s->motion)
            ck_assert_double_eq(rate, 0.0);
        mill_demolish(&m);
    }
}

/* A box of up to 10 mm around r, or of none at all on some sides, as cells at the border have. */
static void box_around(uint64_t *seed, vec3 r, vec3 *lo, vec3 *hi)
{
    const double side = log_uniform(seed, 1e-6, 0.01);
    double edge[6];
    for (int i = 0; i < 6; i++)
        edge[i] = uniform(seed, 0.0, 1.0) < 0.1 ? HUGE_VAL : side * uniform(seed, 0.0, 1.0);
    *lo = vec3_make(r.x - edge[0], r.y - edge[1], r.z - edge[2]);
    *hi = vec3_make(r.x + edge[3], r.y + edge[4], r.z + edge[5]);
}

LOOP_TEST(a_shape_is_in_reach_wherever_it_is_met_but_not_everywhere, SHAPES)
{
    uint64_t seed = 700 + (uint64_t)_i;
    int met = 0, far = 0;
    for (int i = 0; i < unit_draws(6000); i++) {
        struct mill m;
        vec3 lo, hi;
        random_mill(&seed, &m);
        const struct flight f = random_flight(&seed, &m, _i);
        const struct mill_shape *s = m.shape[_i];
        const double t = first_contact(m.shape[_i], &f, random_horizon(&seed, &f), false, NULL);
        box_around(&seed, f.path.r, &lo, &hi);
        far += !s->type->reachable(s, lo, hi, f.radius);
        if (!isinf(t)) {
            met++;
            box_around(&seed, vec3_fly(f.path.r, f.path.v, f.path.g, t), &lo, &hi);
            ck_assert(s->type->reachable(s, lo, hi, f.radius));
            ck_assert(s->type->reachable(s, lo, hi, f.radius * uniform(&seed, 1.0, 2.0)));
        }
        mill_demolish(&m);
    }
    ck_assert_int_gt(met, unit_draws(300));
    ck_assert_int_gt(far, unit_draws(300));
}

int main(void)
{
    return unit_run("shapes");
}
