/* Claims about a drum with periodic ends: what leaves it at one end enters it at the other, balls
 * meet across the ends, and only setups that have images are taken. */
#include "sim_fixture.h"

#define LENGTH 0.04

static const struct mill_setup_drum slice = {.radius = 0.012, .length = LENGTH, .periodic = true};

/* Elastic and smooth, without gravity */
static const struct model gas = {
    .setup = {.drum = {.radius = 0.012, .length = LENGTH, .periodic = true}, .speed = 1.0},
    .floorless = true,
    .balls = {{.diameter = 0.006, .density = STEEL, .count = 12},
              {.diameter = 0.003, .density = STEEL, .count = 60},
              {.diameter = 0.001, .density = STEEL, .count = 1500}},
    .law = {.restitution = 1.0}};

static double momentum(const struct mill_world *w)
{
    double sum = 0.0;
    for (int32_t i = 0; i < w->balls; i++)
        sum += w->species[w->ball[i].species].mass * w->ball[i].v.x;
    return sum;
}

TEST(a_gas_of_several_sizes_keeps_its_energy_and_its_momentum_along_the_axis)
{
    struct bench b;
    bench_open(&b, &gas);
    ck_assert_int_gt(b.sim->schedule->grids.classes, 1);
    const struct mill_energy e = mill_world_energy(b.world, 0.0);
    double mass = 0.0;
    for (int32_t i = 0; i < b.world->balls; i++)
        mass += b.world->species[b.world->ball[i].species].mass;
    const double before = momentum(b.world);
    bench_run(&b, 0.05);
    ck_assert_uint_gt(bench_collisions(&b), 5000);
    ck_assert_uint_eq(b.world->account.collisions[MILL_BALL_WALL], 0);
    ck_assert_double_eq_tol(momentum(b.world), before, 1e-12 * mass);
    const struct mill_energy now = mill_world_energy(b.world, mill_sim_local_time(b.sim));
    ck_assert_double_eq_tol(now.kinetic, e.kinetic, 1e-12 * e.kinetic);
    for (int32_t i = 0; i < b.world->balls; i++)
        ck_assert_double_le(fabs(bench_position(&b, i).x), 0.5 * LENGTH * (1.0 + 1e-12));
    bench_close(&b);
}

SLOW_TEST(each_step_of_such_a_gas_holds_against_brute_force, 2)
{
    struct bench b;
    struct model fewer = gas;
    fewer.balls[2].count = 700;
    fewer.setup.drum.length = (double[]){LENGTH, 0.02}[_i]; /* short: one grid for all sizes */
    if (_i) {
        fewer.balls[0] =
            (struct mill_setup_balls){.diameter = 0.0065, .density = STEEL, .count = 4};
        fewer.balls[1] =
            (struct mill_setup_balls){.diameter = 0.0025, .density = STEEL, .count = 20};
    }
    bench_open(&b, &fewer);
    ck_assert_int_eq(b.sim->schedule->grids.classes == 1, _i);
    ck_assert_int_eq(mill_sim_paranoid(b.sim, true, &b.error), MILL_OK);
    bench_run(&b, 0.002);
    ck_assert_uint_gt(mill_sim_checks(b.sim).events, 500);
    bench_close(&b);
}

LOOP_TEST(a_ball_that_leaves_at_one_end_enters_at_the_other, 2)
{
    const double speed = _i ? 1.0 : -1.0, time = 0.1; /* two and a half lengths */
    const struct mill_setup_ball start = {.position = {0.013, 0.001, 0.0}, .velocity.x = speed};
    const struct model model = {.setup = {.drum = slice, .start = &start},
                                .balls = {{.diameter = 0.003, .density = STEEL, .count = 1}}};
    struct bench b;
    bench_open(&b, &model);
    bench_run(&b, time);
    const double x = start.position.x + speed * time;
    ck_assert_double_eq_tol(bench_position(&b, 0).x, x - LENGTH * round(x / LENGTH), 1e-15);
    ck_assert_double_eq(bench_velocity(&b, 0).x, speed);
    ck_assert_uint_eq(bench_collisions(&b), 0);
    bench_close(&b);
}

static double position_met; /* x of the last impact [m] */

static enum mill_status note(struct mill_observer *o, const struct mill_impact *impact,
                             struct mill_error *error)
{
    (void)o;
    (void)error;
    position_met = impact->position.x;
    return MILL_OK;
}

TEST(two_balls_meet_across_the_ends_as_in_the_middle)
{
    const struct mill_setup_ball start[] = {
        {.position = {-0.016, 0.001, 0.0}, .velocity = {-1.0, 0.0, 0.0}},
        {.position = {0.016, -0.001, 0.0}, .velocity = {0.5, 0.0, 0.0}}};
    const struct model model = {.setup = {.drum = slice, .start = start},
                                .floorless = true,
                                .balls = {{.diameter = 0.004, .density = STEEL, .count = 2}},
                                .law = {.restitution = 1.0}};
    static const struct mill_observer_type type = {.name = "note", .impact = note};
    struct mill_observer observer = {.type = &type, .next = INFINITY};
    struct bench b;
    bench_open(&b, &model);
    mill_sim_observe(b.sim, &observer);
    const double along = sqrt(0.004 * 0.004 - 0.002 * 0.002), met = (0.008 - along) / 1.5;
    bench_run(&b, met - 1e-12);
    ck_assert_uint_eq(bench_collisions(&b), 0);
    bench_run(&b, met + 1e-12);
    ck_assert_uint_eq(b.world->account.collisions[MILL_BALL_BALL], 1);
    const double x = -0.016 - met - 0.5 * along;
    ck_assert_double_eq_tol(position_met, x < -0.02 ? x + LENGTH : x, 1e-14);
    /* equal masses exchange what they have along the line of centres */
    const double share = along * along / (0.004 * 0.004);
    ck_assert_double_eq_tol(bench_velocity(&b, 0).x, -1.0 + 1.5 * share, 1e-12);
    ck_assert_double_eq_tol(bench_velocity(&b, 1).x, 0.5 - 1.5 * share, 1e-12);
    bench_close(&b);
}

TEST(foresight_changes_nothing)
{
    struct bench plain, ahead;
    bench_open(&plain, &gas);
    bench_open(&ahead, &gas);
    bench_run(&plain, 0.002);
    while (mill_sim_time(ahead.sim) < 0.002) {
        mill_schedule_ahead(ahead.sim->schedule);
        ck_assert_int_eq(mill_sim_run(ahead.sim, 0.002, 1, NULL, &ahead.error), MILL_OK);
    }
    for (int32_t i = 0; i < plain.world->balls; i++)
        ck_assert_int_eq(
            memcmp(&plain.world->ball[i], &ahead.world->ball[i], sizeof *plain.world->ball), 0);
    bench_close(&plain);
    bench_close(&ahead);
}

/* A blade on a rotor, in a drum that can have periodic ends */
static struct model with_blade(double position, double width, double pitch)
{
    return (struct model){.setup = {.gravity.z = -9.81, .drum = slice},
                          .balls = {{.diameter = 0.002, .density = STEEL, .count = 50}},
                          .rotor = {.speed = 100.0},
                          .shaft = 0.001,
                          .blades = 1,
                          .blade = {{position, 0.0, 0.006, width, 0.001, pitch}}};
}

static enum mill_fault_code code_of(const struct model *m)
{
    struct mill_world *world;
    struct mill_fault fault;
    const enum mill_fault_code code = model_start(m, NULL, &world, &fault);
    mill_world_free(world);
    return code;
}

TEST(a_blade_keeps_clear_of_the_ends_or_goes_through)
{
    const struct {
        double position, width, pitch;
        enum mill_fault_code code;
    } blade[] = {
        {0.0, 0.038, 0.0, MILL_FAULT_NONE},   {0.0, 0.0381, 0.0, MILL_FAULT_END},
        {0.0, LENGTH, 0.0, MILL_FAULT_NONE},  {0.0, 0.9999 * LENGTH, 0.0, MILL_FAULT_END},
        {-0.014, 0.01, 0.0, MILL_FAULT_NONE}, {0.0141, 0.01, 0.0, MILL_FAULT_END},
        {-0.0141, 0.01, 0.0, MILL_FAULT_END}, {0.0, 0.0379, 0.2, MILL_FAULT_NONE},
        {0.0, 0.0385, 0.2, MILL_FAULT_NONE},  {0.0, 0.0395, 0.2, MILL_FAULT_END},
    };
    for (size_t k = 0; k < sizeof blade / sizeof *blade; k++) {
        const struct model m = with_blade(blade[k].position, blade[k].width, blade[k].pitch);
        ck_assert_msg(code_of(&m) == blade[k].code, "blade %zu", k);
    }
}

TEST(gravity_along_the_axis_a_short_drum_and_a_ball_beyond_the_ends_are_faults)
{
    struct model m = with_blade(0.0, 0.01, 0.0);
    m.setup.gravity.x = 1e-9;
    ck_assert_int_eq(code_of(&m), MILL_FAULT_TILT);
    m.setup.gravity.x = 0.0;
    m.balls[0] = (struct mill_setup_balls){.diameter = 0.0045, .density = STEEL, .count = 2};
    m.setup.drum.length = 0.0134;
    ck_assert_int_eq(code_of(&m), MILL_FAULT_SHORT);
    struct mill_setup_ball start[] = {{.position = {0.0191, 0.0, -0.008}},
                                      {.position = {-0.0209, 0.0, -0.0035}}};
    m.setup.drum.length = LENGTH;
    m.setup.start = start;
    ck_assert_int_eq(code_of(&m), MILL_FAULT_BALL_OUTSIDE);
    start[1].position.x = -0.02 * (1.0 + 1e-7); /* a position of single precision */
    ck_assert_int_eq(code_of(&m), MILL_FAULT_NONE);
    start[1].position.z = -0.0038;
    ck_assert_int_eq(code_of(&m), MILL_FAULT_BALL_IN_BALL);
}

TEST(a_mill_that_moves_along_its_axis_is_a_fault)
{
    const struct mill_shift along = {.amplitude.x = 0.001, .frequency = 10.0};
    const struct mill_turn about = {.axis = {1.0, 0.0, 0.0}, .speed = 10.0},
                           across = {.axis = {0.0, 1.0, 0.0}, .speed = 10.0};
    const struct {
        const struct mill_motion_type *type;
        const void *form;
        enum mill_fault_code code;
    } motion[] = {{&mill_turn_type, &about, MILL_FAULT_NONE},
                  {&mill_turn_type, &across, MILL_FAULT_MOVES},
                  {&mill_shift_type, &along, MILL_FAULT_MOVES}};
    const struct mill_body bar = {.centre = {0.0, 0.0, 0.011},
                                  .x = {1.0, 0.0, 0.0},
                                  .y = {0.0, 1.0, 0.0},
                                  .z = {0.0, 0.0, 1.0},
                                  .size = {LENGTH, 0.001, 0.004}};
    const struct mill_setup_balls balls = {.diameter = 0.002, .density = STEEL, .count = 50};
    for (size_t k = 0; k < sizeof motion / sizeof *motion; k++)
        for (int rides = 0; rides < 2; rides++) {
            const struct mill_setup_motion on = {
                .type = motion[k].type, .form = motion[k].form, .on = MILL_STILL};
            const struct mill_setup_surface lifter = {
                .solid = &mill_box_solid, .body = &bar, .kind = MILL_KINDS};
            const char *const kind = "lifter";
            struct mill_setup s = {.gravity.z = -9.81, .drum = slice, .motions = 1, .motion = &on};
            s.surfaces = 1;
            s.surface = &lifter;
            s.kinds = 1;
            s.kind = &kind;
            s.species = 1;
            s.balls = &balls;
            s.drum.rides = rides;
            struct mill_world *world;
            struct mill_fault fault;
            mill_start_world(&s, NULL, &world, &fault);
            const bool held = rides || motion[k].code != MILL_FAULT_NONE;
            if (held) /* else the lifter runs through the drum at rest */
                ck_assert_int_eq(fault.code, motion[k].code);
            if (held && fault.code != MILL_FAULT_NONE)
                ck_assert_int_eq(fault.other, rides ? -1 : 0);
            mill_world_free(world);
        }
}

int main(void)
{
    return unit_run("ends");
}
