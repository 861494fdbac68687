/* Claims about the mean of a series, of starts, and of counts. */
#include "draws.h"
#include "observe/spread.h"
#include "unit.h"

#include <gsl/gsl_cdf.h>
#include <math.h>

enum { MOST = MILL_SPREAD_MOST };

static double x[MOST];
static uint64_t chance;

/* Normal deviates, by the sum of twelve */
static double normal(void)
{
    double sum = -6;
    for (int i = 0; i < 12; i++)
        sum += uniform(&chance, 0, 1);
    return sum;
}

/* n values from x[from] on: an autoregressive process of first order with variance 1, and a swing
 * of the period */
static void fill(size_t from, size_t n, double memory, size_t period, double swing)
{
    double last = normal();
    for (size_t i = 0; i < n; i++) {
        last = memory * last + sqrt(1 - memory * memory) * normal();
        x[from + i] =
            10 + last + (period ? swing * sin(2 * PI * (double)(i % period) / (double)period) : 0);
    }
}

static struct mill_spread_of alone(size_t n, size_t period)
{
    return (struct mill_spread_of){1, n, period};
}

static struct mill_spread_of apart(size_t n)
{
    return (struct mill_spread_of){n, 1, 0};
}

/* Share of 2000 series whose true mean lies within the 95 % interval told; *reach: half its width
 * over that of the true one, rms */
static double held(struct mill_spread_of of, double memory, double swing, double *reach)
{
    double told = 0, scatter = 0;
    int within = 0, known = 0;
    enum { SERIES = 2000 };
    chance = 7;
    for (int k = 0; k < SERIES; k++) {
        for (size_t s = of.starts; s-- > 0;)
            fill(s * of.each, of.each, memory, of.period, swing);
        const struct mill_spread_mean mean = mill_spread_mean(x, of);
        if (isnan(mean.error))
            continue;
        known++;
        within += fabs(mean.value - 10) <= 1.96 * mean.error;
        told += mean.error * mean.error;
        scatter += (mean.value - 10) * (mean.value - 10);
    }
    ck_assert_int_gt(known, SERIES / 2);
    *reach = sqrt(told / scatter);
    return (double)within / known;
}

/* ---- series ---- */

TEST(mser_is_the_minimum_of_its_formula)
{
    chance = 2;
    fill(0, 60, 0.5, 0, 0);
    for (size_t i = 0; i < 12; i++)
        x[i] -= (double)(12 - i) / 2;
    size_t best = 0;
    double least = INFINITY;
    for (size_t d = 0; d + 5 < 60; d++) {
        double mean = 0, squares = 0;
        for (size_t i = d; i < 60; i++)
            mean += x[i] / (double)(60 - d);
        for (size_t i = d; i < 60; i++)
            squares += (x[i] - mean) * (x[i] - mean);
        if (squares / pow((double)(60 - d), 2) < least) {
            least = squares / pow((double)(60 - d), 2);
            best = d;
        }
    }
    ck_assert_uint_eq(mill_spread_mser(x, 60), best);
    ck_assert_uint_gt(best, 0);
}

TEST(mser_keeps_all_of_a_series_too_short_to_judge)
{
    for (size_t n = 0; n <= 5; n++)
        ck_assert_uint_eq(mill_spread_mser(x, n), 0);
}

TEST(the_error_told_is_the_scatter_of_the_means)
{
    const double memory[] = {-0.2, 0, 0.5, 0.8};
    for (int i = 0; i < 4; i++) {
        double reach;
        const double share = held(alone(480, 0), memory[i], 0, &reach);
        ck_assert_msg(share > 0.93 && share < 0.97, "memory %g: %g", memory[i], share);
        ck_assert_msg(reach > 0.95 && reach < 1.3, "memory %g: %g", memory[i], reach);
    }
}

/* A piece of a short series must be longer than what the mill remembers: six values of a memory of
 * 0.8 are not. */
TEST(in_short_series_the_interval_is_widened_so_that_it_still_holds)
{
    const double memory[] = {0, 0.3, 0.5, 0.8};
    for (int n = 48; n <= 384; n *= 2)
        for (int i = 0; i < 4; i++) {
            double reach;
            if (n * (1 - memory[i]) < 24)
                continue;
            const double share = held(alone((size_t)n, 0), memory[i], 0, &reach);
            ck_assert_msg(share > 0.91 && share < 0.97, "%d, %g: %g", n, memory[i], share);
            ck_assert_msg(reach > 0.95 && reach < 1.35, "%d, %g: %g", n, memory[i], reach);
        }
}

TEST(what_repeats_every_revolution_has_no_part_in_the_error)
{
    for (size_t turns = 3; turns <= 24; turns *= 2) {
        double reach;
        const double share = held(alone(12 * turns, 12), 0, 30, &reach);
        ck_assert_msg(share > 0.93 && share < 0.98, "%zu revolutions: %g", turns, share);
        ck_assert_msg(reach > 1 && reach < 2, "%zu revolutions: %g", turns, reach);
    }
}

/* 5.5 revolutions of a swing of 30 shift the mean by 30 * 2/pi * 0.5/5.5 or so. */
TEST(a_revolution_that_is_not_whole_has_its_part_in_the_error)
{
    double reach;
    ck_assert_double_gt(held(alone(66, 12), 0, 30, &reach), 0.98);
    ck_assert_msg(reach > 0.95 && reach < 1.8, "%g", reach);
}

/* The error as the comments of spread.h define it, step by step, and Student's t of GSL */
static struct mill_spread_mean by_formula(size_t n, size_t period)
{
    const bool repeats = period > 1;
    const size_t phases = repeats ? period : 1;
    double phase[MOST] = {0}, piece[8] = {0}, sum = 0, shift = 0, squares = 0, middle = 0;
    for (size_t i = 0; i < n; i++) {
        phase[i % phases] += x[i] / (double)((n - i % phases + phases - 1) / phases);
        sum += x[i];
    }
    for (size_t i = 0; i < phases; i++)
        shift += phase[i] / (double)phases;
    shift -= sum / (double)n;
    for (size_t k = 0; k < 8; k++) {
        const size_t from = k * n / 8, to = (k + 1) * n / 8;
        for (size_t i = from; i < to; i++)
            piece[k] += (x[i] - phase[i % phases]) / (double)(to - from);
        middle += piece[k] / 8;
    }
    for (size_t k = 0; k < 8; k++)
        squares += (piece[k] - middle) * (piece[k] - middle);
    const double share = repeats ? 1 - 1 / (double)(n / period) : 1;
    const double widened = gsl_cdf_tdist_Pinv(0.975, 7) / gsl_cdf_ugaussian_Pinv(0.975);
    return (struct mill_spread_mean){
        sum / (double)n, sqrt(squares / 56 * widened * widened / share + shift * shift), 7};
}

TEST(the_error_is_that_of_its_formula)
{
    static const struct {
        size_t n, period;
        double memory;
    } of[] = {{36, 0, 0},   {47, 1, 0.5},  {48, 12, 0},      {53, 12, 0.3},  {66, 12, 0.3},
              {72, 3, 0.2}, {100, 3, 0.7}, {150, 6, -0.9},   {287, 12, 0.6}, {288, 12, 0.95},
              {600, 24, 0}, {611, 48, 0},  {MOST, 12, 0.99}, {145, 48, 0},   {144, 48, -0.5}};
    chance = 11;
    for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
        fill(0, of[i].n, of[i].memory, of[i].period, 3);
        const struct mill_spread_mean mean = mill_spread_mean(x, alone(of[i].n, of[i].period));
        const struct mill_spread_mean own = by_formula(of[i].n, of[i].period);
        ck_assert_double_eq_tol(mean.value, own.value, 1e-12);
        ck_assert_msg(fabs(mean.error / own.error - 1) < 1e-4, "%zu of %zu: %.9g, not %.9g",
                      of[i].n, of[i].period, mean.error, own.error);
        ck_assert(mean.freedom == own.freedom);
    }
    for (size_t i = 0; i < MOST; i++)
        x[i] = (double)(i % 12);
    const struct mill_spread_mean swing = mill_spread_mean(x, alone(66, 12)); /* nothing but it */
    ck_assert_double_eq_tol(swing.error, fabs(swing.value - 5.5), 1e-12);
    ck_assert(swing.value < 5.3 && isinf(swing.freedom));
}

/* ---- starts ---- */

TEST(the_interval_of_several_starts_holds_whatever_they_remember)
{
    for (size_t n = MILL_SPREAD_SEVERAL; n <= 16; n *= 2) {
        double reach;
        chance = 13;
        const double share = held(apart(n), 0, 0, &reach);
        ck_assert_msg(share > 0.935 && share < 0.965, "%zu starts: %g", n, share);
        ck_assert_msg(reach > 1.05 && reach < 1.75, "%zu starts: %g", n, reach);
    }
}

TEST(two_starts_in_pieces_are_known_as_well_as_one_that_is_twice_as_long)
{
    for (size_t period = 0; period <= 12; period += 12) {
        double reach;
        const double share = held((struct mill_spread_of){2, 96, period}, 0.5, 30, &reach);
        ck_assert_msg(share > 0.93 && share < 0.98, "%g", share);
        ck_assert_msg(reach > 1 && reach < 1.3, "%g", reach);
    }
    fill(0, 192, 0.5, 0, 0);
    ck_assert(mill_spread_mean(x, (struct mill_spread_of){2, 96, 0}).freedom == 15);
    ck_assert(isnan(mill_spread_mean(x, (struct mill_spread_of){6, 32, 0}).error));
}

TEST(fewer_than_four_starts_have_a_mean_and_no_error)
{
    fill(0, 3, 0, 0, 0);
    const struct mill_spread_mean mean = mill_spread_mean(x, apart(3));
    ck_assert_double_eq_tol(mean.value, (x[0] + x[1] + x[2]) / 3, 1e-12);
    ck_assert(isnan(mean.error) && mean.freedom == 0);
}

TEST(equal_starts_are_known_exactly)
{
    for (size_t i = 0; i < 8; i++)
        x[i] = 0.1;
    const struct mill_spread_mean mean = mill_spread_mean(x, apart(8));
    ck_assert(mean.error == 0 && isinf(mean.freedom));
}

TEST(of_a_few_impacts_only_their_number_is_known)
{
    for (size_t i = 0; i < 8; i++)
        x[i] = (double)(i % 3);
    const double seen = 7; /* within 8 s, in x */
    ck_assert(isnan(mill_spread_counted(x, apart(8), 8).error));
    const struct mill_spread_mean mean = mill_spread_counted(x, apart(8), 16);
    ck_assert(mean.error >= sqrt(seen / 8 / 16) && mean.freedom == 7);
    for (size_t i = 0; i < 8; i++)
        x[i] = i < 3 ? 100 : 0; /* many, but none in most of the starts */
    ck_assert(isnan(mill_spread_counted(x, apart(8), 8).error));
    for (size_t i = 0; i < 8; i++)
        x[i] = 100 + 20 * (double)i;
    for (size_t n = MILL_SPREAD_SEVERAL; n <= 8; n++)
        ck_assert(mill_spread_counted(x, apart(n), 8).error > 0);
}

TEST(quantiles_of_student_are_those_of_gsl)
{
    for (double freedom = 3; freedom < 100; freedom += 1)
        for (int k = 0; k < 3; k++) {
            const double z = k == 0 ? 0.8416 : k == 1 ? 1.96 : 2.5758;
            const double own = gsl_cdf_tdist_Pinv(gsl_cdf_ugaussian_P(z), freedom);
            ck_assert_double_eq_tol(mill_spread_student(z, freedom) / own, 1,
                                    freedom < 7 ? 2e-2 : 1e-3);
        }
}

/* ---- few ---- */

TEST(too_few_batches_have_no_error)
{
    fill(0, MILL_SPREAD_FEWEST, 0, 0, 0);
    const struct mill_spread_mean few = mill_spread_mean(x, alone(MILL_SPREAD_FEWEST - 1, 0));
    ck_assert_double_eq_tol(few.value, 10, 1);
    ck_assert_double_nan(few.error);
    ck_assert(few.freedom == 0);
    ck_assert(mill_spread_mean(x, alone(MILL_SPREAD_FEWEST, 0)).error > 0);
}

int main(void)
{
    return unit_run("spread");
}
