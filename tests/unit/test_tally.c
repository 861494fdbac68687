/* Claims about the statistics that the tally gathers. */
#include "mill_fixture.h"
#include "observe/sink.h"
#include "quantile.h"
#include "state_fixture.h"

#include <stdio.h>
#include <unistd.h>

static struct fixture f;

static void setup(void)
{
    fixture_init(&f);
}

static void teardown(void)
{
    fixture_free(&f);
}

TEST(only_impacts_within_the_window_are_counted)
{
    fixture_create(&f);
    fixture_play(&f, impact_of(0.499, MILL_BALL_BALL, 1, 2, 1, 0.1));
    fixture_play(&f, impact_of(0.5, MILL_BALL_BALL, 1, 2, 1, 0.2));
    fixture_play(&f, impact_of(1.4, MILL_BALL_BALL, 1, 2, 1, 0.4));
    fixture_wait(&f, 1.5);
    fixture_play(&f, impact_of(1.5, MILL_BALL_BALL, 1, 2, 1, 0.8));
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(impacts_of(&f, MILL_BALL_BALL), 2);
    ck_assert_double_eq_tol(
        mill_spectrum_total(&f.results->sums.impacts[MILL_BALL_BALL].normal, 0).dissipation, 0.6,
        1e-15);
    ck_assert_double_eq_tol(mill_tally_per_second(f.results, 2), 2, 1e-15);
}

TEST(a_window_from_zero_on_counts_impacts_at_time_zero)
{
    f.asked.sample_from = 0;
    fixture_create(&f);
    fixture_play(&f, impact_of(0, MILL_BALL_BALL, 1, 2, 1, 0.1));
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(impacts_of(&f, MILL_BALL_BALL), 1);
    ck_assert(f.results->duration == 1.5);
}

TEST(the_row_of_all_is_the_sum_of_the_kinds)
{
    fixture_create(&f);
    for (int kind = 0; kind < MILL_KINDS; kind++)
        for (int i = 0; i <= kind; i++)
            fixture_play(&f, impact_of(0.6 + kind * 0.1, (enum mill_kind)kind, i, 7, 0.1 + i, 0.5));
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(impacts_of(&f, f.results->all), 15);
    ck_assert_uint_eq(strikes_of(&f, f.results->all), 15);
    ck_assert(mill_spectrum_total(&f.results->sums.impacts[f.results->all].normal, 0).dissipation ==
              7.5);
}

TEST(a_kind_without_impacts_has_rate_zero_and_no_median)
{
    fixture_create(&f);
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(impacts_of(&f, MILL_BALL_SHAFT), 0);
    ck_assert_double_nan(
        quantile_of(&f.tally->grid, &f.results->sums.impacts[MILL_BALL_SHAFT].normal, 0, 0.5));
    ck_assert_double_nan(f.results->floor_share[MILL_BALL_SHAFT]);
}

TEST(a_recontact_gives_its_dissipation_to_the_first_contact)
{
    fixture_create(&f);
    fixture_play(&f, impact_of(0.6, MILL_BALL_BALL, 1, 2, 3.0, 0.5));
    fixture_play(&f, impact_of(0.6 + 8e-6, MILL_BALL_BALL, 1, 2, 0.01, 0.25));
    fixture_play(&f, impact_of(0.6 + 16e-6, MILL_BALL_BALL, 1, 2, 0.02, -0.125));
    fixture_play(&f, impact_of(0.6 + 30e-6, MILL_BALL_BALL, 1, 2, 0.04, 1));
    fixture_finish(&f, 1.5);
    const struct mill_speeds *strikes = &f.results->sums.strikes[MILL_BALL_BALL];
    const int first = mill_spectrum_find(&f.tally->grid, 3.0);
    ck_assert_uint_eq(impacts_of(&f, MILL_BALL_BALL), 4);
    ck_assert_uint_eq(strikes_of(&f, MILL_BALL_BALL), 2);
    ck_assert_uint_eq(strikes->normal.slot[first].count, 1);
    ck_assert(strikes->normal.slot[first].dissipation == 0.625);
    ck_assert(mill_spectrum_mean(&strikes->normal) == (3.0 + 0.04) / 2);
    ck_assert(strikes->tangential[0].slot[mill_spectrum_find(&f.tally->grid, 6.0)].dissipation ==
              0.625);
}

TEST(without_a_window_contacts_within_the_duration_of_one_are_one_strike)
{
    const double lasts = mill_tally_contact(&f.world);
    f.asked.strike_window = NAN;
    fixture_create(&f);
    for (int i = 0; i < 4; i++) /* after 0.9, then after 1.1 each time */
        fixture_play(
            &f, impact_of(0.6 + (i > 0 ? 1.1 * i - 0.2 : 0) * lasts, MILL_BALL_BALL, 1, 2, 1, 0.1));
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(strikes_of(&f, MILL_BALL_BALL), 3);
}

TEST(a_strike_begun_before_the_window_is_not_counted_as_new)
{
    fixture_create(&f);
    fixture_play(&f, impact_of(0.5 - 4e-6, MILL_BALL_BALL, 1, 2, 3.0, 0.5));
    fixture_play(&f, impact_of(0.5 + 4e-6, MILL_BALL_BALL, 1, 2, 0.1, 0.25));
    fixture_play(&f, impact_of(0.5 + 12e-6, MILL_BALL_BALL, 1, 2, 0.1, 0.25));
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(impacts_of(&f, MILL_BALL_BALL), 2);
    ck_assert_uint_eq(strikes_of(&f, MILL_BALL_BALL), 0);
    ck_assert(mill_spectrum_total(&f.results->sums.strikes[MILL_BALL_BALL].normal, 0).dissipation ==
              0);
}

TEST(without_a_strike_window_strikes_are_impacts)
{
    f.asked.strike_window = 0;
    fixture_create(&f);
    for (int i = 0; i < 100; i++)
        fixture_play(&f, impact_of(0.7, MILL_BALL_DRUM, i % 3, -1, 0.01 * i, 0.001 * i));
    fixture_finish(&f, 1.5);
    ck_assert_mem_eq(f.results->sums.strikes, f.results->sums.impacts,
                     (MILL_KINDS + 1) * sizeof *f.results->sums.impacts);
}

TEST(tangential_speeds_above_50_mm_per_s_are_chosen_by_the_normal_speed)
{
    fixture_create(&f);
    struct mill_impact slow = impact_of(0.6, MILL_BALL_WALL, 1, 0, 0.04, 0);
    struct mill_impact fast = impact_of(0.7, MILL_BALL_WALL, 1, 0, 0.06, 0);
    slow.tangential_speed = 5;
    fast.tangential_speed = 0.001;
    fixture_play(&f, slow);
    fixture_play(&f, fast);
    fixture_finish(&f, 1.5);
    const struct mill_spectrum *tangential = f.results->sums.impacts[MILL_BALL_WALL].tangential;
    const double v = quantile_of(&f.tally->grid, &tangential[1], 0, 0.5);
    ck_assert_double_eq_tol(v / 0.001, 1, 0.02);
    ck_assert_uint_eq(mill_spectrum_total(&tangential[1], 0).count, 1);
    ck_assert_uint_eq(mill_spectrum_total(&tangential[0], 0).count, 2); /* of all */
}

TEST(the_floor_share_is_that_of_the_window)
{
    fixture_create(&f);
    f.world.account.collisions[MILL_BALL_DRUM] = 1000;
    f.world.account.floored[MILL_BALL_DRUM] = 900;
    fixture_wait(&f, 0.6);
    f.world.account.collisions[MILL_BALL_DRUM] += 10;
    f.world.account.floored[MILL_BALL_DRUM] += 3;
    f.world.account.collisions[MILL_BALL_BALL] += 10;
    fixture_finish(&f, 1.5);
    ck_assert_double_eq_tol(f.results->floor_share[MILL_BALL_DRUM], 0.3, 1e-15);
    ck_assert_double_eq_tol(f.results->floor_share[MILL_BALL_BALL], 0, 1e-15);
    ck_assert_double_eq_tol(f.results->floor_share[f.results->all], 0.15, 1e-15);
}

/* Work in steps of 1/100 revolution, each at the middle of its step; the rotor draws `even` watts
 * in the first, third, ... revolution and `odd` in the others, the torque goes 4, 2, 4, ... */
static void turn(double from, double to, double even, double odd)
{
    const double step = 0.001;
    const int n = (int)lround((to - from) / step);
    for (int i = 0; i < n; i++) {
        const double time = from + (i + 0.5) * step;
        const bool second = ((int)floor((time - f.asked.sample_from) * 10) & 1) != 0;
        fixture_wait(&f, time);
        fixture_work(&f, (second ? odd : even) * step);
        f.world.account.motion[0].impulse += (second ? 2 : 4) * step;
    }
}

TEST(power_and_torque_are_told_with_one_error)
{
    fixture_create(&f);
    turn(0, 1.5, 100, 300);
    fixture_finish(&f, 1.5);
    const struct mill_precision_known *known = &f.results->at.known;
    ck_assert_double_eq_tol(known->motion_power[0].value, 200, 1e-9);
    ck_assert_double_eq_tol(known->motion_torque[0].value, 3, 1e-9);
    /* ten revolutions that take turns scatter by 100 about the mean: 32 if they were independent */
    ck_assert_double_gt(known->motion_power[0].error, 10);
    ck_assert_double_lt(known->motion_power[0].error, 100);
    ck_assert_double_eq_tol(known->motion_torque[0].error / known->motion_power[0].error, 1e-2,
                            1e-6);
}

TEST(with_fewer_than_three_revolutions_there_is_no_standard_error)
{
    f.asked.end = 0.79; /* 2.9 revolutions */
    fixture_create(&f);
    turn(0, 0.79, 100, 100);
    fixture_finish(&f, 0.79);
    ck_assert_double_eq_tol(f.results->at.known.motion_power[0].value, 100, 1e-9);
    ck_assert_double_nan(f.results->at.known.motion_power[0].error);
}

TEST(a_mill_without_a_rotor_has_no_power)
{
    fixture_speed(&f, 0);
    fixture_create(&f);
    fixture_finish(&f, 1.5);
    ck_assert(f.results->at.known.motion_power[0].value == 0);
}

TEST(a_run_that_ends_early_is_averaged_over_what_it_reached)
{
    fixture_create(&f);
    fixture_play(&f, impact_of(0.6, MILL_BALL_BALL, 1, 2, 1, 0.1));
    fixture_play(&f, impact_of(0.7, MILL_BALL_BALL, 1, 2, 1, 0.1));
    f.world.base = 0.3; /* local times are counted from here */
    fixture_finish(&f, 0.75);
    ck_assert_double_eq_tol(f.results->duration, 0.25, 1e-15);
    ck_assert_double_eq_tol(mill_tally_per_second(f.results, 2), 8, 1e-12);
}

TEST(a_run_stopped_before_the_window_has_empty_statistics)
{
    char path[64];
    struct mill_h5 *file;
    fixture_create(&f);
    fixture_play(&f, impact_of(0.2, MILL_BALL_BALL, 1, 2, 1, 0.1));
    fixture_finish(&f, 0.3);
    ck_assert(f.results->duration == 0);
    ck_assert_uint_eq(impacts_of(&f, f.results->all), 0);
    ck_assert(mill_tally_per_second(f.results, 0) == 0);
    ck_assert_double_nan(f.results->at.known.motion_power[0].value);
    ck_assert_double_nan(f.results->floor_share[MILL_BALL_BALL]);
    snprintf(path, sizeof path, "/tmp/millsim_tally_%ld.h5", (long)getpid());
    ck_assert_int_eq(mill_h5_create(path, MILL_H5_OVERWRITE, &file, NULL), MILL_OK);
    for (int times = 0; times < 2; times++) { /* the second replaces the first */
        struct mill_sink_file to;
        mill_sink_file(&to, file, "");
        mill_tally_results_tell(f.results, &to.sink);
    }
    ck_assert(mill_h5_exists(file, "/statistics/strikes/all/tangential_speed/histogram/edges"));
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
    unlink(path);
}

TEST(a_short_window_gets_100_snapshots_a_long_one_1000_a_second)
{
    f.asked.end = 0.51;
    fixture_create(&f);
    fixture_finish(&f, 0.51);
    ck_assert_uint_eq(f.results->sums.counts->samples, 100);
    fixture_free(&f);
    f.asked.end = 2;
    fixture_create(&f);
    fixture_finish(&f, 2);
    ck_assert_uint_eq(f.results->sums.counts->samples, 1500);
}

/* ---- energies ---- */

TEST(an_energy_at_an_edge_belongs_to_the_bin_above_it)
{
    for (int i = 1; i < MILL_ENERGIES_BINS; i++) {
        /* in millijoules the edges are exact */
        const double edge = ldexp(1 + (i - 1) % 16 / 16.0, MILL_ENERGIES_LOWEST + (i - 1) / 16);
        ck_assert(fabs(mill_energies_edge(i) - 1e-3 * edge) <= 1e-15 * edge);
        ck_assert_uint_eq(mill_energies_bin(edge), (size_t)i);
        ck_assert_uint_eq(mill_energies_bin(nextafter(edge, 0)), (size_t)i - 1);
    }
    ck_assert_uint_eq(mill_energies_bin(-1), 0);
    ck_assert_uint_eq(mill_energies_bin(0), 0);
    ck_assert_uint_eq(mill_energies_bin(NAN), 0);
    ck_assert_uint_eq(mill_energies_bin(INFINITY), MILL_ENERGIES_BINS - 1);
}

TEST(an_impact_counts_by_normal_total_and_dissipated_energy)
{
    const double mass = 0.0005; /* and tangential speeds are twice the normal ones */
    fixture_create(&f);
    fixture_play(&f, impact_of(0.4, MILL_BALL_BLADE, 1, 2, 3.0, 0.5)); /* before the window */
    fixture_play(&f, impact_of(0.6, MILL_BALL_BALL, 1, 2, 3.0, 0.5));
    fixture_play(&f, impact_of(0.7, MILL_BALL_BLADE, 1, 2, 2.0, -0.25));
    fixture_finish(&f, 1.5);
    const struct mill_energies_pair *balls = &f.results->sums.pair[0], *blade = balls + 4;
    ck_assert_uint_eq(f.tally->plan.energies.pairs, MILL_KINDS);
    ck_assert_uint_eq(balls->normal[mill_energies_bin(1e3 * 0.25 * mass * 9)].count, 1);
    ck_assert_uint_eq(balls->total[mill_energies_bin(1e3 * 0.25 * mass * 45)], 1);
    ck_assert_uint_eq(balls->dissipated[mill_energies_bin(1e3 * 0.5)], 1);
    const size_t bin = mill_energies_bin(1e3 * 0.5 * mass * 4);
    ck_assert_uint_eq(blade->normal[bin].count, 1);
    ck_assert(blade->normal[bin].dissipation == -0.25);
    ck_assert_uint_eq(blade->dissipated[0], 1);
}

/* 120 batches, so that there are 60 blocks of two; six of them are a revolution. 0: impacts of 1 mJ
 * come in bursts; 1: one in each batch, and losses that go with the work; 2: none */
LOOP_TEST(hard_impacts_have_the_error_of_blocks_and_per_joule_that_of_impacts_without_losses, 3)
{
    enum { BLOCKS = 60 };
    const double batch = 1.0 / 120;
    double hard[BLOCKS] = {0}, loss[BLOCKS] = {0}, lost = 0;
    uint64_t seed = 3, count = 0;
    fixture_create(&f);
    for (int k = 0; k < 2 * BLOCKS; k++) {
        const int many = _i == 0 ? 9 * (random_share(&seed) < 0.3) : _i == 1;
        const double each = _i == 0 ? 1e-3 * random_share(&seed) : 1e-3;
        for (int i = 0; i < many + 2; i++) { /* of 0.25 g v^2; a bit less than 1 mJ is not hard */
            const double v = i < many ? 2 : nextafter(2, 0), t = 0.5 + (k + 0.5) * batch;
            fixture_play(&f, impact_of(t, MILL_BALL_BLADE, i, 0, v, 0.75 * each));
            fixture_play(&f, impact_of(t, MILL_BALL_BALL, i, i + 1, v, 0.25 * each));
            loss[k / 2] += each / (2 * batch);
            lost += each;
        }
        hard[k / 2] += many / (2 * batch);
        count += (uint64_t)many;
        fixture_work(&f, 0.05 * batch);
    }
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(f.tally->blocks.length, 2);
    const struct mill_spread_mean own =
        mill_spread_mean(hard, (struct mill_spread_of){1, BLOCKS, 6});
    const struct mill_spread_mean rate = f.results->hard, per = f.results->hard_per_joule;
    ck_assert(fabs(rate.value - (double)count) < 1e-9);
    ck_assert(fabs(per.value - (double)count / 0.05) < 1e-7);
    for (int k = 0; k < BLOCKS; k++)
        hard[k] -= (double)count / lost * loss[k];
    const struct mill_spread_mean rest =
        mill_spread_mean(hard, (struct mill_spread_of){1, BLOCKS, 6});
    if (_i == 0) {
        ck_assert(own.error > 1.2 * sqrt((double)count) && rest.error < 0.9 * own.error);
        ck_assert_double_eq_tol(rate.error / own.error, 1, 1e-9);
        ck_assert_double_eq_tol(per.error * 0.05 / rest.error, 1, 1e-9);
    } else if (_i == 1) { /* no scatter: as independent impacts */
        ck_assert_double_eq_tol(rate.error, sqrt(120), 1e-9);
        ck_assert_double_eq_tol(per.error, sqrt(120) / 0.05, 1e-7);
    }
    ck_assert(_i < 2 || (isnan(rate.error) && isnan(per.error) && rate.freedom + per.freedom == 0));
    ck_assert(_i == 2 || rate.freedom == own.freedom);
    ck_assert(_i != 0 || fabs(per.freedom / rest.freedom - 1) < 1e-9);
}

/* 3 impacts of 0.25 mJ lose 0.3 J, 8 of 1 mJ 0.4 J, 4 of 4 mJ 0.3 J */
TEST(without_a_threshold_those_impacts_are_hard_that_lose_half_of_the_energy)
{
    static const int many[3] = {3, 8, 4};
    f.asked.hard = NAN;
    fixture_create(&f);
    for (int group = 0; group < 3; group++)
        for (int i = 0; i < many[group]; i++)
            fixture_play(&f,
                         impact_of(0.6 + 0.1 * group + 1e-3 * i, MILL_BALL_BLADE, i, 0,
                                   1.0001 * pow(2, group), (group == 1 ? 0.4 : 0.3) / many[group]));
    fixture_work(&f, 1);
    fixture_finish(&f, 1.5);
    /* in the middle of the logarithms of the bin of 1 mJ: half of its impacts are above */
    ck_assert_double_eq_tol(f.results->is_hard.energy, 1e-3 * sqrt(17.0 / 16), 1e-12);
    ck_assert_double_eq_tol(f.results->hard.value, 4 + 8 / 2, 1e-9);
    ck_assert_double_eq_tol(f.results->hard_per_joule.value, 8, 1e-9);
}

TEST(without_losses_nothing_is_hard_unless_an_energy_is_given)
{
    f.asked.hard = NAN;
    fixture_create(&f);
    fixture_play(&f, impact_of(0.6, MILL_BALL_BLADE, 0, 0, 2, 0));
    fixture_finish(&f, 1.5);
    ck_assert(isnan(f.results->is_hard.energy) && f.results->hard.value == 0);
}

/* ---- save and load ---- */

enum { TRACE = 20000 };

static void play_trace(int from, int to)
{
    for (int i = from; i < to; i++) {
        uint64_t seed = (uint64_t)i;
        const double time = 0.4999 + i * 2e-6;
        struct mill_impact impact =
            impact_of(time, (enum mill_kind)(i % MILL_KINDS), (int)(4 * random_share(&seed)),
                      4 + (int)(4 * random_share(&seed)), pow(10, -6 + 7 * random_share(&seed)),
                      random_share(&seed));
        impact.position =
            vec3_make(0.1 * random_share(&seed) - 0.05, 0.1 * random_share(&seed) - 0.05, 0.03);
        fixture_work(&f, random_share(&seed));
        f.ball[i % FIXTURE_BALLS].v.y = random_share(&seed);
        fixture_play(&f, impact);
    }
}

static void save(struct mill_tally *tally, struct kept *kept)
{
    kept_init(kept);
    mill_tally_type.state(&tally->observer, &kept->state);
}

static enum mill_status load(struct mill_tally *tally, struct kept *kept)
{
    struct mill_state *state = kept_load(kept);
    mill_tally_type.state(&tally->observer, state);
    return state->status;
}

static void create_trace(void)
{
    fixture_init(&f);
    f.asked.end = 0.54;
    fixture_speed(&f, 2 * PI * 250);
    fixture_create(&f);
}

/* The tally at the end, and what is known of it; `cut` < TRACE: saved there and loaded into a new
 * one. */
static struct mill_precision_known play_all(int cut, struct kept *end)
{
    create_trace();
    play_trace(0, cut);
    if (cut < TRACE) {
        struct kept kept;
        const struct mill_account account = f.world.account; /* the books go on as they are */
        struct mill_ball ball[FIXTURE_BALLS];
        memcpy(ball, f.ball, sizeof ball);
        save(f.tally, &kept);
        fixture_free(&f);
        create_trace();
        f.world.account = account;
        memcpy(f.ball, ball, sizeof ball);
        ck_assert_int_eq(load(f.tally, &kept), MILL_OK);
        kept_free(&kept);
    }
    play_trace(cut, TRACE);
    fixture_finish(&f, 0.54);
    save(f.tally, end);
    const struct mill_precision_known known = f.results->at.known;
    fixture_free(&f);
    return known;
}

TEST(an_interrupted_tally_ends_with_the_same_bits)
{
    const int cuts[] = {0, 10, 1000, 10001, TRACE - 1};
    struct kept straight, resumed;
    const struct mill_precision_known known = play_all(TRACE, &straight);
    ck_assert(known.drive.error > 0 && known.median.error > 0);
    for (size_t i = 0; i < sizeof cuts / sizeof *cuts; i++) {
        const struct mill_precision_known again = play_all(cuts[i], &resumed);
        ck_assert(kept_alike(&straight, &resumed));
        ck_assert(memcmp(&again.drive, &known.drive, sizeof known.drive) == 0);
        ck_assert(memcmp(&again.median, &known.median, sizeof known.median) == 0);
        ck_assert(memcmp(again.loss, known.loss, sizeof known.loss) == 0);
        kept_free(&resumed);
    }
    kept_free(&straight);
}

/* A checkpoint writes the results so far, and the run goes on. */
TEST(results_asked_for_meanwhile_leave_the_tally_as_it_is)
{
    const int cuts[] = {0, 10, 1000, 10001, TRACE - 1, TRACE};
    create_trace();
    for (size_t i = 1; i < sizeof cuts / sizeof *cuts; i++) {
        struct mill_tally_results *results;
        struct kept before, after;
        play_trace(cuts[i - 1], cuts[i]);
        save(f.tally, &before);
        ck_assert_int_eq(mill_tally_results_make(f.tally, &f.world, 0.5, &results, NULL), MILL_OK);
        ck_assert(i == 1 ||
                  mill_spectrum_total(&results->sums.impacts[results->all].normal, 0).count > 0);
        mill_tally_results_free(results);
        save(f.tally, &after);
        ck_assert(kept_alike(&before, &after));
        kept_free(&before);
        kept_free(&after);
    }
}

TEST(a_state_of_another_drum_is_refused)
{
    struct kept kept;
    fixture_create(&f);
    save(f.tally, &kept);
    fixture_free(&f);
    f.world.drum_length = 0.24;
    fixture_create(&f);
    ck_assert_int_eq(load(f.tally, &kept), MILL_FAILED);
    kept_free(&kept);
}

/* Numbers that would lead out of the tally's arrays */
static void damage(struct kept *kept, int how)
{
    switch (how) {
    case 0:
        ((struct mill_strike *)kept_find(kept, "pairs")->value)[3].normal = MILL_SPECTRUM_SLOTS;
        break;
    case 1:
        ((struct mill_strike *)kept_find(kept, "pairs")->value)[3].tangential = -1;
        break;
    case 2:
        ((struct mill_precision_progress *)kept_find(kept, "batches")->value)->batches =
            MILL_PRECISION_BATCHES;
        break;
    case 3:
        *(double *)kept_find(kept, "pair_bits")->value = 41;
        break;
    case 4:
        ((struct mill_tally_progress *)kept_find(kept, "progress")->value)->portions =
            MILL_TALLY_PORTIONS;
        break;
    case 5:
        ((struct mill_tally_progress *)kept_find(kept, "progress")->value)->length = 0;
        break;
    case 6:
        ((struct mill_precision_progress *)kept_find(kept, "batches")->value)->batches =
            MILL_PRECISION_BATCHES;
        break;
    }
}
enum { DAMAGES = 7 };

LOOP_TEST(a_number_out_of_range_is_refused, DAMAGES)
{
    struct kept kept;
    f.asked.precision = 0.02;
    fixture_create(&f);
    save(f.tally, &kept);
    ck_assert_int_eq(load(f.tally, &kept), MILL_OK);
    damage(&kept, _i);
    ck_assert_int_eq(load(f.tally, &kept), MILL_FAILED);
    kept_free(&kept);
}

TEST(the_tally_takes_less_than_two_megabytes)
{
    struct kept kept;
    fixture_create(&f);
    save(f.tally, &kept);
    ck_assert_uint_lt(sizeof *f.tally + kept_size(&kept), 2000000);
    kept_free(&kept);
}

/* ---- the end of a run ---- */

TEST(a_number_of_collisions_ends_the_run_at_just_that_one)
{
    for (int from = 0; from < 2; from++) {
        fixture_init(&f);
        f.asked.sample_from = from * 1.0;
        f.asked.max_collisions = 500;
        fixture_create(&f);
        int played = 0;
        for (; f.last != MILL_ENDED && played < 1000; played++)
            fixture_play(&f, impact_of(0.001 * played, MILL_BALL_BALL, 1, 2, 1, 0.1));
        ck_assert_int_eq(played, 500);
        fixture_finish(&f, 0.499);
        ck_assert_uint_eq(impacts_of(&f, f.results->all), from == 0 ? 500 : 0);
        ck_assert_int_eq(f.tally->at.ended, MILL_TALLY_COLLISIONS);
        fixture_free(&f);
    }
}

int main(void)
{
    return unit_run_in("tally", setup, teardown);
}
