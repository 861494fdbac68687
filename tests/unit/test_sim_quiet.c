/* Claims about the loop where contacts pile up or nothing happens at all: bouncing to rest, heaps,
 * rows of touching balls, pinched balls, still mills. */
#include "sim_mills.h"

#define ONE_BALL                                                                                   \
    "[balls]\ncount = 1\ndiameter = 10 mm\ndensity = 7800 kg/m^3\nstart = start.txt\n"             \
    "[drum]\nradius = 100 mm\nlength = 100 mm\n"

/* A ball that falls 45 mm to the bottom of the drum */
static const char *const dropped = "0 0 -0.05\n";
static const double height = 0.045, gravity = 9.81;

START_TEST(a_ball_bounces_as_the_textbook_says_and_without_the_floor_ends_with_a_message)
{
    struct bench b;
    struct witness w;
    bench_open(
        &b, "[run]\ntime = 10 s\n" ONE_BALL "[contact]\nrestitution = 0.5\nrebound_floor = 0 m/s\n",
        dropped);
    witness_join(&w, &b, INFINITY);
    const double v0 = sqrt(2.0 * gravity * height), t0 = sqrt(2.0 * height / gravity);
    ck_assert_int_eq(mill_sim_run(b.sim, 10.0, NO_LIMIT, NULL, &b.error), MILL_FAILED);
    ck_assert_ptr_nonnull(strstr(b.error.text, "at t = 0.2873"));
    ck_assert_ptr_nonnull(strstr(b.error.text, "contact.rebound_floor"));
    double t = t0, v = v0;
    for (int n = 0; n < 20; n++) {
        ck_assert_double_eq_tol(w.speed[n], v, 1e-13);
        ck_assert_double_eq_tol(w.time[n], t, 1e-14);
        v *= 0.5;
        t += 2.0 * v / gravity;
    }
    ck_assert_double_eq_tol(mill_sim_time(b.sim), t0 * (1.0 + 0.5) / (1.0 - 0.5), 1e-9);
    ck_assert_double_le(bench_balance(&b), 1e-14);
    witness_is_content(&w);
    bench_close(&b);
}
END_TEST

START_TEST(with_the_rebound_floor_a_ball_hops_on_for_ever)
{
    struct bench b;
    struct witness w;
    bench_open(&b, "[run]\ntime = 10 s\n" ONE_BALL "[contact]\nrestitution = 0.5\n", dropped);
    witness_join(&w, &b, INFINITY);
    bench_run(&b, 10.0);
    ck_assert_double_eq_tol(w.speed[20], 5e-3, 1e-12);
    /* one hop takes 2 x 5 mm/s / g */
    ck_assert_double_eq_tol((double)bench_collisions(&b), (10.0 - 0.287) * gravity / 0.01, 20.0);
    ck_assert_uint_eq(b.world->account.floored[MILL_BALL_DRUM], bench_collisions(&b) - 7);
    ck_assert_double_le(bench_balance(&b), 1e-12);
    ck_assert_double_lt(b.world->counts.largest_overlap, 1e-15);
    witness_is_content(&w);
    bench_close(&b);
}
END_TEST

START_TEST(a_perfectly_inelastic_ball_without_the_floor_ends_with_a_message)
{
    struct bench b;
    bench_open(
        &b, "[run]\ntime = 10 s\n" ONE_BALL "[contact]\nrestitution = 0\nrebound_floor = 0 m/s\n",
        dropped);
    ck_assert_int_eq(mill_sim_run(b.sim, 10.0, NO_LIMIT, NULL, &b.error), MILL_FAILED);
    ck_assert_ptr_nonnull(strstr(b.error.text, "contact.rebound_floor"));
    bench_close(&b);
}
END_TEST

START_TEST(a_heap_of_inelastic_balls_comes_to_rest_and_the_run_ends)
{
    struct bench b;
    struct witness w;
    bench_open(&b,
               "[run]\ntime = 1 s\n[balls]\ncount = 60\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
               "[drum]\nradius = 20 mm\nlength = 25 mm\n[contact]\nrestitution = 0.3\n"
               "friction = 0.5\ntangential_restitution = 0.2\n",
               NULL);
    witness_join(&w, &b, INFINITY);
    bench_run(&b, 0.4);
    const double per_ball = mill_world_energy(b.world, mill_sim_local_time(b.sim)).kinetic / 60.0;
    ck_assert_double_lt(per_ball, 0.5 * b.world->species[0].mass * 1e-3); /* < 3 cm/s */
    ck_assert_double_le(bench_overlap(&b), 1e-9);
    ck_assert_double_le(b.world->counts.largest_overlap, 1e-9);
    ck_assert_uint_eq(b.world->counts.overlaps, 0);
    ck_assert_double_le(bench_balance(&b), 1e-11);
    witness_is_content(&w);
    bench_close(&b);
}
END_TEST

START_TEST(a_blow_runs_through_a_row_of_touching_balls_to_the_last)
{
    struct bench b;
    bench_open(&b,
               "[run]\ntime = 1 s\n[gravity]\nacceleration = 0 0 0 m/s^2\n[balls]\ncount = 6\n"
               "diameter = 10 mm\ndensity = 7800 kg/m^3\nstart = start.txt\n[drum]\n"
               "radius = 100 mm\nlength = 200 mm\n[contact]\nrestitution = 1\n"
               "rebound_floor = 0 m/s\n",
               "-0.03 0 0  1 0 0\n0 0 0\n0.01 0 0\n0.02 0 0\n0.03 0 0\n0.04 0 0\n");
    bench_run(&b, 0.03);
    ck_assert_uint_eq(bench_collisions(&b), 5);
    for (int32_t i = 0; i < 6; i++) {
        ck_assert_double_eq_tol(bench_velocity(&b, i).x, i == 5 ? 1.0 : 0.0, 1e-15);
        ck_assert_double_eq(bench_velocity(&b, i).y, 0.0);
    }
    ck_assert_double_eq_tol(bench_position(&b, 5).x, 0.05, 1e-15);
    bench_close(&b);
}
END_TEST

START_TEST(an_inelastic_row_against_a_wall_resolves_too)
{
    struct bench b;
    bench_open(&b,
               "[run]\ntime = 1 s\n[gravity]\nacceleration = 0 0 0 m/s^2\n[balls]\ncount = 6\n"
               "diameter = 10 mm\ndensity = 7800 kg/m^3\nstart = start.txt\n[drum]\n"
               "radius = 100 mm\nlength = 200 mm\n[contact]\nrestitution = 0.1\n",
               "0 0 0  5 0 0\n0.055 0 0\n0.065 0 0\n0.075 0 0\n0.085 0 0\n0.095 0 0\n");
    bench_run(&b, 1.0);
    ck_assert_double_le(b.world->counts.largest_overlap, 1e-12);
    ck_assert_double_le(bench_overlap(&b), 1e-12);
    ck_assert_double_le(bench_balance(&b), 1e-12);
    ck_assert_double_lt(mill_world_energy(b.world, 0.0).kinetic, 0.1 * b.world->start.kinetic);
    bench_close(&b);
}
END_TEST

START_TEST(a_mill_in_which_nothing_moves_is_done_at_once)
{
    struct bench b;
    struct witness w;
    bench_open(&b,
               "[run]\ntime = 100 s\n[gravity]\nacceleration = 0 0 0 m/s^2\n[balls]\ncount = 5\n"
               "diameter = 10 mm\ndensity = 7800 kg/m^3\nstart = start.txt\n[drum]\n"
               "radius = 100 mm\nlength = 200 mm\n[rotor]\nspeed = 0 rpm\nshaft_radius = 10 mm\n"
               "[blade.a]\nposition = 0 mm\nangle = 0 deg\ntip_radius = 80 mm\nwidth = 20 mm\n"
               "thickness = 6 mm\n[contact]\nrestitution = 0.5\n",
               /* free, touching each other, the drum, and the blade */
               "0 0 0.05\n0.01 0 0.05\n0 0 -0.095\n0 0.05 0.008\n0.095 0 0.04\n");
    witness_join(&w, &b, 0.5);
    bench_run(&b, 100.0);
    ck_assert_double_eq(mill_sim_time(b.sim), 100.0);
    ck_assert_uint_eq(bench_collisions(&b), 0);
    ck_assert_uint_eq(w.samples, 200);
    for (int32_t i = 0; i < 5; i++)
        ck_assert_double_eq(vec3_norm(bench_velocity(&b, i)), 0.0);
    bench_close(&b);
}
END_TEST

START_TEST(pinched_balls_are_let_go_counted_and_never_lost)
{
    struct bench b;
    struct witness w;
    bench_open(&b, pinching[_i], NULL);
    witness_join(&w, &b, INFINITY);
    bench_run(&b, 0.5);
    ck_assert_uint_gt(b.world->counts.reliefs, 0);
    ck_assert_uint_lt(b.world->counts.reliefs, 1000);
    for (int32_t i = 0; i < b.world->balls; i++) /* drum, end walls and shaft always hold them */
        for (int k = 0; k < 4; k++)
            ck_assert_double_ge(
                b.world->shape[k]->ops->gap(b.world->shape[k], bench_position(&b, i), 0.0025, 0.0),
                -1e-9);
    ck_assert_double_le(b.world->counts.largest_overlap, 1e-9);
    ck_assert_double_le(bench_balance(&b), 1e-10);
    witness_is_content(&w);
    bench_close(&b);
}
END_TEST

START_TEST(only_a_tip_gap_below_a_diameter_is_warned_of)
{
    struct bench b;
    bench_open(&b, pinching[1], NULL);
    ck_assert_int_eq(bench_warnings, 1);
    bench_close(&b);
    bench_open(&b, "[run]\ntime = 10 s\n" ONE_BALL "[contact]\nrestitution = 0.5\n", dropped);
    ck_assert_int_eq(bench_warnings, 0);
    bench_close(&b);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("sim_quiet");
    TCase *tests = tcase_create("sim_quiet");
    tcase_set_timeout(tests, 60.0);
    tcase_add_test(tests,
                   a_ball_bounces_as_the_textbook_says_and_without_the_floor_ends_with_a_message);
    tcase_add_test(tests, with_the_rebound_floor_a_ball_hops_on_for_ever);
    tcase_add_test(tests, a_perfectly_inelastic_ball_without_the_floor_ends_with_a_message);
    tcase_add_test(tests, a_heap_of_inelastic_balls_comes_to_rest_and_the_run_ends);
    tcase_add_test(tests, a_blow_runs_through_a_row_of_touching_balls_to_the_last);
    tcase_add_test(tests, an_inelastic_row_against_a_wall_resolves_too);
    tcase_add_test(tests, a_mill_in_which_nothing_moves_is_done_at_once);
    tcase_add_loop_test(tests, pinched_balls_are_let_go_counted_and_never_lost, 0, PINCHING);
    tcase_add_test(tests, only_a_tip_gap_below_a_diameter_is_warned_of);
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
