/* The wavy drum's profile: the formula, and the distance to the wall, held against points along the
 * arcs. */
#include "wavy_fixture.h"

#include <float.h>

static const double heights[] = {1e-300, 1e-15, 1e-12, 1e-9, 1e-6, 1e-4, 5e-4,
                                 1e-3,   2e-3,  4e-3,  6e-3, 8e-3, 1e-2};

enum { HEIGHTS = sizeof heights / sizeof *heights, MOST = 20 };

/* ---- the profile ---- */

TEST(neighbouring_arcs_touch_in_the_middle_between_their_centres)
{
    for (int n = 2; n <= 500; n = n < MOST ? n + 1 : 5 * n / 2) {
        for (int k = 0; k < HEIGHTS; k++) {
            const struct mill_profile p = mill_lining_profile(n, R, heights[k], 0.0);
            const double y = p.inner * cos(PI / n) - p.outer, z = p.inner * sin(PI / n);
            ck_assert_double_eq_tol(hypot(y, z), 2.0 * p.arc, 1e-16);
        }
    }
}

TEST(the_extreme_radii_are_those_of_the_drum_more_and_less_the_height)
{
    for (int n = 2; n <= MOST; n++) {
        for (int k = 0; k < HEIGHTS; k++) {
            const struct mill_profile p = mill_lining_profile(n, R, heights[k], 0.0);
            ck_assert_double_eq_tol(p.outer + p.arc, R + heights[k], 3e-17);
            ck_assert_double_eq_tol(p.inner - p.arc, R - heights[k], 3e-17);
        }
    }
}

TEST(the_contract_s_equation_holds_and_its_larger_root_is_taken)
{
    for (int n = 2; n <= MOST; n++) {
        for (int k = 0; k < HEIGHTS; k++) {
            const double h = heights[k], q = 1.0 - cos(PI / n);
            const struct mill_profile p = mill_lining_profile(n, R, h, 0.0);
            const double u = p.arc - h, scale = q * (R * R + u * u) + 4.0 * h * fabs(u);
            ck_assert_double_eq_tol(q * u * u + 4.0 * h * u + 2.0 * h * h - q * R * R, 0.0,
                                    1e-13 * scale);
            ck_assert_double_ge(u, -2.0 * h / q);
        }
    }
}

TEST(a_profile_of_no_height_is_the_circle)
{
    for (int n = 2; n <= 500; n++) {
        const struct mill_profile p = mill_lining_profile(n, R, 0.0, 0.0);
        ck_assert_double_eq_tol(p.arc, R, 1e-16);
        ck_assert_double_eq(p.outer, 0.0);
    }
}

/* Point s = 0..1 of the half pitch from the middle of outer arc 0 to the middle of inner arc 1, of
 * a profile of angle 0 */
static vec3 on_profile(const struct mill_profile *p, double s)
{
    const double whole = p->half_outer + p->half_inner;
    const double a = s * whole, pitch = PI / p->buckles;
    if (a <= p->half_outer)
        return vec3_make(0.0, p->outer + p->arc * cos(a), p->arc * sin(a));
    const double b = pitch + PI + (whole - a);
    return vec3_make(0.0, p->inner * cos(pitch) + p->arc * cos(b),
                     p->inner * sin(pitch) + p->arc * sin(b));
}

TEST(the_area_is_what_the_points_of_the_profile_enclose)
{
    enum { POINTS = 20000 };
    for (int n = 2; n <= MOST; n++) {
        for (int k = 0; k < HEIGHTS; k++) {
            const struct mill_profile p = mill_lining_profile(n, R, heights[k], 0.0);
            const struct mill_setup_drum drum = wavy_drum(n, R, 1.0, heights[k], 0.3);
            double area = 0.0;
            vec3 last = on_profile(&p, 0.0);
            for (int i = 1; i <= POINTS; i++) {
                const vec3 next = on_profile(&p, (double)i / POINTS);
                area += n * (last.y * next.z - last.z * next.y);
                last = next;
            }
            ck_assert_double_eq_tol(mill_lining_area(drum.corner, drum.corners), area, 1e-7 * area);
        }
    }
}

TEST(every_profile_of_the_study_is_sound_and_overhangs_are)
{
    int overhangs = 0;
    for (int n = 2; n <= MOST; n++) {
        for (double h = 0.0; h <= 0.01; h += 0.0005) {
            const struct mill_profile p = mill_lining_profile(n, R, h, 0.0);
            ck_assert(p.sound);
            overhangs += h > R * sin(PI / (2 * n));
        }
    }
    ck_assert_int_gt(overhangs, 30);
}

/* Do the arcs of the half pitch keep within it? */
static bool keeps_within(const struct mill_profile *p)
{
    const double c = cos(PI / p->buckles), s = sin(PI / p->buckles);
    for (int i = 1; i < 20000; i++) {
        const vec3 r = on_profile(p, i / 20000.0);
        if (r.z <= 0.0 || r.z * c >= r.y * s)
            return false;
    }
    return true;
}

TEST(a_profile_is_sound_up_to_the_height_at_which_neighbouring_bulges_meet)
{
    for (int n = 2; n <= 300; n = n < 24 ? n + 1 : 2 * n) {
        const double highest = mill_deck_lining_highest(n, R);
        const struct mill_profile below = mill_lining_profile(n, R, 0.998 * highest, 0.0);
        const struct mill_profile above = mill_lining_profile(n, R, 1.002 * highest, 0.0);
        ck_assert(below.sound);
        ck_assert(!above.sound);
        ck_assert(keeps_within(&below));
        ck_assert(above.height >= R || !keeps_within(&above));
        ck_assert(n == 2 || highest < R);
    }
}

/* ---- the distance ---- */

/* Distance to the nearest of points all along the wall */
static double by_points(const struct mill_profile *p, vec3 r)
{
    double least = INFINITY;
    for (int k = 0; k < 2 * p->buckles; k++) { /* the half pitches and their mirror images */
        const double turn = p->angle + 2.0 * PI * (k / 2) / p->buckles;
        const double y = cos(turn) * r.y + sin(turn) * r.z;
        const double z = (k % 2 ? -1.0 : 1.0) * (cos(turn) * r.z - sin(turn) * r.y);
        for (int i = 0; i <= 2000; i++) {
            const vec3 on = on_profile(p, i / 2000.0);
            least = fmin(least, square(on.y - y) + square(on.z - z));
        }
    }
    return sqrt(least);
}

TEST(the_gap_is_the_distance_to_the_nearest_point_of_the_wall)
{
    uint64_t seed = 1;
    int inside = 0, outside = 0;
    for (int i = 0; i < 400; i++) {
        struct wavy_mill m;
        build_random(&seed, &m);
        const vec3 r = random_place(&seed, &m);
        const double gap = wall_gap(&m, r, 0.0);
        if (hypot(r.y, r.z) < R + m.profile.height && gap > -0.9 * m.profile.arc) {
            /* halfway between two points an arc is nearer by this */
            const double step = m.profile.arc * 2.0 * PI / 2000.0, d = fabs(gap);
            const double apart =
                d < step ? step : step * step / 8.0 * (1.0 / d + 1.0 / m.profile.arc);
            const double points = by_points(&m.profile, r);
            ck_assert_double_eq_tol(fabs(gap), points, apart + 1e-15);
        }
        inside += gap > 0.0;
        outside += gap < 0.0;
        mill_demolish(&m.mill);
    }
    ck_assert_int_gt(inside, 100);
    ck_assert_int_gt(outside, 50);
}

TEST(the_gap_is_positive_inside_and_negative_outside)
{
    uint64_t seed = 2;
    for (int i = 0; i < unit_draws(3000); i++) {
        struct wavy_mill m;
        build_random(&seed, &m);
        const struct mill_profile *p = &m.profile;
        const double s = uniform(&seed, 0.0, 1.0), e = 1e-7, c = cos(p->angle), n = sin(p->angle);
        const vec3 a = on_profile(p, fmax(s - 1e-6, 0.0)), b = on_profile(p, fmin(s + 1e-6, 1.0));
        const vec3 on = on_profile(p, s), along = vec3_sub(b, a);
        const vec3 out = vec3_scale(vec3_make(0.0, along.z, -along.y), e / vec3_norm(along));
        for (int side = -1; side <= 1; side += 2) {
            const vec3 r = vec3_axpy(on, side, out);
            const vec3 turned = vec3_make(0.01, c * r.y - n * r.z, n * r.y + c * r.z);
            /* bulges of a billionth have more bend than this leaves room for */
            if (p->height > 1e-5)
                ck_assert_double_eq_tol(wall_gap(&m, turned, 0.0), -side * e, 0.01 * e);
        }
        mill_demolish(&m.mill);
    }
}

SLOW_TEST(buckles_of_next_to_no_height_are_met_like_the_circle, 1)
{
    uint64_t seed = 3;
    for (int i = 0; i < unit_draws(20000); i++) {
        struct wavy_mill m;
        const double h = log_uniform(&seed, 1e-320, 1e-4);
        build(&m, (int)uniform(&seed, 2.0, 501.0), h / 10.0, uniform(&seed, -4.0, 4.0));
        const vec3 r = random_place(&seed, &m);
        const double circle = R - hypot(r.y, r.z);
        ck_assert_double_eq_tol(wall_gap(&m, r, 0.0), circle, h + 1e-16);
        mill_demolish(&m.mill);
    }
}

TEST(across_the_line_at_a_joint_the_gap_has_no_step_and_the_normal_no_kink)
{
    uint64_t seed = 4;
    for (int i = 0; i < unit_draws(3000); i++) {
        struct wavy_mill m;
        build_random(&seed, &m);
        const struct mill_profile *p = &m.profile;
        const struct mill_shape *s = m.drum;
        const double radius = uniform(&seed, 0.01, 0.9) * p->arc;
        /* the direction of an arc is that of its chord */
        const double chord = 2.0 * p->arc * fmin(sin(p->half_inner), sin(p->half_outer));
        const double rounding = 32.0 * DBL_EPSILON * R / chord;
        const double pitch = PI / p->buckles;
        const int k = (int)uniform(&seed, 0.0, p->buckles);
        const double outer = p->angle + 2.0 * pitch * k;
        const double inner = outer + (i % 2 ? pitch : -pitch);
        const vec3 a = vec3_make(0.0, p->outer * cos(outer), p->outer * sin(outer));
        const vec3 b = vec3_make(0.0, p->inner * cos(inner), p->inner * sin(inner));
        const vec3 e = vec3_scale(vec3_sub(b, a), 1.0 / vec3_norm(vec3_sub(b, a)));
        const vec3 at = vec3_axpy(a, p->arc - radius, e), across = vec3_make(0.0, -e.z, e.y);
        for (double off = 1e-16; off < 1e-7; off *= 10.0) {
            const vec3 r0 = vec3_axpy(at, -off, across), r1 = vec3_axpy(at, off, across);
            const struct mill_contact c0 = contact_of(s, r0, radius, 0.0);
            const struct mill_contact c1 = contact_of(s, r1, radius, 0.0);
            const double bend = off / (p->arc - radius);
            ck_assert_double_eq_tol(c0.gap, c1.gap, bend * off + 2e-16);
            ck_assert_double_eq_tol(c0.gap, 0.0, bend * off + 3e-16);
            ck_assert_double_lt(vec3_norm(vec3_sub(c0.normal, c1.normal)),
                                2.0 * bend + 1e-12 + rounding);
        }
        mill_demolish(&m.mill);
    }
}

TEST(the_contact_s_normal_is_the_gap_s_gradient_and_its_point_lies_on_the_wall)
{
    uint64_t seed = 5;
    int checked = 0;
    for (int i = 0; i < unit_draws(4000); i++) {
        struct wavy_mill m;
        build_random(&seed, &m);
        const struct mill_shape *s = m.drum;
        const vec3 r = random_place(&seed, &m);
        const double radius = log_uniform(&seed, 2e-4, 5e-3), h = 1e-8;
        const struct mill_contact c = contact_of(s, r, radius, 0.0);
        if (fabs(c.gap) < 0.3 * m.profile.arc) {
            const vec3 y = vec3_make(0.0, h, 0.0), z = vec3_make(0.0, 0.0, h);
            const double gy =
                wall_gap(&m, vec3_add(r, y), radius) - wall_gap(&m, vec3_sub(r, y), radius);
            const double gz =
                wall_gap(&m, vec3_add(r, z), radius) - wall_gap(&m, vec3_sub(r, z), radius);
            /* on the ridge between two bulges there is none */
            const bool smooth = fabs(hypot(gy, gz) - 2.0 * h) < 1e-6 * h;
            if (smooth) {
                ck_assert_double_eq_tol(c.normal.y, gy / (2.0 * h), 1e-5);
                ck_assert_double_eq_tol(c.normal.z, gz / (2.0 * h), 1e-5);
                checked++;
            }
            const vec3 arm = vec3_sub(r, c.point);
            ck_assert_double_eq(c.gap, wall_gap(&m, r, radius));
            ck_assert_double_eq_tol(vec3_norm(c.normal), 1.0, 1e-14);
            ck_assert_double_eq_tol(vec3_dot(arm, c.normal), radius + c.gap, 1e-15);
            ck_assert_double_eq_tol(wall_gap(&m, c.point, 0.0), 0.0, 1e-15);
            ck_assert_double_eq(vec3_norm(c.velocity), 0.0);
        }
        mill_demolish(&m.mill);
    }
    ck_assert_int_gt(checked, unit_draws(1000));
}

int main(void)
{
    return unit_run("profile");
}
