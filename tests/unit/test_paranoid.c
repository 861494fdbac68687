/* Claims about the checks of a paranoid run: a sound state passes and is counted in full, each kind
 * of fault is told by its own line, and to be watched changes nothing. */
#include "proof/paranoid_state.h"
#include "sim_fixture.h"

/* Four balls without gravity: 0 flies at 1 (1.5 mm apart), 2 at the drum (1 mm), 3 is at rest in
 * the way of the blade, which gets there after some 20 ms. */
static const struct mill_setup_ball still_life_start[] = {
    {.position = {0.0285, 0.0, 0.03}, .velocity.x = 1.0},
    {.position = {0.04, 0.0, 0.03}},
    {.position = {0.0, 0.0, -0.044}, .velocity.z = -1.0},
    {.position = {-0.03, 0.0, 0.025}}};
enum { BALLS = 4, DRUM = 0, BLADE = 4, SHAPES = 5 };
static const struct model still_life = {
    .setup = {.drum = {.radius = 0.05, .length = 0.1}, .start = still_life_start},
    .balls = {{.diameter = 0.01, .density = STEEL, .count = BALLS}},
    .rotor = {.speed = 600 * RPM},
    .shaft = 0.008,
    .blades = 1,
    .blade = {{.position = -0.03, .tip_radius = 0.03, .width = 0.01, .thickness = 0.004}},
    .law = {.restitution = 0.8}};

static const struct model busy = {
    .setup = {.gravity.z = -9.81, .drum = {.radius = 0.03, .length = 0.04}},
    .balls = {{.diameter = 0.005, .density = STEEL, .count = 120}},
    .rotor = {.speed = 1000 * RPM},
    .shaft = 0.006,
    .blades = 2,
    .blade = {{.tip_radius = 0.022, .width = 0.008, .thickness = 0.004, .pitch = 20 * DEG}},
    .law = {0.8, 0.3, 0.4}};

static struct bench b;
static struct mill_schedule *q;
static struct mill_paranoid p;
static struct mill_sim sim;
static struct mill_error error;

static void set_up(void)
{
    bench_open(&b, &still_life);
    memset(&p, 0, sizeof p);
    ck_assert_int_eq(mill_schedule_create(b.world, &q, &error), MILL_OK);
    ck_assert_int_eq(b.world->shapes, SHAPES);
    mill_schedule_begin(q, 0.0625);
    for (int32_t i = 0; i < BALLS; i++)
        mill_schedule_ball(q, i, 0.0, MILL_NOBODY);
    sim = (struct mill_sim){.world = b.world, .schedule = q, .proof = &p.proof, .error = &error};
}

static void tear_down(void)
{
    mill_schedule_free(q);
    bench_close(&b);
}

static void begin_again(void)
{
    tear_down();
    set_up();
}

/* The plan as somebody left it, with a calendar that agrees. */
static void enter(int32_t i)
{
    mill_calendar_set(q->calendar, i, mill_plan_time(&q->plan[i]));
}

static void expect(bool holds, const char *words)
{
    ck_assert(!holds);
    ck_assert_int_eq(sim.status, MILL_FAILED);
    sim.status = MILL_OK;
    ck_assert_msg(strncmp(error.text, "paranoid: ", 10) == 0 && strstr(error.text, words) != NULL,
                  "'%s' in '%s'?", words, error.text);
}

static void expect_of_all(const char *words)
{
    expect(mill_paranoid_all(&sim, true), words);
}

/* ---- a sound state ---- */

TEST(a_sound_state_passes_and_every_check_is_counted)
{
    ck_assert_msg(mill_paranoid_all(&sim, true), "%s", error.text);
    ck_assert_uint_eq(p.checks.entries, BALLS);
    ck_assert_uint_eq(p.checks.places, BALLS);
    ck_assert_uint_eq(p.checks.predictions, BALLS);
    ck_assert_uint_eq(p.checks.pairs, BALLS * (BALLS - 1));
    ck_assert_uint_eq(p.checks.surfaces, BALLS * SHAPES);
    ck_assert_uint_gt(p.checks.samples, BALLS * SHAPES);
    ck_assert_uint_eq(p.checks.accounts, 1);
    ck_assert_uint_eq(p.checks.events, 0);
}

TEST(the_mill_of_these_tests_has_the_contacts_they_speak_of)
{
    ck_assert_double_eq_tol(q->plan[0].pair_t, 1.5e-3, 1e-15);
    ck_assert_int_eq(q->plan[0].partner, 1);
    ck_assert_int_eq(q->plan[1].partner, 0);
    ck_assert_double_eq_tol(q->plan[2].shape_t, 1e-3, 1e-15);
    ck_assert_int_eq(q->plan[2].shape, DRUM);
    ck_assert_int_eq(q->plan[3].shape, BLADE);
    ck_assert(q->plan[3].shape_t > 0.015 && q->plan[3].shape_t < 0.025);
    ck_assert_double_gt(q->plan[0].exit_t, q->plan[0].pair_t);
}

TEST(a_plan_whose_partner_has_changed_course_since_is_no_fault)
{
    /* ball 1 goes away along x: the contact of ball 0 is off, ball 1 has been planned anew */
    b.world->ball[1].v = vec3_make(0.0, 3.0, 0.0);
    b.world->ball[1].contacts++;
    b.world->start = mill_world_energy(b.world, 0.0);
    mill_schedule_ball(q, 1, 0.0, MILL_NOBODY);
    ck_assert_msg(mill_paranoid_all(&sim, false), "%s", error.text);
}

/* ---- overlaps ---- */

TEST(an_overlap_of_two_balls_is_told_with_its_depth)
{
    b.world->ball[1].r.x = 0.0285 + 0.01 - 2e-9;
    expect(mill_paranoid_ball(&sim, 0, true, MILL_NOBODY), "ball 0 and ball 1 overlap by 2e-09 m");
}

TEST(less_than_a_nanometre_is_no_overlap)
{
    b.world->ball[1].r.x = 0.0285 + 0.01 - 0.9e-9;
    b.world->ball[1].v.x = 2.0;
    mill_schedule_ball(q, 0, 0.0, MILL_NOBODY);
    ck_assert_msg(mill_paranoid_ball(&sim, 0, true, MILL_NOBODY), "%s", error.text);
}

TEST(an_overlap_with_a_surface_is_told)
{
    b.world->ball[2].r.z = -0.045 - 2e-9;
    expect_of_all("ball 2 overlaps a surface (ball_drum) by 2e-09 m");
}

TEST(an_overlap_far_from_the_cell_that_lists_the_ball_is_seen)
{
    /* in the grid ball 1 is still where it was: no list of neighbours leads to it */
    b.world->ball[1].r = vec3_make(0.0, 0.004, -0.044);
    expect(mill_paranoid_ball(&sim, 2, true, MILL_NOBODY), "ball 2 and ball 1 overlap by 0.006 m");
}

TEST(a_ball_that_the_blades_let_go_may_be_in_one_and_no_other)
{
    b.world->ball[3].r = vec3_make(-0.03, 0.02, 0.004);
    expect(mill_paranoid_ball(&sim, 3, true, MILL_NOBODY),
           "ball 3 overlaps a surface (ball_blade) by 0.003 m");
    b.world->ball[3].relief = MILL_RELIEF_LASTS;
    mill_schedule_ball(q, 3, 0.0, MILL_NOBODY);
    ck_assert_int_eq(b.world->ball[3].relief, MILL_RELIEF_LASTS);
    ck_assert(mill_paranoid_ball(&sim, 3, true, MILL_NOBODY));
}

/* ---- predictions ---- */

TEST(a_contact_of_two_balls_that_is_planned_too_late_is_told)
{
    q->plan[0].pair_t = q->plan[1].pair_t += 1e-9;
    enter(0);
    enter(1);
    /* 1 m/s for 1e-9 s */
    expect(mill_paranoid_ball(&sim, 0, true, MILL_NOBODY), "ball 0 and ball 1 meet");
    ck_assert_ptr_nonnull(strstr(error.text, "unplanned"));
    ck_assert_ptr_nonnull(strstr(error.text, "overlap by 1e-09 m"));
}

TEST(a_contact_that_one_ball_alone_knows_of_is_enough_unless_its_plan_is_fresh)
{
    q->plan[1].pair_t = INFINITY;
    enter(1);
    ck_assert(mill_paranoid_all(&sim, false));
    expect_of_all("ball 1 and ball 0 meet at t = 0.001");
}

TEST(a_forgotten_contact_with_a_surface_is_told)
{
    q->plan[2].shape_t = INFINITY;
    enter(2);
    expect_of_all("ball 2 meets a surface (ball_drum) by t = 0.00");
    begin_again();
    q->plan[3].shape_t = INFINITY;
    enter(3);
    expect_of_all("ball 3 meets a surface (ball_blade) by t = 0.0");
}

/* The watch searches on its own, also a body that the loop may reject by the ball's last place: it
 * tells the contact, not a later sample that overlaps. */
TEST(a_forgotten_contact_with_a_body_is_told_with_its_time)
{
    const double due = q->plan[3].shape_t;
    q->plan[3].shape_t = INFINITY;
    enter(3);
    expect_of_all("ball 3 meets a surface (ball_blade) by t = ");
    ck_assert_double_eq_tol(strtod(strstr(error.text, "t = ") + 4, NULL), due, 1e-12);
}

TEST(a_contact_planned_a_picosecond_late_is_told)
{
    q->plan[2].shape_t += 1e-11;
    enter(2);
    /* 1 m/s: 1e-11 m, hundred times what rounding explains */
    expect(mill_paranoid_ball(&sim, 2, true, MILL_NOBODY), "ball 2 meets a surface");
}

TEST(a_contact_planned_too_early_is_told)
{
    q->plan[0].pair_t -= 1e-6;
    enter(0);
    expect_of_all("ball 0 and ball 1 are due to meet with a gap of 1e-06 m");
    begin_again();
    q->plan[2].shape_t -= 1e-6;
    enter(2);
    expect_of_all("ball 2 is due to meet a surface (ball_drum) with a gap of 1e-06 m");
}

TEST(a_contact_of_balls_that_part_is_told)
{
    const struct mill_plan plan = {
        .shape_t = INFINITY, .exit_t = INFINITY, .partner = 1, .shape = MILL_NOBODY};
    b.world->ball[1].r.x = 0.0285 + 0.01;
    b.world->ball[1].v.x = 1.005;
    expect(mill_paranoid_touch(&sim, 0, &plan),
           "are due to meet while they move apart at 0.005 m/s");
}

TEST(a_contact_with_a_surface_that_is_left_is_told)
{
    const struct mill_plan plan = {.pair_t = INFINITY,
                                   .shape_t = 0.0,
                                   .exit_t = INFINITY,
                                   .partner = MILL_NOBODY,
                                   .shape = DRUM,
                                   .next = MILL_NEXT_SURFACE};
    b.world->ball[2].r.z = -0.045;
    b.world->ball[2].v.z = 0.005;
    expect(mill_paranoid_touch(&sim, 2, &plan),
           "ball 2 is due to meet a surface (ball_drum) while they move apart at 0.005 m/s");
}

/* Until then there is no contact, and none is claimed: the search goes on. */
TEST(a_search_that_goes_on_is_no_contact)
{
    struct mill_plan plan = {.pair_t = INFINITY,
                             .shape_t = 1e-3,
                             .exit_t = INFINITY,
                             .partner = MILL_NOBODY,
                             .shape = BLADE,
                             .next = MILL_NEXT_SURFACE};
    expect(mill_paranoid_touch(&sim, 3, &plan),
           "ball 3 is due to meet a surface (ball_blade) with a gap of ");
    plan.next = MILL_NEXT_SEARCH;
    ck_assert(mill_paranoid_touch(&sim, 3, &plan));
}

TEST(a_plan_with_nobody_is_told)
{
    const int32_t nobody[] = {MILL_NOBODY, BALLS, 0};
    for (int k = 0; k < 3; k++) {
        q->plan[0].partner = nobody[k];
        expect_of_all("ball 0 has a plan to meet ball");
    }
    q->plan[0].partner = 1;
    q->plan[2].shape = SHAPES;
    expect_of_all("ball 2 has a plan to meet surface 5");
}

/* A tick of the clock late in an epoch is 7e-18 s, in which a ball of 20 km/s gets 1e-13 m. Pinched
 * elastic balls are as fast. */
TEST(what_the_clock_cannot_tell_is_no_fault_of_a_fast_ball)
{
    for (int k = 0; k < 500; k++) {
        const double now = 0.06 + 1.1e-6 * k;
        b.world->ball[2].v.z = -20000.0;
        b.world->ball[2].r.z = -0.0449 + 1.7e-8 * k;
        b.world->ball[2].t = sim.now = now;
        mill_schedule_ball(q, 2, now, MILL_NOBODY);
        ck_assert_msg(mill_paranoid_ball(&sim, 2, true, MILL_NOBODY) &&
                          mill_paranoid_touch(&sim, 2, &q->plan[2]),
                      "%s", error.text);
    }
}

/* ---- calendar, cells, books ---- */

TEST(a_calendar_that_disagrees_with_a_plan_is_told)
{
    mill_calendar_set(q->calendar, 3, q->plan[3].shape_t + 1e-9);
    expect_of_all("the calendar has ball 3 at t = 0.0");
    enter(3);
    mill_calendar_set(q->calendar, 3, INFINITY);
    expect_of_all("the calendar has ball 3 at t = inf");
}

TEST(an_event_that_is_not_the_earliest_is_told)
{
    expect(mill_paranoid_before(&sim, 0, q->plan[0].pair_t),
           "the calendar takes ball 0 at t = 0.001");
    ck_assert_ptr_nonnull(strstr(error.text, "but ball 2 is due at t = 0.00"));
    ck_assert(mill_paranoid_before(&sim, 2, q->plan[2].shape_t));
}

TEST(an_event_in_the_past_is_told)
{
    const double t = q->plan[2].shape_t;
    sim.now = t + 1e-12;
    expect(mill_paranoid_before(&sim, 2, t), "the event of ball 2 comes");
    ck_assert_ptr_nonnull(strstr(error.text, "1e-12 s too late"));
}

/* Ball 0 has met, so the loop says, what its plan names. */
static bool carry_out(const struct mill_plan *plan)
{
    p.due = *plan;
    p.contacts = b.world->ball[0].contacts++;
    return mill_paranoid_after(&sim, 0);
}

TEST(a_contact_carried_out_with_bodies_apart_is_told)
{
    const struct mill_plan pair = {
        .shape_t = INFINITY, .exit_t = INFINITY, .partner = 1, .shape = MILL_NOBODY};
    expect(carry_out(&pair), "ball 0 and ball 1 met with a gap of 0.0015 m");
    const struct mill_plan surface = {.pair_t = INFINITY,
                                      .shape_t = 0.0,
                                      .exit_t = INFINITY,
                                      .partner = MILL_NOBODY,
                                      .shape = 2,
                                      .next = MILL_NEXT_SURFACE};
    expect(carry_out(&surface), "ball 0 met a surface (ball_wall) with a gap of 0.0165 m");
    ck_assert_int_eq(b.world->shape[2]->number, 1);
}

TEST(a_ball_outside_its_cell_is_told)
{
    mill_grids_remove(&q->grids, 3, 0);
    ck_assert(
        mill_grids_insert(&q->grids, 3, 0, mill_cells_at(q->cells, vec3_make(0.0, 0.0, 0.0))));
    expect_of_all("ball 3 at (-0.03, 0, 0.025) m is outside its cell");
}

TEST(a_ball_that_its_cell_does_not_list_is_told)
{
    mill_grids_remove(&q->grids, 3, 0);
    expect_of_all("ball 3 is not in the list of its cell");
}

TEST(an_account_that_is_out_by_more_than_a_billionth_is_told)
{
    b.world->account.work += 1e-8 * b.world->start.kinetic;
    expect_of_all("the energy account has an error of ");
    b.world->account.work = 1e-10 * b.world->start.kinetic;
    ck_assert(mill_paranoid_all(&sim, true));
}

TEST(what_is_not_a_number_never_passes)
{
    b.world->ball[1].v.x = NAN;
    ck_assert(!mill_paranoid_ball(&sim, 0, true, MILL_NOBODY));
    begin_again();
    b.world->ball[1].r.y = NAN;
    ck_assert(!mill_paranoid_ball(&sim, 0, true, MILL_NOBODY));
    begin_again();
    q->plan[2].shape_t = NAN;
    ck_assert(!mill_paranoid_all(&sim, true));
    begin_again();
    b.world->account.dissipation[0] = NAN;
    ck_assert(!mill_paranoid_all(&sim, true));
}

/* ---- runs ---- */

TEST(to_be_watched_changes_nothing)
{
    struct bench plain, watched;
    bench_open(&plain, &busy);
    bench_open(&watched, &busy);
    ck_assert_int_eq(mill_paranoid_start(watched.sim, NULL, &error), MILL_OK);
    bench_run(&plain, 0.1);
    bench_run(&watched, 0.1);
    const size_t n = (size_t)plain.world->balls;
    runs_are_alike(&plain, &watched);
    const struct mill_paranoid_checks c = mill_paranoid_done(watched.sim),
                                      none = mill_paranoid_done(plain.sim);
    const struct mill_counts *counts = &watched.world->counts;
    ck_assert_uint_eq(none.events + none.pairs, 0);
    ck_assert_uint_eq(c.events,
                      bench_collisions(&watched) + counts->stale + counts->cell_crossings);
    ck_assert_uint_gt(c.accounts, c.events / 1000);
    ck_assert_uint_eq(c.pairs, c.predictions * (n - 1));
    bench_close(&plain);
    bench_close(&watched);
}

TEST(the_checks_can_be_switched_off_again)
{
    struct bench run;
    bench_open(&run, &busy);
    ck_assert_int_eq(mill_paranoid_start(run.sim, NULL, &error), MILL_OK);
    ck_assert_uint_eq(mill_paranoid_done(run.sim).predictions, 120);
    mill_paranoid_stop(run.sim);
    bench_run(&run, 0.01);
    ck_assert_uint_eq(mill_paranoid_done(run.sim).predictions, 0);
    bench_close(&run);
}

/* A run that is spoilt at 10 ms, paused anywhere, ends within the next milliseconds. */
static void run_into(struct bench *run, const char *words)
{
    const enum mill_status status = mill_sim_run(run->sim, 0.05, NO_LIMIT, NULL, &run->error);
    ck_assert_int_eq(status, MILL_FAILED);
    ck_assert_msg(strncmp(run->error.text, "paranoid: ", 10) == 0, "%s", run->error.text);
    ck_assert_msg(strstr(run->error.text, words) != NULL, "'%s' in '%s'?", words, run->error.text);
    ck_assert_double_lt(mill_sim_time(run->sim), 0.05);
    bench_close(run);
}

static void open_watched(struct bench *run)
{
    bench_open(run, &busy);
    ck_assert_int_eq(mill_paranoid_start(run->sim, NULL, &run->error), MILL_OK);
    bench_run(run, 0.01);
}

TEST(a_run_ends_when_a_ball_is_put_into_another)
{
    struct bench run;
    open_watched(&run);
    run.world->ball[7].r = run.world->ball[8].r;
    run_into(&run, "ball ");
}

TEST(a_run_ends_when_a_ball_changes_course_unseen)
{
    struct bench run;
    int32_t i = 0;
    open_watched(&run);
    while (vec3_norm(run.world->ball[i].v) < 0.1)
        i++;
    run.world->ball[i].v = vec3_scale(run.world->ball[i].v, -1.0);
    run_into(&run, "ball ");
}

TEST(a_run_ends_when_its_books_are_cooked)
{
    struct bench run;
    open_watched(&run);
    run.world->account.dissipation[MILL_BALL_DRUM] += 1e-6;
    run_into(&run, "the energy account has an error of 1e-06 J");
}

static unsigned long asked, short_windows;

static bool agrees_for_a_while(const double c[5], double t_end, bool at_root, double t)
{
    (void)c, (void)at_root, (void)t;
    short_windows += t_end < 1e-3;
    return ++asked < 1000;
}

TEST(a_run_ends_when_another_solver_finds_another_contact)
{
    struct bench run;
    asked = 0;
    bench_open(&run, &busy);
    ck_assert_int_eq(mill_paranoid_start(run.sim, agrees_for_a_while, &run.error), MILL_OK);
    ck_assert_uint_eq(mill_paranoid_done(run.sim).quartics, asked);
    ck_assert_uint_eq(short_windows, 0); /* brute force looks a millisecond further */
    run_into(&run, "another solver of a quartic contradicts the search for a contact of ball ");
    ck_assert_uint_gt(short_windows, 10); /* the searches of the run itself */
}

TEST(checks_that_begin_in_the_middle_of_a_run_accept_it)
{
    struct bench run;
    bench_open(&run, &busy);
    for (uint64_t budget = 1; budget < 5000; budget = 3 * budget + 1) {
        ck_assert_int_eq(mill_sim_run(run.sim, 1.0, budget, NULL, &run.error), MILL_OK);
        ck_assert_msg(mill_paranoid_start(run.sim, NULL, &run.error) == MILL_OK, "%s",
                      run.error.text);
    }
    bench_close(&run);
}

int main(void)
{
    return unit_run_in("paranoid", set_up, tear_down);
}
