/* When a contact polynomial first closes: flights with known answers, oracles, extreme input. */
#include "millsim/poly.h"
#include "poly_cases.h"
#include "proof/paranoid.h"
#include "unit.h"

#define DIFFER(a, b) (fabs((a) - (b)))

/* ---------------------------------------------------------------- first rise: flights */

TEST(ball_thrown_up_from_the_bottom_returns_after_2u_over_g)
{
    const double r[2] = {0.0, -DRUM_RHO}, g[2] = {0.0, -9.81};
    for (double u = 1e-6; u < 1.0; u *= 1.1) {
        double v[2] = {0.0, u}, c[5];
        contact_polynomial(r, v, g, DRUM_RHO, true, c);
        double t = mill_poly_first_rise(c, INFINITY, true, NULL);
        ck_assert_double_le(DIFFER(t, 2.0 * u / 9.81), 1e-15 * t);
    }
}

TEST(detaching_ball_lands_after_4_v_sin_theta_over_g)
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

TEST(ball_at_the_top_with_v2_equal_g_rho_stays_in_contact)
{
    const double c[5] = {-1e-19, 0.0, 0.0, 0.0, 0.25 * 9.81 * 9.81};
    ck_assert_double_eq(mill_poly_first_rise(c, INFINITY, true, NULL), 0.0);
}

TEST(overlapping_and_closing_is_now)
{
    const double c[5] = {1e-9, 1e-3, -1.0, 0.0, 24.0};
    ck_assert_double_eq(mill_poly_first_rise(c, 0.0, false, NULL), 0.0);
    ck_assert_double_eq(mill_poly_first_rise(c, INFINITY, false, NULL), 0.0);
}

TEST(resting_contact_pressed_on_by_gravity_is_now)
{
    const double c[5] = {0.0, 0.0, 0.7, 0.0, 24.0};
    ck_assert_double_eq(mill_poly_first_rise(c, 1e-3, false, NULL), 0.0);
    ck_assert_double_eq(mill_poly_first_rise(c, 1e-3, true, NULL), 0.0);
}

TEST(overlapping_and_opening_waits_until_it_closes_again)
{
    const double c[5] = {1e-9, -1e-3, 1.0}; /* leaves, and is back at about 1 ms */
    double back = 0.5 * (1e-3 + sqrt(1e-6 - 4e-9));
    ck_assert_double_eq_tol(mill_poly_first_rise(c, 1.0, false, NULL), back, 1e-18);
    ck_assert_double_eq(mill_poly_first_rise(c, 5e-4, false, NULL), (double)INFINITY);
}

TEST(overlap_that_never_opens_fully_closes_at_its_minimum)
{
    const double c[5] = {1e-6, -1e-3, 1.0};
    ck_assert_double_eq(mill_poly_first_rise(c, 1.0, false, NULL), 5e-4);
    const double touch[5] = {0.25, -1.0, 1.0}; /* reaches zero and no farther */
    ck_assert_double_eq(mill_poly_first_rise(touch, 1.0, false, NULL), 0.5);
}

TEST(grazing_from_outside_is_no_contact)
{
    const double c[5] = {-1.0, 2.0, -1.0}; /* touches zero at t = 1 from below */
    struct mill_poly_counts counts = {0};
    ck_assert_double_eq(mill_poly_first_rise(c, 5.0, false, &counts), (double)INFINITY);
    const double just[5] = {-1.0 + 0x1p-53, 2.0, -1.0}; /* closest double above: contact */
    double t = mill_poly_first_rise(just, 5.0, false, &counts);
    ck_assert_double_le(DIFFER(t, 1.0 - sqrt(0x1p-53)), 1e-15);
    ck_assert_uint_eq(counts.solves, 2);
    ck_assert_uint_eq(counts.fallbacks, 2);
}

TEST(contact_at_the_very_end_of_the_window_counts)
{
    const double c[5] = {-4.0, 0.0, 1.0};
    ck_assert_double_eq(mill_poly_first_rise(c, 2.0, false, NULL), 2.0);
    ck_assert_double_eq(mill_poly_first_rise(c, nextafter(2.0, 0.0), false, NULL),
                        (double)INFINITY);
}

TEST(touching_ball_that_leaves_is_not_caught_again_by_rounding)
{
    const double c[5] = {3e-18, -2.0 * DRUM_RHO, 1.0}; /* c0 is noise, the ball leaves at 1 m/s */
    double t = mill_poly_first_rise(c, 1.0, true, NULL);
    ck_assert_double_eq_tol(t, 2.0 * DRUM_RHO, 1e-16);
}

TEST(most_calls_cost_no_solve)
{
    const double c[5] = {-1e-3, 1e-2, 1.0, 1.0, 24.0};
    struct mill_poly_counts counts = {0};
    ck_assert_double_eq(mill_poly_first_rise(c, 1e-3, false, &counts), (double)INFINITY);
    ck_assert_uint_eq(counts.solves, 0);
}

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

SLOW_TEST(first_rise_is_the_one_that_a_bracketing_oracle_finds, 4)
{
    gsl_rng *rng = seeded((unsigned long)(104 + _i));
    struct mill_poly_counts counts = {0}, endless = {0};
    int close_calls = 0, found = 0;
    for (int i = 0; i < unit_draws(250000); i++) {
        struct rise_case q = mill_case(rng);
        struct oracle_answer o = oracle_first_rise(&q);
        double t =
            mill_poly_first_rise(q.c, q.t_end, q.at_root, isinf(q.t_end) ? &endless : &counts);
        close_calls += o.close_call;
        found += isfinite(t);
        const char *wrong = o.close_call ? NULL : disagreement(&q, t, &o);
        if (wrong)
            ck_abort_msg(
                "%s: case %d, t %.17g, oracle %.17g, t_end %g, at_root %d, c %a %a %a %a %a", wrong,
                i, t, o.t, q.t_end, q.at_root, q.c[0], q.c[1], q.c[2], q.c[3], q.c[4]);
    }
    ck_assert_int_lt(close_calls, unit_draws(50));
    ck_assert_int_gt(found, unit_draws(50000));
    ck_assert_uint_gt(counts.fallbacks, unit_draws(100));
    ck_assert_uint_lt(counts.fallbacks, counts.solves / 20);
    ck_assert_uint_eq(endless.fallbacks, endless.solves); /* what no run asks */
    gsl_rng_free(rng);
}

TEST(the_closed_form_agrees_with_first_rises_and_refutes_wrong_ones)
{
    gsl_rng *rng = seeded(115);
    struct mill_paranoid_quartics check = {{mill_paranoid_look}, NULL, 0, 0, 0};
    struct mill_poly_counts counts = {.check = &check.check};
    int missed = 0, invented = 0, contacts = 0;
    for (int i = 0; i < unit_draws(50000); i++) {
        const struct rise_case q = mill_case(rng);
        const double t = mill_poly_first_rise(q.c, q.t_end, q.at_root, &counts);
        if (!(isfinite(t) && t > 0.0 && q.c[4] != 0.0 && !q.at_root && q.c[0] < 0.0))
            continue;
        contacts++;
        /* a window that ends well behind the contact, in which it is said not to be */
        missed += !mill_quartic_agrees(q.c, 1.1 * t, false, INFINITY);
        invented += !mill_quartic_agrees(q.c, q.t_end, false, 0.5 * t);
    }
    ck_assert_uint_eq(check.refuted, 0);
    ck_assert_int_gt(contacts, unit_draws(5000));
    ck_assert_int_gt(missed, contacts * 9 / 10);
    ck_assert_int_gt(invented, contacts * 9 / 10);
    gsl_rng_free(rng);
}

TEST(fast_path_and_sturm_sequence_agree)
{
    gsl_rng *rng = seeded(110);
    for (int i = 0; i < unit_draws(50000); i++) {
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

TEST(a_rise_at_the_end_of_the_window_counts_to_the_last_bit)
{
    gsl_rng *rng = seeded(114);
    int within = 0, beyond = 0;
    for (int i = 0; i < 2000; i++) {
        struct rise_case q = mill_case(rng);
        double t = mill_poly_first_rise(q.c, q.t_end, false, NULL);
        if (q.c[0] >= 0.0 || isinf(t))
            continue;
        for (int ulps = -3; ulps <= 3; ulps++) {
            double end = t + ulps * 0.5 * DBL_EPSILON * t;
            double fast = mill_poly_first_rise(q.c, end, false, NULL);
            ck_assert_int_eq(isfinite(fast), isfinite(mill_poly_sturm_rise(q.c, end)));
            ck_assert(isinf(fast) || fast <= end);
            within += isfinite(fast);
            beyond += isinf(fast);
        }
    }
    ck_assert_int_gt(within, 1000);
    ck_assert_int_gt(beyond, 1000);
    gsl_rng_free(rng);
}

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

SLOW_TEST(first_rise_finds_known_roots_of_any_multiplicity, 1)
{
    gsl_rng *rng = seeded(111);
    for (int i = 0; i < unit_draws(100000); i++) {
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

/* ---------------------------------------------------------------- extreme input */

SLOW_TEST(first_rise_of_any_finite_input_is_a_time, 1)
{
    const double some[9] = {0.0, 1.0, -1.0, 1e-300, -1e-300, 1e300, -1e300, 5e-324, -DBL_MAX};
    const double ends[4] = {0.0, 1e-6, 1e200, INFINITY};
    gsl_rng *rng = seeded(112);
    for (int i = 0; i < unit_draws(100000); i++) {
        double c[5], t_end = ends[gsl_rng_uniform_int(rng, 4)];
        for (int k = 0; k < 5; k++)
            c[k] = some[gsl_rng_uniform_int(rng, 9)] * uniform(rng, 0.5, 1.0);
        double t = mill_poly_first_rise(c, t_end, gsl_rng_uniform(rng) < 0.3, NULL);
        ck_assert(t >= 0.0 && (t <= t_end || isinf(t)));
    }
    gsl_rng_free(rng);
}

TEST(nothing_never_rises)
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

TEST(root_is_found_beside_terms_that_overflow_at_the_end_of_the_window)
{
    const double c[5] = {-1e300, 1e300, 0.0, 0.0, -1e-300}; /* t = 1, and back out at 1e200 */
    ck_assert_double_eq(mill_poly_first_rise(c, 1e150, false, NULL), 1.0);
    ck_assert_double_eq(mill_poly_first_rise(c, INFINITY, false, NULL), 1.0);
}

TEST(rise_from_the_smallest_of_doubles_is_found_to_the_last_bit)
{
    const double tiny = 0x1p-1074;
    const double steep[5] = {-tiny, 0x1.bp-8, 0x1.bp-4, 0x1.2p-1, 1.0};
    const double flat[5] = {-tiny, 0.0, 0.0, 0.0, 1.0};
    ck_assert_double_le(DIFFER(mill_poly_first_rise(steep, INFINITY, false, NULL), tiny / 0x1.bp-8),
                        tiny);
    ck_assert_double_le(
        DIFFER(mill_poly_first_rise(flat, INFINITY, false, NULL), 0x1p-269 * sqrt(2.0)),
        1e-15 * 0x1p-269);
}

TEST(first_rise_does_not_depend_on_the_units)
{
    gsl_rng *rng = seeded(113);
    for (int i = 0; i < unit_draws(5000); i++) {
        struct rise_case q = mill_case(rng);
        double t = mill_poly_first_rise(q.c, q.t_end, q.at_root, NULL);
        for (int j = 0; j < 6; j++) { /* time in units of 2^-e, p in units of 2^-f: exact */
            const int e[6] = {-180, -60, 60, 180, 0, 0}, f[6] = {-360, -120, 120, 360, -900, 900};
            double c[5];
            for (int k = 0; k < 5; k++)
                c[k] = ldexp(q.c[k], f[j] - k * e[j]);
            double scaled = mill_poly_first_rise(c, ldexp(q.t_end, e[j]), q.at_root, NULL);
            ck_assert_int_eq(isfinite(scaled), isfinite(t));
            if (isfinite(t))
                ck_assert_double_le(DIFFER(ldexp(scaled, -e[j]), t), 1e-6 * t);
        }
    }
    gsl_rng_free(rng);
}

int main(void)
{
    return unit_run("poly_rise");
}
