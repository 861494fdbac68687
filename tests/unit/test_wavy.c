/* The first contact with the wavy drum, from its gap alone: the first time at which the gap is
 * closed and closing. Flights aimed at joints, hops that begin there, balls that touch two bulges
 * at once. test_contour.c has flights of any kind. */
#include "wavy_fixture.h"

#include <float.h>

#define CLOSED 1e-12 /* [m] */
/* [m] what the march calls missed: steps past a grazing contact are shorter yet */
#define SUNK 1e-10

static struct mill_contact meet(const struct wavy_mill *m, const struct flight *f, double t)
{
    const vec3 r = vec3_fly(f->path.r, f->path.v, f->path.g, t);
    const vec3 v = vec3_axpy(f->path.v, t, f->path.g);
    return mill_shape_meet(m->drum, r, v, f->radius, &mill_pose_still);
}

static double closing_at(const struct wavy_mill *m, const struct flight *f, double t)
{
    const struct mill_contact c = meet(m, f, t);
    return -vec3_dot(vec3_axpy(f->path.v, t, f->path.g), c.normal);
}

/* The first contact that a flight has within `horizon`, held against a march along the gap. */
static double checked_contact(const struct wavy_mill *m, const struct flight *f, double horizon,
                              bool touching)
{
    const double t = first_contact(m->drum, f, horizon, touching, NULL);
    const double missed = first_below(m->drum, f, fmin(t, horizon), SUNK);
    ck_assert_msg(isinf(missed), "n %d, h %g, a %g: gap %g at %.17g, before the contact at %.17g",
                  m->profile.buckles, m->profile.height, f->radius, gap_at(m->drum, f, missed),
                  missed, t);
    if (!isinf(t)) {
        ck_assert_double_eq_tol(gap_at(m->drum, f, t), 0.0, CLOSED);
        ck_assert_msg(closing_at(m, f, t) > -1e-6, "n %d, h %g, a %g: opens by %g m/s",
                      m->profile.buckles, m->profile.height, f->radius, -closing_at(m, f, t));
    }
    return t;
}

/* Straight at the nearest point of the wall no bound of the way is too large. */
LOOP_TEST(a_flight_just_long_enough_for_its_contact_finds_it, 2)
{
    uint64_t seed = 150 + (uint64_t)_i;
    for (int i = 0; i < unit_draws(2500); i++) {
        struct wavy_mill m;
        build_random(&seed, &m);
        struct flight f = random_flight(&seed, &m);
        const vec3 way = vec3_scale(meet(&m, &f, 0.0).normal, -1.0);
        const double pull = i % 2 ? uniform(&seed, 0.0, 20.0) : 0.0;
        f.path.v = vec3_scale(way, log_uniform(&seed, 1e-2, 10.0));
        f.path.g = vec3_scale(way, pull);
        const double t = first_contact(m.drum, &f, 1e9, false, NULL);
        ck_assert(t < 1e9);
        const double hair = 1e-9 * t + 1e-15 / vec3_norm(f.path.v);
        const double again = first_contact(m.drum, &f, t + hair, false, NULL);
        ck_assert_msg(fabs(again - t) <= 1e-3 * hair, "n %d, h %g: contact at %.17g, not at %g",
                      m.profile.buckles, m.profile.height, t, again);
        if (t > 1e3 * hair)
            ck_assert(isinf(first_contact(m.drum, &f, t - hair, false, NULL)));
        mill_demolish(&m.mill);
    }
}

/* Where the ball's centre is when it touches the wall at a joint, the wall's direction there and
 * its normal into the drum */
struct joint {
    vec3 at, along, normal;
};

static struct joint random_joint(uint64_t *seed, const struct wavy_mill *m, double radius)
{
    const struct mill_profile *p = &m->profile;
    const double pitch = PI / p->buckles;
    const double outer = p->angle + 2.0 * pitch * (int)uniform(seed, 0.0, p->buckles);
    const double inner = outer + (uniform(seed, 0.0, 1.0) < 0.5 ? pitch : -pitch);
    const vec3 a = vec3_make(0.0, p->outer * cos(outer), p->outer * sin(outer));
    const vec3 b = vec3_make(0.0, p->inner * cos(inner), p->inner * sin(inner));
    const vec3 e = vec3_scale(vec3_sub(b, a), 1.0 / vec3_norm(vec3_sub(b, a)));
    const struct joint j = {vec3_axpy(a, p->arc - radius, e), vec3_make(0.0, -e.z, e.y),
                            vec3_scale(e, -1.0)};
    return j;
}

/* A drum with a way through its buckles, so that a ball of 2.5 mm can be at all its joints */
static void build_open(uint64_t *seed, struct wavy_mill *m)
{
    build(m, (int)uniform(seed, 2.0, 21.0), log_uniform(seed, 1e-10, 1e-2),
          uniform(seed, -4.0, 4.0));
}

/* Flown back from the joint, the ball starts off the wall and meets it at the joint or next to it.
 */
SLOW_TEST(a_contact_at_a_joint_is_neither_missed_nor_made_up, 2)
{
    uint64_t seed = 300 + (uint64_t)_i;
    int found = 0, grazing = 0;
    for (int i = 0; i < unit_draws(4000); i++) {
        struct wavy_mill m;
        build_open(&seed, &m);
        struct flight f;
        f.radius = 0.0025;
        random_course(&seed, &f);
        const struct joint j = random_joint(&seed, &m, f.radius);
        const double off = uniform(&seed, 0.0, 1.0) < 0.3 ? 0.0 : log_uniform(&seed, 1e-18, 1e-6);
        const double speed = uniform(&seed, 0.1, 10.0), t = log_uniform(&seed, 1e-6, 1e-2);
        const bool graze = uniform(&seed, 0.0, 1.0) < 0.3;
        const double slope = graze ? 0.0 : log_uniform(&seed, 1e-8, 1.0);
        const vec3 v =
            vec3_axpy(vec3_scale(j.along, i % 2 ? speed : -speed), -speed * slope, j.normal);
        const vec3 at = vec3_axpy(j.at, i % 3 ? off : -off, j.along);
        f.path.r = vec3_fly(at, vec3_scale(v, -1.0), f.path.g, t);
        f.path.v = vec3_axpy(v, -t, f.path.g);
        if (gap_at(m.drum, &f, 0.0) > 0.0) {
            found += !isinf(checked_contact(&m, &f, 2.0 * t, false));
            grazing += graze;
        }
        mill_demolish(&m.mill);
    }
    ck_assert_int_gt(found, unit_draws(500));
    ck_assert_int_gt(grazing, unit_draws(100));
}

SLOW_TEST(a_hop_from_a_joint_ends_where_the_wall_is_next, 2)
{
    uint64_t seed = 400 + (uint64_t)_i;
    int again = 0;
    for (int i = 0; i < unit_draws(4000); i++) {
        struct wavy_mill m;
        build_open(&seed, &m);
        struct flight f;
        f.radius = 0.0025;
        random_course(&seed, &f);
        const struct joint j = random_joint(&seed, &m, f.radius);
        const double off = uniform(&seed, -1.0, 1.0) * log_uniform(&seed, 1e-18, 1e-5);
        f.path.r = vec3_axpy(j.at, i % 4 ? off : 0.0, j.along);
        const struct mill_contact c = meet(&m, &f, 0.0);
        f.path.r = vec3_axpy(f.path.r, -c.gap, c.normal); /* onto the wall, but for rounding */
        const double opening = log_uniform(&seed, 5e-3, 1.0);
        f.path.v = vec3_axpy(vec3_scale(j.along, uniform(&seed, -10.0, 10.0)), opening, c.normal);
        f.path.v = vec3_axpy(f.path.v, opening - vec3_dot(f.path.v, c.normal), c.normal);
        const double t = checked_contact(&m, &f, 0.05, true);
        const double v = vec3_norm(f.path.v) + 1.0;
        ck_assert_msg(t > opening / (20.0 + v * v / (m.profile.arc - f.radius)),
                      "n %d, h %g, off %g: opening at %g m/s, back after %g s", m.profile.buckles,
                      m.profile.height, off, opening, t);
        again += !isinf(t);
        mill_demolish(&m.mill);
    }
    ck_assert_int_gt(again, unit_draws(1000));
}

/* Without the root at t = 0 divided out the hop would be told from rounding alone. */
TEST(a_hop_below_the_rounding_of_a_position_takes_its_full_time)
{
    const double v = 1e-9, g = 9.81; /* rises by 5e-20 m */
    uint64_t seed = 700;
    for (int i = 0; i < unit_draws(3000); i++) {
        struct wavy_mill m;
        build_open(&seed, &m);
        const struct mill_profile *p = &m.profile;
        struct flight f;
        f.radius = 0.0025;
        f.now = 0.0;
        const double pitch = PI / p->buckles * (int)uniform(&seed, 0.0, 2.0 * p->buckles);
        const double turn = p->angle + pitch;
        const bool outer = (int)(pitch * p->buckles / PI + 0.5) % 2 == 0;
        const double rho = outer ? p->outer + p->arc - f.radius : p->inner - p->arc - f.radius;
        const vec3 middle = vec3_make(0.0, cos(turn), sin(turn));
        const struct joint j = random_joint(&seed, &m, f.radius);
        /* else in the middle of an arc, which is a joint where a wide arc is cut in two */
        const bool at_joint = i % 3 == 0, cut = outer ? p->half_outer > 1.4 : p->half_inner > 0.7;
        const vec3 up = at_joint ? j.normal : vec3_scale(middle, -1.0);
        f.path.r = vec3_axpy(at_joint ? j.at : vec3_scale(middle, rho), (i % 5 - 2) * 1e-17, up);
        f.path.v = vec3_scale(up, v);
        f.path.g = vec3_scale(up, -g);
        const double t = ask(m.drum, &f, 0.01, true).t;
        if (at_joint ||
            cut) { /* along the line between two arcs: by either of them, within rounding */
            ck_assert_double_gt(t, 0.99 * v / g);
            ck_assert_double_eq_tol(gap_at(m.drum, &f, t), 0.0, 1e-16);
        } else {
            ck_assert_double_eq_tol(t, 2.0 * v / g, 1e-6 * v / g);
        }
        mill_demolish(&m.mill);
    }
}

TEST(overlapping_and_closing_is_now_and_overlapping_and_opening_only_when_it_closes_again)
{
    uint64_t seed = 500 + (uint64_t)_i;
    int now = 0, later = 0;
    for (int i = 0; i < unit_draws(3000); i++) {
        struct wavy_mill m;
        build_random(&seed, &m);
        struct flight f = random_flight(&seed, &m);
        const double depth = log_uniform(&seed, 1e-13, 1e-6);
        struct mill_contact c = meet(&m, &f, 0.0);
        f.path.r = vec3_axpy(f.path.r, -(c.gap + depth), c.normal);
        c = contact_of(m.drum, f.path.r, f.radius, 0.0);
        const double rate = (i % 2 ? 1.0 : -1.0) * log_uniform(&seed, 1e-3, 1.0);
        f.path.v = vec3_axpy(f.path.v, rate - vec3_dot(f.path.v, c.normal), c.normal);
        if (fabs(c.gap + depth) < 1e-3 * depth) {
            const double t = first_contact(m.drum, &f, 1e-3, false, NULL);
            if (rate < 0.0) {
                ck_assert_double_eq(t, 0.0);
                now++;
            } else if (f.radius < 0.5 * m.profile.arc && m.profile.half_outer < 0.5 * PI) {
                ck_assert_double_gt(t, 0.0); /* where the ball cannot touch two bulges */
                if (!isinf(t))
                    ck_assert_double_gt(closing_at(&m, &f, t), -1e-6);
                later++;
            }
        }
        mill_demolish(&m.mill);
    }
    ck_assert_int_gt(now, unit_draws(500));
    ck_assert_int_gt(later, unit_draws(200));
}

/* ---- two places at once ---- */

TEST(a_ball_too_wide_for_a_buckle_meets_the_bulges_on_both_sides)
{
    struct wavy_mill m;
    build(&m, 20, 0.01, 0.0);
    const double a = 0.5 * (m.profile.inner * sin(PI / 20) - m.profile.arc) + 0.5 * m.profile.arc;
    ck_assert_double_gt(a, m.profile.inner * sin(PI / 20) - m.profile.arc);
    struct flight f;
    f.radius = a;
    f.now = 0.0;
    f.path.r = vec3_make(0.0, 0.05, 0.0); /* straight at the middle of a buckle */
    f.path.v = vec3_make(0.0, 1.0, 0.0);
    f.path.g = nought;
    const double t = checked_contact(&m, &f, 1.0, false);
    const struct mill_contact one = meet(&m, &f, t);
    f = later(&f, t);
    f.path.v = vec3_axpy(f.path.v, -1.8 * vec3_dot(f.path.v, one.normal), one.normal);
    ck_assert_double_lt(fabs(f.path.r.z), 1e-15);
    ck_assert_double_eq_tol(ask(m.drum, &f, 1.0, true).t, 0.0, 1e-15);
    const struct mill_contact two = meet(&m, &f, 0.0);
    ck_assert_double_eq_tol(two.normal.y, one.normal.y, 1e-12);
    ck_assert_double_eq_tol(two.normal.z, -one.normal.z, 1e-12);
    ck_assert_double_gt(closing_at(&m, &f, 0.0), 0.1);
    for (int bounce = 0; ask(m.drum, &f, 1.0, true).t < 1e-3; bounce++) { /* to and fro, and out */
        const struct mill_contact c = meet(&m, &f, 0.0);
        ck_assert_double_lt(vec3_dot(f.path.v, c.normal), 0.0);
        ck_assert_int_lt(bounce, 20);
        f.path.v = vec3_axpy(f.path.v, -1.8 * vec3_dot(f.path.v, c.normal), c.normal);
    }
    ck_assert_double_lt(f.path.v.y, 0.0);
    mill_demolish(&m.mill);
}

int main(void)
{
    return unit_run("wavy");
}
