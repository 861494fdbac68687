/* Claims about balls at rest: they fall asleep, stay where they are, are met like walls, wake up
 * when they are hit or lose what holds them, and none of this loses a contact or energy. */
#include "sim_fixture.h"

#define SIZE 0.005

/* A heap in a drum that stands still */
static const struct model heap = {
    .setup = {.gravity.z = -9.81, .drum = {.radius = 0.02, .length = 0.03}, .speed = 0.5},
    .balls = {{.diameter = SIZE, .density = STEEL, .count = 60}},
    .law = {0.7, 0.5, 0.4}};

static const struct model mixture = {
    .setup = {.gravity.z = -9.81, .drum = {.radius = 0.009, .length = 0.012}},
    .balls = {{.diameter = 0.008, .density = STEEL, .count = 2},
              {.diameter = 0.002, .density = STEEL, .count = 30}},
    .law = {0.6, 0.4, 0.2}};

static bool all_asleep(const struct bench *b)
{
    return b->world->counts.asleep == b->world->balls;
}

static void run_until_asleep(struct bench *b)
{
    while (!all_asleep(b) && mill_sim_time(b->sim) < 20.0)
        bench_run(b, mill_sim_time(b->sim) + 0.1);
    ck_assert(all_asleep(b));
}

SLOW_TEST(a_heap_falls_asleep_and_stays_where_it_is, 2)
{
    const struct model *model = _i ? &mixture : &heap;
    struct bench b;
    struct witness w;
    bench_open(&b, model);
    witness_join(&w, &b, INFINITY);
    run_until_asleep(&b);
    witness_is_content(&w);
    const uint64_t collisions = bench_collisions(&b);
    const size_t bytes = sizeof *b.world->ball * (size_t)b.world->balls;
    struct mill_ball *before = malloc(bytes);
    memcpy(before, b.world->ball, bytes);
    bench_run(&b, mill_sim_time(b.sim) + 5.0);
    ck_assert_mem_eq(before, b.world->ball, bytes);
    ck_assert_uint_eq(bench_collisions(&b), collisions);
    ck_assert_double_le(bench_overlap(&b), 1e-12);
    ck_assert_double_le(bench_balance(&b), 1e-12);
    ck_assert_uint_eq(b.world->counts.overlaps, 0);
    const struct mill_energy e = mill_world_energy(b.world, mill_sim_local_time(b.sim));
    ck_assert_double_eq(e.kinetic + e.rotational, 0.0);
    free(before);
    bench_close(&b);
}

/* Brute force goes through the life of a heap: it settles, falls asleep, is stirred up by a fast
 * ball, and settles again. */
SLOW_TEST(brute_force_finds_no_contact_that_sleeping_balls_hide, 2)
{
    struct bench b;
    bench_open(&b, _i ? &mixture : &heap);
    ck_assert_int_eq(mill_sim_paranoid(b.sim, true, &b.error), MILL_OK);
    while (3 * b.world->counts.asleep < 2 * b.world->balls && mill_sim_time(b.sim) < 3.0)
        bench_run(&b, mill_sim_time(b.sim) + 0.1);
    ck_assert_int_ge(3 * b.world->counts.asleep, 2 * b.world->balls);
    const double now = mill_sim_local_time(b.sim);
    int32_t i = 0; /* the first of those asleep is thrown up */
    while (!mill_world_asleep(b.world, i))
        i++;
    ck_assert(mill_rest_wake(b.sim->schedule, i, now));
    b.world->ball[i].v = vec3_make(0.3, 0.2, 0.9);
    b.world->start.kinetic +=
        0.5 * b.world->species[b.world->ball[i].species].mass * (0.09 + 0.04 + 0.81);
    mill_schedule_ball(b.sim->schedule, i, now, MILL_NOBODY);
    const int64_t before = b.world->counts.asleep;
    bench_run(&b, mill_sim_time(b.sim) + 0.03);
    ck_assert_int_lt(b.world->counts.asleep, before); /* it has woken others */
    bench_run(&b, mill_sim_time(b.sim) + 0.2);
    ck_assert_double_le(bench_balance(&b), 1e-11);
    bench_close(&b);
}

SLOW_TEST(a_run_handed_over_again_and_again_sleeps_with_the_same_bits, 1)
{
    struct bench plain, pieces;
    bench_open(&plain, &heap);
    bench_open(&pieces, &heap);
    run_until_asleep(&plain);
    const double end = mill_sim_time(plain.sim);
    for (uint64_t seed = 3; mill_sim_time(pieces.sim) < end;) {
        struct bench next;
        struct kept kept;
        ck_assert_int_eq(
            mill_sim_run(pieces.sim, end, 1 + random_bits(&seed) % 20000, NULL, &pieces.error),
            MILL_OK);
        kept_init(&kept);
        mill_sim_state(pieces.sim, &kept.state);
        bench_close(&pieces);
        bench_open(&next, &heap);
        mill_sim_state(next.sim, kept_load(&kept));
        ck_assert_msg(kept.state.status == MILL_OK, "%s", kept.error.text);
        kept_free(&kept);
        pieces = next;
    }
    runs_are_alike(&plain, &pieces);
    bench_close(&plain);
    bench_close(&pieces);
}

/* ---- two balls: ball 0 sleeps at a place, ball 1 flies ---- */

static struct mill_setup_ball two_start[2];
static const struct model two = {.setup = {.gravity = {1.0, 2.0, -9.0},
                                           .drum = {.radius = 0.1, .length = 0.2},
                                           .start = two_start},
                                 .balls = {{.diameter = SIZE, .density = STEEL, .count = 2}},
                                 .law = {0.8, 0.3, 0.4}};

/* Lets ball 1 fly from `place` and ball 0 sleep in the centre, at the start of an epoch. */
static void open_two(struct bench *b, vec3 place, vec3 velocity)
{
    two_start[1] = (struct mill_setup_ball){.position = place, .velocity = velocity};
    bench_open(b, &two);
    ck_assert(mill_rest_sleep(b->sim->schedule, 0));
    mill_schedule_ball(b->sim->schedule, 1, 0.0, MILL_NOBODY);
}

/* The first time at which the gap is closed, by small steps until `end`; INFINITY: never */
static double first_touch(const struct bench *b, double end)
{
    const vec3 rest = b->world->ball[0].r;
    enum { STEPS = 20000 };
    for (int k = 0; k <= STEPS; k++) {
        const double t = end * k / STEPS;
        if (vec3_norm(vec3_sub(mill_world_position(b->world, 1, t), rest)) <= SIZE)
            return t;
    }
    return INFINITY;
}

TEST(a_flying_ball_meets_a_sleeping_one_when_brute_force_says_so)
{
    uint64_t seed = 77;
    int hits = 0;
    for (int k = 0; k < 400; k++) {
        struct bench b;
        const double away = SIZE * (1.0 + uniform(&seed, 0.0, 1.0) * (k % 2 ? 0.01 : 1.0));
        const vec3 place = vec3_scale(direction(&seed), away);
        open_two(&b, place, vec3_scale(direction(&seed), k % 3 ? 0.5 : 0.01));
        const struct mill_plan *plan = &b.sim->schedule->plan[1];
        const double end = fmin(fmin(plan->exit_t, plan->shape_t), b.sim->schedule->horizon);
        const double touch = first_touch(&b, end), step = end / 20000.0;
        if (plan->pair_t <= end) {
            ck_assert_int_eq(plan->partner, 0);
            ck_assert_double_eq_tol(
                vec3_norm(
                    vec3_sub(mill_world_position(b.world, 1, plan->pair_t), b.world->ball[0].r)),
                SIZE, 1e-15);
            ck_assert_double_ge(touch, plan->pair_t - 1e-12);
            hits++;
        } else {
            ck_assert_double_gt(touch, end - step);
        }
        bench_close(&b);
    }
    ck_assert_int_gt(hits, 50);
    ck_assert_int_lt(hits, 350);
}

/* above: the speed is above that which wakes a ball */
static void hit(struct bench *b, double speed)
{
    open_two(b, vec3_make(0.0, 0.0, SIZE + 1e-9), vec3_make(0.0, 0.0, -speed));
    bench_run(b, 1e-5);
    ck_assert_uint_eq(b->world->account.collisions[MILL_BALL_BALL], 1);
}

TEST(a_gentle_hit_rebounds_from_a_sleeping_ball_as_from_a_wall)
{
    struct bench b;
    struct witness w;
    open_two(&b, vec3_make(0.0, 0.0, SIZE + 1e-9), vec3_make(0.0, 0.0, -0.015));
    witness_join(&w, &b, INFINITY);
    bench_run(&b, 1e-5);
    ck_assert(mill_world_asleep(b.world, 0));
    ck_assert_double_eq_tol(bench_velocity(&b, 1).z, 0.8 * 0.015, 2e-4);
    witness_is_content(&w);
    ck_assert_int_eq(w.impact.ball, 0);
    ck_assert_int_eq(w.impact.partner, 1);
    ck_assert_double_eq_tol(w.impact.normal.z, -1.0, 1e-9); /* into ball 0 */
    ck_assert_double_lt(w.impact.impulse.z, 0.0);           /* given to ball 0 */
    bench_close(&b);
}

TEST(a_hard_hit_wakes_a_sleeping_ball_and_is_that_of_two_balls)
{
    struct bench b;
    hit(&b, 0.1);
    ck_assert(!mill_world_asleep(b.world, 0));
    ck_assert_double_eq_tol(bench_velocity(&b, 0).z, -0.09, 1e-3);
    ck_assert_double_eq_tol(bench_velocity(&b, 1).z, -0.01, 1e-3);
    bench_close(&b);
}

/* Ball 0 sleeps on ball 1, which stands on nothing. */
LOOP_TEST(a_ball_wakes_up_when_what_holds_it_moves_away, 2)
{
    struct bench b;
    open_two(&b, vec3_make(0.0, 0.0, _i ? SIZE + 1e-6 : -SIZE - 1e-6), vec3_make(0.2, 0.0, 0.0));
    bench_run(&b, 0.03);
    ck_assert_int_eq(mill_world_asleep(b.world, 0), _i); /* what lies on it does not hold it */
    bench_close(&b);
}

TEST(a_ball_that_nothing_holds_wakes_up_at_the_end_of_the_epoch)
{
    struct bench b;
    open_two(&b, vec3_make(0.05, 0.0, 0.0), vec3_make(0.0, 0.0, 0.0));
    bench_run(&b, MILL_WORLD_EPOCH - 1e-9);
    ck_assert(mill_world_asleep(b.world, 0));
    bench_run(&b, MILL_WORLD_EPOCH + 1e-9);
    ck_assert(!mill_world_asleep(b.world, 0));
    bench_close(&b);
}

/* ---- mills ---- */

SLOW_TEST(no_ball_falls_asleep_where_a_moving_surface_could_touch_it, 1)
{
    struct model slow = mills[3];
    slow.rotor.speed = 30 * RPM;
    slow.blade[0].tip_radius = 0.02;
    slow.setup.speed = 0.0;
    struct bench b;
    bench_open(&b, &slow);
    int64_t slept = 0;
    for (int k = 0; k < 20; k++) {
        bench_run(&b, 0.5 + 0.0625 * k);
        const struct mill_schedule *q = b.sim->schedule;
        for (int32_t i = 0; i < b.world->balls; i++) {
            const int32_t cell = q->cells->cell[i];
            for (int32_t s = q->surface_start[cell];
                 mill_world_asleep(b.world, i) && s < q->surface_start[cell + 1]; s++)
                ck_assert_ptr_null(b.world->shape[q->surface[s].shape]->motion);
        }
        slept += b.world->counts.asleep;
    }
    ck_assert_int_gt(slept, 0);
    ck_assert_double_le(b.world->counts.largest_overlap, 1e-12);
    bench_close(&b);
}

LOOP_TEST(balls_never_sleep_where_that_could_change_the_run, 3)
{
    struct model odd = heap;
    if (_i == 0)
        odd.setup.gravity.z = 0.0;
    if (_i == 1)
        odd.setup.rebound_floor = 0.1; /* a ball hops as high as its radius */
    if (_i == 2) {                     /* a blade creeps slower than the rebound floor */
        odd.shaft = 0.004;
        odd.rotor.speed = 1 * RPM;
    }
    struct bench b;
    bench_open(&b, &odd);
    ck_assert_double_eq(b.sim->schedule->rest.calm, 0.0);
    bench_close(&b);
}

int main(void)
{
    return unit_run("rest");
}
