/* Claims about the statistics that the tally gathers. */
#include "mill_fixture.h"
#include "store/h5.h"

#include <stdio.h>
#include <unistd.h>

static struct fixture f;

static void setup(void)
{
    fixture_init(&f);
}

static void teardown(void)
{
    mill_tally_free(f.tally);
}

START_TEST(only_impacts_within_the_window_are_counted)
{
    fixture_create(&f);
    fixture_play(&f, blow(0.499, MILL_BALL_BALL, 1, 2, 1, 0.1));
    fixture_play(&f, blow(0.5, MILL_BALL_BALL, 1, 2, 1, 0.2));
    fixture_play(&f, blow(1.4, MILL_BALL_BALL, 1, 2, 1, 0.4));
    fixture_wait(&f, 1.5);
    fixture_play(&f, blow(1.5, MILL_BALL_BALL, 1, 2, 1, 0.8));
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(impacts_of(&f, MILL_BALL_BALL), 2);
    ck_assert_double_eq_tol(mill_spectrum_dissipation(&f.tally->impacts[MILL_BALL_BALL].normal, 0),
                            0.6, 1e-15);
    ck_assert_double_eq_tol(mill_tally_per_second(f.tally, 2), 2, 1e-15);
}
END_TEST

START_TEST(a_window_from_zero_on_counts_impacts_at_time_zero)
{
    f.deck.sample_from = 0;
    fixture_create(&f);
    fixture_play(&f, blow(0, MILL_BALL_BALL, 1, 2, 1, 0.1));
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(impacts_of(&f, MILL_BALL_BALL), 1);
    ck_assert(f.tally->at.duration == 1.5);
}
END_TEST

START_TEST(the_row_of_all_is_the_sum_of_the_kinds)
{
    fixture_create(&f);
    for (int kind = 0; kind < MILL_KINDS; kind++)
        for (int i = 0; i <= kind; i++)
            fixture_play(&f, blow(0.6 + kind * 0.1, (enum mill_kind)kind, i, 7, 0.1 + i, 0.5));
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(impacts_of(&f, MILL_TALLY_ALL), 15);
    ck_assert_uint_eq(strikes_of(&f, MILL_TALLY_ALL), 15);
    ck_assert(mill_spectrum_dissipation(&f.tally->impacts[MILL_TALLY_ALL].normal, 0) == 7.5);
}
END_TEST

START_TEST(a_kind_without_impacts_has_rate_zero_and_no_median)
{
    fixture_create(&f);
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(impacts_of(&f, MILL_BALL_SHAFT), 0);
    ck_assert_double_nan(
        mill_spectrum_quantile(&f.tally->grid, &f.tally->impacts[MILL_BALL_SHAFT].normal, 0, 0.5));
    ck_assert_double_nan(mill_tally_floor_share(f.tally, MILL_BALL_SHAFT));
}
END_TEST

START_TEST(a_recontact_gives_its_dissipation_to_the_first_contact)
{
    struct mill_spectrum tangential;
    fixture_create(&f);
    fixture_play(&f, blow(0.6, MILL_BALL_BALL, 1, 2, 3.0, 0.5));
    fixture_play(&f, blow(0.6 + 8e-6, MILL_BALL_BALL, 1, 2, 0.01, 0.25));
    fixture_play(&f, blow(0.6 + 16e-6, MILL_BALL_BALL, 1, 2, 0.02, -0.125));
    fixture_play(&f, blow(0.6 + 30e-6, MILL_BALL_BALL, 1, 2, 0.04, 1));
    fixture_finish(&f, 1.5);
    const struct mill_speeds *strikes = &f.tally->strikes[MILL_BALL_BALL];
    const int first = mill_spectrum_find(&f.tally->grid, 3.0);
    ck_assert_uint_eq(impacts_of(&f, MILL_BALL_BALL), 4);
    ck_assert_uint_eq(strikes_of(&f, MILL_BALL_BALL), 2);
    ck_assert_uint_eq(strikes->normal.slot[first].count, 1);
    ck_assert(strikes->normal.slot[first].dissipation == 0.625);
    ck_assert(mill_spectrum_mean(&strikes->normal) == (3.0 + 0.04) / 2);
    mill_tally_tangential(strikes, &tangential);
    ck_assert(tangential.slot[mill_spectrum_find(&f.tally->grid, 6.0)].dissipation == 0.625);
}
END_TEST

START_TEST(a_strike_begun_before_the_window_is_not_counted_as_new)
{
    fixture_create(&f);
    fixture_play(&f, blow(0.5 - 4e-6, MILL_BALL_BALL, 1, 2, 3.0, 0.5));
    fixture_play(&f, blow(0.5 + 4e-6, MILL_BALL_BALL, 1, 2, 0.1, 0.25));
    fixture_play(&f, blow(0.5 + 12e-6, MILL_BALL_BALL, 1, 2, 0.1, 0.25));
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(impacts_of(&f, MILL_BALL_BALL), 2);
    ck_assert_uint_eq(strikes_of(&f, MILL_BALL_BALL), 0);
    ck_assert(mill_spectrum_dissipation(&f.tally->strikes[MILL_BALL_BALL].normal, 0) == 0);
}
END_TEST

START_TEST(without_a_strike_window_strikes_are_impacts)
{
    f.deck.strike_window = 0;
    fixture_create(&f);
    for (int i = 0; i < 100; i++)
        fixture_play(&f, blow(0.7, MILL_BALL_DRUM, i % 3, -1, 0.01 * i, 0.001 * i));
    fixture_finish(&f, 1.5);
    ck_assert_mem_eq(f.tally->strikes, f.tally->impacts, sizeof f.tally->impacts);
}
END_TEST

START_TEST(tangential_speeds_above_50_mm_per_s_are_chosen_by_the_normal_speed)
{
    fixture_create(&f);
    struct mill_impact slow = blow(0.6, MILL_BALL_WALL, 1, 0, 0.04, 0);
    struct mill_impact fast = blow(0.7, MILL_BALL_WALL, 1, 0, 0.06, 0);
    slow.tangential_speed = 5;
    fast.tangential_speed = 0.001;
    fixture_play(&f, slow);
    fixture_play(&f, fast);
    fixture_finish(&f, 1.5);
    const struct mill_spectrum *tangential = f.tally->impacts[MILL_BALL_WALL].tangential;
    const double v = mill_spectrum_quantile(&f.tally->grid, &tangential[1], 0, 0.5);
    ck_assert_double_eq_tol(v / 0.001, 1, 0.02);
    ck_assert_uint_eq(mill_spectrum_count(&tangential[0], 0), 1);
}
END_TEST

START_TEST(the_floor_share_is_that_of_the_window)
{
    fixture_create(&f);
    f.world.account.collisions[MILL_BALL_DRUM] = 1000;
    f.world.account.floored[MILL_BALL_DRUM] = 900;
    fixture_wait(&f, 0.6);
    f.world.account.collisions[MILL_BALL_DRUM] += 10;
    f.world.account.floored[MILL_BALL_DRUM] += 3;
    f.world.account.collisions[MILL_BALL_BALL] += 10;
    fixture_finish(&f, 1.5);
    ck_assert_double_eq_tol(mill_tally_floor_share(f.tally, MILL_BALL_DRUM), 0.3, 1e-15);
    ck_assert_double_eq_tol(mill_tally_floor_share(f.tally, MILL_BALL_BALL), 0, 1e-15);
    ck_assert_double_eq_tol(mill_tally_floor_share(f.tally, MILL_TALLY_ALL), 0.15, 1e-15);
}
END_TEST

/* Work in steps of 1/100 revolution, each at the middle of its step; the rotor draws `even` watts
 * in the first, third, ... revolution and `odd` in the others, the torque goes 4, 2, 4, ... */
static void turn(double from, double to, double even, double odd)
{
    const double step = 0.001;
    const int n = (int)lround((to - from) / step);
    for (int i = 0; i < n; i++) {
        const double time = from + (i + 0.5) * step;
        const bool second = ((int)floor((time - f.deck.sample_from) * 10) & 1) != 0;
        fixture_wait(&f, time);
        f.world.account.rotor_work += (second ? odd : even) * step;
        f.world.account.rotor_impulse += (second ? 2 : 4) * step;
    }
}

START_TEST(power_and_torque_have_the_standard_error_of_their_revolutions)
{
    fixture_create(&f);
    turn(0, 1.5, 100, 300);
    fixture_finish(&f, 1.5);
    const struct mill_rotorstat *stat = &f.tally->rotor;
    ck_assert_uint_eq(stat->blocks, 10);
    ck_assert_double_eq_tol(mill_tally_power(f.tally), 200, 1e-9);
    ck_assert_double_eq_tol(mill_tally_torque(f.tally), 3, 1e-9);
    for (int i = 0; i < 10; i++)
        ck_assert_double_eq_tol(stat->power[i], (i % 2 ? 300 : 100), 1e-6);
    /* sd of five 100 and five 300 with n - 1: sqrt(10/9) * 100 */
    ck_assert_double_eq_tol(mill_rotorstat_error(stat->power, 10), 100 / 3.0, 1e-6);
    ck_assert_double_eq_tol(mill_rotorstat_error(stat->torque, 10), 1 / 3.0, 1e-6);
}
END_TEST

START_TEST(with_fewer_than_two_revolutions_there_is_no_standard_error)
{
    f.deck.time = 0.69; /* 1.9 revolutions */
    fixture_create(&f);
    turn(0, 0.69, 100, 100);
    fixture_finish(&f, 0.69);
    ck_assert_uint_eq(f.tally->rotor.blocks, 1);
    ck_assert_double_eq_tol(mill_tally_power(f.tally), 100, 1e-9);
    ck_assert_double_nan(mill_rotorstat_error(f.tally->rotor.power, f.tally->rotor.blocks));
}
END_TEST

START_TEST(a_rotor_that_turns_the_other_way_has_revolutions_too)
{
    f.world.rotor_speed = -f.world.rotor_speed;
    fixture_create(&f);
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(f.tally->rotor.blocks, 10);
}
END_TEST

START_TEST(a_mill_without_a_rotor_has_no_revolutions_and_no_power)
{
    f.world.rotor_speed = 0;
    fixture_create(&f);
    fixture_finish(&f, 1.5);
    ck_assert_uint_eq(f.tally->rotor.blocks, 0);
    ck_assert(mill_tally_power(f.tally) == 0);
}
END_TEST

START_TEST(a_window_of_whole_revolutions_loses_none_to_rounding)
{
    f.world.balls = 1; /* the snapshots are not looked at */
    for (int revolutions = 1; revolutions < 200; revolutions++) {
        f.deck.sample_from = 0.1 * revolutions;
        f.world.rotor_speed = f.deck.rotor_speed = 1 + 0.37 * revolutions;
        f.deck.time = f.deck.sample_from + revolutions * 2 * PI / f.deck.rotor_speed;
        fixture_create(&f);
        fixture_finish(&f, f.deck.time);
        ck_assert_uint_eq(f.tally->rotor.blocks, (size_t)revolutions);
        mill_tally_free(f.tally);
    }
    f.tally = NULL;
}
END_TEST

START_TEST(very_many_revolutions_are_taken_together)
{
    struct mill_rotorstat stat;
    ck_assert(mill_rotorstat_init(&stat, 2 * PI, 1e6));
    ck_assert(stat.revolutions == 16);
    ck_assert_uint_eq(stat.planned, 62500);
    mill_rotorstat_free(&stat);
}
END_TEST

START_TEST(a_run_that_ends_early_is_averaged_over_what_it_reached)
{
    fixture_create(&f);
    fixture_play(&f, blow(0.6, MILL_BALL_BALL, 1, 2, 1, 0.1));
    fixture_play(&f, blow(0.7, MILL_BALL_BALL, 1, 2, 1, 0.1));
    f.world.base = 0.3; /* local times are counted from here */
    fixture_finish(&f, 0.75);
    ck_assert_double_eq_tol(f.tally->at.duration, 0.25, 1e-15);
    ck_assert_double_eq_tol(mill_tally_per_second(f.tally, 2), 8, 1e-12);
    ck_assert_uint_eq(f.tally->rotor.blocks, 2);
    ck_assert(isinf(mill_tally_observer(f.tally)->next));
}
END_TEST

START_TEST(a_run_stopped_before_the_window_has_empty_statistics)
{
    char path[64];
    struct mill_h5 *file;
    fixture_create(&f);
    fixture_play(&f, blow(0.2, MILL_BALL_BALL, 1, 2, 1, 0.1));
    fixture_finish(&f, 0.3);
    ck_assert(f.tally->at.duration == 0);
    ck_assert_uint_eq(impacts_of(&f, MILL_TALLY_ALL), 0);
    ck_assert(mill_tally_per_second(f.tally, 0) == 0);
    ck_assert_double_nan(mill_tally_power(f.tally));
    ck_assert_double_nan(mill_tally_floor_share(f.tally, MILL_BALL_BALL));
    snprintf(path, sizeof path, "/tmp/millsim_tally_%ld.h5", (long)getpid());
    ck_assert_int_eq(mill_h5_create(path, MILL_H5_OVERWRITE, &file, NULL), MILL_OK);
    mill_tally_write(f.tally, file);
    mill_tally_write(f.tally, file); /* replaces the first */
    ck_assert(mill_h5_exists(file, "/statistics/strikes/all/tangential_speed/histogram/edges"));
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
    unlink(path);
}
END_TEST

START_TEST(a_short_window_gets_100_snapshots_a_long_one_1000_a_second)
{
    f.deck.time = 0.51;
    fixture_create(&f);
    fixture_finish(&f, 0.51);
    ck_assert_uint_eq(f.tally->maps->samples, 100);
    mill_tally_free(f.tally);
    f.deck.time = 2;
    fixture_create(&f);
    fixture_finish(&f, 2);
    ck_assert_uint_eq(f.tally->maps->samples, 1500);
}
END_TEST

/* ---- save and load ---- */

enum { TRACE = 20000 };

static void play_trace(int from, int to)
{
    for (int i = from; i < to; i++) {
        uint64_t seed = (uint64_t)i;
        const double time = 0.4999 + i * 2e-6;
        struct mill_impact impact =
            blow(time, (enum mill_kind)(i % MILL_KINDS), (int)(4 * random_share(&seed)),
                 4 + (int)(4 * random_share(&seed)), pow(10, -6 + 7 * random_share(&seed)),
                 random_share(&seed));
        impact.position =
            vec3_make(0.1 * random_share(&seed) - 0.05, 0.1 * random_share(&seed) - 0.05, 0.03);
        f.world.account.rotor_work += random_share(&seed);
        f.ball[i % FIXTURE_BALLS].v.y = random_share(&seed);
        fixture_play(&f, impact);
    }
}

static unsigned char *state_of(struct mill_tally *tally, size_t *size)
{
    struct mill_part part[MILL_TALLY_PARTS];
    size_t values;
    const size_t parts = mill_tally_parts(tally, part, &values);
    ck_assert_uint_le(parts, MILL_TALLY_PARTS);
    *size = mill_parts_size(part, parts);
    unsigned char *state = malloc(*size);
    mill_parts_pack(part, parts, state);
    return state;
}

static enum mill_status load(struct mill_tally *tally, const unsigned char *state, size_t size,
                             struct mill_error *error)
{
    struct mill_source_memory memory = mill_parts_from(state, size);
    return mill_tally_load(tally, &memory.source, error);
}

/* The results as bytes; `cut` < TRACE: saved there and loaded into a new tally. */
static unsigned char *result_of(int cut, size_t *size)
{
    fixture_init(&f);
    f.deck.time = 0.54;
    f.deck.rotor_speed = f.world.rotor_speed = 2 * PI * 200;
    fixture_create(&f);
    play_trace(0, cut);
    if (cut < TRACE) {
        unsigned char *state = state_of(f.tally, size);
        struct fixture again = f; /* the books go on as they are */
        mill_tally_free(f.tally);
        struct fixture fresh;
        fixture_init(&fresh);
        fresh.deck = again.deck;
        fresh.world.rotor_speed = again.world.rotor_speed;
        fixture_create(&fresh);
        f.tally = fresh.tally;
        ck_assert_int_eq(load(f.tally, state, *size, NULL), MILL_OK);
        free(state);
    }
    play_trace(cut, TRACE);
    fixture_finish(&f, 0.54);
    unsigned char *result = state_of(f.tally, size);
    mill_tally_free(f.tally);
    f.tally = NULL;
    return result;
}

START_TEST(an_interrupted_tally_ends_with_the_same_bits)
{
    const int cuts[] = {0, 10, 1000, 10001, TRACE - 1};
    size_t size, other;
    unsigned char *straight = result_of(TRACE, &size);
    for (size_t i = 0; i < sizeof cuts / sizeof *cuts; i++) {
        unsigned char *resumed = result_of(cuts[i], &other);
        ck_assert_uint_eq(size, other);
        ck_assert(memcmp(straight, resumed, size) == 0);
        free(resumed);
    }
    free(straight);
}
END_TEST

/* A checkpoint writes the results so far, and the run goes on. */
START_TEST(a_tally_finished_and_taken_back_ends_with_the_same_bits)
{
    size_t size, other, values;
    unsigned char *straight = result_of(TRACE, &size);
    fixture_init(&f);
    f.deck.time = 0.54;
    f.deck.rotor_speed = f.world.rotor_speed = 2 * PI * 200;
    fixture_create(&f);
    const int cuts[] = {0, 10, 1000, 10001, TRACE - 1, TRACE};
    for (size_t i = 1; i < sizeof cuts / sizeof *cuts; i++) {
        struct mill_part part[MILL_TALLY_PARTS];
        play_trace(cuts[i - 1], cuts[i]);
        mill_tally_parts(f.tally, part, &values);
        unsigned char *before = malloc(mill_parts_size(part, values));
        mill_parts_pack(part, values, before);
        unsigned char *state = state_of(f.tally, &size);
        mill_tally_finish(f.tally, &f.world, 1e-5 * (double)i);
        unsigned char *finished = state_of(f.tally, &other);
        ck_assert(memcmp(finished, state, size) != 0);
        mill_tally_rewind(f.tally, before);
        unsigned char *again = state_of(f.tally, &other);
        ck_assert_uint_eq(size, other);
        ck_assert(memcmp(again, state, size) == 0);
        ck_assert(f.tally->observer.next == f.tally->at.next);
        free(before);
        free(state);
        free(finished);
        free(again);
    }
    fixture_finish(&f, 0.54);
    unsigned char *result = state_of(f.tally, &other);
    ck_assert(memcmp(result, straight, size) == 0);
    free(result);
    free(straight);
}
END_TEST

START_TEST(a_state_cut_short_or_of_another_deck_is_refused)
{
    struct mill_error error;
    fixture_create(&f);
    size_t size;
    unsigned char *state = state_of(f.tally, &size);
    ck_assert_int_eq(load(f.tally, state, size - 1, &error), MILL_FAILED);
    ck_assert_int_eq(load(f.tally, state, 8, &error), MILL_FAILED);
    mill_tally_free(f.tally);
    f.world.drum_length = 0.24;
    fixture_create(&f);
    ck_assert_int_eq(load(f.tally, state, size, &error), MILL_FAILED);
    ck_assert_ptr_nonnull(strstr(error.text, "another deck"));
    free(state);
}
END_TEST

START_TEST(the_tally_takes_less_than_two_megabytes)
{
    fixture_create(&f);
    size_t size;
    free(state_of(f.tally, &size));
    ck_assert_uint_lt(sizeof *f.tally + size, 2000000);
}
END_TEST

static Suite *make_suite(void)
{
    Suite *suite = suite_create("tally");
    TCase *tests = tcase_create("tally");
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, only_impacts_within_the_window_are_counted);
    tcase_add_test(tests, a_window_from_zero_on_counts_impacts_at_time_zero);
    tcase_add_test(tests, the_row_of_all_is_the_sum_of_the_kinds);
    tcase_add_test(tests, a_kind_without_impacts_has_rate_zero_and_no_median);
    tcase_add_test(tests, a_recontact_gives_its_dissipation_to_the_first_contact);
    tcase_add_test(tests, a_strike_begun_before_the_window_is_not_counted_as_new);
    tcase_add_test(tests, without_a_strike_window_strikes_are_impacts);
    tcase_add_test(tests, tangential_speeds_above_50_mm_per_s_are_chosen_by_the_normal_speed);
    tcase_add_test(tests, the_floor_share_is_that_of_the_window);
    tcase_add_test(tests, power_and_torque_have_the_standard_error_of_their_revolutions);
    tcase_add_test(tests, with_fewer_than_two_revolutions_there_is_no_standard_error);
    tcase_add_test(tests, a_rotor_that_turns_the_other_way_has_revolutions_too);
    tcase_add_test(tests, a_mill_without_a_rotor_has_no_revolutions_and_no_power);
    tcase_add_test(tests, a_window_of_whole_revolutions_loses_none_to_rounding);
    tcase_add_test(tests, very_many_revolutions_are_taken_together);
    tcase_add_test(tests, a_run_that_ends_early_is_averaged_over_what_it_reached);
    tcase_add_test(tests, a_run_stopped_before_the_window_has_empty_statistics);
    tcase_add_test(tests, a_short_window_gets_100_snapshots_a_long_one_1000_a_second);
    tcase_add_test(tests, an_interrupted_tally_ends_with_the_same_bits);
    tcase_add_test(tests, a_tally_finished_and_taken_back_ends_with_the_same_bits);
    tcase_add_test(tests, a_state_cut_short_or_of_another_deck_is_refused);
    tcase_add_test(tests, the_tally_takes_less_than_two_megabytes);
    suite_add_tcase(suite, tests);
    return suite;
}

int main(void)
{
    SRunner *runner = srunner_create(make_suite());
    srunner_run_all(runner, CK_NORMAL);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
