/* Claims about the event list's single day, however many share it, about events that lie in their
 * owner's records, and about the walk that names what comes up soon. */
#include "calendar_fixture.h"

/* ---- a day of many ---- */

/* Days so long that all events share one; the width follows the rate again after a thousand events
 * or so. */
static void one_day(struct twin *twin)
{
    mill_calendar_set_width(twin->calendar, 1e3);
}

static void empty_out(struct twin *twin)
{
    for (int32_t item = next(twin); item >= 0; item = next(twin))
        set(twin, item, INFINITY);
}

TEST(many_at_one_time_come_out_by_their_numbers)
{
    static const int32_t items[] = {2, 23, 24, 25, 26, 100, 1000};
    uint64_t seed = 1;
    for (int k = 0; k < 7; k++) {
        struct twin twin = make_twin(items[k]);
        one_day(&twin);
        for (int n = 0; n < 4 * items[k]; n++)
            set(&twin, below(&seed, items[k]), 0.25);
        empty_out(&twin);
        ck_assert_int_eq(twin.wrong, 0);
        free_twin(&twin);
    }
}

TEST(many_in_one_day_come_out_by_their_times)
{
    static const int32_t items[] = {2, 23, 24, 25, 26, 100, 1000};
    uint64_t seed = 2;
    for (int k = 0; k < 7; k++) {
        struct twin twin = make_twin(items[k]);
        one_day(&twin);
        for (int32_t i = 0; i < items[k]; i++)
            set(&twin, i, uniform(&seed, 0.0, 1.0));
        empty_out(&twin);
        ck_assert_int_eq(twin.wrong, 0);
        free_twin(&twin);
    }
}

/* Around the number from which a day is kept as a heap, and far above: events come, go, are put
 * forward and put off, tie, all within one day. */
TEST(a_crowd_that_changes_stays_in_order)
{
    static const int32_t items[] = {30, 60, 400};
    uint64_t seed = 3;
    for (int k = 0; k < 3; k++) {
        struct twin twin = make_twin(items[k]);
        for (int n = 0; n < 60000; n++) {
            const int32_t item = below(&seed, items[k]);
            if (n % 500 == 0)
                one_day(&twin);
            /* more and fewer by turns */
            const bool fewer = n / 700 % 2 ? below(&seed, 4) > 0 : below(&seed, 8) == 0;
            set(&twin, item, fewer ? HUGE_VAL : 1e-3 * (n / 10 + below(&seed, 50)));
            next(&twin);
        }
        ck_assert_int_eq(twin.wrong, 0);
        free_twin(&twin);
    }
}

TEST(negative_times_and_both_zeros_are_in_order)
{
    static const double times[] = {-0.0, 0.0, -1e-300, 1e-300, -1e300, -5e-324, 5e-324,
                                   -2.0, 2.0, -1.0,    1.0,    -0.5,   0.5,     -1e-3};
    uint64_t seed = 4;
    for (int32_t items = 1; items <= 200; items += 1 + items / 4) {
        struct twin twin = make_twin(items);
        for (int n = 0; n < 30; n++) {
            clear(&twin, n % 2 ? 0.0 : -10.0);
            if (n % 3 == 0)
                one_day(&twin);
            for (int32_t i = 0; i < items; i++)
                set(&twin, i, times[below(&seed, sizeof times / sizeof *times)]);
            empty_out(&twin);
        }
        ck_assert_int_eq(twin.wrong, 0);
        free_twin(&twin);
    }
}

/* ---- events lent by their owner ---- */

struct record {
    uint64_t before[3];
    struct mill_event event;
    uint64_t after[2];
};

TEST(events_in_the_owner_s_records_give_the_same_order_and_touch_nothing_beside_them)
{
    enum { ITEMS = 200 };
    const uint64_t mark = UINT64_C(0x5555AAAA5555AAAA);
    static struct record record[ITEMS];
    for (int i = 0; i < ITEMS; i++) {
        memset(&record[i].event, 0x77, sizeof record[i].event); /* never set by the owner */
        record[i].before[0] = record[i].before[1] = record[i].before[2] = mark;
        record[i].after[0] = record[i].after[1] = mark;
    }
    struct twin twin = make_twin(ITEMS);
    struct mill_calendar *lent = mill_calendar_create(ITEMS, &record[0].event, sizeof record[0]);
    ck_assert_ptr_nonnull(lent);
    mill_calendar_free(twin.calendar);
    twin.calendar = lent;
    uint64_t seed = 5;
    for (int32_t i = 0; i < ITEMS; i++)
        ck_assert_double_eq(mill_calendar_time(lent, i), HUGE_VAL);
    for (int32_t i = 0; i < ITEMS; i++)
        set(&twin, i, gap(&seed, EXPONENTIAL, 1e-4));
    for (int n = 0; n < 50000; n++) {
        const int32_t item = next(&twin);
        if (item >= 0)
            ck_assert_double_eq(record[item].event.t, twin.time[item]);
        set(&twin, item < 0 ? 0 : item, twin.now + gap(&seed, EXPONENTIAL, 1e-4));
        disturb(&twin, &seed, EXPONENTIAL, 1e-4);
    }
    ck_assert_int_eq(twin.wrong, 0);
    for (int i = 0; i < ITEMS; i++) {
        for (int k = 0; k < 3; k++)
            ck_assert_uint_eq(record[i].before[k], mark);
        for (int k = 0; k < 2; k++)
            ck_assert_uint_eq(record[i].after[k], mark);
    }
    free_twin(&twin);
}

/* ---- the walk ahead ---- */

/* Through disturbances, changes of width, empty calendars and new beginnings */
SLOW_TEST(the_walk_ahead_names_items_only_and_changes_nothing, 1)
{
    static const int32_t items[] = {1, 2, 20, 1000};
    for (int k = 0; k < 4; k++) {
        struct twin twin = make_twin(items[k]);
        uint64_t seed = 60 + (uint64_t)k;
        long named = 0;
        for (int n = 0; n < 60000; n++) {
            const double mean = n / 9000 % 2 ? 1e-10 : 1e-4;
            if (below(&seed, 3000) == 0)
                clear(&twin, uniform(&seed, -1.0, 1.0));
            if (below(&seed, 2000) == 0)
                mill_calendar_set_width(twin.calendar, log_uniform(&seed, 1e-12, 1e2));
            if (below(&seed, 5000) == 0)
                empty_out(&twin);
            for (int32_t asked = below(&seed, 5); asked > 0; asked--) {
                const int32_t item = mill_calendar_ahead(twin.calendar);
                ck_assert_int_ge(item, -1);
                ck_assert_int_lt(item, items[k]);
                named += item >= 0;
            }
            const int32_t item = next(&twin);
            set(&twin, item >= 0 ? item : below(&seed, items[k]),
                twin.now + gap(&seed, (enum gaps)(n / 1000 % GAPS), mean));
            disturb(&twin, &seed, EXPONENTIAL, mean);
        }
        ck_assert_int_eq(twin.wrong, 0);
        ck_assert(named > 0 || items[k] < 20);
        free_twin(&twin);
    }
}

/* How many of `events` had been named since they were set, at least one event before their turn */
static double share_named(struct mill_calendar *calendar, bool *named, uint64_t *seed, long events)
{
    long in_time = 0;
    for (long n = 0; n < events; n++) {
        double t = NAN;
        const int32_t item = mill_calendar_next(calendar, &t);
        in_time += named[item];
        named[item] = false;
        mill_calendar_set(calendar, item, t + gap(seed, EXPONENTIAL, 1.0));
        const int32_t soon = mill_calendar_ahead(calendar);
        if (soon >= 0)
            named[soon] = true;
    }
    return (double)in_time / (double)events;
}

/* 5000 items have years of some 40 000 events. */
TEST(a_steady_run_s_events_are_named_before_their_turn_year_after_year)
{
    enum { ITEMS = 5000 };
    static bool named[ITEMS];
    static struct mill_event event[ITEMS];
    struct mill_calendar *calendar = mill_calendar_create(ITEMS, event, sizeof event[0]);
    uint64_t seed = 7;
    for (int32_t i = 0; i < ITEMS; i++)
        mill_calendar_set(calendar, i, gap(&seed, EXPONENTIAL, 1.0));
    share_named(calendar, named, &seed, 100000); /* until the width has settled */
    for (int part = 0; part < 40; part++) {
        const double share = share_named(calendar, named, &seed, 10000);
        ck_assert_msg(share > 0.8, "%.3f of the events in part %d", share, part);
    }
    mill_calendar_free(calendar);
}

TEST(after_a_new_beginning_events_are_named_again)
{
    enum { ITEMS = 5000 };
    static bool named[ITEMS];
    static struct mill_event event[ITEMS];
    struct mill_calendar *calendar = mill_calendar_create(ITEMS, event, sizeof event[0]);
    uint64_t seed = 8;
    for (int run = 0; run < 4; run++) {
        mill_calendar_clear(calendar, 0.0);
        memset(named, 0, sizeof named);
        for (int32_t i = 0; i < ITEMS; i++)
            mill_calendar_set(calendar, i, gap(&seed, EXPONENTIAL, 1.0));
        share_named(calendar, named, &seed, run == 0 ? 100000 : 1000);
        const double share = share_named(calendar, named, &seed, 20000);
        ck_assert_msg(share > 0.8, "%.3f of the events in run %d", share, run);
    }
    mill_calendar_free(calendar);
}

int main(void)
{
    return unit_run("calendar_today");
}
