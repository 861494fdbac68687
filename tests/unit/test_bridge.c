/* Two balls between surfaces that slide past each other: a pair that locks gives way as balls of
 * steel do, and what does not lock is let alone. */
#include "engine/bridge.h"

#include "slabs_fixture.h"

/* A chamber with two discs on a shaft; between a disc and the end wall is a gap of 1.875 diameters,
 * in which two balls lock if their friction is above 0.27. */
struct discs {
    struct mill_setup setup;
    struct mill_setup_surface surface[4];
    struct mill_body chamber, shaft, disc[2];
    struct mill_turn turn;
    struct mill_setup_motion motion;
    struct mill_setup_balls balls;
    struct mill_setup_ball start[2];
};

static struct mill_body cylinder(double x, double radius, double length, int inside)
{
    return (struct mill_body){.inside = inside,
                              .centre = {x, 0.0, 0.0},
                              .x = {0.0, 1.0, 0.0},
                              .y = {0.0, 0.0, 1.0},
                              .z = {1.0, 0.0, 0.0},
                              .radius = radius,
                              .length = length};
}

static void prepare(struct discs *d, double friction)
{
    memset(d, 0, sizeof *d);
    d->chamber = cylinder(0.0, 0.04, 0.04, 1);
    d->shaft = cylinder(0.0, 0.008, 0.05, 0);
    d->disc[0] = cylinder(-0.01, 0.03, 0.005, 0);
    d->disc[1] = cylinder(0.01, 0.03, 0.005, 0);
    d->turn = (struct mill_turn){.axis = {1.0, 0.0, 0.0}, .speed = 4000 * RPM};
    d->motion = (struct mill_setup_motion){&mill_turn_type, &d->turn, MILL_STILL, "shaft"};
    const struct mill_body *body[4] = {&d->chamber, &d->shaft, &d->disc[0], &d->disc[1]};
    for (int k = 0; k < 4; k++)
        d->surface[k] =
            (struct mill_setup_surface){.solid = &mill_round_cylinder_solid,
                                        .body = body[k],
                                        .number = k - 1,
                                        .motion = k > 0 ? 0 : MILL_STILL,
                                        .kind = k > 0 ? MILL_BALL_BLADE : MILL_BALL_DRUM};
    d->balls = (struct mill_setup_balls){"ball", 0.004, 6050.0, 2};
    d->start[0] = (struct mill_setup_ball){{0.0145005407, -0.003782477, 0.00954240747},
                                           {-0.31316781, -0.388314545, -0.75747478},
                                           {-169.725876, -269.346954, 132.627151}};
    d->start[1] = (struct mill_setup_ball){{0.0179969762, -0.00571734505, 0.00972228963},
                                           {0.426624835, -0.281238586, 0.0265108906},
                                           {-129.213867, -3.08179712, -92.3974991}};
    d->setup = (struct mill_setup){.gravity = {0.0, 0.0, -9.81},
                                   .motions = 1,
                                   .motion = &d->motion,
                                   .rotor = MILL_STILL,
                                   .surfaces = 4,
                                   .surface = d->surface,
                                   .species = 1,
                                   .balls = &d->balls,
                                   .start = d->start,
                                   .rebound_floor = 5e-3};
    for (int k = 0; k < MILL_KINDS; k++)
        d->setup.law[k] = (struct mill_law){0.9, friction, 0.4};
}

static void open_discs(struct bench *b, const struct discs *d)
{
    memset(b, 0, sizeof *b);
    ck_assert_int_eq(mill_start_world(&d->setup, NULL, &b->world, NULL), MILL_FAULT_NONE);
    ck_assert_int_eq(mill_sim_create(b->world, &b->sim, &b->error), MILL_OK);
}

/* Rigid balls would lock until the program gave up: 21 J. LAMMPS with balls of steel does 3.44 mJ
 * from this start, and 2.9 to 3.9 mJ from starts that differ by 20 um and 20 mm/s. */
TEST(a_pair_that_locks_gives_way_as_balls_of_steel_do)
{
    struct discs d;
    struct bench b;
    prepare(&d, 0.3);
    open_discs(&b, &d);
    bench_run(&b, 5e-3);
    const double work = b.world->account.work;
    ck_assert_msg(work > 3.0e-3 && work < 4.6e-3, "%g J", work);
    ck_assert_uint_eq(b.world->counts.bridges, 1);
    ck_assert_uint_eq(b.world->counts.smoothed, 0);
    ck_assert_double_gt(b.world->account.bridge_work, 0.0);
    bench_close(&b);
}
END_TEST

/* Without friction nothing locks, and with little of it balls slip out. */
LOOP_TEST(a_pair_that_does_not_lock_is_no_bridge, 2)
{
    struct discs d;
    struct bench b;
    prepare(&d, _i ? 0.1 : 0.0);
    open_discs(&b, &d);
    bench_run(&b, 5e-3);
    ck_assert_uint_gt(b.world->account.collisions[MILL_BALL_BALL], 0);
    ck_assert_uint_eq(b.world->counts.bridges, 0);
    ck_assert_double_lt(b.world->account.work, 1e-3);
    bench_close(&b);
}
END_TEST

/* ---- the rule ---- */

enum { ONE, OTHER };

static struct discs parts;
static struct bench mill;
static struct mill_bridges bridges;
static double duration, mass, r;
static struct mill_memory_pool memory;

static void set_up(void)
{
    prepare(&parts, 0.3);
    open_discs(&mill, &parts);
    ck_assert(mill_bridges_create(&bridges, mill.world, &memory));
    ck_assert_ptr_nonnull(bridges.ball);
    duration = bridges.duration[0];
    mass = 0.5 * mill.world->species[0].mass; /* reduced */
    r = mill.world->species[0].radius;
}

static void tear_down(void)
{
    mill_memory_drop(&memory);
    bench_close(&mill);
}

static const struct mill_shape *shape_on(bool moves, int *number)
{
    for (int k = 0; k < mill.world->shapes; k++)
        if (!mill.world->shape[k]->motion == !moves && !mill.world->shape[k]->pinches) {
            *number = k;
            return mill.world->shape[k];
        }
    ck_abort_msg("no such surface");
    return NULL;
}

/* Ball 0 lies on a surface that moves, ball 1 below one that stands, and the line of centres makes
 * this angle [rad] with both normals. The surfaces slide at V [m/s]. */
static double slide(void)
{
    int turns;
    shape_on(true, &turns);
    const struct mill_pose pose = mill_shape_pose(mill.world->shape[turns], 0.0);
    return vec3_norm(mill_pose_velocity(
        &pose, vec3_axpy(mill.world->ball[ONE].r, -r, vec3_make(1.0, 0.0, 0.0))));
}

static void lean(double apart, double t)
{
    int turns, stands;
    shape_on(true, &turns);
    shape_on(false, &stands);
    mill_bridges_touch(&bridges, ONE, turns, vec3_make(1.0, 0.0, 0.0), t);
    mill_bridges_touch(&bridges, OTHER, stands, vec3_make(-apart, 0.0, 0.0), t);
}

static bool push(double angle, double impulse, double t)
{
    bool gives;
    mill_bridges_push(&bridges, mill.world, ONE, OTHER, vec3_make(cos(angle), sin(angle), 0.0),
                      impulse, t, &gives);
    return gives;
}

static bool gives_way(double t)
{
    return mill_bridges_give(&bridges, mill.world, ONE, t) &&
           mill_bridges_give(&bridges, mill.world, OTHER, t);
}

/* [N] Hertz: 4/3 E R^(1/2) d^(3/2), with the reduced modulus of steel, E = 1.154e11 Pa, and the
 * reduced radius R of two balls */
static double pressing(double depth)
{
    return 4.0 / 3.0 * 1.1538e11 * sqrt(0.5 * r * depth) * depth;
}

/* [N s] What a pair at this angle bears: two impacts at V; the force that unlocks it, but no more
 * than 40 impacts within a duration; and a share of the force when it stands upright */
static double borne(double angle, double lost)
{
    const double held = cos(2.0 * atan(0.3));
    const double grip = fmax(r * (held - cos(angle)) / (1.0 + 0.5 * cos(angle)), 0.0);
    const double unlocks = fmin(pressing(grip), 40.0 * mass * bridges.speed / duration);
    return 2.0 * mass * slide() +
           duration * (unlocks + lost * pressing(2.0 / 3.0 * r * (1.0 - cos(angle))));
}

/* An angle that locks, 2 atan(0.3) = 0.583, and ones that do not */
static const double angles[] = {0.5, 0.584, 0.6, 0.9};

LOOP_TEST(a_pair_gives_way_once_it_has_got_what_it_bears, 2 * COUNT(angles))
{
    const double angle = angles[_i / 2], all = borne(angle, 0.008);
    lean(1.0, 0.0);
    ck_assert(push(angle, (_i % 2 ? 1.001 : 0.999) * all, 0.1 * duration) == (_i % 2 == 1));
    ck_assert(gives_way(0.1 * duration) == (_i % 2 == 1));
}
END_TEST

/* A third ball that touches the pair on its way takes what it would have given back. */
TEST(a_pair_that_another_ball_touches_bears_more)
{
    const double angle = angles[0], all = borne(angle, 0.5);
    bridges.ball[ONE].last = 0.0;
    bridges.ball[ONE].partner = 7;
    lean(1.0, 0.0);
    ck_assert(!push(angle, 0.999 * all, 0.1 * duration));
    ck_assert(push(angle, 0.002 * all, 0.1 * duration));
}
END_TEST

TEST(impulses_add_up_within_a_duration_and_are_forgotten_after_it)
{
    const double angle = angles[0], all = borne(angle, 0.008);
    for (int k = 0; k <= 20; k++) {
        lean(1.0, 2.0 * k * duration);
        ck_assert(!push(angle, 0.9 * all, 2.0 * k * duration));
    }
    lean(1.0, 41.5 * duration);
    ck_assert(push(angle, 1.001 * all, 41.5 * duration)); /* and they do not count backwards */
    bridges.ball[ONE].impulse = bridges.ball[OTHER].impulse = 0.0;
    lean(1.0, 100.0 * duration);
    ck_assert(!push(angle, 0.6 * all, 100.0 * duration));
    ck_assert(push(angle, 0.6 * all, 100.1 * duration));
}
END_TEST

TEST(friction_is_back_one_duration_after_the_pair_has_met_for_the_last_time)
{
    lean(1.0, 0.0);
    ck_assert(push(angles[0], 10.0 * borne(angles[0], 0.008), 0.0));
    ck_assert(gives_way(0.5 * duration));
    lean(1.0, 0.5 * duration);
    ck_assert(!push(angles[0], 1e-9, 0.5 * duration)); /* it has given way already */
    ck_assert(gives_way(1.4 * duration));
    ck_assert(!gives_way(1.6 * duration));
    ck_assert(!mill_bridges_give(&bridges, mill.world, OTHER, 1.6 * duration));
}
END_TEST

TEST(balls_that_surfaces_do_not_press_together_are_no_bridge)
{
    const double plenty = 1e3 * borne(angles[0], 0.5);
    lean(-1.0, 0.0); /* the other surface pushes it away */
    ck_assert(!push(angles[0], plenty, 0.0));
    lean(1.0, 0.0);
    ck_assert(!push(PI - angles[0], plenty, 0.0));
    int turns;
    shape_on(true, &turns);
    mill_bridges_touch(&bridges, ONE, turns, vec3_make(-1.0, 0.0, 0.0), 0.0);
    ck_assert(!push(angles[0], plenty, 0.0));
    lean(1.0, 0.0);
    ck_assert(!push(angles[0], plenty, 1.1 * duration)); /* they have left the surfaces */
}
END_TEST

TEST(surfaces_of_one_motion_make_no_bridge)
{
    int turns;
    shape_on(true, &turns);
    mill_bridges_touch(&bridges, ONE, turns, vec3_make(1.0, 0.0, 0.0), 0.0);
    mill_bridges_touch(&bridges, OTHER, turns, vec3_make(-1.0, 0.0, 0.0), 0.0);
    ck_assert(!push(angles[0], 1e3 * borne(angles[0], 0.5), 0.0));
}
END_TEST

TEST(a_pair_gives_way_on_when_local_time_restarts)
{
    lean(1.0, 5.0 * duration);
    ck_assert(push(angles[0], 10.0 * borne(angles[0], 0.008), 5.0 * duration));
    mill_bridges_restart(&bridges, mill.world, 5.0 * duration);
    ck_assert(gives_way(0.9 * duration));
    ck_assert(!gives_way(1.1 * duration));
}
END_TEST

/* What turns as one body has no gap in which surfaces slide. */
TEST(where_all_surfaces_have_one_motion_nothing_is_kept)
{
    struct discs d;
    struct bench b;
    struct mill_bridges none = {.ball = NULL};
    prepare(&d, 0.3);
    for (int k = 0; k < 4; k++)
        d.surface[k].motion = 0;
    open_discs(&b, &d);
    ck_assert(mill_bridges_create(&none, b.world, &memory));
    ck_assert_ptr_null(none.ball);
    ck_assert(!mill_bridges_give(&none, b.world, ONE, 0.0));
    bench_close(&b);
}
END_TEST

/* ---- threads, hand-overs ---- */

enum { STACK = 8 };

/* A long chamber with discs that leave gaps of 1.875 diameters between them and rings that stand */
static void open_stack(struct bench *b, int threads)
{
    static struct mill_body chamber, disc[2 * STACK];
    static struct mill_setup_surface surface[2 * STACK + 1];
    static struct mill_setup_balls balls = {"ball", 0.004, 6050.0, 1500};
    static struct mill_turn turn = {.axis = {1.0, 0.0, 0.0}, .speed = 4000 * RPM};
    static struct mill_setup_motion motion = {&mill_turn_type, &turn, MILL_STILL, "shaft"};
    const double pitch = 0.025;
    chamber = cylinder(0.0, 0.025, STACK * pitch, 1);
    surface[0] = (struct mill_setup_surface){
        &mill_round_cylinder_solid, &chamber, -1, MILL_STILL, MILL_BALL_DRUM, 0};
    for (int k = 0; k < 2 * STACK; k++) { /* turning, standing, turning, ... */
        disc[k] = cylinder((0.5 * k + 0.25 - 0.5 * STACK) * pitch, 0.019, 0.005, 0);
        surface[1 + k] = (struct mill_setup_surface){
            &mill_round_cylinder_solid, &disc[k], k, k % 2 ? MILL_STILL : 0, MILL_BALL_BLADE, 0};
    }
    struct mill_setup setup = {.gravity = {0.0, 0.0, -9.81},
                               .motions = 1,
                               .motion = &motion,
                               .rotor = MILL_STILL,
                               .surfaces = 2 * STACK + 1,
                               .surface = surface,
                               .species = 1,
                               .balls = &balls,
                               .seed = 1,
                               .rebound_floor = 5e-3};
    for (int k = 0; k < MILL_KINDS; k++)
        setup.law[k] = (struct mill_law){0.9, 0.3, 0.4};
    memset(b, 0, sizeof *b);
    ck_assert_int_eq(mill_start_world(&setup, NULL, &b->world, NULL), MILL_FAULT_NONE);
    ck_assert_int_eq(mill_sim_create(b->world, &b->sim, &b->error), MILL_OK);
    if (threads > 1)
        use_threads(b, threads);
}

SLOW_TEST(bridges_give_way_in_the_same_way_on_threads_and_after_a_hand_over, 2)
{
    struct bench plain, other;
    const double end = 0.07;
    open_stack(&plain, 1);
    bench_run(&plain, end);
    ck_assert_uint_gt(plain.world->counts.bridges, 5);
    open_stack(&other, _i ? 1 : 2);
    if (_i == 0) {
        bench_run(&other, end);
        has_shared(&other);
    }
    while (_i && mill_sim_time(other.sim) < end) {
        struct bench next;
        struct kept kept;
        ck_assert_int_eq(mill_sim_run(other.sim, end, 20000, NULL, &other.error), MILL_OK);
        kept_init(&kept);
        mill_sim_state(other.sim, &kept.state);
        bench_close(&other);
        open_stack(&next, 1);
        mill_sim_state(next.sim, kept_load(&kept));
        ck_assert_int_eq(kept.state.status, MILL_OK);
        kept_free(&kept);
        other = next;
    }
    runs_are_alike(&plain, &other);
    bench_close(&plain);
    bench_close(&other);
}
END_TEST

int main(void)
{
    return unit_run_in("bridge", set_up, tear_down);
}
