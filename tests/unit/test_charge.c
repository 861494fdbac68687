/* Claims about the charge of a tumbling mill: from sums made by hand to its numbers. */
#include "observe/charge.h"

#include "mill_fixture.h"

#define DEGREES (PI / 180)

static struct fixture f;
static struct mill_charge_sum sum[2];
static double met[FIXTURE_BALLS], number[MILL_CHARGE_NUMBERS];
static struct mill_charge charge;

/* The wall rises on the side of +y, and gravity acts along -z. */
static void setup(void)
{
    fixture_init(&f);
    memset(sum, 0, sizeof sum);
    memset(met, 0, sizeof met);
    f.world.g = vec3_make(0, 0, -9.81);
    charge = (struct mill_charge){.world = &f.world,
                                  .interval = 1e-3,
                                  .every = 4,
                                  .down = {0, 0, -1},
                                  .rising = {0, 1, 0},
                                  .inner = 0.055,
                                  .block = sum,
                                  .met = met};
}

static void teardown(void)
{
    fixture_free(&f);
}

static void estimate(void)
{
    mill_charge_estimate(&charge, 0, 0, &sum[0], number);
}

/* The layer is full between two angles [degrees], with so much noise in each bin. */
static void fill(double toe, double shoulder, double noise)
{
    uint64_t state = 1;
    for (int k = 0; k < MILL_CHARGE_ANGLES; k++) {
        const double low = 2 * k - 180, in = fmin(low + 2, shoulder) - fmax(low, toe);
        sum[0].layer[k] = fmax(0, in) / 2 * (1 + noise * (random_share(&state) - 0.5));
    }
    estimate();
}

TEST(toe_and_shoulder_are_the_ends_of_a_full_layer)
{
    fill(-43.3, 131.7, 0);
    ck_assert_double_eq_tol(number[MILL_CHARGE_TOE] / DEGREES, -43.3, 1e-9);
    ck_assert_double_eq_tol(number[MILL_CHARGE_SHOULDER] / DEGREES, 131.7, 1e-9);
}

TEST(noise_within_the_layer_moves_them_little)
{
    fill(-43, 131, 0.5);
    ck_assert_double_eq_tol(number[MILL_CHARGE_TOE] / DEGREES, -43, 1.5);
    ck_assert_double_eq_tol(number[MILL_CHARGE_SHOULDER] / DEGREES, 131, 1.5);
    ck_assert_double_ne(number[MILL_CHARGE_TOE] / DEGREES, -43);
}

TEST(a_shoulder_can_be_beyond_the_highest_place)
{
    fill(-30, 180, 0);
    for (int k = 0; k < 5; k++)
        sum[0].layer[k] = 1; /* to 190 degrees */
    estimate();
    ck_assert_double_eq_tol(number[MILL_CHARGE_SHOULDER] / DEGREES, 190, 1e-9);
    ck_assert_double_eq_tol(number[MILL_CHARGE_TOE] / DEGREES, -30, 1e-9);
}

TEST(a_layer_all_around_has_neither_toe_nor_shoulder)
{
    fill(-180, 180, 0);
    ck_assert(isnan(number[MILL_CHARGE_TOE]));
    ck_assert(isnan(number[MILL_CHARGE_SHOULDER]));
}

TEST(nothing_is_known_without_samples)
{
    estimate();
    for (int i = 0; i < MILL_CHARGE_NUMBERS; i++)
        ck_assert_msg(isnan(number[i]), "number %d is %g", i, number[i]);
}

/* A stream function with its top at a place: psi falls as the square of the distance, to the wall
 */
TEST(the_centre_of_circulation_is_the_top_of_the_stream_function)
{
    const double step = 2 * PI / MILL_CHARGE_SECTORS, ring = 0.075 / MILL_CHARGE_RINGS;
    const double x = 0.03, y = -0.025;
    double psi[2];
    for (int k = 0; k < MILL_CHARGE_SECTORS; k++)
        for (int i = 0; i < MILL_CHARGE_RINGS; i++) {
            const double angle = (k + 0.5) * step - PI;
            for (int n = 0; n < 2; n++) {
                const double r = (i + n) * ring;
                psi[n] = -pow(r * sin(angle) - x, 2) - pow(-r * cos(angle) - y, 2);
            }
            sum[0].flow[k][i] = (psi[0] - psi[1]) * (i + 0.5);
        }
    /* the wall is no streamline of it: all that flows must be above 0 there */
    for (int k = 0; k < MILL_CHARGE_SECTORS; k++) {
        const double angle = (k + 0.5) * step - PI;
        const double rim = pow(0.075 * sin(angle) - x, 2) + pow(-0.075 * cos(angle) - y, 2);
        sum[0].flow[k][MILL_CHARGE_RINGS - 1] -= (rim - 0.003) * (MILL_CHARGE_RINGS - 0.5);
    }
    estimate();
    ck_assert_double_eq_tol(number[MILL_CHARGE_FLIGHT + 3], x, 0.2 * ring);
    ck_assert_double_eq_tol(number[MILL_CHARGE_FLIGHT + 4], y, 0.2 * ring);
}

/* The balls of the fixture are on a ring of 60 mm; all go to one place. */
static void gather(vec3 r, vec3 v)
{
    for (int i = 0; i < FIXTURE_BALLS; i++) {
        f.ball[i].r = r;
        f.ball[i].v = v;
    }
    mill_charge_sample(&charge, 0, 0, 0, 4);
    estimate();
}

TEST(the_centre_of_mass_is_where_the_balls_are)
{
    gather(vec3_make(0.02, 0.03, -0.04), vec3_make(0, 0, 0));
    ck_assert_double_eq_tol(number[MILL_CHARGE_FLIGHT + 1], 0.03, 1e-12);
    ck_assert_double_eq_tol(number[MILL_CHARGE_FLIGHT + 2], -0.04, 1e-12);
    ck_assert_double_eq_tol(number[MILL_CHARGE_REPOSE], atan2(0.03, 0.04), 1e-12);
}

TEST(a_ball_counts_in_the_layer_from_its_inner_radius_on)
{
    gather(vec3_make(0, 0, -0.054), vec3_make(0, 0, 0));
    ck_assert(sum[0].layer[90] + sum[0].layer[89] == 0);
    gather(vec3_make(0, 0.0002, -0.056), vec3_make(0, 0, 0));
    ck_assert_double_eq_tol(sum[0].layer[90], FIXTURE_BALLS * f.species.mass, 1e-15);
}

TEST(what_rises_with_the_wall_flows_forward)
{
    gather(vec3_make(0, 0.001, -0.06), vec3_make(0, 0.5, 0));
    ck_assert_double_eq_tol(sum[0].flow[30][24], FIXTURE_BALLS * f.species.mass * 0.5, 1e-5);
}

TEST(a_sample_is_taken_once_in_so_many_samples_of_the_flow)
{
    for (uint64_t k = 0; k < 10; k++)
        mill_charge_sample(&charge, 0, 0, k, k + 1);
    ck_assert(sum[0].samples == 2);
    mill_charge_sample(&charge, 1, 0, 10, 30); /* many at once */
    ck_assert(sum[1].samples == 5);
}

static void meet(double time, int ball, int partner)
{
    const enum mill_kind kind = partner < 0 ? MILL_BALL_DRUM : MILL_BALL_BALL;
    const struct mill_impact impact = impact_of(time, kind, ball, partner, 1, 0);
    mill_charge_impact(&charge, 0, true, &impact);
}

/* The fall by 5 mm takes 31.9 ms. */
TEST(a_flight_counts_if_it_is_longer_than_the_fall_by_a_diameter)
{
    meet(1.000, 3, -1);
    sum[0].flight = 0; /* nothing was known before */
    meet(1.031, 3, -1);
    ck_assert(sum[0].flight == 0);
    meet(1.064, 3, -1);
    ck_assert_double_eq_tol(sum[0].flight, 0.033, 1e-12);
}

TEST(an_impact_of_two_balls_ends_the_flights_of_both)
{
    meet(1, 3, -1);
    meet(1, 4, -1);
    sum[0].flight = 0;
    meet(1.1, 4, 3);
    ck_assert_double_eq_tol(sum[0].flight, 0.2, 1e-12);
    sum[0].samples = 10;
    estimate();
    ck_assert_double_eq_tol(number[MILL_CHARGE_FLIGHT], 0.2 / (FIXTURE_BALLS * 10 * 4e-3), 1e-12);
}

TEST(blocks_that_are_joined_keep_their_sums)
{
    struct mill_charge_sum block[7] = {0};
    struct mill_charge joined = charge;
    joined.block = block;
    for (int k = 0; k < 7; k++)
        block[k].samples = block[k].layer[5] = pow(10, k);
    mill_charge_join(&joined, 7, 3);
    const double expected[7] = {11, 1100, 110000, 1000000};
    for (int k = 0; k < 7; k++)
        ck_assert_msg(block[k].layer[5] == expected[k], "block %d: %g", k, block[k].layer[5]);
}

int main(void)
{
    return unit_run_in("charge", setup, teardown);
}
