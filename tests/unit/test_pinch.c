/* Claims about balls that a moving body presses: when they are pressed, and when let go. */
#include "engine/pinch.h"

#include "sim_fixture.h"

#define BALL 3

static struct bench mill;
static struct mill_pinches pinches;
static struct mill_memory_pool memory;
static double duration, most;

static void set_up(void)
{
    bench_open(&mill, &pinching[0]);
    ck_assert(mill_pinches_create(&pinches, mill.world, &memory));
    ck_assert(pinches.ball);
    duration = pinches.duration[mill.world->ball[BALL].species];
    most = pinches.most[mill.world->ball[BALL].species];
}

static void tear_down(void)
{
    mill_memory_drop(&memory);
    bench_close(&mill);
}

static bool is_pressed(double t)
{
    return mill_pinches_press(&pinches, mill.world, BALL, t);
}

/* Meets a blade at these times [durations]. Returns for how long the ball was pressed [s]. */
static double meet(int count, const double *times)
{
    double pressed = 0.0;
    for (int k = 0; k < count; k++)
        pressed += mill_pinches_meet(&pinches, mill.world, BALL, times[k] * duration);
    return pressed;
}

/* The blade gives the ball an impulse upwards, with this friction. Is it let go? */
static bool push_up(double impulse, double friction)
{
    return mill_pinches_push(&pinches, mill.world, BALL, impulse, vec3_make(0.0, 0.0, 1.0),
                             friction);
}

static bool push(double impulse)
{
    return push_up(impulse, 0.3);
}

/* A blade, a surface above the ball, turned by an angle [rad] from one that faces the blade, and
 * the blade again with this impulse: is the ball let go? */
static bool nipped(double angle, double above, double below, double impulse)
{
    static double t;
    t += 2.0 * duration;
    mill_pinches_meet(&pinches, mill.world, BALL, t);
    mill_pinches_lean(&pinches, BALL, vec3_make(0.0, sin(angle), -cos(angle)), above);
    mill_pinches_meet(&pinches, mill.world, BALL, t + 0.1 * duration);
    return push_up(impulse, below);
}

TEST(a_ball_that_slips_on_neither_surface_of_a_nip_is_let_go)
{
    ck_assert(nipped(1e-3, 0.3, 0.2, 1e-3 * most));
    ck_assert(!nipped(atan(0.3) + atan(0.2) + 0.1, 0.3, 0.2, 0.999 * most));
    ck_assert(!nipped(0.1, 0.0, 0.0, 1e-3 * most));
}

/* [N s] 4/3 E r^(1/2) d^(3/2), E = 1.154e11 Pa, for a duration */
static double pressing(double r, double depth)
{
    return 4.0 / 3.0 * 1.1538e11 * sqrt(r * depth) * depth * duration;
}

TEST(a_ball_in_a_wider_nip_is_let_go_once_it_is_pressed_in_so_far_that_friction_holds_it)
{
    const double r = mill.world->species[mill.world->ball[BALL].species].radius;
    const double held = cos(2.0 * atan(1.0)), angle = 2.0 * atan(1.0) + 0.002;
    const double grip = r * (held - cos(angle)) / (1.0 + cos(angle));
    const double all = pressing(r, grip) + 0.04 * pressing(r, 0.5 * r * (1.0 - cos(angle)));
    pinches.most[mill.world->ball[BALL].species] = 2.0 * all;
    ck_assert(!nipped(angle, 1.0, 1.0, 0.999 * all));
    ck_assert(nipped(angle, 1.0, 1.0, 1.001 * all));
}

TEST(surfaces_that_face_the_same_way_make_no_nip)
{
    ck_assert(!nipped(PI, 0.3, 0.3, 0.999 * most));
    ck_assert(nipped(PI, 0.3, 0.3, 1.001 * most));
}

TEST(a_wall_met_before_the_blade_came_makes_no_nip)
{
    mill_pinches_lean(&pinches, BALL, vec3_make(0.0, 0.0, -1.0), 1.5);
    mill_pinches_meet(&pinches, mill.world, BALL, 2.0 * duration);
    ck_assert(!push_up(1e-9 * most, 1.5));
}

TEST(meeting_a_blade_again_within_one_duration_is_not_yet_a_pinch)
{
    ck_assert_double_eq(meet(3, (double[]){1.0, 1.3, 1.9}), 0.0);
    ck_assert(!is_pressed(1.95 * duration));
}

TEST(what_outlasts_an_impact_presses_the_ball_until_a_duration_without_a_blade)
{
    meet(3, (double[]){1.0, 1.6, 2.2});
    ck_assert(is_pressed(2.2 * duration));
    ck_assert(is_pressed(3.1 * duration));
    ck_assert(!is_pressed(3.3 * duration));
    ck_assert_double_eq_tol(meet(1, (double[]){2.5}), 0.3 * duration, 1e-12 * duration);
}

TEST(blades_that_come_a_duration_apart_press_nothing)
{
    for (int k = 0; k < 100; k++) {
        mill_pinches_meet(&pinches, mill.world, BALL, 1.01 * k * duration);
        ck_assert(!is_pressed(1.01 * k * duration));
    }
}

TEST(pressed_stays_pressed_when_local_time_restarts)
{
    meet(3, (double[]){1.0, 1.6, 2.2});
    mill_pinches_restart(&pinches, mill.world, 2.0 * duration);
    ck_assert(is_pressed(1.1 * duration));
    ck_assert(!is_pressed(1.3 * duration));
}

TEST(more_than_ten_elastic_impacts_at_once_let_the_ball_go)
{
    for (int k = 0; k < 10; k++) {
        mill_pinches_meet(&pinches, mill.world, BALL, duration);
        ck_assert(!push(most / 10.0 * (1.0 - 1e-12)));
    }
    mill_pinches_meet(&pinches, mill.world, BALL, duration);
    ck_assert(push(most / 10.0));
}

/* 0.4 of the most each half duration adds up to 0.4 (1 + 1/2 + ...) < 0.8 */
TEST(impulses_that_lie_a_duration_back_do_not_count)
{
    for (int k = 0; k < 1000; k++) {
        mill_pinches_meet(&pinches, mill.world, BALL, 0.5 * k * duration);
        ck_assert(!push(0.4 * most));
    }
}

TEST(a_pressed_ball_parts_at_a_hundredth_of_the_blades_speed)
{
    ck_assert_double_eq_tol(most, 10 * 2 * mill.world->species[0].mass * 100 * pinches.parting,
                            1e-12 * most);
    ck_assert_double_gt(pinches.parting, mill.world->rebound_floor);
}

TEST(where_no_blade_moves_nothing_is_kept_and_nothing_pressed)
{
    struct mill_pinches none = {.ball = NULL};
    struct bench still;
    struct model stands = pinching[0];
    stands.rotor.speed = 0.0;
    bench_open(&still, &stands);
    ck_assert(mill_pinches_create(&none, still.world, &memory));
    ck_assert(!none.ball && !mill_pinches_press(&none, still.world, BALL, 0.0));
    bench_close(&still);
}

int main(void)
{
    return unit_run_in("pinch", set_up, tear_down);
}
