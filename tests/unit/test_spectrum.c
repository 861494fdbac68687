/* Claims about the logarithmic bins of speeds. */
#include "draws.h"
#include "observe/spectrum.h"
#include "quantile.h"

static struct mill_spectrum_grid grid;
static struct mill_spectrum spectrum;

static void setup(void)
{
    mill_spectrum_grid_init(&grid);
    memset(&spectrum, 0, sizeof spectrum);
}

static int slot_by_bisection(double v)
{
    if (!(v >= grid.edge[0]))
        return 0;
    int low = 0, high = MILL_SPECTRUM_BINS + 1; /* edge[low] <= v < edge[high] */
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (v >= grid.edge[middle])
            low = middle;
        else
            high = middle;
    }
    return low + 1;
}

static void fill(volatile double v) /* volatile: gcc warns of slots it cannot rule out */
{
    mill_spectrum_add(&spectrum, mill_spectrum_find(&grid, v), 1, v, 0);
}

TEST(edges_are_powers_of_twenty_and_finer_than_two_percent)
{
    for (int k = 0; k <= MILL_SPECTRUM_BINS; k++)
        ck_assert_ldouble_eq_tol(grid.edge[k] / powl(20, (k - 760) / 152.0L), 1, 4e-16L);
    for (int k = 0; k < MILL_SPECTRUM_BINS; k++)
        ck_assert_double_lt(grid.edge[k + 1] / grid.edge[k], 1.02);
}

TEST(the_speeds_people_ask_for_are_edges)
{
    ck_assert(grid.edge[760 - 152] == 0.05);
    ck_assert(grid.edge[760] == 1);
    ck_assert(grid.edge[760 + 152] == 20);
    ck_assert_int_eq(mill_spectrum_find(&grid, 0.05), MILL_SPECTRUM_FAST);
    ck_assert_int_eq(mill_spectrum_find(&grid, nextafter(0.05, 0)), MILL_SPECTRUM_FAST - 1);
}

TEST(the_slot_is_that_of_a_bisection_at_every_edge_and_its_neighbours)
{
    for (int k = 0; k <= MILL_SPECTRUM_BINS; k++) {
        const double v[3] = {nextafter(grid.edge[k], 0), grid.edge[k],
                             nextafter(grid.edge[k], INFINITY)};
        for (int i = 0; i < 3; i++)
            ck_assert_int_eq(mill_spectrum_find(&grid, v[i]), slot_by_bisection(v[i]));
        ck_assert_int_eq(mill_spectrum_find(&grid, v[0]), k);
        ck_assert_int_eq(mill_spectrum_find(&grid, v[1]), k + 1);
    }
}

TEST(the_slot_is_that_of_a_bisection_at_random_speeds)
{
    uint64_t seed = 1;
    int wrong = 0;
    for (int i = 0; i < 1000000; i++) {
        const double v = pow(10, -8 + 13 * uniform(&seed, 0.0, 1.0));
        wrong += mill_spectrum_find(&grid, v) != slot_by_bisection(v);
    }
    ck_assert_int_eq(wrong, 0);
}

TEST(the_slot_is_that_of_a_bisection_at_the_corners_of_the_table)
{
    for (int octave = -23; octave <= 12; octave++)
        for (int cell = 0; cell < 64; cell++) {
            const double v = ldexp(1 + cell / 64.0, octave);
            ck_assert_int_eq(mill_spectrum_find(&grid, v), slot_by_bisection(v));
            ck_assert_int_eq(mill_spectrum_find(&grid, nextafter(v, 0)),
                             slot_by_bisection(nextafter(v, 0)));
        }
}

TEST(what_is_no_speed_is_underflow_and_what_is_too_fast_overflow)
{
    const volatile double slow[] = {0, -0.0, -1, 1e-300, 3.1e-7, (double)NAN, -INFINITY};
    const volatile double fast[] = {1789, 1e5, 1e300, INFINITY};
    for (size_t i = 0; i < sizeof slow / sizeof *slow; i++)
        ck_assert_int_eq(mill_spectrum_find(&grid, slow[i]), 0);
    for (size_t i = 0; i < sizeof fast / sizeof *fast; i++)
        ck_assert_int_eq(mill_spectrum_find(&grid, fast[i]), MILL_SPECTRUM_BINS + 1);
}

/* Log-linear within a bin of width d = log(20)/152 is off by d^2/8 times the slope of the density
 * of log v, which is 2 - (v/s)^2 for Rayleigh's. */
TEST(quantiles_of_a_rayleigh_distribution_are_as_good_as_the_interpolation_allows)
{
    enum { N = 4000000 };
    const double s = 0.3, d = log(20) / 152;
    for (int i = 0; i < N; i++) /* v with the cumulative share (i + 1/2)/N: exact, no noise */
        fill(s * sqrt(-2 * log(1 - (i + 0.5) / N)));
    const double levels[] = {0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99};
    for (size_t i = 0; i < sizeof levels / sizeof *levels; i++) {
        const double exact = s * sqrt(-2 * log(1 - levels[i]));
        const double bound = d * d / 8 * fabs(2 - exact * exact / (s * s)) + 1e-5;
        ck_assert_double_eq_tol(quantile_of(&grid, &spectrum, 0, levels[i]) / exact, 1, bound);
    }
}

TEST(a_quantile_never_leaves_the_bin_it_belongs_to)
{
    fill(0.3);
    const double v = quantile_of(&grid, &spectrum, 0, 0.5);
    ck_assert_int_eq(mill_spectrum_find(&grid, v), mill_spectrum_find(&grid, 0.3));
    fill(7);
    ck_assert_int_eq(mill_spectrum_find(&grid, quantile_of(&grid, &spectrum, 0, 0.75)),
                     mill_spectrum_find(&grid, 7));
}

TEST(quantiles_above_a_speed_leave_out_the_slower_ones)
{
    for (int i = 0; i < 1000; i++)
        fill(0.001);
    fill(nextafter(0.05, 0));
    for (int i = 0; i < 3; i++)
        fill(2);
    ck_assert_uint_eq(mill_spectrum_total(&spectrum, MILL_SPECTRUM_FAST).count, 3);
    ck_assert_double_eq_tol(quantile_of(&grid, &spectrum, MILL_SPECTRUM_FAST, 0.5) / 2, 1, 0.02);
    ck_assert_double_lt(quantile_of(&grid, &spectrum, 0, 0.5), 0.0011);
}

TEST(speeds_outside_the_bins_weigh_in_the_quantiles)
{
    for (int i = 0; i < 6; i++)
        fill(0);
    for (int i = 0; i < 4; i++)
        fill(1e6);
    ck_assert(quantile_of(&grid, &spectrum, 0, 0.5) == 0);
    ck_assert(quantile_of(&grid, &spectrum, 0, 0.7) == grid.edge[MILL_SPECTRUM_BINS]);
}

TEST(the_mean_is_that_of_the_speeds_not_of_the_bins)
{
    fill(0.1);
    ck_assert(mill_spectrum_mean(&spectrum) == 0.1);
    fill(0.2);
    fill(0);
    ck_assert_double_eq_tol(mill_spectrum_mean(&spectrum), 0.1, 1e-16);
}

TEST(without_speeds_there_is_no_mean_and_no_quantile)
{
    ck_assert_double_nan(mill_spectrum_mean(&spectrum));
    ck_assert_double_nan(quantile_of(&grid, &spectrum, 0, 0.5));
    fill(0.001);
    ck_assert_double_nan(quantile_of(&grid, &spectrum, MILL_SPECTRUM_FAST, 0.5));
}

TEST(a_merged_spectrum_holds_both)
{
    struct mill_spectrum other;
    memset(&other, 0, sizeof other);
    mill_spectrum_add(&spectrum, 100, 1, 1, 0.5);
    mill_spectrum_add(&other, 100, 1, 2, 0.25);
    mill_spectrum_add(&other, 0, 1, 0, -0.125);
    mill_sums_add_records(&mill_spectrum_sums, 1, &spectrum, &other);
    ck_assert_uint_eq(mill_spectrum_total(&spectrum, 0).count, 3);
    ck_assert_uint_eq(spectrum.slot[100].count, 2);
    ck_assert(mill_spectrum_total(&spectrum, 0).dissipation == 0.625);
    ck_assert(mill_spectrum_mean(&spectrum) == 1);
}

int main(void)
{
    return unit_run_in("spectrum", setup, NULL);
}
