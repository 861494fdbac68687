/* The opinion of GSL on contact times: it shares every answer of the search, and none that is
 * wrong. */
#include "poly_cases.h"
#include "proof/paranoid.h"
#include "unit.h"

/* Is it a question for opinions? */
static bool begins_below(const struct rise_case *q)
{
    return (q->at_root || q->c[0] == 0.0 ? q->c[1] : q->c[0]) < 0.0 && q->c[4] != 0.0;
}

TEST(it_agrees_with_the_search_in_mills)
{
    gsl_rng *rng = seeded(130);
    struct mill_paranoid_quartics check = {{mill_paranoid_look}, mill_opinion_agrees, 0, 0, 0};
    struct mill_poly_counts counts = {.check = &check.check};
    for (int i = 0; i < unit_draws(250000); i++) {
        const struct rise_case q = mill_case(rng);
        mill_poly_first_rise(q.c, q.t_end, q.at_root, &counts);
    }
    ck_assert_uint_gt(check.asked, (unsigned long)unit_draws(125000));
    ck_assert_uint_eq(check.doubted, 0);
    gsl_rng_free(rng);
}

TEST(it_sees_contacts_that_are_missed_invented_early_or_late)
{
    gsl_rng *rng = seeded(131);
    int contacts = 0, missed = 0, invented = 0, early = 0, late = 0;
    for (int i = 0; i < unit_draws(50000); i++) {
        const struct rise_case q = mill_case(rng);
        const double t = mill_poly_first_rise(q.c, q.t_end, q.at_root, NULL);
        if (!begins_below(&q) || !isfinite(t))
            continue;
        contacts++;
        /* a window that ends well behind the contact, in which it is said not to be */
        missed += !mill_opinion_agrees(q.c, 1.1 * t, q.at_root, INFINITY);
        invented += !mill_opinion_agrees(q.c, q.t_end, q.at_root, 0.5 * t);
        early += !mill_opinion_agrees(q.c, q.t_end, q.at_root, t * (1.0 - 1e-6));
        late += !mill_opinion_agrees(q.c, 2.0 * t, q.at_root, t * (1.0 + 1e-6));
    }
    ck_assert_int_gt(contacts, unit_draws(10000));
    ck_assert_int_gt(missed, contacts * 19 / 20); /* the others are grazing */
    ck_assert_int_gt(invented, contacts * 19 / 20);
    ck_assert_int_gt(early, contacts * 9 / 10);
    ck_assert_int_gt(late, contacts * 9 / 10);
    gsl_rng_free(rng);
}

/* Sixteenths: exact coefficients, and roots that are double, threefold and fourfold */
TEST(it_agrees_where_roots_are_multiple)
{
    gsl_rng *rng = seeded(132);
    int asked = 0, found = 0;
    for (int i = 0; i < unit_draws(100000); i++) {
        struct rise_case q = {.t_end = 5.0};
        double root[4];
        dyadic_quartic(rng, root, q.c);
        if (!begins_below(&q))
            continue;
        const double t = mill_poly_first_rise(q.c, q.t_end, false, NULL);
        asked++;
        found += isfinite(t);
        ck_assert_msg(mill_opinion_agrees(q.c, q.t_end, false, t), "t %g of roots %g %g %g %g", t,
                      root[0], root[1], root[2], root[3]);
    }
    ck_assert_int_gt(found, asked / 4);
    gsl_rng_free(rng);
}

/* -(t - 1)(t - 2)(t^2 + 1), a gap that is closed from 1 to 2 */
TEST(it_knows_the_times_between_two_roots)
{
    const double c[5] = {-2.0, 3.0, -3.0, 3.0, -1.0};
    ck_assert(mill_opinion_agrees(c, 5.0, false, 1.0));
    ck_assert(mill_opinion_agrees(c, 0.999, false, INFINITY));
    ck_assert(!mill_opinion_agrees(c, 1.001, false, INFINITY));
    ck_assert(!mill_opinion_agrees(c, 5.0, false, INFINITY));
    ck_assert(!mill_opinion_agrees(c, 5.0, false, 2.0));
    ck_assert(!mill_opinion_agrees(c, 5.0, false, 1.0 + 1e-9));
    ck_assert(!mill_opinion_agrees(c, 5.0, false, 0.0));
}

int main(void)
{
    return unit_run("opinion");
}
