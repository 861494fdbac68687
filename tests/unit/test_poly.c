/* Quadratics, quartics and Sturm counts. */
#include <complex.h>

#include "millsim/poly.h"
#include "poly_cases.h"
#include "proof/paranoid.h"
#include "unit.h"

#define J ((double complex)_Complex_I)

/* ---------------------------------------------------------------- quadratics */

TEST(small_root_of_a_quadratic_keeps_its_digits)
{
    double x[2];
    ck_assert_int_eq(mill_poly_quadratic(1.0, -5e8, 1.0, x), 2);
    ck_assert_double_eq_tol(x[0], 1e-9, 1e-24);
    ck_assert_double_eq_tol(x[1], 1e9, 1e-6);
}

TEST(nearly_double_roots_are_right_to_the_last_bits)
{
    /* Kahan's example: b^2 - ac is all rounding unless the products are exact */
    double x[2];
    int n = mill_poly_quadratic(94906265.625, -94906267.0, 94906268.375, x);
    ck_assert_int_eq(n, 2);
    ck_assert_double_eq_tol(x[0], 1.0, 1e-15);
    ck_assert_double_eq_tol(x[1], 1.000000028975958, 1e-15);
}

TEST(double_root_counts_once)
{
    double x[2];
    ck_assert_int_eq(mill_poly_quadratic(1.0, -3.0, 9.0, x), 1);
    ck_assert_double_eq(x[0], 3.0);
    ck_assert_int_eq(mill_poly_quadratic(2.0, 0.0, 0.0, x), 1);
    ck_assert_double_eq(x[0], 0.0);
}

TEST(quadratic_without_square_term_is_linear)
{
    double x[2];
    ck_assert_int_eq(mill_poly_quadratic(0.0, 2.0, -8.0, x), 1);
    ck_assert_double_eq(x[0], 2.0);
    ck_assert_int_eq(mill_poly_quadratic(0.0, 0.0, 1.0, x), 0);
}

TEST(quadratic_survives_the_ends_of_the_exponent_range)
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

LOOP_TEST(hard_quartics_are_solved_to_the_floor, COUNT(hard))
{
    const struct known_quartic *q = &hard[_i];
    double re[4], im[4];
    mill_quartic_roots(q->c, re, im);
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

TEST(conjugate_pairs_are_adjacent)
{
    for (size_t i = 0; i < sizeof hard / sizeof hard[0]; i++) {
        double re[4], im[4];
        mill_quartic_roots(hard[i].c, re, im);
        for (int k = 0; k < 4; k += 2)
            ck_assert(im[k] == -im[k + 1] && (im[k] == 0.0 || re[k] == re[k + 1]));
    }
}

TEST(quartic_scales_to_the_ends_of_the_exponent_range)
{
    for (int e = -240; e <= 240; e += 10)
        for (int f = -60; f <= 60; f += 30) { /* 2^f (x - 1)(x - 2)(x - 3)(x + 4), x in 2^e */
            const double c[5] = {-24, 38, -13, -2, 1}, root[4] = {1, 2, 3, -4};
            double scaled[5], re[4], im[4], unit = ldexp(1.0, e);
            for (int k = 0; k < 5; k++)
                scaled[k] = ldexp(c[k], f - e * k);
            mill_quartic_roots(scaled, re, im);
            for (int k = 0; k < 4; k++)
                ck_assert_double_le(distance_to_nearest(root[k] * unit, re, im), 1e-15 * unit);
        }
}

TEST(quartic_with_zero_roots_has_them_exactly)
{
    double re[4], im[4];
    for (int zeros = 1; zeros <= 4; zeros++) { /* x^zeros times a product of (x - 1), (x - 2) ... */
        const double c[5][5] = {
            {0}, {0, -6, 11, -6, 1}, {0, 0, 2, -3, 1}, {0, 0, 0, -1, 1}, {0, 0, 0, 0, 1}};
        int exact = 0;
        mill_quartic_roots(c[zeros], re, im);
        for (int k = 0; k < 4; k++)
            exact += re[k] == 0.0 && im[k] == 0.0;
        ck_assert_int_eq(exact, zeros);
        for (int k = 1; k <= 4 - zeros; k++)
            ck_assert_double_le(distance_to_nearest(k, re, im), 1e-15 * k);
    }
}

/* The resolvent cubic then has a double root, known to half the digits only. */
TEST(two_zero_roots_between_large_ones_leave_these_all_their_digits)
{
    gsl_rng *rng = seeded(103);
    for (int i = 0; i < unit_draws(1000); i++) {
        const double c[5] = {0.0, 0.0, log_uniform(rng, 1e-20, 1e20), 0.0,
                             -log_uniform(rng, 1e-20, 1e20)};
        const double root = sqrt(-c[2] / c[4]);
        double re[4], im[4];
        int zeros = 0;
        mill_quartic_roots(c, re, im);
        for (int k = 0; k < 4; k++)
            zeros += re[k] == 0.0 && im[k] == 0.0;
        ck_assert_int_eq(zeros, 2);
        ck_assert_double_le(distance_to_nearest(root, re, im), 1e-15 * root);
        ck_assert_double_le(distance_to_nearest(-root, re, im), 1e-15 * root);
    }
    gsl_rng_free(rng);
}

static int exact_zeros(const double c[5])
{
    double re[4], im[4];
    int zeros = 0;
    mill_quartic_roots(c, re, im);
    for (int k = 0; k < 4; k++)
        zeros += re[k] == 0.0 && im[k] == 0.0;
    return zeros;
}

TEST(a_root_at_zero_is_exact_beside_a_cluster)
{
    const double found[5] = {0.0, 0x1.e378p+5, -0x1.d64p+5, 0x1.07p+4, -0x1.ffffffffffffep-1};
    ck_assert_int_eq(exact_zeros(found), 1);
    for (double r = 0.0625; r < 4.0; r += 0.0625) { /* x (x - r)^3 but for a bit */
        const double c[5] = {0.0, -r * r * r, 3.0 * r * r, -3.0 * r, 1.0 + 0x1p-52};
        ck_assert_int_eq(exact_zeros(c), 1);
    }
}

/* Roots of magnitude 1e-6..1e6, real, conjugate, and multiple; c = their product, rounded */
static void random_quartic(gsl_rng *rng, double complex root[4], double c[5])
{
    int kind = (int)gsl_rng_uniform_int(rng, 8);
    for (int k = 0; k < 4; k++)
        root[k] = log_uniform(rng, 1e-6, 1e6) * (gsl_rng_uniform(rng) < 0.5 ? -1.0 : 1.0);
    if (kind == 1 || kind == 2 || kind == 7)
        root[1] = conj(root[0] += J * log_uniform(rng, 1e-6, 1e6));
    if (kind == 2)
        root[3] = conj(root[2] += J * log_uniform(rng, 1e-6, 1e6));
    if (kind >= 3 && kind != 7) /* 3: one double, 4: two double, 5: triple, 6: quadruple */
        root[1] = root[0];
    if (kind == 4)
        root[3] = root[2];
    if (kind >= 5) /* 7: a double pair */
        root[2] = root[0];
    if (kind >= 6)
        root[3] = kind == 6 ? root[0] : root[1];
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

TEST(quartics_from_known_roots_are_solved_as_well_as_their_coefficients_allow)
{
    gsl_rng *rng = seeded(101);
    for (int i = 0; i < unit_draws(100000); i++) {
        double complex root[4];
        double c[5], re[4], im[4];
        random_quartic(rng, root, c);
        mill_quartic_roots(c, re, im);
        for (int k = 0; k < 4; k++)
            if (!(distance_to_nearest(root[k], re, im) <= rounding_radius(root, k)))
                ck_abort_msg("case %d: root %d missed: (%.17g, %.17g)", i, k, creal(root[k]),
                             cimag(root[k]));
    }
    gsl_rng_free(rng);
}

TEST(quartic_roots_of_any_finite_input_are_numbers)
{
    const double some[7] = {0.0, 1.0, -1.0, 1e-300, -1e-300, 1e300, -1e300};
    for (int i = 0; i < 7 * 7 * 7 * 7 * 6; i++) {
        double c[5], re[4], im[4];
        for (int k = 0, j = i; k < 5; k++, j /= 7)
            c[k] = some[k < 4 ? j % 7 : j + 1];
        mill_quartic_roots(c, re, im);
        for (int k = 0; k < 4; k++)
            ck_assert(!isnan(re[k]) && !isnan(im[k]));
    }
}

SLOW_TEST(quartic_roots_of_any_magnitude_are_numbers, 1)
{
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    for (int i = 0; i < unit_draws(200000); i++) {
        double c[5], re[4], im[4];
        for (int k = 0; k < 5; k++)
            c[k] =
                k < 4 && gsl_rng_uniform_int(rng, 4) == 0
                    ? 0.0
                    : ldexp(gsl_rng_uniform(rng) - 0.5, (int)gsl_rng_uniform_int(rng, 2000) - 1000);
        mill_quartic_roots(c, re, im);
        for (int k = 0; k < 4; k++)
            ck_assert_msg(!isnan(re[k]) && !isnan(im[k]), "%a %a %a %a %a", c[0], c[1], c[2], c[3],
                          c[4]);
    }
    gsl_rng_free(rng);
}

/* Small roots 2^-688 and 0 (too small for a number) beside -+2^329: squares that are no numbers
 * come up on the way. */
TEST(quartic_with_roots_three_hundred_decades_apart_keeps_them)
{
    const double c[5] = {-0x1.6868686868686p-919, 0x1.0000000000001p+0, -0x1.aea0652a233p+687, -0.0,
                         0x1.4414120e4edf5p+28};
    const double small = -c[1] / c[2], large = sqrt(-c[2] / c[4]);
    double re[4], im[4];
    mill_quartic_roots(c, re, im);
    double lowest = INFINITY, highest = -INFINITY, least = INFINITY;
    for (int k = 0; k < 4; k++) {
        ck_assert_double_eq(im[k], 0.0);
        lowest = fmin(lowest, re[k]);
        highest = fmax(highest, re[k]);
        least = fmin(least, fabs(re[k] - small));
    }
    ck_assert_double_le(fabs(lowest + large), 1e-15 * large);
    ck_assert_double_le(fabs(highest - large), 1e-15 * large);
    ck_assert_double_le(least, 1e-15 * small);
}

/* ---------------------------------------------------------------- Sturm counts */

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

SLOW_TEST(sturm_counts_distinct_roots_open_at_lo_and_closed_at_hi, 1)
{
    gsl_rng *rng = seeded(102);
    for (int i = 0; i < unit_draws(20000); i++) {
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

TEST(sturm_counts_agree_with_known_roots_over_all_magnitudes)
{
    gsl_rng *rng = seeded(103);
    int asked = 0;
    for (int i = 0; i < unit_draws(10000); i++) {
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
    ck_assert_int_gt(asked, unit_draws(3000));
    gsl_rng_free(rng);
}

TEST(sturm_counts_roots_over_a_hundred_decades)
{
    gsl_rng *rng = seeded(105);
    for (int i = 0; i < unit_draws(2000); i++) {
        double root[4], decade = uniform(rng, -70.0, -20.0), c[5];
        long double p[6] = {0.0L, 1.0L};
        for (int n = 0; n < 4; n++, decade += uniform(rng, 3.0, 30.0)) {
            root[n] = pow(10.0, decade) * (gsl_rng_uniform(rng) < 0.5 ? -1.0 : 1.0);
            for (int k = n + 2; k > 0; k--)
                p[k] = p[k - 1] - root[n] * p[k];
        }
        for (int k = 0; k < 5; k++)
            c[k] = (double)p[k + 1];
        for (int n = 0; n < 4; n++) {
            double cut = 10.0 * fabs(root[n]);
            ck_assert_int_eq(mill_poly_sturm_count(c, 4, -cut, cut), n + 1);
            ck_assert_int_eq(mill_poly_sturm_count(c, 4, 0.0, cut), distinct_in(root, 4, 0.0, cut));
        }
    }
    gsl_rng_free(rng);
}

TEST(sturm_tells_a_double_root_from_two_near_ones_and_from_none)
{
    /* (x - 1)^2 (x^2 + 1) with its constant one ulp lower and higher */
    double c[5] = {1, -2, 2, -2, 1};
    ck_assert_int_eq(mill_poly_sturm_count(c, 4, 0.0, INFINITY), 1);
    c[0] = nextafter(1.0, 0.0);
    ck_assert_int_eq(mill_poly_sturm_count(c, 4, 0.0, INFINITY), 2);
    c[0] = nextafter(1.0, 2.0);
    ck_assert_int_eq(mill_poly_sturm_count(c, 4, 0.0, INFINITY), 0);
}

TEST(sturm_ignores_leading_zeros_and_constants)
{
    const double line[5] = {-1.0, 2.0}, constant[3] = {5.0}, nothing[5] = {0.0};
    ck_assert_int_eq(mill_poly_sturm_count(line, 4, 0.0, 0.5), 1);
    ck_assert_int_eq(mill_poly_sturm_count(line, 4, 0.5, 1.0), 0);
    ck_assert_int_eq(mill_poly_sturm_count(constant, 2, -INFINITY, INFINITY), 0);
    ck_assert_int_eq(mill_poly_sturm_count(nothing, 4, -INFINITY, INFINITY), 0);
}

int main(void)
{
    return unit_run("poly");
}
