/* Claims about the observers on a second thread: they get the same calls as on one thread, the run
 * ends at the same event, and the program goes on where there is no second thread. */
#include "sim_fixture.h"

#include <pthread.h>

/* Remembers all calls as one number, and who made them. */
struct listener {
    struct mill_observer base; /* first: the loop hands its address back */
    const struct mill_world *world;
    uint64_t calls, impacts;
    double every;          /* [s] between samples */
    uint64_t last, failed; /* number of the impact that ends the run, or fails; 0: none */
    pthread_t first;       /* the thread of the loop */
    uint64_t elsewhere;    /* calls on another thread */
};

static void remember(struct listener *l, const void *what, size_t bytes)
{
    for (const unsigned char *at = what, *end = at + bytes; at < end; at++)
        l->calls = (l->calls ^ *at) * UINT64_C(0x100000001B3);
    l->elsewhere += !pthread_equal(pthread_self(), l->first);
}

static enum mill_status hear(struct mill_observer *o, const struct mill_impact *i,
                             struct mill_error *error)
{
    struct listener *l = (struct listener *)o;
    const double numbers[] = {i->time,        i->normal_speed, i->dissipation,  i->position.x,
                              i->impulse.y,   i->place.z,      (double)i->ball, (double)i->partner,
                              i->facing.x,    i->slip.z,       (double)i->slid, (double)i->lasting,
                              (double)i->kind};
    const vec3 y = mill_motion_pose(l->world->motion[0], i->time - l->world->base).y;
    remember(l, numbers, sizeof numbers);
    remember(l, &y, sizeof y);
    l->impacts++;
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

static uint64_t ahead(const struct mill_observer *o)
{
    const struct listener *l = (const struct listener *)o;
    return l->last > 0 ? (l->last - l->impacts) / 2 : UINT64_MAX; /* at least */
}

static double then(const struct mill_observer *o)
{
    return o->next + ((const struct listener *)o)->every;
}

static double wrong_then(const struct mill_observer *o)
{
    return o->next + 1.5 * ((const struct listener *)o)->every;
}

static const struct mill_observer_type hears = {.impact = hear, .ahead = ahead},
                                       looks = {.name = "looks", .sample = look, .then = then},
                                       both = {.impact = hear,
                                               .sample = look,
                                               .ahead = ahead,
                                               .then = then},
                                       waits = {.impact = hear, .sample = look, .ahead = ahead},
                                       wrong = {
                                           .name = "wrong", .sample = look, .then = wrong_then};

/* A mill with an observer */
struct heard {
    struct bench b;
    struct listener l;
};

static void open_heard(struct heard *h, const struct mill_observer_type *type, int threads)
{
    memset(&h->l, 0, sizeof h->l);
    bench_open(&h->b, &mills[0]);
    h->l.base.type = type;
    h->l.world = h->b.world;
    h->l.first = pthread_self();
    h->l.every = 1e-3;
    h->l.base.next = type->sample ? 0.5e-3 : (double)INFINITY;
    mill_sim_use_threads(h->b.sim, threads);
    ck_assert_int_eq(mill_sim_observe(h->b.sim, &h->l.base), MILL_OK);
}

static void are_alike(struct heard *one, struct heard *two)
{
    ck_assert_uint_eq(one->l.impacts, two->l.impacts);
    ck_assert_uint_eq(one->l.calls, two->l.calls);
    ck_assert_uint_eq(one->l.elsewhere, 0);
    runs_are_alike(&one->b, &two->b);
}

static void close_both(struct heard *one, struct heard *two)
{
    bench_close(&one->b);
    bench_close(&two->b);
}

START_TEST(observers_get_the_same_calls_on_a_second_thread)
{
    const struct mill_observer_type *const types[] = {&hears, &looks, &both, &waits};
    struct heard one, two;
    open_heard(&one, types[_i], 1);
    open_heard(&two, types[_i], 2);
    struct witness w; /* so that there are impacts for the second thread in all cases */
    witness_join(&w, &two.b, INFINITY);
    bench_run(&one.b, 0.15);
    bench_run(&two.b, 0.15);
    witness_is_content(&w);
    are_alike(&one, &two);
    ck_assert_int_eq(mill_sim_threads(one.b.sim), 1);
    ck_assert_int_eq(mill_sim_threads(two.b.sim), 2);
    ck_assert_uint_gt(two.l.impacts > 0 || types[_i] == &looks, 0);
    ck_assert_uint_gt(two.l.elsewhere, 1000);
    close_both(&one, &two);
}
END_TEST

START_TEST(an_observer_ends_the_run_at_the_same_impact)
{
    const uint64_t last[] = {1, 2, 1000, 4096, 4097, 20000};
    struct heard one, two;
    open_heard(&one, &both, 1);
    open_heard(&two, &both, 2);
    one.l.last = two.l.last = last[_i];
    ck_assert_int_eq(mill_sim_run(one.b.sim, 1.0, NO_LIMIT, NULL, &one.b.error), MILL_ENDED);
    ck_assert_int_eq(mill_sim_run(two.b.sim, 1.0, NO_LIMIT, NULL, &two.b.error), MILL_ENDED);
    ck_assert_str_eq(two.b.error.text, "heard enough");
    ck_assert_uint_eq(two.l.impacts, last[_i]);
    are_alike(&one, &two);
    close_both(&one, &two);
}
END_TEST

START_TEST(a_failure_of_an_observer_ends_the_run_with_its_message)
{
    struct heard h;
    open_heard(&h, &both, 2);
    h.l.failed = 9000;
    ck_assert_int_eq(mill_sim_run(h.b.sim, 10.0, NO_LIMIT, NULL, &h.b.error), MILL_FAILED);
    ck_assert_str_eq(h.b.error.text, "impact 9000 fails");
    ck_assert_uint_eq(h.l.impacts, 9000); /* and it gets no other call */
    ck_assert_double_lt(mill_sim_time(h.b.sim), 1.0);
    bench_close(&h.b);
}
END_TEST

START_TEST(a_sample_at_another_time_than_promised_is_a_failure)
{
    struct heard h;
    struct witness w;
    open_heard(&h, &wrong, 2);
    witness_join(&w, &h.b, INFINITY);
    ck_assert_int_eq(mill_sim_run(h.b.sim, 10.0, NO_LIMIT, NULL, &h.b.error), MILL_FAILED);
    ck_assert_str_eq(h.b.error.text, "wrong: its next sample is at another time than it said");
    bench_close(&h.b);
}
END_TEST

START_TEST(pauses_change_nothing_and_after_each_the_observers_have_got_everything)
{
    struct heard one, two;
    open_heard(&one, &both, 1);
    open_heard(&two, &both, 2);
    for (int k = 1; k <= 12; k++) {
        const uint64_t budget = (uint64_t)k * k * 300;
        ck_assert_int_eq(mill_sim_run(one.b.sim, 1.0, budget, NULL, &one.b.error), MILL_OK);
        ck_assert_int_eq(mill_sim_run(two.b.sim, 1.0, budget, NULL, &two.b.error), MILL_OK);
        are_alike(&one, &two);
    }
    ck_assert_uint_gt(two.l.elsewhere, 0);
    close_both(&one, &two);
}
END_TEST

START_TEST(the_number_of_threads_can_change_between_two_calls)
{
    struct heard one, two;
    open_heard(&one, &both, 1);
    open_heard(&two, &both, 2);
    bench_run(&one.b, 0.12);
    for (int k = 1; k <= 4; k++) {
        mill_sim_use_threads(two.b.sim, 1 + k % 2);
        bench_run(&two.b, 0.03 * k);
    }
    bench_run(&two.b, 0.12);
    ck_assert_uint_eq(one.l.calls, two.l.calls);
    close_both(&one, &two);
}
END_TEST

int main(void)
{
    const struct unit_test tests[] = {
        {observers_get_the_same_calls_on_a_second_thread, 4},
        {an_observer_ends_the_run_at_the_same_impact, 6},
        {a_failure_of_an_observer_ends_the_run_with_its_message, 1},
        {a_sample_at_another_time_than_promised_is_a_failure, 1},
        {pauses_change_nothing_and_after_each_the_observers_have_got_everything, 1},
        {the_number_of_threads_can_change_between_two_calls, 1},
    };
    return unit_run("sim_thread", tests, sizeof tests / sizeof *tests);
}
