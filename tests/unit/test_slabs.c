/* Claims about the slabs of a mill: how it is cut, which calendar has an event, and which event is
 * first. */
#include "slabs_fixture.h"

/* ---- how the mill is cut ---- */

static void is_well_cut(const struct sliced *c)
{
    const struct mill_slabs *s = c->s;
    const bool periodic = c->p->grids.period > 0.0;
    int32_t before = 0; /* layer where the slab must begin */
    for (int k = 0; k < s->count; k++) {
        const struct mill_slab *own = &s->slab[k], *next = &s->slab[(k + 1) % s->count];
        ck_assert_int_eq(layer_of(c, own->lo), before);
        ck_assert_int_eq(own->lo % s->layer, 0);
        ck_assert_int_eq(own->hi % s->layer, 0);
        ck_assert_int_ge(own->inner_lo, own->lo);
        ck_assert_int_le(own->inner_hi, own->hi);
        ck_assert_int_ge(own->inner_hi - own->inner_lo, 3 * s->layer); /* there is room to work */
        before = layer_of(c, own->hi);
        if (k + 1 < s->count)
            ck_assert_int_ge(next->inner_lo - own->inner_hi, 4 * s->layer);
        else if (periodic)
            ck_assert_int_ge(layers_of(c) * s->layer + next->inner_lo - own->inner_hi,
                             4 * s->layer);
        else
            ck_assert_int_eq(own->inner_hi, own->hi);
    }
    ck_assert_int_eq(before, layers_of(c));
}

/* Each ball is in the calendar of its slab, and in no other. Takes all events out. */
static void all_are_filed(struct sliced *c)
{
    struct mill_slabs *s = c->s;
    int32_t found = 0;
    for (int k = 0; k <= s->count; k++) {
        struct mill_calendar *calendar = k < s->count ? s->slab[k].calendar : s->late;
        double t;
        for (int32_t i; (i = mill_calendar_next(calendar, &t)) >= 0; found++) {
            const int32_t block = block_of_ball(c, i);
            ck_assert_msg(k < s->count && block >= s->slab[k].lo && block < s->slab[k].hi,
                          "ball %d is in calendar %d", i, k);
            ck_assert_msg(t == mill_plan_time(&c->p->plan[i]), "ball %d has another time", i);
            mill_calendar_set(calendar, i, INFINITY);
            ck_assert_msg(found < c->b.world->balls, "balls are in two calendars");
        }
    }
    ck_assert_int_eq(found, c->b.world->balls);
}

LOOP_TEST(slabs_fill_the_mill_with_four_layers_between_the_parts_in_which_threads_work, LONG_MILLS)
{
    for (int threads = 2; threads <= 4; threads++) {
        struct sliced c;
        open_sliced(&c, _i, threads);
        ck_assert_int_eq(c.s->count, threads);
        is_well_cut(&c);
        close_sliced(&c);
    }
}

LOOP_TEST(every_event_is_in_the_calendar_of_its_slab_also_after_another_cut, 2 * LONG_MILLS)
{
    struct sliced c;
    uint64_t seed = 1;
    open_sliced(&c, _i % LONG_MILLS, 3);
    const int32_t before = c.s->slab[0].hi;
    if (_i >= LONG_MILLS) {
        for (int32_t i = 0; i < c.b.world->balls; i++) /* most contacts are at one end */
            c.b.world->ball[i].contacts +=
                layer_of(&c, block_of_ball(&c, i)) < 12 ? 200 + (uint32_t)below(&seed, 50) : 3;
        mill_slabs_cut(c.s);
        ck_assert_int_lt(c.s->slab[0].hi, before);
        is_well_cut(&c);
    }
    all_are_filed(&c);
    close_sliced(&c);
}

TEST(slabs_get_equal_shares_of_the_contacts_where_that_is_possible)
{
    struct sliced c;
    double share[2] = {0.0, 0.0};
    open_sliced(&c, 0, 2);
    for (int32_t i = 0; i < c.b.world->balls; i++) {
        const int32_t layer = layer_of(&c, block_of_ball(&c, i));
        c.b.world->ball[i].contacts += layer < 14 ? 100 : 50;
    }
    mill_slabs_cut(c.s);
    for (int32_t i = 0; i < c.b.world->balls; i++) {
        const int32_t block = block_of_ball(&c, i);
        share[block >= c.s->slab[0].hi] += layer_of(&c, block) < 14 ? 100.0 : 50.0;
    }
    ck_assert_double_gt(share[0], 0.8 * share[1]);
    ck_assert_double_lt(share[0], 1.25 * share[1]);
    close_sliced(&c);
}

LOOP_TEST(a_mill_that_is_too_short_or_has_one_thread_is_not_cut, 2)
{
    struct model model = long_stirred;
    struct bench b;
    struct mill_slabs *s;
    model.blades = 0;
    model.balls[0].count = 100;
    model.setup.drum.length = 0.0051 * (_i ? 13 : 14);
    bench_open(&b, &model);
    for (int threads = 0; threads <= 4; threads++) {
        ck_assert(mill_slabs_create(b.sim->schedule, threads, &s));
        ck_assert_int_eq(s != NULL, !_i && threads >= 2);
        mill_slabs_free(s);
    }
    bench_close(&b);
}

/* ---- which event is first ---- */

/* The first of these times; of equal ones that of the smaller ball. -1: none */
static int32_t first_of(const double *t, int32_t balls)
{
    int32_t first = -1;
    for (int32_t i = 0; i < balls; i++)
        if (t[i] < HUGE_VAL && (first < 0 || t[i] < t[first]))
            first = i;
    return first;
}

LOOP_TEST(events_come_out_in_order_of_time_and_ball_whatever_calendar_has_them, LONG_MILLS)
{
    struct sliced c;
    uint64_t seed = 2;
    open_sliced(&c, _i, 4);
    const int32_t balls = c.b.world->balls;
    double *t = malloc(sizeof *t * (size_t)balls), now = 0.0, due;
    for (int32_t i = 0; i < balls; i++)
        t[i] = mill_plan_time(&c.p->plan[i]);
    c.s->end = t[first_of(t, balls)] + 2e-3; /* new events before this are late */
    int late = 0;
    for (int32_t n = 0, i; (i = mill_slabs_next(c.s, &due)) >= 0; n++) {
        const int32_t first = first_of(t, balls), other = below(&seed, balls);
        ck_assert_msg(i == first && due == t[first] && due >= now, "event %d: ball %d, not %d", n,
                      i, first);
        now = due;
        t[i] = n < 400 ? now + uniform(&seed, 0.0, 3e-3) : HUGE_VAL;
        mill_slabs_enter(c.s, i, t[i]);
        if (n < 400) { /* one comes at exactly the same time */
            t[other] = t[i];
            mill_slabs_enter(c.s, other, t[other]);
        }
        late += c.s->home[i] == c.s->count;
    }
    ck_assert_int_eq(first_of(t, balls), -1);
    ck_assert_int_gt(late, 10);
    free(t);
    close_sliced(&c);
}

LOOP_TEST(without_slabs_all_events_are_in_the_calendar_of_the_schedule_again, LONG_MILLS)
{
    struct sliced c;
    open_sliced(&c, _i, 3);
    const int32_t balls = c.b.world->balls;
    double *t = malloc(sizeof *t * (size_t)balls), due;
    for (int32_t i = 0; i < balls; i++)
        t[i] = mill_plan_time(&c.p->plan[i]);
    mill_slabs_free(c.s);
    ck_assert_ptr_null(c.p->slabs);
    ck_assert_ptr_null(c.p->marks);
    for (int32_t i; (i = mill_calendar_next(c.p->calendar, &due)) >= 0;) {
        ck_assert_msg(i == first_of(t, balls) && due == t[i], "ball %d is not the first", i);
        t[i] = INFINITY;
        mill_calendar_set(c.p->calendar, i, INFINITY);
    }
    ck_assert_int_eq(first_of(t, balls), -1);
    free(t);
    bench_close(&c.b);
}

int main(void)
{
    return unit_run("slabs");
}
