/* Claims about the loop on several threads: all results and calls of observers are those of one
 * thread, bit for bit, wherever the run ends or pauses, and also where there is no other thread. */
#define _GNU_SOURCE /* pthread_setattr_default_np */
#include "slabs_fixture.h"

#include <pthread.h>

/* All that the next event depends on, but where calendars have filed it */
static void states_are_alike(const struct bench *a, const struct bench *b)
{
    struct kept one, two;
    kept_init(&one);
    kept_init(&two);
    mill_sim_state(a->sim, &one.state);
    mill_sim_state(b->sim, &two.state);
    forget_places(&one, "plan");
    forget_places(&two, "plan");
    ck_assert_uint_eq(one.fields, two.fields);
    for (size_t k = 0; k < one.fields; k++)
        ck_assert_msg(one.field[k].bytes == two.field[k].bytes &&
                          memcmp(one.field[k].value, two.field[k].value, one.field[k].bytes) == 0,
                      "%s differs", one.field[k].name);
    kept_free(&one);
    kept_free(&two);
    runs_are_alike(a, b);
}

/* Remembers all calls as one number. */
struct listener {
    struct mill_observer base; /* first: the loop hands its address back */
    const struct mill_world *world;
    uint64_t calls, impacts;
    double every;                /* [s] between samples */
    uint64_t last, failed;       /* number of the impact that ends the run, or fails; 0: none */
    volatile sig_atomic_t *stop; /* set at each 500th impact; NULL: never */
};

static void remember(struct listener *l, const void *what, size_t bytes)
{
    for (const unsigned char *at = what, *end = at + bytes; at < end; at++)
        l->calls = (l->calls ^ *at) * UINT64_C(0x100000001B3);
}

static enum mill_status hear(struct mill_observer *o, const struct mill_impact *i,
                             struct mill_error *error)
{
    struct listener *l = (struct listener *)o;
    const double numbers[] = {i->time,        i->normal_speed, i->dissipation,  i->position.x,
                              i->impulse.y,   i->place.z,      (double)i->ball, (double)i->partner,
                              i->facing.x,    i->slip.z,       (double)i->slid, (double)i->lasting,
                              (double)i->kind};
    const struct mill_world *w = l->world;
    const vec3 y = w->motions ? mill_motion_pose(w->motion[0], i->time - w->base).y : nought;
    remember(l, numbers, sizeof numbers);
    remember(l, &y, sizeof y);
    l->impacts++;
    if (l->stop && l->impacts % 500 == 0)
        *l->stop = 1;
    if (l->impacts == l->failed)
        return mill_error_set(error, MILL_FAILED, "impact %d fails", (int)l->failed);
    return l->last > 0 && l->impacts >= l->last ? mill_error_set(error, MILL_ENDED, "heard enough")
                                                : MILL_OK;
}

/* What a sample sees of the balls, the account and the motions */
static enum mill_status look(struct mill_observer *o, const struct mill_world *w, double t,
                             struct mill_error *error)
{
    struct listener *l = (struct listener *)o;
    (void)error;
    for (int32_t i = 0; i < w->balls; i++) {
        const vec3 r = mill_world_position(w, i, t), v = mill_world_velocity(w, i, t);
        remember(l, &r, sizeof r);
        remember(l, &v, sizeof v);
        remember(l, &w->spin[i], sizeof w->spin[i]);
    }
    remember(l, &w->account, sizeof w->account);
    for (int k = 0; k < w->motions; k++) {
        const vec3 y = mill_motion_pose(w->motion[k], t).y;
        remember(l, &y, sizeof y);
    }
    o->next += l->every;
    return MILL_OK;
}

static const struct mill_observer_type hears = {.impact = hear},
                                       looks = {.name = "looks", .sample = look},
                                       both = {.impact = hear, .sample = look};

/* The mill with two observers */
struct heard {
    struct bench b;
    struct listener l, after; /* the second gets all impacts */
};

static void join(struct listener *l, struct bench *b, const struct mill_observer_type *type)
{
    memset(l, 0, sizeof *l);
    l->base.type = type;
    l->world = b->world;
    l->every = 2e-3;
    l->base.next = 1e-3;
    ck_assert_int_eq(mill_sim_observe(b->sim, &l->base), MILL_OK);
}

static void open_heard(struct heard *h, const struct mill_observer_type *type, int threads)
{
    bench_open(&h->b, &long_stirred);
    use_threads(&h->b, threads);
    join(&h->l, &h->b, type);
    join(&h->after, &h->b, &hears);
}

static void are_alike(struct heard *one, struct heard *two)
{
    ck_assert_uint_eq(one->l.impacts, two->l.impacts);
    ck_assert_uint_eq(one->l.calls, two->l.calls);
    ck_assert_uint_eq(one->after.impacts, two->after.impacts);
    ck_assert_uint_eq(one->after.calls, two->after.calls);
    states_are_alike(&one->b, &two->b);
}

static void close_both(struct heard *one, struct heard *two)
{
    bench_close(&one->b);
    bench_close(&two->b);
}

/* More threads than cores wait for each other for long: shorter runs */
static void come_to_the_same_state(int which, int threads, double end)
{
    const struct model model = long_mill(which);
    struct bench one, more;
    bench_open(&one, &model);
    bench_run(&one, end);
    ck_assert_int_eq(one.sim->schedule->grids.classes, which == MIXED ? 2 : 1);
    bench_open(&more, &model);
    use_threads(&more, threads);
    bench_run(&more, end);
    has_shared(&more);
    states_are_alike(&one, &more);
    ck_assert(end < 0.1 || (one.world->counts.reliefs > 0) == (which == NARROW));
    bench_close(&one);
    bench_close(&more);
}

LOOP_TEST(all_mills_come_to_the_same_state_on_two_threads, LONG_MILLS)
{
    come_to_the_same_state(_i, 2, _i == MIXED ? 0.02 : 0.1); /* local time restarts at 62.5 ms */
}

LOOP_TEST(and_on_more_threads_than_two, LONG_MILLS)
{
    come_to_the_same_state(_i, 3, _i == MIXED ? 0.006 : 0.02);
    come_to_the_same_state(_i, 4, _i == MIXED ? 0.006 : 0.02);
}

LOOP_TEST(observers_get_the_same_calls_in_the_same_order, 3)
{
    const struct mill_observer_type *const types[] = {&hears, &looks, &both};
    for (int threads = 2; threads <= 4; threads++) {
        const double end = threads == 2 ? 0.08 : 0.03;
        struct heard one, more;
        open_heard(&one, types[_i], 1);
        open_heard(&more, types[_i], threads);
        bench_run(&one.b, end);
        bench_run(&more.b, end);
        has_shared(&more.b);
        are_alike(&one, &more);
        ck_assert_uint_gt(one.after.impacts, 1000);
        close_both(&one, &more);
    }
}

static const uint64_t some_impacts[] = {1, 2, 1000, 2001, 4097, 12000};

LOOP_TEST(an_observer_ends_the_run_at_the_same_impact_and_others_still_get_it, 6)
{
    const uint64_t last = some_impacts[_i];
    struct heard one, more;
    open_heard(&one, &both, 1);
    open_heard(&more, &both, _i < 4 ? 4 - _i % 2 : 2);
    one.l.last = more.l.last = last;
    for (int more_of_it = 0; more_of_it < 3; more_of_it++) { /* the next impacts end it, too */
        ck_assert_int_eq(mill_sim_run(one.b.sim, 1.0, NO_LIMIT, NULL, &one.b.error), MILL_ENDED);
        ck_assert_int_eq(mill_sim_run(more.b.sim, 1.0, NO_LIMIT, NULL, &more.b.error), MILL_ENDED);
        ck_assert_str_eq(more.b.error.text, "heard enough");
        ck_assert_uint_eq(more.l.impacts, last + (uint64_t)more_of_it);
        ck_assert_uint_eq(more.after.impacts, more.l.impacts);
        are_alike(&one, &more);
    }
    one.l.last = more.l.last = 0;
    bench_run(&one.b, 0.05);
    bench_run(&more.b, 0.05);
    are_alike(&one, &more);
    close_both(&one, &more);
}

LOOP_TEST(a_failure_of_an_observer_ends_the_run_at_the_same_impact_with_its_message, 6)
{
    struct heard one, more;
    open_heard(&one, &both, 1);
    open_heard(&more, &both, _i < 4 ? 4 - _i % 2 : 2);
    one.l.failed = more.l.failed = some_impacts[_i];
    ck_assert_int_eq(mill_sim_run(one.b.sim, 1.0, NO_LIMIT, NULL, &one.b.error), MILL_FAILED);
    ck_assert_int_eq(mill_sim_run(more.b.sim, 1.0, NO_LIMIT, NULL, &more.b.error), MILL_FAILED);
    ck_assert_str_eq(more.b.error.text, one.b.error.text);
    ck_assert_uint_eq(more.l.impacts, some_impacts[_i]); /* and it gets no other call */
    ck_assert_uint_eq(more.after.impacts, some_impacts[_i] - 1);
    are_alike(&one, &more);
    close_both(&one, &more);
}

/* Of all kinds, with those of pinched balls */
static uint64_t contacts(const struct bench *b)
{
    return bench_collisions(b) + b->world->counts.pinch_contacts;
}

TEST(pauses_change_nothing_and_after_each_the_observers_have_got_everything)
{
    struct heard one, more;
    open_heard(&one, &both, 1);
    open_heard(&more, &both, 2);
    bench_run(&one.b, 0.08);
    int pauses = 0;
    for (uint64_t seed = 1; mill_sim_time(more.b.sim) < 0.08; pauses++) {
        const uint64_t budget = 1 + random_bits(&seed) % 3000;
        ck_assert_int_eq(mill_sim_run(more.b.sim, 0.08, budget, NULL, &more.b.error), MILL_OK);
        ck_assert_uint_eq(more.l.impacts, contacts(&more.b));
    }
    ck_assert_int_gt(pauses, 8);
    has_shared(&more.b);
    are_alike(&one, &more);
    close_both(&one, &more);
}

TEST(a_run_that_was_stopped_goes_on_to_the_same_bits)
{
    struct heard one, more;
    volatile sig_atomic_t stop = 0;
    open_heard(&one, &both, 1);
    open_heard(&more, &both, 2);
    bench_run(&one.b, 0.08);
    more.l.stop = &stop;
    int stops = 0;
    enum mill_status status;
    while ((status = mill_sim_run(more.b.sim, 0.08, NO_LIMIT, &stop, &more.b.error)) != MILL_OK) {
        ck_assert_int_eq(status, MILL_STOPPED);
        ck_assert_uint_eq(more.l.impacts, contacts(&more.b));
        ck_assert_uint_lt(more.l.impacts, 500 * (uint64_t)(stops + 1) + 2000); /* soon */
        stop = 0;
        stops++;
    }
    ck_assert_int_gt(stops, 5);
    are_alike(&one, &more);
    close_both(&one, &more);
}

TEST(the_number_of_threads_can_change_between_two_calls)
{
    const int threads[] = {2, 1, 4, 3, 2, 1, 3};
    struct heard one, more;
    open_heard(&one, &both, 1);
    open_heard(&more, &both, 2);
    bench_run(&one.b, 0.07);
    for (int k = 0; k < 7; k++) {
        use_threads(&more.b, threads[k]);
        bench_run(&more.b, 0.01 * (k + 1));
        if (threads[k] > 1 && k < 6) /* not just after local time has been restarted */
            has_shared(&more.b);
    }
    bench_run(&more.b, 0.07);
    are_alike(&one, &more);
    close_both(&one, &more);
}

/* No thread can have a stack of this size. */
static void forbid_threads(void)
{
    pthread_attr_t attr;
    pthread_t id;
    ck_assert_int_eq(pthread_attr_init(&attr), 0);
    ck_assert_int_eq(pthread_attr_setstacksize(&attr, (size_t)1 << 60), 0);
    ck_assert_int_eq(pthread_setattr_default_np(&attr), 0);
    ck_assert_int_ne(pthread_create(&id, NULL, (void *(*)(void *))abort, NULL), 0);
}

TEST(where_no_thread_can_be_started_one_does_all)
{
    struct heard one, more;
    open_heard(&one, &both, 1);
    bench_run(&one.b, 0.05);
    forbid_threads();
    open_heard(&more, &both, 4);
    bench_run(&more.b, 0.05);
    ck_assert_int_eq(windows(&more.b), 0);
    are_alike(&one, &more);
    close_both(&one, &more);
}

TEST(a_mill_that_is_too_short_gets_no_slabs)
{
    struct model model = long_stirred;
    struct bench b;
    model.blades = 1;
    model.balls[0].count = 100;
    for (int layers = 6; layers < 90; layers++) {
        model.setup.drum.length = 0.005001 * layers;
        bench_open(&b, &model);
        mill_sim_use_threads(b.sim, 4);
        const int worth = layers < 20 ? 1 : layers < 45 ? 2 : layers < 80 ? 3 : 4;
        ck_assert_int_eq(mill_sim_threads(b.sim), worth);
        ck_assert_int_eq(b.sim->slabs == NULL, layers < 20);
        bench_run(&b, 0.002);
        bench_close(&b);
    }
}

/* A heap that falls asleep */
TEST(with_sleeping_balls_one_thread_goes_on)
{
    const struct model heap = {
        .setup = {.gravity.z = -9.81, .drum = {.radius = 0.01, .length = 0.08}, .speed = 0.5},
        .balls = {{.diameter = 0.005, .density = STEEL, .count = 40}},
        .law = {0.6, 0.5, 0.4}};
    struct bench one, two;
    bench_open(&one, &heap);
    bench_open(&two, &heap);
    use_threads(&two, 2);
    bench_run(&two, 0.06);
    has_shared(&two);
    while (two.world->counts.asleep == 0 && mill_sim_time(two.sim) < 10.0)
        bench_run(&two, mill_sim_time(two.sim) + MILL_WORLD_EPOCH);
    ck_assert_int_gt(two.world->counts.asleep, 0);
    const double end = mill_sim_time(two.sim) + 0.3 * MILL_WORLD_EPOCH;
    bench_run(&one, end);
    bench_run(&two, end);
    ck_assert_int_eq(windows(&two), 0);
    states_are_alike(&one, &two);
    bench_close(&one);
    bench_close(&two);
}

/* Both halves of a mill are mirror images, and its cells' edges have no rounding errors: every
 * event has a twin at exactly the same time. mirrored: balls whose images start like them */
static void open_twins(struct bench *b, int32_t mirrored)
{
    enum { PAIRS = 128 };
    static struct mill_setup_ball start[2 * PAIRS];
    const struct model model = {
        .setup = {.drum = {.radius = 0.021, .length = 0.125}, .start = start},
        .floorless = true,
        .balls = {{.diameter = 0.0075, .density = STEEL, .count = 2 * PAIRS}},
        .law = {.restitution = 1.0}};
    uint64_t seed = 5;
    for (int32_t k = 0; k < PAIRS; k++) {
        const vec3 r = {-0.0625 + 0.0078125 * (k / 16 + 0.5), 0.008 * (k % 4 - 1.5),
                        0.008 * (k / 4 % 4 - 1.5)};
        const vec3 v = vec3_scale(direction(&seed), 1.0), w = vec3_scale(direction(&seed), 1.0);
        /* the first of two is now in this half, now in the other */
        const int32_t left = k + k % 2 * PAIRS, right = k + !(k % 2) * PAIRS;
        start[left] = (struct mill_setup_ball){r, v, nought};
        start[right] = (struct mill_setup_ball){{-r.x, r.y, r.z}, {-v.x, v.y, v.z}, nought};
        if (k >= mirrored)
            start[right].velocity = w;
    }
    bench_open(b, &model);
}

LOOP_TEST(events_at_exactly_equal_times_in_two_slabs_come_in_the_order_of_one_thread, 2)
{
    struct bench one, two;
    struct witness w;
    struct listener l[2];
    int ties = 0;
    open_twins(&one, _i ? 40 : 128);
    open_twins(&two, _i ? 40 : 128);
    witness_join(&w, &one, INFINITY);
    join(&l[0], &one, &hears);
    join(&l[1], &two, &hears);
    use_threads(&two, 2);
    for (int k = 1; k <= 4; k++) {
        bench_run(&one, 0.01 * k);
        bench_run(&two, 0.01 * k);
        states_are_alike(&one, &two);
        ck_assert_uint_eq(l[0].calls, l[1].calls);
        ck_assert_int_gt(windows(&two), 10 * k);
    }
    for (int k = 1; k < 64; k++)
        ties += w.time[k] == w.time[k - 1];
    ck_assert_int_ge(ties, _i ? 5 : 20);
    bench_close(&one);
    bench_close(&two);
}

LOOP_TEST(a_run_can_be_taken_up_with_another_number_of_threads, LONG_MILLS)
{
    const struct model model = long_mill(_i);
    const int threads[] = {2, 1, 4, 2};
    struct bench plain, b;
    bench_open(&plain, &model);
    const double part = _i == MIXED ? 0.002 : 0.01;
    bench_run(&plain, 4.0 * part);
    bench_open(&b, &model);
    use_threads(&b, threads[0]);
    for (int k = 1; k <= 4; k++) {
        struct kept kept;
        bench_run(&b, part * k);
        kept_init(&kept);
        mill_sim_state(b.sim, &kept.state);
        bench_close(&b);
        bench_open(&b, &model);
        use_threads(&b, threads[k % 4]);
        mill_sim_state(b.sim, kept_load(&kept));
        ck_assert_int_eq(kept.state.status, MILL_OK);
        kept_free(&kept);
    }
    states_are_alike(&plain, &b);
    bench_close(&plain);
    bench_close(&b);
}

int main(void)
{
    return unit_run("sim_slabs");
}
