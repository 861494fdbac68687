/* Soft spheres in whole mills: the books close, threads, pauses and hand-overs have no part in a
 * run, damaged states are refused, observers hear of each contact once, and power and energies are
 * those of hard spheres. */
#include "engine/soft.h"
#include "sim_fixture.h"

/* So soft that the tests are short */
#define MODULUS 3e7
#define END 0.07 /* [s] local time restarts once */

static struct model softened(const struct model *mill, double modulus, long steps)
{
    struct model m = *mill;
    m.setup.soft = (struct mill_soft_setup){.on = 1, .modulus = modulus, .steps = steps};
    return m;
}

static struct model soft_mill(int k)
{
    return softened(&mills[k], MODULUS, 40);
}

/* All that the next step depends on, and all results. `pooled`: also the contacts and where they
 * are kept, which a hand-over may change */
static void states_are_alike(const struct bench *a, const struct bench *b, bool pooled)
{
    struct kept one, two;
    kept_init(&one);
    kept_init(&two);
    mill_sim_state(a->sim, &one.state);
    mill_sim_state(b->sim, &two.state);
    ck_assert_uint_eq(one.fields, two.fields);
    for (size_t k = 0; k < one.fields; k++)
        ck_assert_msg((!pooled && (!strcmp(one.field[k].name, "touch") ||
                                   !strcmp(one.field[k].name, "soft_ball"))) ||
                          (one.field[k].bytes == two.field[k].bytes &&
                           memcmp(one.field[k].value, two.field[k].value, one.field[k].bytes) == 0),
                      "%s differs", one.field[k].name);
    kept_free(&one);
    kept_free(&two);
    runs_are_alike(a, b);
    ck_assert_mem_eq(&a->world->soft_facts, &b->world->soft_facts, sizeof a->world->soft_facts);
}

/* ---- books ---- */

/* Root of the mean square of the balance, over some starts */
static double balance(int k, long steps)
{
    enum { SEEDS = 3 };
    double sum = 0.0;
    for (unsigned long seed = 1; seed <= SEEDS; seed++) {
        struct model m = softened(&mills[k], 1e8, steps);
        struct bench b;
        m.setup.seed = seed;
        bench_open(&b, &m);
        bench_run(&b, 0.03);
        ck_assert_uint_gt(b.world->soft_facts.contacts, 50);
        sum += bench_balance(&b) * bench_balance(&b);
        bench_close(&b);
    }
    return sqrt(sum / SEEDS);
}

/* Of second order but where a contact begins to slide or leaves an edge within a step: there are
 * most of these in the first mill. */
SLOW_TEST(books_close_to_a_ten_thousandth_and_finer_steps_close_them_better, MILLS)
{
    const double coarse = balance(_i, 40), fine = balance(_i, 160);
    ck_assert_double_lt(coarse, 1e-4);
    ck_assert_msg(fine < coarse / (_i == 0 ? 2.0 : 4.0), "%g at 40 steps, %g at 160", coarse, fine);
}
END_TEST

/* A box of balls that fly apart: work is none, and what is not lost is in motion or in springs. */
TEST(energy_is_in_motion_or_in_springs_or_lost_at_every_moment)
{
    const struct model m = soft_mill(2);
    struct bench b;
    double most = 0.0;
    bench_open(&b, &m);
    for (int k = 1; k <= 300; k++) {
        bench_run(&b, 1e-4 * k);
        most = fmax(most, b.world->account.elastic);
        ck_assert_double_lt(bench_balance(&b), 2e-4);
    }
    ck_assert_double_gt(most, 0.01 * b.world->start.kinetic); /* not for nothing */
    bench_close(&b);
}
END_TEST

/* ---- observers ---- */

static size_t lasting(const struct mill_soft *s, double *lost)
{
    size_t count = 0;
    for (int k = 0; k < s->parts; k++)
        for (size_t n = 0; n < s->part[k].touch.count; n++) {
            const struct mill_soft_touch *t = mill_soft_touch(&s->part[k], (int32_t)n);
            count += t->a >= 0;
            *lost += t->a >= 0 ? t->lost : 0.0;
        }
    return count;
}

LOOP_TEST(observers_hear_of_each_contact_once_when_it_ends, 2)
{
    const struct model m = soft_mill(3 * _i);
    struct bench b;
    struct witness w;
    bench_open(&b, &m);
    witness_join(&w, &b, 1e-3);
    bench_run(&b, END);
    witness_is_content(&w);
    uint64_t heard = 0;
    double lost = w.dissipation, all = 0.0;
    for (int k = 0; k < MILL_KINDS; k++) {
        heard += w.impacts[k];
        all += b.world->account.dissipation[k];
        ck_assert_uint_eq(w.impacts[k], b.world->account.collisions[k]);
    }
    ck_assert_uint_eq(heard + lasting(b.sim->soft, &lost), b.world->soft_facts.contacts);
    ck_assert_uint_gt(heard, 100);
    ck_assert_double_eq_tol(lost, all, 1e-10 * b.world->account.dissipation_gross);
    bench_close(&b);
}
END_TEST

/* ---- threads and pauses ---- */

/* Remembers all impacts as one number. */
struct listener {
    struct mill_observer base; /* first: the loop hands its address back */
    uint64_t calls;
};

static enum mill_status hear(struct mill_observer *o, const struct mill_impact *i,
                             struct mill_error *error)
{
    struct listener *l = (struct listener *)o;
    const double numbers[] = {i->time,      i->normal_speed, i->dissipation,     (double)i->ball,
                              i->impulse.y, i->place.z,      (double)i->partner, (double)i->slid,
                              i->slip.x,    i->facing.x,     i->position.x};
    const unsigned char *at = (const unsigned char *)numbers;
    (void)error;
    for (size_t k = 0; k < sizeof numbers; k++)
        l->calls = (l->calls ^ at[k]) * UINT64_C(0x100000001B3);
    return MILL_OK;
}

static const struct mill_observer_type hears = {.impact = hear};

static void open_heard(struct bench *b, struct listener *l, const struct model *m, int threads)
{
    bench_open(b, m);
    *l = (struct listener){{&hears, INFINITY}, 0};
    ck_assert_int_eq(mill_sim_observe(b->sim, &l->base), MILL_OK);
    if (threads > 1)
        mill_sim_use_threads(b->sim, threads);
    ck_assert_int_eq(mill_sim_threads(b->sim), threads);
}

static void share(int mill, int threads)
{
    const struct model m = soft_mill(mill);
    struct bench one, more;
    struct listener heard[2];
    open_heard(&one, &heard[0], &m, 1);
    open_heard(&more, &heard[1], &m, threads);
    bench_run(&one, END);
    bench_run(&more, END);
    ck_assert_uint_eq(heard[0].calls, heard[1].calls);
    states_are_alike(&one, &more, true);
    bench_close(&one);
    bench_close(&more);
}

TEST(two_threads_change_no_bit)
{
    share(0, 2);
}
END_TEST

SLOW_TEST(no_number_of_threads_changes_a_bit, 2 * MILLS)
{
    share(_i / 2, 2 + _i % 2);
}
END_TEST

/* The threads may change on the way, too. */
SLOW_TEST(pauses_change_no_bit, MILLS)
{
    const struct model m = soft_mill(_i);
    struct bench plain, paused;
    struct listener heard[2];
    uint64_t seed = 8;
    open_heard(&plain, &heard[0], &m, 1);
    open_heard(&paused, &heard[1], &m, 1);
    bench_run(&plain, END);
    for (int k = 0; mill_sim_time(paused.sim) < END; k++) {
        const double until = k % 3 ? END : fmin(END, mill_sim_time(paused.sim) + 1e-5);
        mill_sim_use_threads(paused.sim, k % 10 == 0 ? 2 : 1);
        ck_assert_int_eq(
            mill_sim_run(paused.sim, until, 1 + random_bits(&seed) % 200, NULL, &paused.error),
            MILL_OK);
    }
    ck_assert_uint_eq(heard[0].calls, heard[1].calls);
    states_are_alike(&plain, &paused, true);
    bench_close(&plain);
    bench_close(&paused);
}
END_TEST

/* ---- the state ---- */

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

static void relay(struct model m)
{
    struct bench plain, pieces;
    uint64_t seed = 5;
    bench_open(&plain, &m);
    bench_run(&plain, END);
    bench_open(&pieces, &m);
    while (mill_sim_time(pieces.sim) < END) {
        ck_assert_int_eq(
            mill_sim_run(pieces.sim, END, 1 + random_bits(&seed) % 800, NULL, &pieces.error),
            MILL_OK);
        hand_over(&pieces, &m);
    }
    states_are_alike(&plain, &pieces, false);
    bench_close(&plain);
    bench_close(&pieces);
}

TEST(a_run_handed_over_again_and_again_ends_with_the_same_bits)
{
    relay(soft_mill(0));
}
END_TEST

/* Balls that go on at the other end of a slice are near other surfaces at once. They are few, so
 * that no faster one makes the search for surfaces more frequent. */
LOOP_TEST(a_periodic_run_handed_over_again_and_again_ends_with_the_same_bits, 4)
{
    struct model m = soft_mill(0);
    m.setup = (struct mill_setup){.drum = {.radius = 0.04, .length = 0.04, .periodic = true},
                                  .speed = 3.0,
                                  .seed = 1 + (unsigned long)_i,
                                  .soft = m.setup.soft};
    m.balls[0].count = 4;
    m.rotor.speed = 0.1;
    m.blades = 1;
    m.blade[0].thickness = 0.03;
    m.blade[0].pitch = 0.0;
    m.blade[0].position = 0.5 * m.blade[0].width + 0.007 - 0.5 * m.setup.drum.length;
    m.law = (struct mill_law){1.0, 0.0, 0.0};
    relay(m);
}
END_TEST

SLOW_TEST(every_run_handed_over_again_and_again_ends_with_the_same_bits, MILLS)
{
    relay(soft_mill(_i));
}
END_TEST

TEST(a_state_of_hard_spheres_is_refused)
{
    const struct model soft = soft_mill(0);
    struct bench from, to;
    struct kept kept;
    for (int k = 0; k < 2; k++) {
        bench_open(&from, k ? &mills[0] : &soft);
        bench_open(&to, k ? &soft : &mills[0]);
        save(&from, &kept);
        ck_assert_int_eq(load(&to, &kept), MILL_FAILED);
        kept_free(&kept);
        bench_close(&from);
        bench_close(&to);
    }
}
END_TEST

TEST(a_field_missing_or_of_another_length_is_refused)
{
    const struct model m = soft_mill(0);
    struct bench b;
    struct kept kept;
    bench_open(&b, &m);
    bench_run(&b, 0.01);
    save(&b, &kept);
    for (size_t k = 0; k < kept.fields; k++) {
        kept.field[k].bytes -= 4;
        ck_assert_int_eq(load(&b, &kept), MILL_FAILED);
        kept.field[k].bytes += 4;
        kept.field[k].name[0] ^= 1;
        ck_assert_int_eq(load(&b, &kept), MILL_FAILED);
        kept.field[k].name[0] ^= 1;
    }
    ck_assert_msg(load(&b, &kept) == MILL_OK, "%s", b.error.text);
    kept_free(&kept);
    bench_close(&b);
}
END_TEST

/* The first contact between balls, or with a surface, of a saved state */
static struct mill_soft_touch *saved_touch(struct kept *kept, bool surface)
{
    struct kept_field *f = kept_find(kept, "touch");
    struct mill_soft_touch *t = (struct mill_soft_touch *)(void *)f->value;
    for (size_t k = 0; k < f->bytes / sizeof *t; k++)
        if ((t[k].b < 0) == surface)
            return &t[k];
    ck_abort_msg("there is no such contact");
    return NULL;
}

static void damage(struct kept *kept, const struct bench *b, int how)
{
    struct mill_soft_touch *pair = saved_touch(kept, false), *wall = saved_touch(kept, true);
    int32_t *slot = (int32_t *)(void *)kept_find(kept, "slot")->value;
    int64_t *step = (int64_t *)(void *)kept_find(kept, "step")->value;
    struct mill_ball *ball = (struct mill_ball *)(void *)kept_find(kept, "ball")->value;
    const int32_t balls = b->world->balls;
    switch (how) {
    case 0:
        slot[42] = balls;
        break;
    case 1:
        slot[42] = -1;
        break;
    case 2:
        slot[42] = slot[41];
        break;
    case 3:
        pair->b = balls;
        break;
    case 4:
        pair->b = pair->a; /* itself */
        break;
    case 5:
        pair->b = MILL_NOBODY - 1;
        break;
    case 6:
        pair->a = -1;
        break;
    case 7:
        pair->a = balls;
        break;
    case 8:
        wall->shape = b->world->shapes;
        break;
    case 9:
        wall->shape = -1;
        break;
    case 10:
        *step = -1;
        break;
    case 11:
        *step = b->sim->soft->steps;
        break;
    case 12:
        ball[42].species = -1;
        break;
    case 13:
        pair->a = 0;
        pair->b = balls - 1; /* which is far from it */
        break;
    case 14:
        ball[42].v.x = NAN;
        break;
    case 15:
        wall->drag.z = INFINITY;
        break;
    case 16:
        ((struct mill_soft_ball *)(void *)kept_find(kept, "soft_ball")->value)[42].turn.y = NAN;
        break;
    }
}
enum { DAMAGES = 17 };

LOOP_TEST(a_damaged_state_is_refused, DAMAGES)
{
    const struct model m = soft_mill(0);
    struct bench from, to;
    struct kept kept;
    bench_open(&from, &m);
    bench_run(&from, 0.02);
    save(&from, &kept);
    damage(&kept, &from, _i);
    bench_open(&to, &m);
    ck_assert_int_eq(load(&to, &kept), MILL_FAILED);
    ck_assert_msg(strstr(to.error.text, "damaged"), "%s", to.error.text);
    kept_free(&kept);
    bench_close(&to);
    bench_close(&from);
}
END_TEST

/* ---- too soft ---- */

/* Balls that are pressed into each other by a radius can pass each other. */
TEST(a_run_of_balls_that_are_too_soft_ends)
{
    struct model m = softened(&mills[0], 1e5, 40);
    struct bench b;
    m.rotor.speed = 1e5 * RPM;
    bench_open(&b, &m);
    ck_assert_int_eq(mill_sim_run(b.sim, 0.05, UINT64_MAX, NULL, &b.error), MILL_FAILED);
    ck_assert_msg(strstr(b.error.text, "need a larger soft.modulus"), "%s", b.error.text);
    bench_close(&b);
}
END_TEST

/* A surface that hardly moves does not say how fast the balls are. */
TEST(springs_are_made_for_the_fastest_of_surfaces_balls_and_falls)
{
    struct model m = softened(&mills[0], 1e9, 40);
    struct bench b;
    m.rotor.speed = 1e-9;
    for (int k = 0; k < 2; k++) {
        m.setup.speed = 20.0 * k;
        bench_open(&b, &m);
        const double fall = 0.3 * sqrt(2.0 * 9.81 * 2.0 * m.setup.drum.radius);
        ck_assert_double_eq_tol(b.world->soft_facts.speed, k ? 20.0 : fall, 1e-9);
        bench_close(&b);
    }
}
END_TEST

/* ---- hard and soft spheres ---- */

/* A short mill, full of balls; no gap is as wide as one of them */
static const struct model dense = {
    .setup = {.gravity.z = -9.81, .drum = {.radius = 0.03, .length = 0.036}},
    .balls = {{.diameter = 0.004, .density = STEEL, .count = 900}},
    .rotor = {.speed = 1000 * RPM},
    .shaft = 0.006,
    .blades = 2,
    .blade = {{.tip_radius = 0.024, .width = 0.006, .thickness = 0.004, .pitch = 20 * DEG}},
    .law = {0.7, 0.3, 0.3}};

struct mean {
    double value, error;
};

static struct mean mean_of(const double *x, int count)
{
    double sum = 0.0, squares = 0.0;
    for (int k = 0; k < count; k++)
        sum += x[k] / count;
    for (int k = 0; k < count; k++)
        squares += (x[k] - sum) * (x[k] - sum);
    return (struct mean){sum, sqrt(squares / (count - 1.0) / count)};
}

SLOW_TEST(power_and_energies_of_a_dense_mill_are_those_of_hard_spheres, 1)
{
    enum { STARTS = 4, FIGURES = 3 };
    /* at 1 GPa, less than 5 % of the power and a tenth of the spin is the softness's (docs/soft.md)
     */
    static const double softer[FIGURES] = {0.0, 0.1, 0.05};
    double x[2][FIGURES][STARTS] = {{{0.0}}};
    for (int soft = 0; soft < 2; soft++)
        for (int k = 0; k < STARTS; k++) {
            struct model m = softened(&dense, 1e9, 40);
            struct bench b;
            m.setup.seed = 1 + (unsigned long)k;
            m.setup.soft.on = soft;
            bench_open(&b, &m);
            bench_run(&b, 0.03);
            const double before = b.world->account.work;
            for (int at = 0; at < 60; at++) {
                bench_run(&b, 0.03 + 1e-3 * (at + 1));
                const struct mill_energy e = mill_world_energy(b.world, mill_sim_local_time(b.sim));
                x[soft][0][k] += e.kinetic / 60.0;
                x[soft][1][k] += e.rotational / 60.0;
            }
            x[soft][2][k] = (b.world->account.work - before) / 0.06;
            bench_close(&b);
        }
    for (int k = 0; k < FIGURES; k++) {
        const struct mean hard = mean_of(x[0][k], STARTS), soft = mean_of(x[1][k], STARTS);
        const double error = hypot(hard.error, soft.error), off = fabs(hard.value - soft.value);
        ck_assert_msg(off < 3.0 * error + softer[k] * soft.value, "%g and %g +- %g", hard.value,
                      soft.value, error);
        ck_assert_double_lt(error, 0.1 * soft.value); /* not for nothing */
    }
}
END_TEST

int main(void)
{
    return unit_run("soft_run");
}
