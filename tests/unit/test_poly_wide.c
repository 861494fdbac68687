/* Numbers of 1280 bits: exact where they fit, and honest about a sign where they do not. */
#include "base/poly_wide.h"
#include "poly_cases.h"
#include "unit.h"

static struct wide negative(struct wide a)
{
    a.sign = -a.sign;
    return a;
}

static double any_double(gsl_rng *rng)
{
    double x = ldexp(uniform(rng, 1.0, 2.0), (int)gsl_rng_uniform_int(rng, 600) - 300);
    return gsl_rng_uniform(rng) < 0.5 ? -x : x;
}

TEST(doubles_go_in_and_come_out_unchanged)
{
    const double some[6] = {0.0, 1.0, -5e-324, DBL_MAX, -0x1.fffffffffffffp-33, 0x1p31};
    for (int i = 0; i < 6; i++) {
        struct wide a = wide_from(some[i]);
        ck_assert_double_eq(wide_to_double(a), some[i]);
        ck_assert_int_eq(wide_sign(a), (some[i] > 0.0) - (some[i] < 0.0));
    }
}

TEST(products_and_sums_are_exact)
{
    gsl_rng *rng = seeded(120); /* (a + b)(a - b) + b b - a a = 0 to the last of 1280 bits */
    for (int i = 0; i < 20000; i++) {
        struct wide a = wide_from(any_double(rng)), b = wide_from(any_double(rng));
        struct wide minus_b = negative(b), minus_a = negative(a);
        struct wide sum = wide_sum(a, b), difference = wide_sum(a, minus_b);
        struct wide left = wide_product(sum, difference);
        struct wide bb = wide_product(b, b), aa = wide_product(a, minus_a);
        left = wide_sum(left, bb);
        left = wide_sum(left, aa);
        ck_assert_int_eq(left.size, 0);
        ck_assert_int_eq(left.noise, WIDE_EXACT);
    }
    gsl_rng_free(rng);
}

TEST(sums_carry_and_borrow_like_integers)
{
    gsl_rng *rng = seeded(121);
    for (int i = 0; i < 20000; i++) {
        int64_t x = (int64_t)(gsl_rng_get(rng) << 20) - (1LL << 51), y = (int64_t)gsl_rng_get(rng);
        struct wide a = wide_from((double)x), b = wide_from((double)y);
        struct wide sum = wide_sum(a, b);
        ck_assert_double_eq(wide_to_double(sum), (double)(x + y));
        ck_assert_int_eq(wide_sign(sum), (x + y > 0) - (x + y < 0));
    }
    gsl_rng_free(rng);
}

TEST(a_sign_that_the_width_cannot_hold_is_not_claimed)
{
    /* 2^1000 + 2^-250 + 2^-280 - 2^1000: the last term is one word too many, and what is left
     * next to the cut counts for nothing */
    struct wide big = wide_from(0x1p1000), mid = wide_from(0x1p-250), low = wide_from(0x1p-280);
    struct wide minus = negative(big), sum = wide_sum(big, mid);
    sum = wide_sum(sum, low);
    ck_assert_int_eq(wide_sign(sum), 1);
    sum = wide_sum(sum, minus);
    ck_assert_int_eq(wide_sign(sum), 0);
    big = wide_from(0x1p500); /* fits */
    minus = negative(big);
    sum = wide_sum(big, mid);
    sum = wide_sum(sum, low);
    sum = wide_sum(sum, minus);
    ck_assert_int_eq(wide_sign(sum), 1);
}

TEST(products_of_uncertain_numbers_stay_uncertain)
{
    struct wide big = wide_from(0x1p1000), low = wide_from(0x1p-600), minus = negative(big);
    struct wide lost = wide_sum(big, low);
    lost = wide_sum(lost, minus); /* 2^-600, of which nothing is left */
    struct wide product = wide_product(lost, big);
    struct wide small = wide_from(0x1p600), large = wide_from(0x1p1020);
    large = wide_product(large, large);
    small = wide_sum(product, small);
    large = wide_sum(product, large);
    ck_assert_int_eq(wide_sign(small), 0);
    ck_assert_int_eq(wide_sign(large), 1);
}

int main(void)
{
    return unit_run("poly_wide");
}
