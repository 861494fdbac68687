/* Claims about the books and the clock of the event loop: energy, momentum, work of the rotor, what
 * observers are told, and that nothing but the deck decides a run. */
#include "engine/sim_private.h"
#include "sim_mills.h"

START_TEST(the_books_balance_and_nothing_overlaps_in_small_mills_of_all_kinds)
{
    struct bench b;
    struct witness w;
    bench_open(&b, mills[_i], NULL);
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
        ck_assert_double_eq(b.world->account.rotor_work_gross, 0.0);
    else
        ck_assert_double_gt(b.world->account.rotor_work, 0.0);
    bench_close(&b);
}
END_TEST

START_TEST(a_run_has_the_same_bits_whatever_is_sampled_and_wherever_it_pauses)
{
    struct bench plain, sliced;
    struct witness w;
    uint64_t budget = 1;
    bench_open(&plain, mills[_i], NULL);
    bench_run(&plain, 0.2);
    bench_open(&sliced, mills[_i], NULL);
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
END_TEST

/* What large mills do at every event must not show in any. */
START_TEST(looking_ahead_changes_nothing)
{
    struct bench plain, seer;
    bench_open(&plain, mills[_i], NULL);
    bench_run(&plain, 0.1);
    bench_open(&seer, mills[_i], NULL);
    for (int events = 0; mill_sim_run(seer.sim, 0.1, 1, NULL, &seer.error) == MILL_OK &&
                         mill_sim_time(seer.sim) < 0.1;
         events++) {
        for (int k = 0; k < events % 4; k++)
            mill_predict_ahead(seer.sim->predict);
    }
    runs_are_alike(&plain, &seer);
    bench_close(&plain);
    bench_close(&seer);
}
END_TEST

/* Enough balls for words of 32 bits and for looking ahead */
START_TEST(a_large_gas_keeps_its_energy_and_nothing_overlaps)
{
    struct bench b;
    bench_open(&b,
               "[run]\ntime = 1 s\n[gravity]\nacceleration = 0 0 0 m/s^2\n[balls]\ncount = 70000\n"
               "diameter = 5 mm\ndensity = 7800 kg/m^3\nspeed = 1 m/s\n[drum]\nradius = 135 mm\n"
               "length = 270 mm\n[contact]\nrestitution = 1\nfriction = 0\n"
               "rebound_floor = 0 m/s\n",
               NULL);
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
END_TEST

START_TEST(a_run_stopped_by_a_signal_goes_on_as_if_nothing_had_happened)
{
    struct bench plain, stopped;
    volatile sig_atomic_t stop = 1;
    bench_open(&plain, mills[0], NULL);
    bench_run(&plain, 0.1);
    bench_open(&stopped, mills[0], NULL);
    bench_run(&stopped, 0.033);
    ck_assert_int_eq(mill_sim_run(stopped.sim, 0.1, NO_LIMIT, &stop, &stopped.error), MILL_STOPPED);
    ck_assert_double_lt(mill_sim_time(stopped.sim), 0.05);
    stop = 0;
    ck_assert_int_eq(mill_sim_run(stopped.sim, 0.1, NO_LIMIT, &stop, &stopped.error), MILL_OK);
    runs_are_alike(&plain, &stopped);
    bench_close(&plain);
    bench_close(&stopped);
}
END_TEST

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
START_TEST(a_run_that_an_observer_ends_is_told_to_all_and_can_go_on)
{
    static const struct mill_observer_type type = {.impact = have_enough};
    struct mill_observer o = {&type, INFINITY};
    struct bench b, plain;
    struct witness before, after;
    bench_open(&b, mills[0], NULL);
    witness_join(&before, &b, INFINITY);
    ck_assert_int_eq(mill_sim_observe(b.sim, &o), MILL_OK);
    witness_join(&after, &b, INFINITY);
    ck_assert_int_eq(mill_sim_run(b.sim, 1.0, NO_LIMIT, NULL, &b.error), MILL_ENDED);
    ck_assert_str_eq(b.error.text, "a drum");
    ck_assert_uint_eq(before.impacts[MILL_BALL_DRUM], 1);
    ck_assert_uint_eq(after.impacts[MILL_BALL_DRUM], 1);
    ck_assert(mill_sim_time(b.sim) == after.last);
    bench_open(&plain, mills[0], NULL);
    bench_run(&plain, 0.02);
    while (mill_sim_run(b.sim, 0.02, NO_LIMIT, NULL, &b.error) == MILL_ENDED)
        continue;
    runs_are_alike(&plain, &b);
    bench_close(&plain);
    bench_close(&b);
}
END_TEST

START_TEST(impulse_and_slip_are_those_of_the_impact)
{
    struct bench b;
    struct witness w;
    bench_open(&b, mills[0], NULL);
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
END_TEST

START_TEST(an_observer_that_fails_ends_the_run_with_its_own_message)
{
    static const struct mill_observer_type type = {.impact = refuse};
    struct bench b;
    struct mill_observer o = {&type, INFINITY};
    bench_open(&b, mills[0], NULL);
    ck_assert_int_eq(mill_sim_observe(b.sim, &o), MILL_OK);
    ck_assert_int_eq(mill_sim_run(b.sim, 1.0, NO_LIMIT, NULL, &b.error), MILL_FAILED);
    ck_assert_str_eq(b.error.text, "disk full");
    ck_assert_uint_eq(bench_collisions(&b), 1);
    bench_close(&b);
}
END_TEST

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

START_TEST(collisions_of_balls_conserve_momentum_and_angular_momentum)
{
    const char *deck = "[run]\ntime = 1 s\n[gravity]\nacceleration = 0 0 0 m/s^2\n"
                       "[balls.a]\ncount = 27\ndiameter = 8 mm\ndensity = 7800 kg/m^3\n"
                       "[balls.b]\ncount = 27\ndiameter = 6 mm\ndensity = 2500 kg/m^3\n"
                       "[drum]\nradius = 500 mm\nlength = 1000 mm\n"
                       "[contact]\nrestitution = 0.7\nfriction = 0.4\n"
                       "tangential_restitution = 0.5\n";
    struct bench b;
    vec3 p0, l0, p1, l1;
    bench_open(&b, deck, NULL);
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
END_TEST

START_TEST(energy_of_a_free_flight_only_changes_its_form)
{
    struct bench b;
    bench_open(&b,
               "[run]\ntime = 1 s\n[gravity]\nacceleration = 1 -5 -8 m/s^2\n[balls]\ncount = 1\n"
               "diameter = 10 mm\ndensity = 7800 kg/m^3\nstart = start.txt\n[drum]\n"
               "radius = 1 m\nlength = 2 m\n[contact]\nrestitution = 0.5\n",
               "0.3 0 0.1  1 2 3  10 20 30\n");
    const double m = 7800.0 * 4.0 / 3.0 * 3.14159265358979323846 * 125e-9;
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
END_TEST

START_TEST(a_turning_shaft_drives_a_ball_by_friction_and_its_work_is_booked)
{
    struct bench b;
    bench_open(&b,
               "[run]\ntime = 1 s\n[gravity]\nacceleration = 0 0 0 m/s^2\n[balls]\ncount = 1\n"
               "diameter = 10 mm\ndensity = 7800 kg/m^3\nstart = start.txt\n[drum]\n"
               "radius = 100 mm\nlength = 100 mm\n[rotor]\nspeed = 100 rad/s\n"
               "shaft_radius = 20 mm\n[contact]\nrestitution = 0.5\nfriction = 0.2\n",
               "0 0 0.035  0 0 -1\n");
    const double m = b.world->species[0].mass, j = 0.2 * m * 1.5; /* slides: mu times J_n */
    bench_run(&b, 0.02);
    const vec3 v = bench_velocity(&b, 0);
    ck_assert_uint_eq(b.world->account.collisions[MILL_BALL_SHAFT], 1);
    ck_assert_double_eq_tol(v.z, 0.5, 1e-14);
    ck_assert_double_eq_tol(v.y, -0.3, 1e-14); /* the top of the shaft moves to -y at 2 m/s */
    ck_assert_double_eq_tol(b.world->spin[0].x * 0.4 * 0.005, -0.3, 1e-14); /* as a gear would */
    ck_assert_double_eq_tol(b.world->account.rotor_work, 2.0 * j, 1e-16);
    ck_assert_double_eq_tol(b.world->account.rotor_impulse, 0.02 * j, 1e-18);
    ck_assert_double_le(bench_balance(&b), 1e-14);
    bench_close(&b);
}
END_TEST

/* Three balls in the reference drum, seen at time t */
static void three_balls(double angle_deg, const char *start, double t, vec3 r[3], vec3 v[3],
                        vec3 spin[3], uint64_t *collisions)
{
    char deck[1024];
    struct bench b;
    snprintf(deck, sizeof deck,
             "[run]\ntime = 9 s\n[balls]\ncount = 3\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
             "start = start.txt\n[drum]\nradius = 75 mm\nlength = 120 mm\n[rotor]\n"
             "speed = 60 rpm\nshaft_radius = 15 mm\nangle = %.17g deg\n[blade.a]\n"
             "position = 0 mm\nangle = 0 deg\ntip_radius = 67 mm\nwidth = 12 mm\n"
             "thickness = 7 mm\n[contact]\nrestitution = 0.8\nfriction = 0.3\n",
             angle_deg);
    bench_open(&b, deck, start);
    bench_run(&b, t);
    for (int32_t i = 0; i < 3; i++) {
        r[i] = bench_position(&b, i);
        v[i] = bench_velocity(&b, i);
        spin[i] = b.world->spin[i];
    }
    *collisions = bench_collisions(&b);
    bench_close(&b);
}

START_TEST(restarts_of_the_local_clock_do_not_show_in_the_result)
{
    const char *start = "0 0.05 0.045\n0.03 0.01 0.05 -1 0 0\n-0.03 0.01 0.05 1 0 0\n";
    vec3 r[3], v[3], spin[3], early_r[3], early_v[3], early_spin[3];
    uint64_t all, early, late;
    char later[1024] = "";
    size_t used = 0;
    three_balls(-30.0, start, 0.17, r, v, spin, &all);
    three_balls(-30.0, start, 0.03, early_r, early_v, early_spin, &early);
    for (int i = 0; i < 3; i++)
        used +=
            (size_t)snprintf(later + used, sizeof later - used,
                             "%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n",
                             early_r[i].x, early_r[i].y, early_r[i].z, early_v[i].x, early_v[i].y,
                             early_v[i].z, early_spin[i].x, early_spin[i].y, early_spin[i].z);
    /* seen from there, the blade strikes before the first restart; above, after it */
    three_balls(-30.0 + 0.03 * 360.0, later, 0.17 - 0.03, early_r, early_v, early_spin, &late);
    ck_assert_uint_ge(all, 4);
    ck_assert_uint_eq(early + late, all);
    for (int i = 0; i < 3; i++) {
        ck_assert_double_lt(vec3_norm(vec3_sub(r[i], early_r[i])), 1e-13);
        ck_assert_double_lt(vec3_norm(vec3_sub(v[i], early_v[i])), 1e-11);
    }
}
END_TEST

START_TEST(an_audit_finds_what_overlaps_at_any_moment_of_the_run)
{
    struct bench b;
    bench_open(&b, mills[0], NULL);
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
END_TEST

int main(void)
{
    Suite *suite = suite_create("sim");
    TCase *tests = tcase_create("sim");
    tcase_set_timeout(tests, 60.0);
    tcase_add_loop_test(tests, the_books_balance_and_nothing_overlaps_in_small_mills_of_all_kinds,
                        0, MILLS);
    tcase_add_loop_test(tests, a_run_has_the_same_bits_whatever_is_sampled_and_wherever_it_pauses,
                        0, MILLS);
    tcase_add_loop_test(tests, looking_ahead_changes_nothing, 0, MILLS);
    tcase_add_test(tests, a_large_gas_keeps_its_energy_and_nothing_overlaps);
    tcase_add_test(tests, a_run_stopped_by_a_signal_goes_on_as_if_nothing_had_happened);
    tcase_add_test(tests, a_run_that_an_observer_ends_is_told_to_all_and_can_go_on);
    tcase_add_test(tests, impulse_and_slip_are_those_of_the_impact);
    tcase_add_test(tests, an_observer_that_fails_ends_the_run_with_its_own_message);
    tcase_add_test(tests, collisions_of_balls_conserve_momentum_and_angular_momentum);
    tcase_add_test(tests, energy_of_a_free_flight_only_changes_its_form);
    tcase_add_test(tests, a_turning_shaft_drives_a_ball_by_friction_and_its_work_is_booked);
    tcase_add_test(tests, restarts_of_the_local_clock_do_not_show_in_the_result);
    tcase_add_test(tests, an_audit_finds_what_overlaps_at_any_moment_of_the_run);
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
