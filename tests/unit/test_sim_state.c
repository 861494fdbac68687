/* Claims about the saved state of the loop: a run that is taken up from it goes on to the same
 * bits, and no bytes of another mill, nor damaged ones, are taken for it. */
#include "sim_fixture.h"

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

/* A mill of its own, made anew, that has taken up the state of `b`; that one ends. */
static void hand_over(struct bench *b, const struct model *model)
{
    struct bench next;
    struct kept kept;
    save(b, &kept);
    bench_close(b);
    bench_open(&next, model);
    ck_assert_msg(load(&next, &kept) == MILL_OK, "%s", next.error.text);
    kept_free(&kept);
    *b = next;
}

/* Runs to `until`, handed over after every 1 to `most` events; how often. */
static int run_in_pieces(struct bench *b, const struct model *model, double until, uint64_t most,
                         uint64_t seed)
{
    int pieces = 0;
    for (double before = -1.0; before < until; pieces++) {
        before = mill_sim_time(b->sim);
        ck_assert_int_eq(
            mill_sim_run(b->sim, until, 1 + random_bits(&seed) % most, NULL, &b->error), MILL_OK);
        hand_over(b, model);
    }
    return pieces;
}

SLOW_TEST(a_run_handed_over_again_and_again_ends_with_the_same_bits, 2 * MILLS)
{
    struct bench plain, pieces;
    bench_open(&plain, &mills[_i % MILLS]);
    bench_run(&plain, 0.2); /* local time restarts three times meanwhile */
    bench_open(&pieces, &mills[_i % MILLS]);
    ck_assert_int_gt(run_in_pieces(&pieces, &mills[_i % MILLS], 0.2, 800, (uint64_t)_i), 10);
    runs_are_alike(&plain, &pieces);
    bench_close(&plain);
    bench_close(&pieces);
}

SLOW_TEST(every_single_event_may_be_the_last_before_the_hand_over, MILLS)
{
    struct bench plain, pieces;
    bench_open(&plain, &mills[_i % MILLS]);
    bench_open(&pieces, &mills[_i % MILLS]);
    ck_assert_int_eq(mill_sim_run(plain.sim, 1.0, 25, NULL, &plain.error), MILL_OK);
    for (int k = 0; k < 25; k++) {
        ck_assert_int_eq(mill_sim_run(pieces.sim, 1.0, 1, NULL, &pieces.error), MILL_OK);
        hand_over(&pieces, &mills[_i % MILLS]);
    }
    runs_are_alike(&plain, &pieces);
    bench_close(&plain);
    bench_close(&pieces);
}

/* So many hand-overs that some fall between two contacts of a pressed ball */
SLOW_TEST(pinches_are_counted_on_across_the_hand_over, PINCHING)
{
    struct bench plain, pieces;
    bench_open(&plain, &pinching[_i]);
    bench_run(&plain, 0.2);
    ck_assert_uint_gt(plain.world->counts.reliefs, 0);
    bench_open(&pieces, &pinching[_i]);
    run_in_pieces(&pieces, &pinching[_i], 0.2, 400, 7);
    runs_are_alike(&plain, &pieces);
    bench_close(&plain);
    bench_close(&pieces);
}

TEST(saving_changes_nothing)
{
    struct bench plain, saved;
    struct kept kept;
    bench_open(&plain, &mills[0]);
    bench_run(&plain, 0.1);
    bench_open(&saved, &mills[0]);
    while (mill_sim_time(saved.sim) < 0.1) {
        ck_assert_int_eq(mill_sim_run(saved.sim, 0.1, 500, NULL, &saved.error), MILL_OK);
        save(&saved, &kept);
        kept_free(&kept);
    }
    runs_are_alike(&plain, &saved);
    bench_close(&plain);
    bench_close(&saved);
}

TEST(what_was_loaded_is_what_was_saved)
{
    struct bench b;
    struct kept saved, again;
    bench_open(&b, &mills[1]);
    bench_run(&b, 0.07);
    save(&b, &saved);
    hand_over(&b, &mills[1]);
    save(&b, &again);
    forget_places(&saved, "plan");
    forget_places(&again, "plan");
    ck_assert(kept_alike(&saved, &again));
    kept_free(&saved);
    kept_free(&again);
    bench_close(&b);
}

TEST(a_state_from_before_the_first_event_serves_too)
{
    struct bench plain, later;
    bench_open(&plain, &mills[0]);
    bench_run(&plain, 0.05);
    bench_open(&later, &mills[0]);
    hand_over(&later, &mills[0]);
    bench_run(&later, 0.05);
    runs_are_alike(&plain, &later);
    bench_close(&plain);
    bench_close(&later);
}

/* One mill, and others that differ in the number of balls, shapes or cells */
static const struct model own = {
    .setup = {.gravity.z = -9.81, .drum = {.radius = 0.04, .length = 0.04}},
    .balls = {{.diameter = 0.005, .density = STEEL, .count = 100}},
    .rotor = {.speed = 1000 * RPM},
    .shaft = 0.008,
    .blades = 2,
    .blade = {{.tip_radius = 0.033, .width = 0.008, .thickness = 0.005}},
    .law = {.restitution = 0.8}};
enum { OTHERS = 4 };

static struct model other_than_own(int how)
{
    struct model m = own;
    m.balls[0].count += how == 0 ? 1 : how == 1 ? -1 : 0;
    m.setup.drum.radius += how == 2 ? 0.02 : 0.0;
    m.blades -= how == 3;
    return m;
}

LOOP_TEST(a_state_of_another_mill_is_refused, OTHERS)
{
    const struct model another = other_than_own(_i);
    struct bench b, other;
    struct kept kept;
    bench_open(&b, &own);
    bench_run(&b, 0.02);
    save(&b, &kept);
    bench_open(&other, &another);
    ck_assert_int_eq(load(&other, &kept), MILL_FAILED);
    ck_assert_str_eq(other.error.text, "the saved balls are of another deck");
    bench_run(&other, 0.02); /* and it is none the worse for it */
    bench_close(&other);
    bench_close(&b);
    kept_free(&kept);
}

TEST(a_field_missing_or_of_another_length_is_refused)
{
    struct bench b;
    struct kept kept;
    bench_open(&b, &own);
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

/* Each size has a grid of its own. */
static const struct model mixed = {
    .setup = {.drum = {.radius = 0.04, .length = 0.04}, .speed = 1.0},
    .balls = {{.diameter = 0.012, .density = STEEL, .count = 10},
              {.diameter = 0.003, .density = STEEL, .count = 600}},
    .law = {.restitution = 0.8}};

TEST(a_mixture_handed_over_again_and_again_ends_with_the_same_bits)
{
    struct bench plain, pieces;
    bench_open(&plain, &mixed);
    ck_assert_int_eq(plain.sim->schedule->grids.classes, 2);
    bench_run(&plain, 0.07);
    bench_open(&pieces, &mixed);
    run_in_pieces(&pieces, &mixed, 0.07, 2000, 3);
    runs_are_alike(&plain, &pieces);
    bench_close(&plain);
    bench_close(&pieces);
}

/* A state in which two balls have changed their sizes: each is then in one row, of the grid of its
 * new size. */
TEST(each_ball_is_in_the_grid_of_its_size_in_the_state)
{
    struct bench from, to;
    struct kept kept;
    bench_open(&from, &mixed);
    bench_run(&from, 0.005);
    from.world->ball[0].species = 1;
    from.world->ball[609].species = 0;
    save(&from, &kept);
    bench_open(&to, &mixed);
    ck_assert_int_eq(load(&to, &kept), MILL_OK);
    const struct mill_grids *g = &to.sim->schedule->grids;
    long held[2] = {0, 0};
    for (int k = 0; k < 2; k++)
        for (int32_t cell = 0; cell < mill_cells_count(&g->own[k]); cell++)
            held[k] += mill_cells_held(&g->own[k], cell);
    ck_assert(held[0] == 600 && held[1] == 10);
    for (int32_t i = 0; i < 610; i++) {
        const struct mill_cells *c = &g->own[g->class_of[to.world->ball[i].species]];
        int times = 0;
        for (int32_t k = 0; k < mill_cells_held(c, c->cell[i]); k++)
            times += mill_cells_ball(c, c->cell[i], k) == i;
        ck_assert_int_eq(times, 1);
    }
    kept_free(&kept);
    bench_close(&from);
    bench_close(&to);
}

static void damage(struct mill_sim *sim, int how)
{
    struct mill_world *w = sim->world;
    struct mill_plan *plan = &sim->schedule->plan[42];
    int32_t *cell = &sim->schedule->cells->cell[42];
    switch (how) {
    case 0:
        *cell = mill_cells_count(sim->schedule->cells);
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
    case 15:
        plan->next = MILL_NEXT_EXIT + 1;
        plan->exit_t = sim->now;
        break;
    case 16:
        plan->next = MILL_NEXT_PAIR;
        plan->partner = MILL_NOBODY;
        plan->pair_t = INFINITY;
        plan->exit_t = sim->now;
        break;
    case 17:
        plan->next = MILL_NEXT_SURFACE;
        plan->shape = MILL_NOBODY;
        plan->shape_t = INFINITY;
        plan->exit_t = sim->now;
        break;
    }
}
enum { DAMAGES = 18 };

LOOP_TEST(an_index_out_of_range_is_refused, DAMAGES)
{
    struct bench good, bad;
    struct kept kept;
    bench_open(&bad, &own);
    bench_run(&bad, 0.02);
    const int32_t cell = bad.sim->schedule->cells->cell[42];
    const int32_t species = bad.world->ball[42].species;
    damage(bad.sim, _i);
    save(&bad, &kept);
    bad.sim->schedule->cells->cell[42] = cell; /* so that it can be freed */
    bad.world->ball[42].species = species;
    bench_open(&good, &own);
    ck_assert_int_eq(load(&good, &kept), MILL_FAILED);
    ck_assert_str_eq(good.error.text, "the saved balls are damaged");
    kept_free(&kept);
    bench_close(&good);
    bench_close(&bad);
}

int main(void)
{
    return unit_run("sim_state");
}
