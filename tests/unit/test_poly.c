/* Quadratics, quartics, Sturm counts and the first closing of a contact polynomial. */
#include <check.h>
#include <complex.h>
#include <stdlib.h>

#include "millsim/poly.h"
#include "poly_cases.h"
#include "poly_sturm.h"

#define J ((double complex)_Complex_I)
#define DIFFER(a, b) (fabs((a) - (b)))

static gsl_rng *seeded(unsigned long seed)
{
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, seed);
    return rng;
}

/* ---------------------------------------------------------------- quadratics */

START_TEST(small_root_of_a_quadratic_keeps_its_digits)
{
    double x[2];
    ck_assert_int_eq(mill_poly_quadratic(1.0, -5e8, 1.0, x), 2);
    ck_assert_double_eq_tol(x[0], 1e-9, 1e-24);
    ck_assert_double_eq_tol(x[1], 1e9, 1e-6);
}
END_TEST

START_TEST(nearly_double_roots_are_right_to_the_last_bits)
{
    /* Kahan's example: b^2 - ac is all rounding unless the products are exact */
    double x[2];
    int n = mill_poly_quadratic(94906265.625, -94906267.0, 94906268.375, x);
    ck_assert_int_eq(n, 2);
    ck_assert_double_eq_tol(x[0], 1.0, 1e-15);
    ck_assert_double_eq_tol(x[1], 1.000000028975958, 1e-15);
}
END_TEST

START_TEST(double_root_counts_once)
{
    double x[2];
    ck_assert_int_eq(mill_poly_quadratic(1.0, -3.0, 9.0, x), 1);
    ck_assert_double_eq(x[0], 3.0);
    ck_assert_int_eq(mill_poly_quadratic(2.0, 0.0, 0.0, x), 1);
    ck_assert_double_eq(x[0], 0.0);
}
END_TEST

START_TEST(quadratic_without_square_term_is_linear)
{
    double x[2];
    ck_assert_int_eq(mill_poly_quadratic(0.0, 2.0, -8.0, x), 1);
    ck_assert_double_eq(x[0], 2.0);
    ck_assert_int_eq(mill_poly_quadratic(0.0, 0.0, 1.0, x), 0);
}
END_TEST

START_TEST(quadratic_survives_the_ends_of_the_exponent_range)
{
    double x[2];
    for (int e = -1000; e <= 1000; e += 8) { /* 2^e (x - 1)(x - 3), and x scaled by 2^e/2 */
        double s = ldexp(1.0, e), h = ldexp(1.0, e / 2);
        ck_assert_int_eq(mill_poly_quadratic(s, -2.0 * s, 3.0 * s, x), 2);
        ck_assert(x[0] == 1.0 && x[1] == 3.0);
        ck_assert_int_eq(mill_poly_quadratic(1.0, -2.0 * h, 3.0 * h * h, x), 2);
        ck_assert(x[0] == h && x[1] == 3.0 * h);
        ck_assert_int_eq(mill_poly_quadratic(1.0 / h, -2.0, 3.0 * h, x), 2);
        ck_assert(x[0] == h && x[1] == 3.0 * h);
    }
}
END_TEST

/* ---------------------------------------------------------------- quartics */

struct known_quartic {
    double complex root[4];
    double c[5]; /* c0 .. c4 */
    double floor;
};

/* From the literature on quartic solvers; floor is what rounding the coefficients costs */
static const struct known_quartic hard[] = {
    {{1e9, 1e6, 1e3, 1}, {1e18, -1001001001e9, 1001002001001000, -1001001001, 1}, 0},
    {{2.003, 2.002, 2.001, 2}, {16.048044012, -32.072044006, 24.036011, -8.006, 1}, 2e-6},
    {{1e14, 2, 1, -1}, {-2e14, 100000000000002, 199999999999999, -100000000000002, 1}, 0},
    {{-2e7, 1e7, 1, -1}, {2e14, -1e7, -200000000000001, 1e7, 1}, 0},
    {{1e7, -1e6, 1 + J, 1 - J}, {-2e13, 19999982e6, -9999981999998, -9000002, 1}, 0},
    {{1e8, 11, 1e3 + J, 1e3 - J},
     {1100001100000000, -102200111000011, 201101022001, -100002011, 1},
     0},
    {{1000, 1000, 1000, 1000}, {1e12, -4e9, 6e6, -4000, 1}, 0},
    {{1e4, 10001, 10010, 10100}, {1011111101e7, -4033322201e3, 603331110, -40111, 1}, 3e-7},
    {{1.001 + 4.998 * J, 1.001 - 4.998 * J, 1 + 5.001 * J, 1 - 5.001 * J},
     {675.791976032005, -104.036032002, 55.996006, -4.002, 1},
     4e-14},
};

static double distance_to_nearest(double complex z, const double re[4], const double im[4])
{
    double nearest = INFINITY;
    for (int k = 0; k < 4; k++)
        nearest = fmin(nearest, cabs(z - (re[k] + im[k] * J)));
    return nearest;
}

START_TEST(hard_quartics_are_solved_to_the_floor)
{
    const struct known_quartic *q = &hard[_i];
    double re[4], im[4];
    mill_poly_quartic_roots(q->c, re, im);
    for (int k = 0; k < 4; k++)
        ck_assert_double_le(distance_to_nearest(q->root[k], re, im) / cabs(q->root[k]),
                            10.0 * q->floor + 1e-14);
    for (int k = 0; k < 4; k++) { /* and nothing else is returned */
        double nearest = INFINITY;
        for (int j = 0; j < 4; j++)
            nearest = fmin(nearest, cabs(q->root[j] - (re[k] + im[k] * J)));
        ck_assert_double_le(nearest / hypot(re[k], im[k]), 10.0 * q->floor + 1e-14);
    }
}
END_TEST

START_TEST(conjugate_pairs_are_adjacent)
{
    for (size_t i = 0; i < sizeof hard / sizeof hard[0]; i++) {
        double re[4], im[4];
        mill_poly_quartic_roots(hard[i].c, re, im);
        for (int k = 0; k < 4; k += 2)
            ck_assert(im[k] == -im[k + 1] && (im[k] == 0.0 || re[k] == re[k + 1]));
    }
}
END_TEST

START_TEST(quartic_scales_to_the_ends_of_the_exponent_range)
{
    for (int e = -240; e <= 240; e += 10)
        for (int f = -60; f <= 60; f += 30) { /* 2^f (x - 1)(x - 2)(x - 3)(x + 4), x in 2^e */
            const double c[5] = {-24, 38, -13, -2, 1}, root[4] = {1, 2, 3, -4};
            double scaled[5], re[4], im[4], unit = ldexp(1.0, e);
            for (int k = 0; k < 5; k++)
                scaled[k] = ldexp(c[k], f - e * k);
            mill_poly_quartic_roots(scaled, re, im);
            for (int k = 0; k < 4; k++)
                ck_assert_double_le(distance_to_nearest(root[k] * unit, re, im), 1e-15 * unit);
        }
}
END_TEST

START_TEST(quartic_with_zero_roots_has_them_exactly)
{
    double re[4], im[4];
    for (int zeros = 1; zeros <= 4; zeros++) { /* x^zeros times a product of (x - 1), (x - 2) ... */
        const double c[5][5] = {
            {0}, {0, -6, 11, -6, 1}, {0, 0, 2, -3, 1}, {0, 0, 0, -1, 1}, {0, 0, 0, 0, 1}};
        int exact = 0;
        mill_poly_quartic_roots(c[zeros], re, im);
        for (int k = 0; k < 4; k++)
            exact += re[k] == 0.0 && im[k] == 0.0;
        ck_assert_int_eq(exact, zeros);
        for (int k = 1; k <= 4 - zeros; k++)
            ck_assert_double_le(distance_to_nearest(k, re, im), 1e-15 * k);
    }
}
END_TEST

/* Roots of magnitude 1e-6..1e6, real, conjugate, and multiple; c = their product, rounded */
static void random_quartic(gsl_rng *rng, double complex root[4], double c[5])
{
    int kind = (int)gsl_rng_uniform_int(rng, 7);
    for (int k = 0; k < 4; k++)
        root[k] = log_uniform(rng, 1e-6, 1e6) * (gsl_rng_uniform(rng) < 0.5 ? -1.0 : 1.0);
    if (kind == 1 || kind == 2)
        root[1] = conj(root[0] += J * log_uniform(rng, 1e-6, 1e6));
    if (kind == 2)
        root[3] = conj(root[2] += J * log_uniform(rng, 1e-6, 1e6));
    if (kind >= 3) /* 3: one double, 4: two double, 5: triple, 6: quadruple */
        root[1] = root[0];
    if (kind == 4)
        root[3] = root[2];
    if (kind >= 5)
        root[2] = root[0];
    if (kind == 6)
        root[3] = root[0];
    long double complex p[5] = {1.0L};
    for (int n = 0; n < 4; n++)
        for (int k = n + 1; k >= 0; k--)
            p[k] = (k ? p[k - 1] : 0.0L) - root[n] * (k <= n ? p[k] : 0.0L);
    for (int k = 0; k < 5; k++)
        c[k] = (double)creall(p[k]);
}

/* How far rounding the coefficients can move root[which] (Rouche, with its nearest neighbours taken
 * as one cluster in turn) */
static double rounding_radius(const double complex root[4], int which)
{
    double complex z = root[which];
    double apart[4], size = 1.0, best = INFINITY;
    for (int k = 0; k < 4; k++) {
        apart[k] = cabs(root[k] - z);
        size *= cabs(z) + cabs(root[k]);
    }
    for (int i = 1; i < 4; i++)
        for (int j = i; j > 0 && apart[j] < apart[j - 1]; j--) {
            double swap = apart[j];
            apart[j] = apart[j - 1];
            apart[j - 1] = swap;
        }
    for (int cluster = 1; cluster <= 4; cluster++) {
        double far = 1.0;
        for (int k = cluster; k < 4; k++)
            far *= 0.5 * apart[k];
        double radius = 2.0 * pow(2.0 * DBL_EPSILON * size / far, 1.0 / cluster);
        radius = fmax(radius, 2.0 * apart[cluster - 1]);
        if (cluster == 4 || radius <= 0.5 * apart[cluster])
            best = fmin(best, radius);
    }
    return best;
}

START_TEST(quartics_from_known_roots_are_solved_as_well_as_their_coefficients_allow)
{
    gsl_rng *rng = seeded(101);
    for (int i = 0; i < 100000; i++) {
        double complex root[4];
        double c[5], re[4], im[4];
        random_quartic(rng, root, c);
        mill_poly_quartic_roots(c, re, im);
        for (int k = 0; k < 4; k++)
            if (!(distance_to_nearest(root[k], re, im) <= rounding_radius(root, k)))
                ck_abort_msg("case %d: root %d missed: (%.17g, %.17g)", i, k, creal(root[k]),
                             cimag(root[k]));
    }
    gsl_rng_free(rng);
}
END_TEST

/* ---------------------------------------------------------------- Sturm counts */

/* Sixteenths up to 4, so that the coefficients are exact; repeats are common */
static void dyadic_quartic(gsl_rng *rng, double root[4], double c[5])
{
    double p[6] = {0.0, gsl_rng_uniform(rng) < 0.5 ? -1.0 : 1.0};
    for (int n = 0; n < 4; n++) {
        root[n] = ((double)gsl_rng_uniform_int(rng, 129) - 64.0) / 16.0;
        if (n > 0 && gsl_rng_uniform(rng) < 0.4)
            root[n] = root[gsl_rng_uniform_int(rng, (unsigned long)n)];
        for (int k = n + 2; k > 0; k--)
            p[k] = p[k - 1] - root[n] * p[k];
    }
    for (int k = 0; k < 5; k++)
        c[k] = p[k + 1];
}

static int distinct_in(const double *root, int n, double lo, double hi)
{
    int found = 0;
    for (int i = 0; i < n; i++) {
        bool again = false;
        for (int j = 0; j < i; j++)
            again = again || root[j] == root[i];
        found += root[i] > lo && root[i] <= hi && !again;
    }
    return found;
}

START_TEST(sturm_counts_distinct_roots_open_at_lo_and_closed_at_hi)
{
    gsl_rng *rng = seeded(102);
    for (int i = 0; i < 20000; i++) {
        double root[4], c[5], ends[6] = {-INFINITY, INFINITY};
        dyadic_quartic(rng, root, c);
        for (int k = 0; k < 4; k++) /* mostly on the roots themselves */
            ends[k + 2] = gsl_rng_uniform(rng) < 0.7 ? root[k] : uniform(rng, -5.0, 5.0);
        for (int a = 0; a < 6; a++)
            for (int b = 0; b < 6; b++)
                if (ends[a] < ends[b])
                    ck_assert_int_eq(mill_poly_sturm_count(c, 4, ends[a], ends[b]),
                                     distinct_in(root, 4, ends[a], ends[b]));
    }
    gsl_rng_free(rng);
}
END_TEST

START_TEST(sturm_counts_agree_with_known_roots_over_all_magnitudes)
{
    gsl_rng *rng = seeded(103);
    int asked = 0;
    for (int i = 0; i < 10000; i++) {
        double complex root[4];
        double c[5];
        random_quartic(rng, root, c);
        bool certain = true; /* simple roots that rounding can neither merge nor move over 0 */
        for (int k = 0; k < 4; k++)
            for (int j = 0; j < k; j++)
                certain = certain && rounding_radius(root, k) + rounding_radius(root, j) <
                                         0.5 * cabs(root[k] - root[j]);
        if (!certain)
            continue;
        double cut = log_uniform(rng, 1e-6, 1e6) * (gsl_rng_uniform(rng) < 0.5 ? -1.0 : 1.0);
        int below = 0, above = 0;
        for (int k = 0; k < 4; k++) {
            certain = certain && fabs(creal(root[k]) - cut) > rounding_radius(root, k);
            below += cimag(root[k]) == 0.0 && creal(root[k]) < cut;
            above += cimag(root[k]) == 0.0 && creal(root[k]) > cut;
        }
        if (!certain)
            continue;
        asked++;
        ck_assert_int_eq(mill_poly_sturm_count(c, 4, -INFINITY, cut), below);
        ck_assert_int_eq(mill_poly_sturm_count(c, 4, cut, INFINITY), above);
    }
    ck_assert_int_gt(asked, 3000);
    gsl_rng_free(rng);
}
END_TEST

START_TEST(sturm_tells_a_double_root_from_two_near_ones_and_from_none)
{
    /* (x - 1)^2 (x^2 + 1) with its constant one ulp lower and higher */
    double c[5] = {1, -2, 2, -2, 1};
    ck_assert_int_eq(mill_poly_sturm_count(c, 4, 0.0, INFINITY), 1);
    c[0] = nextafter(1.0, 0.0);
    ck_assert_int_eq(mill_poly_sturm_count(c, 4, 0.0, INFINITY), 2);
    c[0] = nextafter(1.0, 2.0);
    ck_assert_int_eq(mill_poly_sturm_count(c, 4, 0.0, INFINITY), 0);
}
END_TEST

START_TEST(sturm_ignores_leading_zeros_and_constants)
{
    const double line[5] = {-1.0, 2.0}, constant[3] = {5.0}, nothing[5] = {0.0};
    ck_assert_int_eq(mill_poly_sturm_count(line, 4, 0.0, 0.5), 1);
    ck_assert_int_eq(mill_poly_sturm_count(line, 4, 0.5, 1.0), 0);
    ck_assert_int_eq(mill_poly_sturm_count(constant, 2, -INFINITY, INFINITY), 0);
    ck_assert_int_eq(mill_poly_sturm_count(nothing, 4, -INFINITY, INFINITY), 0);
}
END_TEST

/* ---------------------------------------------------------------- first rise: flights */

START_TEST(ball_thrown_up_from_the_bottom_returns_after_2u_over_g)
{
    const double r[2] = {0.0, -DRUM_RHO}, g[2] = {0.0, -9.81};
    for (double u = 1e-6; u < 1.0; u *= 1.1) {
        double v[2] = {0.0, u}, c[5];
        contact_polynomial(r, v, g, DRUM_RHO, true, c);
        double t = mill_poly_first_rise(c, INFINITY, true, NULL);
        ck_assert_double_le(DIFFER(t, 2.0 * u / 9.81), 1e-15 * t);
    }
}
END_TEST

START_TEST(detaching_ball_lands_after_4_v_sin_theta_over_g)
{
    for (double theta = 0.02; theta < 1.55; theta += 0.01) {
        double speed = sqrt(9.81 * DRUM_RHO * cos(theta));
        const double r[2] = {DRUM_RHO * sin(theta), DRUM_RHO * cos(theta)}, g[2] = {0.0, -9.81};
        const double v[2] = {-speed * cos(theta), speed * sin(theta)};
        double c[5], lands = 4.0 * speed * sin(theta) / 9.81;
        contact_polynomial(r, v, g, DRUM_RHO, true, c);
        ck_assert_double_lt(c[3], 0.0);
        c[1] = c[2] = 0.0; /* exactly so at the point of detachment: t = 0 is a triple root */
        double t = mill_poly_first_rise(c, INFINITY, true, NULL);
        ck_assert_double_le(DIFFER(t, lands), 1e-14 * lands);
        c[1] = -1e-17; /* and within rounding of it */
        t = mill_poly_first_rise(c, INFINITY, true, NULL);
        ck_assert_double_le(DIFFER(t, lands), 1e-10 * lands);
    }
}
END_TEST

START_TEST(ball_at_the_top_with_v2_equal_g_rho_stays_in_contact)
{
    const double c[5] = {-1e-19, 0.0, 0.0, 0.0, 0.25 * 9.81 * 9.81};
    ck_assert_double_eq(mill_poly_first_rise(c, INFINITY, true, NULL), 0.0);
}
END_TEST

START_TEST(overlapping_and_closing_is_now)
{
    const double c[5] = {1e-9, 1e-3, -1.0, 0.0, 24.0};
    ck_assert_double_eq(mill_poly_first_rise(c, 0.0, false, NULL), 0.0);
    ck_assert_double_eq(mill_poly_first_rise(c, INFINITY, false, NULL), 0.0);
}
END_TEST

START_TEST(resting_contact_pressed_on_by_gravity_is_now)
{
    const double c[5] = {0.0, 0.0, 0.7, 0.0, 24.0};
    ck_assert_double_eq(mill_poly_first_rise(c, 1e-3, false, NULL), 0.0);
    ck_assert_double_eq(mill_poly_first_rise(c, 1e-3, true, NULL), 0.0);
}
END_TEST

START_TEST(overlapping_and_opening_waits_until_it_closes_again)
{
    const double c[5] = {1e-9, -1e-3, 1.0}; /* leaves, and is back at about 1 ms */
    double back = 0.5 * (1e-3 + sqrt(1e-6 - 4e-9));
    ck_assert_double_eq_tol(mill_poly_first_rise(c, 1.0, false, NULL), back, 1e-18);
    ck_assert_double_eq(mill_poly_first_rise(c, 5e-4, false, NULL), (double)INFINITY);
}
END_TEST

START_TEST(overlap_that_never_opens_fully_closes_at_its_minimum)
{
    const double c[5] = {1e-6, -1e-3, 1.0};
    ck_assert_double_eq(mill_poly_first_rise(c, 1.0, false, NULL), 5e-4);
    const double touch[5] = {0.25, -1.0, 1.0}; /* reaches zero and no farther */
    ck_assert_double_eq(mill_poly_first_rise(touch, 1.0, false, NULL), 0.5);
}
END_TEST

START_TEST(grazing_from_outside_is_no_contact)
{
    const double c[5] = {-1.0, 2.0, -1.0}; /* touches zero at t = 1 from below */
    struct mill_poly_counts counts = {0, 0};
    ck_assert_double_eq(mill_poly_first_rise(c, 5.0, false, &counts), (double)INFINITY);
    const double just[5] = {-1.0 + 0x1p-53, 2.0, -1.0}; /* closest double above: contact */
    double t = mill_poly_first_rise(just, 5.0, false, &counts);
    ck_assert_double_le(DIFFER(t, 1.0 - sqrt(0x1p-53)), 1e-15);
    ck_assert_uint_eq(counts.solves, 2);
    ck_assert_uint_eq(counts.fallbacks, 2);
}
END_TEST

START_TEST(contact_at_the_very_end_of_the_window_counts)
{
    const double c[5] = {-4.0, 0.0, 1.0};
    ck_assert_double_eq(mill_poly_first_rise(c, 2.0, false, NULL), 2.0);
    ck_assert_double_eq(mill_poly_first_rise(c, nextafter(2.0, 0.0), false, NULL),
                        (double)INFINITY);
}
END_TEST

START_TEST(touching_ball_that_leaves_is_not_caught_again_by_rounding)
{
    const double c[5] = {3e-18, -2.0 * DRUM_RHO, 1.0}; /* c0 is noise, the ball leaves at 1 m/s */
    double t = mill_poly_first_rise(c, 1.0, true, NULL);
    ck_assert_double_eq_tol(t, 2.0 * DRUM_RHO, 1e-16);
}
END_TEST

START_TEST(most_calls_cost_no_solve)
{
    const double c[5] = {-1e-3, 1e-2, 1.0, 1.0, 24.0};
    struct mill_poly_counts counts = {0, 0};
    ck_assert_double_eq(mill_poly_first_rise(c, 1e-3, false, &counts), (double)INFINITY);
    ck_assert_uint_eq(counts.solves, 0);
}
END_TEST

/* ---------------------------------------------------------------- first rise: against oracles */

/* Residual in units of the rounding of the terms, for a time that is not a minimum */
static double residual_ulps(const struct rise_case *q, double t)
{
    long double c[5];
    for (int k = 0; k < 5; k++)
        c[k] = q->at_root && k == 0 ? 0.0L : q->c[k];
    long double unit = oracle_noise(c, 4, t) / (16.0L * LDBL_EPSILON) * DBL_EPSILON;
    return (double)(fabsl(oracle_value(c, 4, t)) / unit);
}

static const char *disagreement(const struct rise_case *q, double t, const struct oracle_answer *o)
{
    if (isfinite(t) != isfinite(o->t))
        return isfinite(t) ? "invented" : "missed";
    if (!isfinite(t))
        return t > 0.0 ? NULL : "not a time";
    if (!(t >= 0.0 && t <= q->t_end))
        return "outside the window";
    if (o->t == 0.0 || t == 0.0)
        return t == o->t ? NULL : "not the one at 0";
    if (o->t == (double)o->from) /* a minimum: flat, so known to half the digits at worst */
        return DIFFER(t, o->t) <= 1e-7 * t ? NULL : "not the minimum";
    if (t < (1.0 - 1e-13) * (double)o->from || t > (1.0 + 1e-13) * (double)o->to)
        return "not the first";
    return residual_ulps(q, t) <= 2.0 ? NULL : "inaccurate";
}

START_TEST(first_rise_is_the_one_that_a_bracketing_oracle_finds)
{
    gsl_rng *rng = seeded((unsigned long)(104 + _i));
    struct mill_poly_counts counts = {0, 0};
    int close_calls = 0, found = 0;
    for (int i = 0; i < 250000; i++) {
        struct rise_case q = mill_case(rng);
        struct oracle_answer o = oracle_first_rise(&q);
        double t = mill_poly_first_rise(q.c, q.t_end, q.at_root, &counts);
        close_calls += o.close_call;
        found += isfinite(t);
        const char *wrong = o.close_call ? NULL : disagreement(&q, t, &o);
        if (wrong)
            ck_abort_msg(
                "%s: case %d, t %.17g, oracle %.17g, t_end %g, at_root %d, c %a %a %a %a %a", wrong,
                i, t, o.t, q.t_end, q.at_root, q.c[0], q.c[1], q.c[2], q.c[3], q.c[4]);
    }
    ck_assert_int_lt(close_calls, 50);
    ck_assert_int_gt(found, 50000);
    ck_assert_uint_gt(counts.fallbacks, 100);
    ck_assert_uint_lt(counts.fallbacks, counts.solves / 20);
    gsl_rng_free(rng);
}
END_TEST

START_TEST(fast_path_and_sturm_sequence_agree)
{
    gsl_rng *rng = seeded(110);
    for (int i = 0; i < 50000; i++) {
        struct rise_case q = mill_case(rng);
        bool falling = q.c[1] < 0.0;
        if (q.c[0] == 0.0 || (q.c[0] > 0.0 && !falling))
            continue;
        double fast = mill_poly_first_rise(q.c, q.t_end, false, NULL);
        double sure = mill_poly_sturm_rise(q.c, q.t_end);
        ck_assert_int_eq(isfinite(fast), isfinite(sure));
        q.at_root = false;
        if (isfinite(sure) && DIFFER(fast, sure) > 1e-7 * sure)
            ck_assert_double_le(residual_ulps(&q, fast), 2.0);
    }
    gsl_rng_free(rng);
}
END_TEST

/* From the roots alone: where the sign goes from - to +, in exact arithmetic */
static double rise_of_known_roots(const double root[4], double lead, double t_end)
{
    double first = INFINITY;
    for (int i = 0; i < 4; i++) {
        double sign = lead;
        int times = 0;
        for (int j = 0; j < 4; j++) {
            times += root[j] == root[i];
            sign *= root[j] > root[i] ? -1.0 : 1.0;
        }
        if (root[i] >= 0.0 && root[i] <= t_end && sign > 0.0 && (times % 2 || root[i] == 0.0))
            first = fmin(first, root[i]);
    }
    return first;
}

START_TEST(first_rise_finds_known_roots_of_any_multiplicity)
{
    gsl_rng *rng = seeded(111);
    for (int i = 0; i < 100000; i++) {
        double root[4], c[5];
        dyadic_quartic(rng, root, c);
        if (c[0] > 0.0)
            continue;
        double t_end = gsl_rng_uniform(rng) < 0.5 ? (double)INFINITY : fabs(root[0]);
        double right = rise_of_known_roots(root, c[4], t_end);
        double t = mill_poly_first_rise(c, t_end, false, NULL);
        ck_assert_int_eq(isfinite(t), isfinite(right));
        struct rise_case q = {{c[0], c[1], c[2], c[3], c[4]}, t_end, false};
        if (isfinite(t) && t != right)
            ck_assert(DIFFER(t, right) < 1e-2 && residual_ulps(&q, t) <= 2.0);
    }
    gsl_rng_free(rng);
}
END_TEST

/* ---------------------------------------------------------------- extreme input */

START_TEST(first_rise_of_any_finite_input_is_a_time)
{
    const double some[9] = {0.0, 1.0, -1.0, 1e-300, -1e-300, 1e300, -1e300, 5e-324, -DBL_MAX};
    const double ends[4] = {0.0, 1e-6, 1e200, INFINITY};
    gsl_rng *rng = seeded(112);
    for (int i = 0; i < 100000; i++) {
        double c[5], t_end = ends[gsl_rng_uniform_int(rng, 4)];
        for (int k = 0; k < 5; k++)
            c[k] = some[gsl_rng_uniform_int(rng, 9)] * uniform(rng, 0.5, 1.0);
        double t = mill_poly_first_rise(c, t_end, gsl_rng_uniform(rng) < 0.3, NULL);
        ck_assert(t >= 0.0 && (t <= t_end || isinf(t)));
    }
    gsl_rng_free(rng);
}
END_TEST

START_TEST(nothing_never_rises)
{
    const double nothing[5] = {0.0}, inside[5] = {1.0}, outside[5] = {-1.0};
    for (int at_root = 0; at_root < 2; at_root++) {
        ck_assert_double_eq(mill_poly_first_rise(nothing, INFINITY, at_root, NULL),
                            (double)INFINITY);
        ck_assert_double_eq(mill_poly_first_rise(inside, INFINITY, at_root, NULL),
                            (double)INFINITY);
        ck_assert_double_eq(mill_poly_first_rise(outside, INFINITY, at_root, NULL),
                            (double)INFINITY);
    }
}
END_TEST

START_TEST(first_rise_does_not_depend_on_the_units)
{
    gsl_rng *rng = seeded(113);
    for (int i = 0; i < 5000; i++) {
        struct rise_case q = mill_case(rng);
        double t = mill_poly_first_rise(q.c, q.t_end, q.at_root, NULL);
        for (int e = -180; e <= 180; e += 120) { /* seconds in 2^e, areas in 2^2e: exact */
            double c[5];
            for (int k = 0; k < 5; k++)
                c[k] = ldexp(q.c[k], 2 * e - k * e);
            double scaled = mill_poly_first_rise(c, ldexp(q.t_end, e), q.at_root, NULL);
            ck_assert_int_eq(isfinite(scaled), isfinite(t));
            if (isfinite(t))
                ck_assert_double_le(DIFFER(ldexp(scaled, -e), t), 1e-6 * t);
        }
    }
    gsl_rng_free(rng);
}
END_TEST

START_TEST(quartic_roots_of_any_finite_input_are_numbers)
{
    const double some[7] = {0.0, 1.0, -1.0, 1e-300, -1e-300, 1e300, -1e300};
    for (int i = 0; i < 7 * 7 * 7 * 7 * 6; i++) {
        double c[5], re[4], im[4];
        for (int k = 0, j = i; k < 5; k++, j /= 7)
            c[k] = some[k < 4 ? j % 7 : j + 1];
        mill_poly_quartic_roots(c, re, im);
        for (int k = 0; k < 4; k++)
            ck_assert(!isnan(re[k]) && !isnan(im[k]));
    }
}
END_TEST

static TCase *group(Suite *suite, const char *name)
{
    TCase *tc = tcase_create(name);
    tcase_set_timeout(tc, 60.0);
    suite_add_tcase(suite, tc);
    return tc;
}

static Suite *poly_suite(void)
{
    Suite *s = suite_create("poly");
    TCase *tc = group(s, "quadratic");
    tcase_add_test(tc, small_root_of_a_quadratic_keeps_its_digits);
    tcase_add_test(tc, nearly_double_roots_are_right_to_the_last_bits);
    tcase_add_test(tc, double_root_counts_once);
    tcase_add_test(tc, quadratic_without_square_term_is_linear);
    tcase_add_test(tc, quadratic_survives_the_ends_of_the_exponent_range);
    tc = group(s, "quartic");
    tcase_add_loop_test(tc, hard_quartics_are_solved_to_the_floor, 0,
                        (int)(sizeof hard / sizeof hard[0]));
    tcase_add_test(tc, conjugate_pairs_are_adjacent);
    tcase_add_test(tc, quartic_scales_to_the_ends_of_the_exponent_range);
    tcase_add_test(tc, quartic_with_zero_roots_has_them_exactly);
    tcase_add_test(tc, quartics_from_known_roots_are_solved_as_well_as_their_coefficients_allow);
    tcase_add_test(tc, quartic_roots_of_any_finite_input_are_numbers);
    tc = group(s, "sturm");
    tcase_add_test(tc, sturm_counts_distinct_roots_open_at_lo_and_closed_at_hi);
    tcase_add_test(tc, sturm_counts_agree_with_known_roots_over_all_magnitudes);
    tcase_add_test(tc, sturm_tells_a_double_root_from_two_near_ones_and_from_none);
    tcase_add_test(tc, sturm_ignores_leading_zeros_and_constants);
    tc = group(s, "first rise of a flight");
    tcase_add_test(tc, ball_thrown_up_from_the_bottom_returns_after_2u_over_g);
    tcase_add_test(tc, detaching_ball_lands_after_4_v_sin_theta_over_g);
    tcase_add_test(tc, ball_at_the_top_with_v2_equal_g_rho_stays_in_contact);
    tcase_add_test(tc, overlapping_and_closing_is_now);
    tcase_add_test(tc, resting_contact_pressed_on_by_gravity_is_now);
    tcase_add_test(tc, overlapping_and_opening_waits_until_it_closes_again);
    tcase_add_test(tc, overlap_that_never_opens_fully_closes_at_its_minimum);
    tcase_add_test(tc, grazing_from_outside_is_no_contact);
    tcase_add_test(tc, contact_at_the_very_end_of_the_window_counts);
    tcase_add_test(tc, touching_ball_that_leaves_is_not_caught_again_by_rounding);
    tcase_add_test(tc, most_calls_cost_no_solve);
    tc = group(s, "first rise against oracles");
    tcase_add_loop_test(tc, first_rise_is_the_one_that_a_bracketing_oracle_finds, 0, 4);
    tcase_add_test(tc, fast_path_and_sturm_sequence_agree);
    tcase_add_test(tc, first_rise_finds_known_roots_of_any_multiplicity);
    tc = group(s, "first rise of extreme input");
    tcase_add_test(tc, first_rise_of_any_finite_input_is_a_time);
    tcase_add_test(tc, nothing_never_rises);
    tcase_add_test(tc, first_rise_does_not_depend_on_the_units);
    return s;
}

int main(void)
{
    SRunner *runner = srunner_create(poly_suite());
    srunner_run_all(runner, CK_NORMAL);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
