/* Claims about the event list, against a plain array of times that is searched from end to end. */
#include "calendar_fixture.h"

#include <time.h>

/* ---- traces ---- */

static void compare_with_a_list(uint64_t seed, int32_t items, enum gaps kind, long steps)
{
    struct twin twin = make_twin(items);
    for (long step = 0; step < steps; step++) {
        const long phase = steps / 6 + 1;
        const double mean = step / phase % 2 ? 1e-10 : 1e-4; /* up and down by a million, twice */
        if (step % (steps / 3 + 1) == 0) {
            clear(&twin, uniform(&seed, -1.0, 1.0));
            for (int32_t i = 0; i < items; i++)
                set(&twin, i, twin.now + gap(&seed, kind, mean));
        }
        const int32_t item = next(&twin);
        if (item >= 0)
            set(&twin, item, twin.now + gap(&seed, kind, mean));
        else
            set(&twin, below(&seed, items), twin.now + gap(&seed, kind, mean));
        disturb(&twin, &seed, kind, mean);
    }
    ck_assert_int_eq(twin.wrong, 0);
    free_twin(&twin);
}

LOOP_TEST(events_come_out_as_from_a_sorted_list, GAPS)
{
    static const int32_t items[] = {1, 2, 3, 10, 1000, 20000};
    for (size_t k = 0; k < sizeof items / sizeof *items; k++) {
        const long steps = items[k] <= 10 ? 60000 : 60000000 / items[k];
        compare_with_a_list(100 + k, items[k], (enum gaps)_i, steps);
    }
}

TEST(equal_times_come_out_in_the_order_of_the_items)
{
    struct twin twin = make_twin(500);
    uint64_t seed = 7;
    for (int n = 0; n < 2000; n++)
        set(&twin, below(&seed, 500), 0.25);
    for (int32_t item = next(&twin); item >= 0; item = next(&twin))
        set(&twin, item, INFINITY);
    ck_assert_int_eq(twin.wrong, 0);
    free_twin(&twin);
}

TEST(the_width_of_a_day_has_no_influence_on_the_order)
{
    struct twin twin = make_twin(300);
    uint64_t seed = 8;
    for (int32_t i = 0; i < 300; i++)
        set(&twin, i, gap(&seed, BIMODAL, 1e-3));
    for (int n = 0; n < 30000; n++) {
        const int32_t item = next(&twin);
        set(&twin, item, twin.now + gap(&seed, BIMODAL, 1e-3));
        if (n % 37 == 0)
            mill_calendar_set_width(twin.calendar, log_uniform(&seed, 1e-12, 1e2));
    }
    ck_assert_int_eq(twin.wrong, 0);
    free_twin(&twin);
}

TEST(an_empty_calendar_has_no_event)
{
    struct twin twin = make_twin(5);
    double t;
    ck_assert_int_eq(mill_calendar_next(twin.calendar, &t), -1);
    set(&twin, 3, 1.0);
    ck_assert_int_eq(next(&twin), 3);
    set(&twin, 3, INFINITY);
    ck_assert_int_eq(mill_calendar_next(twin.calendar, &t), -1);
    set(&twin, 4, 2.0);
    clear(&twin, 0.0);
    ck_assert_int_eq(mill_calendar_next(twin.calendar, &t), -1);
    free_twin(&twin);
}

TEST(it_tells_when_an_item_is_due_wherever_that_is_filed)
{
    struct twin twin = make_twin(5);
    const double far[] = {1e-9, 1e-7, 1e-3, 1e3};
    for (int32_t item = 0; item < 4; item++)
        set(&twin, item, far[item]);
    for (int32_t turn = 0; turn < 4; turn++) {
        for (int32_t item = 0; item < 5; item++)
            ck_assert_double_eq(mill_calendar_time(twin.calendar, item),
                                item < turn || item == 4 ? HUGE_VAL : far[item]);
        ck_assert_int_eq(next(&twin), turn);
        set(&twin, turn, INFINITY);
    }
    set(&twin, 2, 1e3);
    clear(&twin, 0.0);
    ck_assert_double_eq(mill_calendar_time(twin.calendar, 2), INFINITY);
    free_twin(&twin);
}

/* ---- several calendars over the same items ---- */

enum { SHARED = 400 };

/* Two calendars, the calendar of each item, and its time */
struct shared {
    struct mill_event event[SHARED];
    struct mill_calendar *calendar[2];
    int home[SHARED];
    double time[SHARED], now[2];
    long wrong; /* answers that differ from the arrays' */
};

static struct shared *make_shared(void)
{
    struct shared *s = calloc(1, sizeof *s);
    for (int k = 0; k < 2; k++)
        s->calendar[k] = mill_calendar_create(SHARED, s->event, sizeof s->event[0]);
    for (int k = 0; k < 2; k++)
        mill_calendar_clear(s->calendar[k], 0.0);
    for (int32_t i = 0; i < SHARED; i++)
        s->time[i] = INFINITY;
    return s;
}

static void free_shared(struct shared *s)
{
    mill_calendar_free(s->calendar[0]);
    mill_calendar_free(s->calendar[1]);
    free(s);
}

/* Enters an item into a calendar; before, takes it out of the other one, if it is there. */
static void set_shared(struct shared *s, int k, int32_t item, double t)
{
    if (s->home[item] != k)
        mill_calendar_set(s->calendar[s->home[item]], item, INFINITY);
    s->home[item] = k;
    s->time[item] = t;
    mill_calendar_set(s->calendar[k], item, t);
}

static int32_t next_shared(struct shared *s, int k)
{
    double t = NAN;
    const int32_t item = mill_calendar_next(s->calendar[k], &t);
    int32_t first = -1;
    for (int32_t i = 0; i < SHARED; i++)
        if (s->home[i] == k && s->time[i] < HUGE_VAL && (first < 0 || s->time[i] < s->time[first]))
            first = i;
    s->wrong += item != first || (first >= 0 && t != s->time[first]);
    s->now[k] = first >= 0 ? s->time[first] : s->now[k];
    return first;
}

/* Events come out of both calendars, go into both, and some change from one to the other. mean:
 * of the gaps in each. most: stretch [steps] in which only one of them is used */
static void share(struct shared *s, const double mean[2], int most, bool resize, uint64_t *seed)
{
    for (int32_t i = 0; i < SHARED; i++) {
        const int k = below(seed, 2);
        set_shared(s, k, i, gap(seed, EXPONENTIAL, mean[k]));
    }
    for (int step = 0, k = 0, left = 0; step < 40000; step++, left--) {
        if (left <= 0) {
            k = below(seed, 2);
            left = 1 + below(seed, most);
        }
        const int32_t item = next_shared(s, k);
        const int to = below(seed, 50) == 0 ? !k : k;
        set_shared(s, to, item >= 0 ? item : below(seed, SHARED),
                   s->now[to] + gap(seed, EXPONENTIAL, mean[to]));
        mill_calendar_ahead(s->calendar[k]);
        if (resize && step % 37 == 0)
            mill_calendar_set_width(s->calendar[below(seed, 2)], log_uniform(seed, 1e-12, 1e2));
    }
}

LOOP_TEST(calendars_that_share_items_do_not_disturb_each_other, 3)
{
    static const double means[][2] = {{1e-6, 1e-6}, {1e-9, 1e-3}, {1e2, 1e-7}};
    struct shared *s = make_shared();
    uint64_t seed = 20 + (uint64_t)_i;
    double before[2];
    for (int k = 0; k < 2; k++)
        before[k] = mill_calendar_width(s->calendar[k]);
    share(s, means[_i], 1 + 999 * (_i % 2), false, &seed);
    ck_assert_int_eq(s->wrong, 0);
    for (int k = 0; k < 2; k++) /* each has adapted its days to its own events */
        ck_assert(_i == 0 || mill_calendar_width(s->calendar[k]) != before[k]);
    free_shared(s);
}

LOOP_TEST(a_new_width_of_one_leaves_the_events_of_the_other_where_they_are, 2)
{
    static const double mean[2] = {1e-5, 1e-4};
    struct shared *s = make_shared();
    uint64_t seed = 30;
    share(s, mean, 1 + 99 * _i, true, &seed);
    ck_assert_int_eq(s->wrong, 0);
    free_shared(s);
}

/* ---- extremes: a livelock here ends in the test's timeout ---- */

static void run_with_gaps(int32_t items, const double *gaps, int count, double start)
{
    struct twin twin = make_twin(items);
    uint64_t seed = 9;
    clear(&twin, start);
    for (int32_t i = 0; i < items; i++)
        set(&twin, i, start + gaps[0]);
    for (int n = 0; n < 20000; n++) {
        const int32_t item = next(&twin);
        /* long stretches of one gap, so that the width follows it */
        set(&twin, item, twin.now + gaps[n / 4000 % count] * (1.0 + below(&seed, 3)));
    }
    ck_assert_int_eq(twin.wrong, 0);
    free_twin(&twin);
}

TEST(extreme_gaps_neither_stall_nor_disorder_it)
{
    static const double tiny[] = {1e-18}, huge[] = {1e6}, none[] = {0.0},
                        mixed[] = {1e-18, 1e6, 0.0, 1e-9, 1e300};
    static const int32_t items[] = {1, 3, 1000};
    for (int k = 0; k < 3; k++) {
        run_with_gaps(items[k], tiny, 1, 0.0);
        run_with_gaps(items[k], tiny, 1, 1e5); /* less than the clock can tell apart */
        run_with_gaps(items[k], huge, 1, 0.0);
        run_with_gaps(items[k], none, 1, 0.5);
        run_with_gaps(items[k], mixed, 5, 0.0);
        run_with_gaps(items[k], mixed, 5, -1e9);
    }
}

/* ---- cost ---- */

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Seconds per event of the hold model: take the first, put it back a random gap later. The best of
 * several stretches, after enough events for the width to settle. */
static double cost_of_an_event(int32_t items, enum gaps kind)
{
    struct mill_event *event = calloc((size_t)items, sizeof *event);
    struct mill_calendar *calendar = mill_calendar_create(items, event, sizeof *event);
    uint64_t seed = 10;
    double best = INFINITY, t;
    for (int32_t i = 0; i < items; i++)
        mill_calendar_set(calendar, i, gap(&seed, kind, 1.0));
    const long stretch = 200000, warm = 3L * items;
    for (long n = 0; n < warm; n++) {
        const int32_t item = mill_calendar_next(calendar, &t);
        mill_calendar_set(calendar, item, t + gap(&seed, kind, 1.0));
    }
    for (int round = 0; round < 8; round++) {
        const double begin = seconds();
        for (long n = 0; n < stretch; n++) {
            const int32_t item = mill_calendar_next(calendar, &t);
            mill_calendar_set(calendar, item, t + gap(&seed, kind, 1.0));
        }
        best = fmin(best, (seconds() - begin) / (double)stretch);
    }
    mill_calendar_free(calendar);
    free(event);
    return best;
}

/* Memory latency alone explains a factor of 3 to 4, of 6 beside neighbours that fill the caches; a
 * list or a scan would show 1000, their square root 30. */
SLOW_TEST(a_thousand_times_more_items_cost_hardly_more_per_event, GAPS)
{
    const int32_t few_items = unit_draws(1000);
    const double few = cost_of_an_event(few_items, (enum gaps)_i);
    const double many = cost_of_an_event(1000 * few_items, (enum gaps)_i);
    ck_assert_msg(many < 20.0 * few, "%.0f ns, and %.0f ns of a thousandth", 1e9 * many, 1e9 * few);
}

/* After the rate changed by a million, and back, events must cost what they did before. */
TEST(the_width_follows_the_rate_of_events)
{
    static struct mill_event event[1000];
    struct mill_calendar *calendar = mill_calendar_create(1000, event, sizeof event[0]);
    uint64_t seed = 11;
    double t = 0.0, width[4];
    for (int phase = 0; phase < 4; phase++) {
        const double mean = phase % 2 ? 1e-9 : 1e-3;
        for (int32_t i = 0; i < 1000; i++)
            mill_calendar_set(calendar, i, t + gap(&seed, EXPONENTIAL, mean));
        for (int n = 0; n < 100000; n++) {
            const int32_t item = mill_calendar_next(calendar, &t);
            mill_calendar_set(calendar, item, t + gap(&seed, EXPONENTIAL, mean));
        }
        width[phase] = mill_calendar_width(calendar) * 1000.0 / mean; /* events a day */
        ck_assert_double_gt(width[phase], 1.0);
        ck_assert_double_lt(width[phase], 64.0);
    }
    mill_calendar_free(calendar);
}

int main(void)
{
    return unit_run("calendar");
}
