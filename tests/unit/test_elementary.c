/* Claims about the elementary functions, held against the C library's in extended precision. */
#include "base/elementary.h"

#include "draws.h"

#include <float.h>

enum { TRIES = 200000 };

/* [1] how many units in the last place a value is off */
static double units_off(double value, long double right)
{
    int e;
    frexp((double)right, &e);
    return (double)(fabsl(value - right) / ldexpl(1.0L, e - DBL_MANT_DIG));
}

TEST(cosine_and_sine_are_right_to_the_last_place)
{
    uint64_t seed = 1;
    for (int i = 0; i < TRIES; i++) {
        const double angle = uniform(&seed, -1.0, 1.0) * (i % 2 ? 7.0 : 9e5);
        const struct mill_heading at = mill_elementary_heading(angle);
        ck_assert_double_lt(units_off(at.cos, cosl(angle)), 0.8);
        ck_assert_double_lt(units_off(at.sin, sinl(angle)), 0.8);
    }
}

TEST(quarter_turns_are_exact_but_for_the_rounding_of_pi)
{
    for (int k = -8; k <= 8; k++) {
        const struct mill_heading at = mill_elementary_heading(0.5 * PI * k);
        const int quarter = k & 3;
        ck_assert_double_eq_tol(at.cos, quarter == 0 ? 1.0 : quarter == 2 ? -1.0 : 0.0, 1e-15);
        ck_assert_double_eq_tol(at.sin, quarter == 1 ? 1.0 : quarter == 3 ? -1.0 : 0.0, 1e-15);
    }
    ck_assert(mill_elementary_heading(0.0).cos == 1.0 && mill_elementary_heading(0.0).sin == 0.0);
}

TEST(huge_angles_still_give_a_direction)
{
    uint64_t seed = 2;
    for (int i = 0; i < 1000; i++) {
        const struct mill_heading at = mill_elementary_heading(log_uniform(&seed, 1e6, 1e18));
        ck_assert_double_eq_tol(at.cos * at.cos + at.sin * at.sin, 1.0, 1e-15);
    }
}

TEST(directions_have_their_angles)
{
    uint64_t seed = 3;
    for (int i = 0; i < TRIES; i++) {
        const double y = uniform(&seed, -1.0, 1.0), x = uniform(&seed, -1.0, 1.0);
        ck_assert_double_lt(units_off(mill_elementary_atan2(y, x), atan2l(y, x)), 4.0);
        ck_assert_double_lt(units_off(mill_elementary_asin(y), asinl(y)), 4.0);
    }
    ck_assert(mill_elementary_atan2(0.0, 0.0) == 0.0);
    ck_assert(mill_elementary_atan2(0.0, -1.0) == PI);
    ck_assert(mill_elementary_asin(1.0) == 0.5 * PI && mill_elementary_asin(-1.0) == -0.5 * PI);
}

SLOW_TEST(cube_roots_and_exponentials_are_right_to_the_last_place_or_two, 1)
{
    uint64_t seed = 4;
    for (int i = 0; i < TRIES; i++) {
        const double x = log_uniform(&seed, 1e-300, 1e300), y = uniform(&seed, -700.0, 700.0);
        ck_assert_double_lt(units_off(mill_elementary_cbrt(x), cbrtl(x)), 2.0);
        ck_assert_double_lt(units_off(mill_elementary_root5(x), powl(x, 0.2L)), 2.0);
        ck_assert_double_lt(units_off(mill_elementary_exp(y), expl(y)), 2.0);
    }
    ck_assert(mill_elementary_cbrt(27.0) == 3.0 && mill_elementary_root5(243.0) == 3.0 &&
              mill_elementary_exp(0.0) == 1.0);
}

/* What other C libraries and processors must find, too: frozen here, with no library in between. */
TEST(every_library_gives_the_same_bits)
{
    uint64_t seed = 5, sum = UINT64_C(14695981039346656037);
    for (int i = 0; i < TRIES; i++) {
        const double angle = uniform(&seed, -20.0, 20.0), x = uniform(&seed, 0.001, 1.0);
        const struct mill_heading at = mill_elementary_heading(angle);
        const double values[] = {at.cos, at.sin, mill_elementary_atan2(angle, x),
                                 mill_elementary_cbrt(x), mill_elementary_exp(angle)};
        for (size_t k = 0; k < sizeof values / sizeof *values; k++) {
            uint64_t bits;
            memcpy(&bits, &values[k], sizeof bits);
            sum = (sum ^ bits) * UINT64_C(1099511628211);
        }
    }
    ck_assert_msg(sum == UINT64_C(0x9b18755d91a6f944), "0x%016llx", (unsigned long long)sum);
}

int main(void)
{
    return unit_run("elementary");
}
