/* Claims about the saved state of the loop: a run that is taken up from it goes on to the same
 * bits, and no bytes of another mill, nor damaged ones, are taken for it. */
#include "sim_mills.h"

static uint64_t next_random(uint64_t *seed)
{
    *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return *seed >> 33;
}

static void save(const struct bench *b, struct kept *kept)
{
    kept_init(kept);
    mill_sim_state(b->sim, &kept->state);
}

static enum mill_status load(struct bench *b, struct kept *kept)
{
    struct mill_state *state = kept_load(kept);
    mill_sim_state(b->sim, state);
    b->error = kept->error;
    return state->status;
}

/* A mill of its own, made from the deck anew, that has taken up the state of `b`; that one ends. */
static void hand_over(struct bench *b, const char *deck)
{
    struct bench next;
    struct kept kept;
    save(b, &kept);
    bench_close(b);
    bench_open(&next, deck, NULL);
    ck_assert_msg(load(&next, &kept) == MILL_OK, "%s", next.error.text);
    kept_free(&kept);
    *b = next;
}

/* Runs to `until`, handed over after every 1 to `most` events; how often. */
static int run_in_pieces(struct bench *b, const char *deck, double until, uint64_t most,
                         uint64_t seed)
{
    int pieces = 0;
    for (double before = -1.0; before < until; pieces++) {
        before = mill_sim_time(b->sim);
        ck_assert_int_eq(
            mill_sim_run(b->sim, until, 1 + next_random(&seed) % most, NULL, &b->error), MILL_OK);
        hand_over(b, deck);
    }
    return pieces;
}

START_TEST(a_run_handed_over_again_and_again_ends_with_the_same_bits)
{
    struct bench plain, pieces;
    bench_open(&plain, mills[_i % MILLS], NULL);
    bench_run(&plain, 0.2); /* local time restarts three times meanwhile */
    bench_open(&pieces, mills[_i % MILLS], NULL);
    ck_assert_int_gt(run_in_pieces(&pieces, mills[_i % MILLS], 0.2, 800, (uint64_t)_i), 10);
    runs_are_alike(&plain, &pieces);
    bench_close(&plain);
    bench_close(&pieces);
}
END_TEST

START_TEST(every_single_event_may_be_the_last_before_the_hand_over)
{
    struct bench plain, pieces;
    bench_open(&plain, mills[_i % MILLS], NULL);
    bench_open(&pieces, mills[_i % MILLS], NULL);
    ck_assert_int_eq(mill_sim_run(plain.sim, 1.0, 25, NULL, &plain.error), MILL_OK);
    for (int k = 0; k < 25; k++) {
        ck_assert_int_eq(mill_sim_run(pieces.sim, 1.0, 1, NULL, &pieces.error), MILL_OK);
        hand_over(&pieces, mills[_i % MILLS]);
    }
    runs_are_alike(&plain, &pieces);
    bench_close(&plain);
    bench_close(&pieces);
}
END_TEST

/* Hand-overs are closer than the 30000 contacts that a pinch is recognised by. */
START_TEST(pinches_are_counted_on_across_the_hand_over)
{
    struct bench plain, pieces;
    bench_open(&plain, pinching[_i], NULL);
    bench_run(&plain, 0.2);
    ck_assert_uint_gt(plain.world->counts.reliefs, 0);
    bench_open(&pieces, pinching[_i], NULL);
    run_in_pieces(&pieces, pinching[_i], 0.2, 40000, 7);
    runs_are_alike(&plain, &pieces);
    bench_close(&plain);
    bench_close(&pieces);
}
END_TEST

START_TEST(saving_changes_nothing)
{
    struct bench plain, saved;
    struct kept kept;
    bench_open(&plain, mills[0], NULL);
    bench_run(&plain, 0.1);
    bench_open(&saved, mills[0], NULL);
    while (mill_sim_time(saved.sim) < 0.1) {
        ck_assert_int_eq(mill_sim_run(saved.sim, 0.1, 500, NULL, &saved.error), MILL_OK);
        save(&saved, &kept);
        kept_free(&kept);
    }
    runs_are_alike(&plain, &saved);
    bench_close(&plain);
    bench_close(&saved);
}
END_TEST

START_TEST(what_was_loaded_is_what_was_saved)
{
    struct bench b;
    struct kept saved, again;
    bench_open(&b, mills[1], NULL);
    bench_run(&b, 0.07);
    save(&b, &saved);
    hand_over(&b, mills[1]);
    save(&b, &again);
    forget_places(&saved, "plan");
    forget_places(&again, "plan");
    ck_assert(kept_alike(&saved, &again));
    kept_free(&saved);
    kept_free(&again);
    bench_close(&b);
}
END_TEST

START_TEST(a_state_from_before_the_first_event_serves_too)
{
    struct bench plain, later;
    bench_open(&plain, mills[0], NULL);
    bench_run(&plain, 0.05);
    bench_open(&later, mills[0], NULL);
    hand_over(&later, mills[0]);
    bench_run(&later, 0.05);
    runs_are_alike(&plain, &later);
    bench_close(&plain);
    bench_close(&later);
}
END_TEST

/* Mill 0 has 200 balls, ten shapes and many cells: as it is, and with one of these changed */
#define MILL(balls, radius, blades)                                                                \
    "[run]\ntime = 1 s\n[balls]\ncount = " balls "\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"      \
    "[drum]\nradius = " radius "\nlength = 40 mm\n[rotor]\nspeed = 1000 rpm\n"                     \
    "shaft_radius = 8 mm\n[blades]\ncount = " blades "\ntip_radius = 33 mm\nwidth = 8 mm\n"        \
    "thickness = 5 mm\n[contact]\nrestitution = 0.8\n"
static const char own[] = MILL("100", "40 mm", "2");
static const char *const others[] = {MILL("101", "40 mm", "2"), MILL("99", "40 mm", "2"),
                                     MILL("100", "60 mm", "2"), MILL("100", "40 mm", "1")};

START_TEST(a_state_of_another_mill_is_refused)
{
    struct bench b, other;
    struct kept kept;
    bench_open(&b, own, NULL);
    bench_run(&b, 0.02);
    save(&b, &kept);
    bench_open(&other, others[_i], NULL);
    ck_assert_int_eq(load(&other, &kept), MILL_FAILED);
    ck_assert_str_eq(other.error.text, "the saved balls are of another deck");
    bench_run(&other, 0.02); /* and it is none the worse for it */
    bench_close(&other);
    bench_close(&b);
    kept_free(&kept);
}
END_TEST

START_TEST(a_field_missing_or_of_another_length_is_refused)
{
    struct bench b;
    struct kept kept;
    bench_open(&b, own, NULL);
    bench_run(&b, 0.02);
    save(&b, &kept);
    for (size_t k = 0; k < kept.fields; k++) {
        kept.field[k].bytes -= 4;
        ck_assert_int_eq(load(&b, &kept), MILL_FAILED);
        kept.field[k].bytes += 4;
        kept.field[k].name[0] ^= 1;
        ck_assert_int_eq(load(&b, &kept), MILL_FAILED);
        kept.field[k].name[0] ^= 1;
    }
    ck_assert_int_eq(load(&b, &kept), MILL_OK);
    kept_free(&kept);
    bench_close(&b);
}
END_TEST

static void damage(struct mill_sim *sim, int how)
{
    struct mill_world *w = sim->world;
    struct mill_plan *plan = &sim->predict->plan[42];
    int32_t *cell = &sim->predict->cells.cell[42];
    switch (how) {
    case 0:
        *cell = mill_cells_count(&sim->predict->cells);
        break;
    case 1:
        *cell = -1;
        break;
    case 2:
        plan->partner = w->balls;
        break;
    case 3:
        plan->partner = MILL_NOBODY - 1;
        break;
    case 4:
        plan->shape = (int16_t)w->shapes;
        break;
    case 5:
        plan->shape = MILL_NOBODY - 1;
        break;
    case 6:
        plan->face = 6;
        break;
    case 7:
        plan->face = -1;
        break;
    case 8:
        w->ball[42].species = w->species_count;
        break;
    case 9:
        w->ball[42].species = -1;
        break;
    case 10:
        *cell = 0; /* of the layer around the grid, which holds no balls */
        break;
    case 11:
        plan->partner = MILL_NOBODY;
        plan->pair_t = sim->now;
        break;
    case 12:
        plan->shape = MILL_NOBODY;
        plan->shape_t = sim->now;
        break;
    case 13:
        plan->partner = 42; /* itself */
        break;
    case 14:
        plan->pair_t = (double)NAN;
        break;
    }
}
enum { DAMAGES = 15 };

START_TEST(an_index_out_of_range_is_refused)
{
    struct bench good, bad;
    struct kept kept;
    bench_open(&bad, own, NULL);
    bench_run(&bad, 0.02);
    const int32_t cell = bad.sim->predict->cells.cell[42];
    const int32_t species = bad.world->ball[42].species;
    damage(bad.sim, _i);
    save(&bad, &kept);
    bad.sim->predict->cells.cell[42] = cell; /* so that it can be freed */
    bad.world->ball[42].species = species;
    bench_open(&good, own, NULL);
    ck_assert_int_eq(load(&good, &kept), MILL_FAILED);
    ck_assert_str_eq(good.error.text, "the saved balls are damaged");
    kept_free(&kept);
    bench_close(&good);
    bench_close(&bad);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("sim_state");
    TCase *tests = tcase_create("sim_state");
    tcase_set_timeout(tests, 60.0);
    tcase_add_loop_test(tests, a_run_handed_over_again_and_again_ends_with_the_same_bits, 0,
                        2 * MILLS);
    tcase_add_loop_test(tests, every_single_event_may_be_the_last_before_the_hand_over, 0, MILLS);
    tcase_add_loop_test(tests, pinches_are_counted_on_across_the_hand_over, 0, PINCHING);
    tcase_add_test(tests, saving_changes_nothing);
    tcase_add_test(tests, what_was_loaded_is_what_was_saved);
    tcase_add_test(tests, a_state_from_before_the_first_event_serves_too);
    tcase_add_loop_test(tests, a_state_of_another_mill_is_refused, 0,
                        (int)(sizeof others / sizeof *others));
    tcase_add_test(tests, a_field_missing_or_of_another_length_is_refused);
    tcase_add_loop_test(tests, an_index_out_of_range_is_refused, 0, DAMAGES);
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
