/* The calendar. Time is divided into days of equal length. A year of days is an array of lists, one
 * list per day, without order. One more list, the overflow, holds all events after the year. The
 * program compares only the events of today one by one. There are about EVENTS_A_DAY of them for
 * any number of balls, because the length of a day is adapted to the event rate. Comparing all of a
 * few events without a branch is the fastest way to find the earliest. If a day has many events
 * (balls that start in step), they become a binary heap. To insert or remove an event takes O(1)
 * time. The order is (time, item), so that runs can be repeated exactly. */
#include "engine/calendar.h"

#include "base/memory.h"
#include "millsim/vec3.h"

#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

#define EVENTS_A_DAY 5.0 /* more make searches longer; fewer make more empty days to skip */
#define CROWD 24         /* with so many events, today is a heap */
#define BLOCK 8          /* so many events are compared at once */
#define DAYS_AHEAD 4     /* number of days for which mill_calendar_ahead looks ahead */

/* places outside of the lists; waiting: not yet in a list */
enum { NOWHERE = -1, TODAY = -2, WAITING = -3 };

struct mill_calendar {
    int32_t items;
    int32_t days;    /* in one year, a power of two */
    int32_t today;   /* 0 .. days - 1 */
    int32_t in_year; /* events in the lists of the days after today */
    double width, per_width;
    double year_start; /* [s] */
    uint64_t taken;    /* number of events that came out in this year */
    int32_t last_item; /* the last event returned; the same event returned again counts once */
    double last_t;
    int32_t waiting;          /* an item whose event is not yet in a list, or -1 */
    int32_t ahead, ahead_day; /* present place of a walk through the lists of the next days */
    struct mill_event *event; /* of item 0 */
    size_t stride;            /* bytes from one event to the next */
    int32_t *head; /* first item of each list, [days + 1]; the last list is the overflow */
    double *due;   /* [s] times of today's events (room for all items), then BLOCK times INFINITY */
    int32_t *who;  /* their items */
    int32_t count; /* number of today's events */
    bool heaped;   /* they form a heap; else they have no order */
};

static struct mill_event *event_of(const struct mill_calendar *c, int32_t item)
{
    return (struct mill_event *)((char *)c->event + (size_t)item * c->stride);
}

/* Is an event due before today's event at index `at`? */
static bool is_before(const struct mill_calendar *c, double t, int32_t item, int32_t at)
{
    return (t < c->due[at]) | ((t == c->due[at]) & (item < c->who[at]));
}

/* Puts an event at index `at`; the event's `next` is this index. */
static void put(struct mill_calendar *c, int32_t at, double t, int32_t item)
{
    c->due[at] = t;
    c->who[at] = item;
    event_of(c, item)->next = at;
}

static void sift(struct mill_calendar *c, int32_t at, double t, int32_t item)
{
    while (at > 0 && is_before(c, t, item, (at - 1) / 2)) {
        put(c, at, c->due[(at - 1) / 2], c->who[(at - 1) / 2]);
        at = (at - 1) / 2;
    }
    for (int32_t child = 2 * at + 1; child < c->count; child = 2 * at + 1) {
        if (child + 1 < c->count && is_before(c, c->due[child + 1], c->who[child + 1], child))
            child++;
        if (is_before(c, t, item, child))
            break;
        put(c, at, c->due[child], c->who[child]);
        at = child;
    }
    put(c, at, t, item);
}

/* Replaces the event at index `at`; in a heap, it then moves to its place. */
static inline void place(struct mill_calendar *c, int32_t at, double t, int32_t item)
{
    if (c->heaped)
        sift(c, at, t, item);
    else
        put(c, at, t, item);
}

static void join_today(struct mill_calendar *c, int32_t item)
{
    struct mill_event *n = event_of(c, item);
    n->place = TODAY;
    c->due[c->count + BLOCK] = HUGE_VAL;
    c->count++;
    place(c, c->count - 1, n->t, item);
    if (c->heaped || c->count < CROWD)
        return;
    c->heaped = true;
    for (c->count = 1; c->count < CROWD; c->count++)
        sift(c, c->count, c->due[c->count], c->who[c->count]);
}

/* The time of the earliest of BLOCK events from `due` on; bits: which of them have this time */
static inline double earliest(const double *due, unsigned *bits)
{
#ifdef __SSE2__
    const __m128d a = _mm_loadu_pd(due), b = _mm_loadu_pd(due + 2), c = _mm_loadu_pd(due + 4),
                  d = _mm_loadu_pd(due + 6);
    __m128d t = _mm_min_pd(_mm_min_pd(a, b), _mm_min_pd(c, d));
    t = _mm_min_pd(t, _mm_shuffle_pd(t, t, 1));
    *bits = (unsigned)_mm_movemask_pd(_mm_cmpeq_pd(a, t)) |
            (unsigned)_mm_movemask_pd(_mm_cmpeq_pd(b, t)) << 2 |
            (unsigned)_mm_movemask_pd(_mm_cmpeq_pd(c, t)) << 4 |
            (unsigned)_mm_movemask_pd(_mm_cmpeq_pd(d, t)) << 6;
    return _mm_cvtsd_f64(t);
#else
    double t = due[0];
    for (int k = 1; k < BLOCK; k++)
        t = mill_least(t, due[k]);
    *bits = 0;
    for (int k = 0; k < BLOCK; k++)
        *bits |= (unsigned)(due[k] == t) << k;
    return t;
#endif
}

/* The item with the earliest of today's events */
static int32_t first_of_today(const struct mill_calendar *c, double *t)
{
    assert(c->count > 0);
    unsigned bits;
    *t = earliest(c->due, &bits);
    int32_t item = c->who[__builtin_ctz(bits)];
    const bool alone = (bits & (bits - 1)) == 0;
    if (alone && c->count <= BLOCK)
        return item;
    if (c->heaped) {
        *t = c->due[0];
        return c->who[0];
    }
    for (int32_t k = 0; k < c->count; k++)
        if (c->due[k] < *t || (c->due[k] == *t && c->who[k] < item)) {
            *t = c->due[k];
            item = c->who[k];
        }
    return item;
}

static double day_of(const struct mill_calendar *c, double t)
{
    return (t - c->year_start) * c->per_width;
}

static void take_out(struct mill_calendar *c, int32_t item)
{
    struct mill_event *n = event_of(c, item);
    c->ahead = item == c->ahead ? -1 : c->ahead; /* it may go into another calendar */
    if (n->place >= 0) {
        int32_t *link = n->prev >= 0 ? &event_of(c, n->prev)->next : &c->head[n->place];
        *link = n->next;
        if (n->next >= 0)
            event_of(c, n->next)->prev = n->prev;
        c->in_year -= n->place < c->days;
    } else if (n->place == TODAY) {
        assert(n->next >= 0 && n->next < c->count);
        const double t = c->due[--c->count];
        const int32_t last = c->who[c->count];
        if (!c->heaped) /* even the last one itself: a branch would often be mispredicted */
            put(c, n->next, t, last);
        c->due[c->count] = HUGE_VAL;
        if (c->heaped && n->next < c->count)
            sift(c, n->next, t, last);
        c->heaped = c->heaped && c->count > 0;
    } else if (n->place == WAITING) {
        c->waiting = -1;
    }
    n->place = NOWHERE;
}

/* Puts an event into its list. The day is monotone in t for any rounding, so days are in order. */
static void file(struct mill_calendar *c, int32_t item)
{
    struct mill_event *n = event_of(c, item);
    const double day = day_of(c, n->t);
    if (day < (double)(c->today + 1)) {
        join_today(c, item);
        return;
    }
    n->place = day < (double)c->days ? (int32_t)day : c->days;
    c->in_year += n->place < c->days;
    n->prev = -1;
    n->next = c->head[n->place];
    if (n->next >= 0)
        event_of(c, n->next)->prev = item;
    c->head[n->place] = item;
}

static void file_waiting(struct mill_calendar *c)
{
    const int32_t item = c->waiting;
    c->waiting = -1;
    if (item >= 0)
        file(c, item);
}

/* Sorts the events of a list into days again: of the overflow, or of the day that is now today. */
static void refile(struct mill_calendar *c, int32_t list)
{
    int32_t item = c->head[list];
    c->head[list] = -1;
    for (int32_t next; item >= 0; item = next) {
        next = event_of(c, item)->next;
        c->in_year -= list < c->days;
        file(c, item);
    }
}

struct mill_calendar *mill_calendar_create(int32_t items, struct mill_event *event, size_t stride)
{
    assert(items >= 0 && event && stride >= sizeof *event);
    struct mill_calendar *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    c->items = items;
    c->event = event;
    c->stride = stride;
    c->days = 16;
    while (c->days < items && c->days < (1 << 29))
        c->days *= 2;
    c->head = mill_memory_get((size_t)c->days + 1, sizeof *c->head);
    /* few of these are ever used, and only those cost memory */
    c->due = malloc(((size_t)items + BLOCK) * sizeof *c->due);
    c->who = malloc(((size_t)items + BLOCK) * sizeof *c->who);
    if (!c->head || !c->due || !c->who) {
        mill_calendar_free(c);
        return NULL;
    }
    for (int32_t k = 0; k < BLOCK; k++)
        c->due[k] = HUGE_VAL;
    mill_calendar_clear(c, 0.0);
    mill_calendar_set_width(c, 1e-6); /* any value: it is adapted within the first year */
    return c;
}

void mill_calendar_free(struct mill_calendar *c)
{
    if (!c)
        return;
    free(c->head);
    free(c->due);
    free(c->who);
    free(c);
}

static void begin_year(struct mill_calendar *c, double start)
{
    c->year_start = start;
    c->today = c->ahead_day = 0;
    c->taken = 0;
    c->ahead = -1;
}

/* Empties all lists. Each event keeps its time, and the place NOWHERE if there is none. */
static void empty(struct mill_calendar *c, double start)
{
    for (int32_t list = 0; list <= c->days; list++)
        c->head[list] = -1;
    c->waiting = -1;
    while (c->count > 0)
        c->due[--c->count] = HUGE_VAL;
    c->in_year = 0;
    c->heaped = false;
    begin_year(c, start);
}

void mill_calendar_clear(struct mill_calendar *c, double start)
{
    for (int32_t i = 0; i < c->items; i++)
        event_of(c, i)->place = NOWHERE;
    c->last_item = -1;
    empty(c, start);
}

void mill_calendar_set(struct mill_calendar *c, int32_t item, double t)
{
    assert(item >= 0 && item < c->items && t == t);
    struct mill_event *n = event_of(c, item);
    const double day = day_of(c, t);
    if (n->place == TODAY && day < (double)(c->today + 1)) {
        assert(n->next >= 0 && n->next < c->count);
        n->t = t;
        place(c, n->next, t, item);
        return;
    }
    take_out(c, item);
    n->t = t;
    if (!(t < HUGE_VAL))
        return;
    file_waiting(c);
    if (!(day >= (double)(c->today + 1) && day < (double)c->days)) {
        file(c, item);
        return;
    }
    /* Entered with the next event: till then the cache can load its list's head in a long table */
    c->waiting = item;
    n->place = WAITING;
    __builtin_prefetch(&c->head[(int32_t)day], 1);
}

double mill_calendar_time(const struct mill_calendar *c, int32_t item)
{
    assert(item >= 0 && item < c->items);
    return event_of(c, item)->place == NOWHERE ? HUGE_VAL : event_of(c, item)->t;
}

double mill_calendar_width(const struct mill_calendar *c)
{
    return c->width;
}

void mill_calendar_set_width(struct mill_calendar *c, double width)
{
    assert(width > 0.0);
    const double now = c->year_start + (double)c->today * c->width;
    int32_t first = c->waiting; /* of one list of all events */
    if (first >= 0)
        event_of(c, first)->next = -1;
    for (int32_t k = 0; k < c->count; k++) {
        event_of(c, c->who[k])->next = first;
        first = c->who[k];
    }
    for (int32_t list = 0; list <= c->days; list++)
        for (int32_t item = c->head[list], next; item >= 0; item = next) {
            next = event_of(c, item)->next;
            event_of(c, item)->next = first;
            first = item;
        }
    c->width = width;
    c->per_width = 1.0 / width;
    empty(c, now);
    c->head[c->days] = first;
    refile(c, c->days);
}

/* Changes the length of a day if the last `days_passed` days had too many or too few events. */
static bool adapt(struct mill_calendar *c, double days_passed)
{
    const double load = (double)c->taken / days_passed;
    if (load > EVENTS_A_DAY / 2.5 && load < EVENTS_A_DAY * 2.5)
        return false;
    const double factor = fmin(fmax(EVENTS_A_DAY / fmax(load, 1e-3), 1.0 / 64.0), 64.0);
    const double width = fmin(fmax(c->width * factor, 1e-15), 1e3);
    if (width == c->width)
        return false;
    mill_calendar_set_width(c, width);
    return true;
}

/* Begins the next year. If it has no events, begins the year of the earliest event. To find this
 * event the whole overflow is read, which would take too long in every year. */
static void next_year(struct mill_calendar *c)
{
    double first = HUGE_VAL;
    begin_year(c, c->year_start + (double)c->days * c->width);
    refile(c, c->days);
    if (c->count > 0 || c->in_year > 0)
        return;
    for (int32_t i = c->head[c->days]; i >= 0; i = event_of(c, i)->next)
        first = event_of(c, i)->t < first ? event_of(c, i)->t : first;
    begin_year(c, first);
    refile(c, c->days);
}

int32_t mill_calendar_next(struct mill_calendar *c, double *t)
{
    if (c->count == 0)
        file_waiting(c);
    while (c->count == 0) { /* go to the first day with events */
        if (c->in_year == 0 && c->head[c->days] < 0)
            return -1;
        if (c->in_year > 0) {
            refile(c, ++c->today);
        } else {
            c->today = c->days - 1;
            if (!adapt(c, (double)c->days))
                next_year(c);
        }
    }
    const int32_t item = first_of_today(c, t);
    if (item != c->last_item || *t != c->last_t) {
        c->last_item = item;
        c->last_t = *t;
        c->taken++;
        /* if the rate has risen by far, adapt before the end of the year */
        if (c->taken > 4 * (uint64_t)EVENTS_A_DAY * ((uint64_t)c->today + 64))
            adapt(c, (double)c->today + 1.0);
    }
    return item;
}

/* The events of a list can be anywhere in memory. So each is loaded at least one call before its
 * successor is read from it. If the list changes in between, `ahead` may be in another list or, as
 * one of today's events, give an index (less than the number of items). Only the speed differs. */
int32_t mill_calendar_ahead(struct mill_calendar *c)
{
    if (c->ahead_day <= c->today)
        c->ahead = -1; /* the walk is behind the present day */
    if (c->ahead < 0) {
        const int32_t day = (c->ahead_day > c->today ? c->ahead_day : c->today) + 1;
        if (day > c->today + DAYS_AHEAD || day + 1 >= c->days)
            return -1;
        c->ahead_day = day;
        c->ahead = c->head[day];
        if (c->head[day + 1] >= 0)
            __builtin_prefetch(event_of(c, c->head[day + 1]), 1);
    }
    const int32_t item = c->ahead;
    if (item >= 0) {
        c->ahead = event_of(c, item)->next;
        if (c->ahead >= 0)
            __builtin_prefetch(event_of(c, c->ahead), 1);
    }
    return item;
}
