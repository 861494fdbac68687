/* Claims about the books and the clock of the event loop: energy, momentum, work of the rotor, what
 * observers are told, and that nothing but the deck decides a run. */
#include "sim_fixture.h"

LOOP_TEST(the_books_balance_and_nothing_overlaps_in_small_mills_of_all_kinds, MILLS)
{
    struct bench b;
    struct witness w;
    bench_open(&b, &mills[_i]);
    witness_join(&w, &b, INFINITY);
    for (int k = 1; k <= 10; k++) {
        bench_run(&b, 0.05 * k);
        ck_assert_double_le(bench_balance(&b), 1e-12);
        ck_assert_double_le(bench_overlap(&b), 1e-9);
    }
    witness_is_content(&w);
    for (int k = 0; k < MILL_KINDS; k++) {
        ck_assert_uint_gt(w.impacts[k], 0);
        ck_assert_uint_eq(w.impacts[k], b.world->account.collisions[k]);
    }
    ck_assert_double_le(b.world->counts.largest_overlap, 1e-9);
    ck_assert_uint_eq(b.world->counts.overlaps, 0);
    ck_assert_uint_eq(b.world->counts.reliefs, 0);
    ck_assert_uint_eq(b.world->counts.not_closing, 0);
    if (b.world->rotor_speed == 0.0)
        ck_assert_double_eq(b.world->account.work_gross, 0.0);
    else
        ck_assert_double_gt(b.world->account.work, 0.0);
    bench_close(&b);
}

LOOP_TEST(a_run_has_the_same_bits_whatever_is_sampled_and_wherever_it_pauses, MILLS)
{
    struct bench plain, sliced;
    struct witness w;
    uint64_t budget = 1;
    bench_open(&plain, &mills[_i]);
    bench_run(&plain, 0.2);
    bench_open(&sliced, &mills[_i]);
    witness_join(&w, &sliced, 0.00037);
    for (double until = 0.0; until < 0.2; until += 0.003)
        for (int k = 0; k < 40; k++) {
            budget = budget * 7 % 997;
            ck_assert_int_eq(mill_sim_run(sliced.sim, until, budget, NULL, &sliced.error), MILL_OK);
        }
    bench_run(&sliced, 0.2);
    ck_assert_uint_eq(w.samples, 540);
    witness_is_content(&w);
    runs_are_alike(&plain, &sliced);
    bench_close(&plain);
    bench_close(&sliced);
}

/* What large mills do at every event must not show in any. */
LOOP_TEST(looking_ahead_changes_nothing, MILLS)
{
    struct bench plain, seer;
    bench_open(&plain, &mills[_i]);
    bench_run(&plain, 0.1);
    bench_open(&seer, &mills[_i]);
    for (int events = 0; mill_sim_run(seer.sim, 0.1, 1, NULL, &seer.error) == MILL_OK &&
                         mill_sim_time(seer.sim) < 0.1;
         events++) {
        for (int k = 0; k < events % 4; k++)
            mill_schedule_ahead(seer.sim->schedule);
    }
    runs_are_alike(&plain, &seer);
    bench_close(&plain);
    bench_close(&seer);
}

/* Enough balls for words of 32 bits and for looking ahead */
TEST(a_large_gas_keeps_its_energy_and_nothing_overlaps)
{
    const struct model gas = {.floorless = true,
                              .setup = {.drum = {.radius = 0.135, .length = 0.27}, .speed = 1.0},
                              .balls = {{.diameter = 0.005, .density = STEEL, .count = 70000}},
                              .law = {.restitution = 1.0}};
    struct bench b;
    bench_open(&b, &gas);
    const struct mill_energy before = mill_world_energy(b.world, 0.0);
    bench_run(&b, 0.5e-3);
    const struct mill_energy after = mill_world_energy(b.world, mill_sim_local_time(b.sim));
    ck_assert_uint_gt(b.world->account.collisions[MILL_BALL_BALL], 10000);
    ck_assert_double_eq_tol(after.kinetic, before.kinetic, 1e-12 * before.kinetic);
    mill_sim_audit(b.sim);
    ck_assert_double_le(b.world->counts.largest_overlap, 1e-9);
    ck_assert_uint_eq(b.world->counts.overlaps, 0);
    bench_close(&b);
}

TEST(a_run_stopped_by_a_signal_goes_on_as_if_nothing_had_happened)
{
    struct bench plain, stopped;
    volatile sig_atomic_t stop = 1;
    bench_open(&plain, &mills[0]);
    bench_run(&plain, 0.1);
    bench_open(&stopped, &mills[0]);
    bench_run(&stopped, 0.033);
    ck_assert_int_eq(mill_sim_run(stopped.sim, 0.1, NO_LIMIT, &stop, &stopped.error), MILL_STOPPED);
    ck_assert_double_lt(mill_sim_time(stopped.sim), 0.05);
    stop = 0;
    ck_assert_int_eq(mill_sim_run(stopped.sim, 0.1, NO_LIMIT, &stop, &stopped.error), MILL_OK);
    runs_are_alike(&plain, &stopped);
    bench_close(&plain);
    bench_close(&stopped);
}

static enum mill_status refuse(struct mill_observer *o, const struct mill_impact *impact,
                               struct mill_error *error)
{
    (void)o;
    (void)impact;
    return mill_error_set(error, MILL_FAILED, "disk full");
}

static enum mill_status have_enough(struct mill_observer *o, const struct mill_impact *impact,
                                    struct mill_error *error)
{
    (void)o;
    return impact->kind == MILL_BALL_DRUM ? mill_error_set(error, MILL_ENDED, "a drum") : MILL_OK;
}

/* Between the two stands the one that ends it. */
TEST(a_run_that_an_observer_ends_is_told_to_all_and_can_go_on)
{
    static const struct mill_observer_type type = {.impact = have_enough};
    struct mill_observer o = {&type, INFINITY};
    struct bench b, plain;
    struct witness before, after;
    bench_open(&b, &mills[0]);
    witness_join(&before, &b, INFINITY);
    ck_assert_int_eq(mill_sim_observe(b.sim, &o), MILL_OK);
    witness_join(&after, &b, INFINITY);
    ck_assert_int_eq(mill_sim_run(b.sim, 1.0, NO_LIMIT, NULL, &b.error), MILL_ENDED);
    ck_assert_str_eq(b.error.text, "a drum");
    ck_assert_uint_eq(before.impacts[MILL_BALL_DRUM], 1);
    ck_assert_uint_eq(after.impacts[MILL_BALL_DRUM], 1);
    ck_assert(mill_sim_time(b.sim) == after.last);
    bench_open(&plain, &mills[0]);
    bench_run(&plain, 0.02);
    while (mill_sim_run(b.sim, 0.02, NO_LIMIT, NULL, &b.error) == MILL_ENDED)
        continue;
    runs_are_alike(&plain, &b);
    bench_close(&plain);
    bench_close(&b);
}

TEST(impulse_and_slip_are_those_of_the_impact)
{
    struct bench b;
    struct witness w;
    bench_open(&b, &mills[0]);
    witness_join(&w, &b, INFINITY);
    for (int k = 0; k < 2000; k++) {
        const struct mill_impact last = w.impact;
        ck_assert_int_eq(mill_sim_run(b.sim, 1.0, 1, NULL, &b.error), MILL_OK);
        if (w.impact.time == last.time)
            continue;
        const struct mill_impact *i = &w.impact;
        ck_assert_double_eq_tol(vec3_norm(i->slip), i->tangential_speed,
                                1e-12 + 1e-9 * i->tangential_speed);
        ck_assert(fabs(vec3_dot(i->slip, i->normal)) < 1e-12);
        ck_assert(vec3_dot(i->impulse, i->normal) > 0.0);  /* pushes the ball away */
        ck_assert(vec3_dot(i->impulse, i->slip) <= 1e-15); /* friction goes against the slip */
    }
    bench_close(&b);
}

TEST(an_observer_that_fails_ends_the_run_with_its_own_message)
{
    static const struct mill_observer_type type = {.impact = refuse};
    struct bench b;
    struct mill_observer o = {&type, INFINITY};
    bench_open(&b, &mills[0]);
    ck_assert_int_eq(mill_sim_observe(b.sim, &o), MILL_OK);
    ck_assert_int_eq(mill_sim_run(b.sim, 1.0, NO_LIMIT, NULL, &b.error), MILL_FAILED);
    ck_assert_str_eq(b.error.text, "disk full");
    ck_assert_uint_eq(bench_collisions(&b), 1);
    bench_close(&b);
}

static enum mill_status stay(struct mill_observer *o, const struct mill_world *world, double t,
                             struct mill_error *error)
{
    (void)o, (void)world, (void)t, (void)error;
    return MILL_OK;
}

TEST(an_observer_whose_next_sample_is_never_later_neither_hangs_nor_crashes_the_run)
{
    static const struct mill_observer_type samples = {.name = "stuck", .sample = stay}, none = {0};
    struct bench b;
    struct mill_observer idle = {.type = &none}, stuck = {.type = &samples};
    bench_open(&b, &mills[0]);
    ck_assert_int_eq(mill_sim_observe(b.sim, &idle), MILL_OK);
    bench_run(&b, 0.01);
    ck_assert_int_eq(mill_sim_observe(b.sim, &stuck), MILL_OK);
    ck_assert_int_eq(mill_sim_run(b.sim, 1.0, NO_LIMIT, NULL, &b.error), MILL_FAILED);
    ck_assert_msg(strncmp(b.error.text, "stuck: ", 7) == 0, "%s", b.error.text);
    bench_close(&b);
}

/* Momentum and angular momentum of all balls about the origin, spins included */
static void momenta(const struct bench *b, vec3 *linear, vec3 *angular)
{
    const struct mill_world *w = b->world;
    *linear = *angular = vec3_make(0.0, 0.0, 0.0);
    for (int32_t i = 0; i < w->balls; i++) {
        const struct mill_species *s = &w->species[w->ball[i].species];
        const vec3 p = vec3_scale(bench_velocity(b, i), s->mass);
        *linear = vec3_add(*linear, p);
        *angular = vec3_add(*angular, vec3_cross(bench_position(b, i), p));
        *angular = vec3_axpy(*angular, s->inertia, w->spin[i]);
    }
}

TEST(collisions_of_balls_conserve_momentum_and_angular_momentum)
{
    static const struct model two_kinds = {
        .setup = {.drum = {.radius = 0.5, .length = 1.0}},
        .balls = {{.diameter = 0.008, .density = STEEL, .count = 27},
                  {.diameter = 0.006, .density = 2500.0, .count = 27}},
        .law = {0.7, 0.4, 0.5}};
    struct bench b;
    vec3 p0, l0, p1, l1;
    bench_open(&b, &two_kinds);
    for (int32_t i = 0; i < 54; i++) { /* a block of them, all flying to its middle and spinning */
        const vec3 at = vec3_make(i % 3 - 1.0, i / 3 % 3 - 1.0, i / 9 - 2.5);
        b.world->ball[i].r = vec3_scale(at, 0.0101);
        b.world->ball[i].v = vec3_make(-at.x + 0.1 * at.y, -at.y, -at.z + 0.3);
        b.world->spin[i] = vec3_make(100.0 * at.z, 50.0, -70.0 * at.x);
    }
    mill_sim_free(b.sim);
    ck_assert_int_eq(mill_sim_create(b.world, &b.sim, &b.error), MILL_OK);
    momenta(&b, &p0, &l0);
    bench_run(&b, 0.1);
    momenta(&b, &p1, &l1);
    ck_assert_uint_gt(b.world->account.collisions[MILL_BALL_BALL], 100);
    ck_assert_uint_eq(bench_collisions(&b), b.world->account.collisions[MILL_BALL_BALL]);
    ck_assert_double_lt(vec3_norm(vec3_sub(p1, p0)), 1e-14 * vec3_norm(p0));
    ck_assert_double_lt(vec3_norm(vec3_sub(l1, l0)), 1e-13 * vec3_norm(l0));
    bench_close(&b);
}

TEST(energy_of_a_free_flight_only_changes_its_form)
{
    const struct mill_setup_ball start = {{0.3, 0.0, 0.1}, {1.0, 2.0, 3.0}, {10.0, 20.0, 30.0}};
    const struct model model = {.setup = {.gravity = {1.0, -5.0, -8.0},
                                          .drum = {.radius = 1.0, .length = 2.0},
                                          .start = &start},
                                .balls = {{.diameter = 0.01, .density = STEEL, .count = 1}},
                                .law = {.restitution = 0.5}};
    struct bench b;
    bench_open(&b, &model);
    const double m = 7800.0 * 4.0 / 3.0 * PI * 125e-9;
    const struct mill_energy e = mill_world_energy(b.world, 0.0);
    ck_assert_double_eq_tol(e.kinetic, 0.5 * m * 14.0, 1e-15);
    ck_assert_double_eq_tol(e.rotational, 0.5 * 0.4 * m * 25e-6 * 1400.0, 1e-17);
    ck_assert_double_eq_tol(e.potential, -m * (0.3 * 1.0 - 0.1 * 8.0), 1e-16);
    bench_run(&b, 0.1);
    const struct mill_energy later = mill_world_energy(b.world, mill_sim_local_time(b.sim));
    ck_assert_double_eq_tol(later.kinetic, 0.5 * m * (1.1 * 1.1 + 1.5 * 1.5 + 2.2 * 2.2), 1e-14);
    ck_assert_double_eq_tol(later.kinetic + later.potential, e.kinetic + e.potential, 1e-15);
    ck_assert_double_eq(later.rotational, e.rotational);
    ck_assert_uint_eq(bench_collisions(&b), 0);
    bench_close(&b);
}

TEST(a_turning_shaft_drives_a_ball_by_friction_and_its_work_is_booked)
{
    const struct mill_setup_ball start = {.position.z = 0.035, .velocity.z = -1.0};
    const struct model model = {.setup = {.drum = {.radius = 0.1, .length = 0.1}, .start = &start},
                                .balls = {{.diameter = 0.01, .density = STEEL, .count = 1}},
                                .rotor = {.speed = 100.0},
                                .shaft = 0.02,
                                .law = {0.5, 0.2}};
    struct bench b;
    bench_open(&b, &model);
    const double m = b.world->species[0].mass, j = 0.2 * m * 1.5; /* slides: mu times J_n */
    bench_run(&b, 0.02);
    const vec3 v = bench_velocity(&b, 0);
    ck_assert_uint_eq(b.world->account.collisions[MILL_BALL_SHAFT], 1);
    ck_assert_double_eq_tol(v.z, 0.5, 1e-14);
    ck_assert_double_eq_tol(v.y, -0.3, 1e-14); /* the top of the shaft moves to -y at 2 m/s */
    ck_assert_double_eq_tol(b.world->spin[0].x * 0.4 * 0.005, -0.3, 1e-14); /* as a gear would */
    ck_assert_double_eq_tol(b.world->account.work, 2.0 * j, 1e-16);
    ck_assert_double_eq_tol(b.world->account.motion[0].impulse, 0.02 * j, 1e-18);
    ck_assert_double_le(bench_balance(&b), 1e-14);
    bench_close(&b);
}

/* A rotor with a shaft, a box that turns on it as a planet, about an axis askew, and two blades
 * that stand still, one listed before and one after what moves */
static void open_planetary(struct bench *b)
{
    const struct mill_turn sun = {.axis = {1.0, 0.0, 0.0}, .speed = 300 * RPM};
    /* half a turn about a line 1 cm off the axis: 2 cm off it */
    const struct mill_turn arm = {.centre = {0.0, 0.01, 0.0}, .axis = {1.0, 0.0, 0.0}, .angle = PI};
    const struct mill_turn wheel = {.axis = {1.0, 0.0, 0.3}, .speed = -900 * RPM};
    const struct mill_setup_motion motion[] = {
        {.type = &mill_turn_type, .form = &sun, .on = MILL_STILL},
        {.type = &mill_turn_type, .form = &arm, .on = 0},
        {.type = &mill_turn_type, .form = &wheel, .on = 1}};
    const struct mill_body shaft = mill_setup_shaft(0.005, mills[0].setup.drum.length);
    const struct mill_blade box = {.tip_radius = 0.008, .width = 0.01, .thickness = 0.006};
    const struct mill_blade left = {
        .position = -0.016, .tip_radius = 0.03, .width = 0.004, .thickness = 0.004};
    const struct mill_blade right = {
        .position = 0.016, .angle = PI, .tip_radius = 0.03, .width = 0.004, .thickness = 0.004};
    const struct mill_body part[] = {mill_setup_blade(&left), mill_setup_blade(&box),
                                     mill_setup_blade(&right)};
    static const int moves[] = {MILL_STILL, 2, MILL_STILL};
    struct mill_setup_surface surface[4] = {shaft_surface(&shaft)};
    for (int k = 0; k < 3; k++) {
        surface[1 + k] = blade_surface(&part[k], k);
        surface[1 + k].motion = moves[k];
    }
    const struct mill_setup_balls balls = {.diameter = 0.005, .density = STEEL, .count = 80};
    struct mill_setup setup = mills[0].setup;
    setup.rebound_floor = 5e-3;
    setup.motions = 3;
    setup.motion = motion;
    setup.surfaces = 4;
    setup.surface = surface;
    setup.species = 1;
    setup.balls = &balls;
    setup.seed = 1;
    for (int k = 0; k < MILL_KINDS; k++)
        setup.law[k] = mills[0].law;
    memset(b, 0, sizeof *b);
    ck_assert_int_eq(mill_start_world(&setup, NULL, &b->world, NULL), MILL_FAULT_NONE);
    ck_assert_int_eq(mill_sim_create(b->world, &b->sim, &b->error), MILL_OK);
}

TEST(a_planet_strikes_balls_beside_blades_that_stand_still)
{
    struct bench b, watched;
    open_planetary(&b);
    bench_run(&b, 0.3);
    ck_assert_uint_gt(b.world->account.collisions[MILL_BALL_BLADE], 50);
    ck_assert_double_gt(b.world->account.work, 0.0);
    ck_assert_double_le(bench_overlap(&b), 1e-9);
    ck_assert_double_le(bench_balance(&b), 1e-12);
    ck_assert_uint_eq(b.world->counts.overlaps, 0);
    bench_close(&b);
    open_planetary(&watched);
    ck_assert_int_eq(mill_sim_paranoid(watched.sim, true, &watched.error), MILL_OK);
    bench_run(&watched, 0.1);
    bench_close(&watched);
}

/* Three balls in the reference drum, and what becomes of them by time t; how many contacts */
static uint64_t three_balls(double angle, double t, struct mill_setup_ball ball[3])
{
    const struct model model = {
        .setup = {.gravity.z = -9.81, .drum = {.radius = 0.075, .length = 0.12}, .start = ball},
        .balls = {{.diameter = 0.005, .density = STEEL, .count = 3}},
        .rotor = {.speed = 60 * RPM, .angle = angle},
        .shaft = 0.015,
        .blades = 1,
        .blade = {{.tip_radius = 0.067, .width = 0.012, .thickness = 0.007}},
        .law = {0.8, 0.3}};
    struct bench b;
    bench_open(&b, &model);
    bench_run(&b, t);
    for (int32_t i = 0; i < 3; i++)
        ball[i] = (struct mill_setup_ball){bench_position(&b, i), bench_velocity(&b, i),
                                           b.world->spin[i]};
    const uint64_t collisions = bench_collisions(&b);
    bench_close(&b);
    return collisions;
}

TEST(restarts_of_the_local_clock_do_not_show_in_the_result)
{
    struct mill_setup_ball whole[3] = {{.position = {0.0, 0.05, 0.045}},
                                       {.position = {0.03, 0.01, 0.05}, .velocity.x = -1.0},
                                       {.position = {-0.03, 0.01, 0.05}, .velocity.x = 1.0}};
    struct mill_setup_ball parts[3];
    memcpy(parts, whole, sizeof parts);
    const uint64_t all = three_balls(-30 * DEG, 0.17, whole);
    const uint64_t early = three_balls(-30 * DEG, 0.03, parts);
    /* seen from there, the blade strikes before the first restart; above, after it */
    const uint64_t late = three_balls((-30.0 + 0.03 * 360.0) * DEG, 0.17 - 0.03, parts);
    ck_assert_uint_ge(all, 4);
    ck_assert_uint_eq(early + late, all);
    for (int i = 0; i < 3; i++) {
        ck_assert_double_lt(vec3_norm(vec3_sub(whole[i].position, parts[i].position)), 1e-13);
        ck_assert_double_lt(vec3_norm(vec3_sub(whole[i].velocity, parts[i].velocity)), 1e-11);
    }
}

/* So slow that where the blades stood a whole tenth of a second ago tells where they are not. */
TEST(no_contact_with_a_slow_rotor_is_missed_when_the_local_clock_restarts)
{
    static const struct mill_setup_ball start[] = {
        {{0.072741096679379058, -0.29569903183683355, -0.29569903183683344},
         {-1.48512752e-05, -3.2599977e-05, 9.53031536e-06},
         {-0.100578666, 0.698029669, 0.708970037}}};
    static const struct model slow = {
        .setup = {.gravity.z = -9.81, .drum = {.radius = 0.5, .length = 0.8}, .start = start},
        .balls = {{.diameter = 0.1636368375915129, .density = 1.0, .count = 1}},
        .rotor = {.speed = -0.0057095467278403846},
        .shaft = 0.017039567232131958,
        .blades = 3,
        .blade = {{-0.8 / 3.0, 0.0, 0.46043701942118886, 0.133739439646403, 0.12040891254266869},
                  {0.0, -0.98207104206085205, 0.46043701942118886, 0.133739439646403,
                   0.12040891254266869},
                  {0.8 / 3.0, -1.96414208412170410, 0.46043701942118886, 0.133739439646403,
                   0.12040891254266869}},
        .law = {0.8, 0.05, 0.0}};
    struct bench b;
    bench_open(&b, &slow);
    ck_assert_int_eq(mill_sim_paranoid(b.sim, true, &b.error), MILL_OK);
    bench_run(&b, 2.0);
    ck_assert_uint_gt(b.world->account.collisions[MILL_BALL_BLADE], 0);
    bench_close(&b);
}

TEST(an_audit_finds_what_overlaps_at_any_moment_of_the_run)
{
    struct bench b;
    bench_open(&b, &mills[0]);
    bench_run(&b, 0.01);
    mill_sim_audit(b.sim);
    ck_assert_uint_eq(b.world->counts.overlaps, 0);
    ck_assert_double_eq_tol(fmax(bench_overlap(&b), 0.0),
                            fmax(b.world->counts.largest_overlap, 0.0), 1e-15);
    /* ball 0 is put a micrometre into the drum, by hand */
    struct mill_ball *ball = &b.world->ball[0];
    const double touch = b.world->drum_radius - b.world->species[ball->species].radius;
    *ball = (struct mill_ball){
        .r = {0.0, touch + 1e-6, 0.0}, .t = mill_sim_local_time(b.sim), .species = ball->species};
    mill_sim_audit(b.sim);
    ck_assert_uint_ge(b.world->counts.overlaps, 1);
    ck_assert_double_ge(b.world->counts.largest_overlap, 1e-6 - 1e-12);
    bench_close(&b);
}

int main(void)
{
    return unit_run("sim");
}
