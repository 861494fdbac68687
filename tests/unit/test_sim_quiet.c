/* Claims about the loop where contacts pile up or nothing happens at all: bouncing to rest, heaps,
 * rows of touching balls, pinched balls, still mills. */
#include "sim_fixture.h"

static const double height = 0.045, gravity = 9.81;

/* A ball that falls 45 mm to the bottom of the drum */
static void open_dropped(struct bench *b, double restitution, bool floorless)
{
    const struct mill_setup_ball start = {.position.z = -0.05};
    const struct model model = {
        .setup = {.gravity.z = -gravity, .drum = {.radius = 0.1, .length = 0.1}, .start = &start},
        .floorless = floorless,
        .balls = {{.diameter = 0.01, .density = STEEL, .count = 1}},
        .law = {.restitution = restitution}};
    bench_open(b, &model);
}

/* Balls of 10 mm in a drum without gravity */
static void open_still(struct bench *b, const struct mill_setup_ball *start, int balls,
                       struct mill_law law, bool floorless)
{
    const struct model model = {.setup = {.drum = {.radius = 0.1, .length = 0.2}, .start = start},
                                .floorless = floorless,
                                .balls = {{.diameter = 0.01, .density = STEEL, .count = balls}},
                                .law = law};
    bench_open(b, &model);
}

TEST(a_ball_bounces_as_the_textbook_says_and_without_the_floor_ends_with_a_message)
{
    struct bench b;
    struct witness w;
    open_dropped(&b, 0.5, true);
    witness_join(&w, &b, INFINITY);
    const double v0 = sqrt(2.0 * gravity * height), t0 = sqrt(2.0 * height / gravity);
    ck_assert_int_eq(mill_sim_run(b.sim, 10.0, NO_LIMIT, NULL, &b.error), MILL_FAILED);
    ck_assert_ptr_nonnull(strstr(b.error.text, "after t = 0.2873"));
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

TEST(with_the_rebound_floor_a_ball_hops_until_it_falls_asleep)
{
    struct bench b;
    struct witness w;
    open_dropped(&b, 0.5, false);
    witness_join(&w, &b, INFINITY);
    bench_run(&b, 10.0);
    ck_assert_double_eq_tol(w.speed[20], 5e-3, 1e-12);
    ck_assert_int_eq(b.world->counts.asleep, 1);
    /* one hop takes 2 x 5 mm/s / g, and so many hops pass before it falls asleep */
    const double awake = 10.0 - b.world->counts.sleep - mill_sim_local_time(b.sim);
    ck_assert_double_eq_tol((double)bench_collisions(&b), (awake - 0.287) * gravity / 0.01, 20.0);
    ck_assert_uint_eq(b.world->account.floored[MILL_BALL_DRUM], bench_collisions(&b) - 7);
    ck_assert_double_le(bench_balance(&b), 1e-12);
    ck_assert_double_lt(b.world->counts.largest_overlap, 1e-15);
    witness_is_content(&w);
    bench_close(&b);
}

TEST(a_perfectly_inelastic_ball_without_the_floor_ends_with_a_message)
{
    struct bench b;
    open_dropped(&b, 0.0, true);
    ck_assert_int_eq(mill_sim_run(b.sim, 10.0, NO_LIMIT, NULL, &b.error), MILL_FAILED);
    ck_assert_ptr_nonnull(strstr(b.error.text, "contact.rebound_floor"));
    bench_close(&b);
}

TEST(a_heap_of_inelastic_balls_comes_to_rest_and_the_run_ends)
{
    static const struct model heap = {
        .setup = {.gravity.z = -9.81, .drum = {.radius = 0.02, .length = 0.025}},
        .balls = {{.diameter = 0.005, .density = STEEL, .count = 60}},
        .law = {0.3, 0.5, 0.2}};
    struct bench b;
    struct witness w;
    bench_open(&b, &heap);
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

TEST(a_blow_runs_through_a_row_of_touching_balls_to_the_last)
{
    static const struct mill_setup_ball row[] = {{.position.x = -0.03, .velocity.x = 1.0},
                                                 {.position.x = 0.0},
                                                 {.position.x = 0.01},
                                                 {.position.x = 0.02},
                                                 {.position.x = 0.03},
                                                 {.position.x = 0.04}};
    struct bench b;
    open_still(&b, row, 6, (struct mill_law){.restitution = 1.0}, true);
    bench_run(&b, 0.03);
    ck_assert_uint_eq(bench_collisions(&b), 5);
    for (int32_t i = 0; i < 6; i++) {
        ck_assert_double_eq_tol(bench_velocity(&b, i).x, i == 5 ? 1.0 : 0.0, 1e-15);
        ck_assert_double_eq(bench_velocity(&b, i).y, 0.0);
    }
    ck_assert_double_eq_tol(bench_position(&b, 5).x, 0.05, 1e-15);
    bench_close(&b);
}

TEST(an_inelastic_row_against_a_wall_resolves_too)
{
    static const struct mill_setup_ball row[] = {{.velocity.x = 5.0},   {.position.x = 0.055},
                                                 {.position.x = 0.065}, {.position.x = 0.075},
                                                 {.position.x = 0.085}, {.position.x = 0.095}};
    struct bench b;
    open_still(&b, row, 6, (struct mill_law){.restitution = 0.1}, false);
    bench_run(&b, 1.0);
    ck_assert_double_le(b.world->counts.largest_overlap, 1e-12);
    ck_assert_double_le(bench_overlap(&b), 1e-12);
    ck_assert_double_le(bench_balance(&b), 1e-12);
    ck_assert_double_lt(mill_world_energy(b.world, 0.0).kinetic, 0.1 * b.world->start.kinetic);
    bench_close(&b);
}

TEST(a_mill_in_which_nothing_moves_is_done_at_once)
{
    /* free, touching each other, the drum, and the blade */
    static const struct mill_setup_ball ball[] = {{.position = {0.0, 0.0, 0.05}},
                                                  {.position = {0.01, 0.0, 0.05}},
                                                  {.position = {0.0, 0.0, -0.095}},
                                                  {.position = {0.0, 0.05, 0.008}},
                                                  {.position = {0.095, 0.0, 0.04}}};
    static const struct model model = {
        .setup = {.drum = {.radius = 0.1, .length = 0.2}, .start = ball},
        .balls = {{.diameter = 0.01, .density = STEEL, .count = 5}},
        .shaft = 0.01,
        .blades = 1,
        .blade = {{.tip_radius = 0.08, .width = 0.02, .thickness = 0.006}},
        .law = {.restitution = 0.5}};
    struct bench b;
    struct witness w;
    bench_open(&b, &model);
    witness_join(&w, &b, 0.5);
    bench_run(&b, 100.0);
    ck_assert_double_eq(mill_sim_time(b.sim), 100.0);
    ck_assert_uint_eq(bench_collisions(&b), 0);
    ck_assert_uint_eq(w.samples, 200);
    for (int32_t i = 0; i < 5; i++)
        ck_assert_double_eq(vec3_norm(bench_velocity(&b, i)), 0.0);
    bench_close(&b);
}

LOOP_TEST(pinched_balls_are_let_go_counted_and_never_lost, PINCHING)
{
    struct bench b;
    struct witness w;
    bench_open(&b, &pinching[_i]);
    witness_join(&w, &b, INFINITY);
    bench_run(&b, 0.5);
    ck_assert_uint_gt(b.world->counts.reliefs, 0);
    ck_assert_uint_lt(b.world->counts.reliefs, 1000);
    for (int32_t i = 0; i < b.world->balls; i++) /* drum, end walls and shaft always hold them */
        for (int k = 0; k < 4; k++)
            ck_assert_double_ge(
                mill_shape_gap(b.world->shape[k], bench_position(&b, i), 0.0025, &mill_pose_still),
                -1e-9);
    ck_assert_double_le(b.world->counts.largest_overlap, 1e-9);
    ck_assert_double_le(bench_balance(&b), 1e-10);
    witness_is_content(&w);
    bench_close(&b);
}

int main(void)
{
    return unit_run("sim_quiet");
}
