/* The event list. Time is cut into days of equal width; a year of days is held in an array of
 * unordered lists, what lies beyond the year in one overflow list. Only today's events are looked
 * at one by one (calendar_today.c): there are about EVENTS_A_DAY of them whatever the number of
 * balls, for the width follows the event rate. Inserting and removing is O(1). Method: G. Paul,
 * J. Comput. Phys. 221 (2007) 615. Order: (time, item), so runs repeat exactly. */
#include "engine/calendar.h"

#include "base/memory.h"
#include "engine/calendar_today.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#define EVENTS_A_DAY 5.0 /* more: longer searches; fewer: more empty days to step over */
#define DAYS_AHEAD 4     /* how far the walk of mill_calendar_ahead goes */
#define NOWHERE (-1)
#define OVERFLOW_LIST (-2)
#define TODAY (-3)
#define WAITING (-4) /* to be filed */

struct mill_calendar {
    int32_t items;
    int32_t days;     /* in a year, a power of two */
    int32_t today;    /* 0 .. days - 1 */
    int32_t in_year;  /* events in lists after today */
    int32_t overflow; /* head of the overflow list */
    double width, per_width;
    double year_start; /* [s] */
    uint64_t taken;    /* events that came up in this year */
    int32_t last_item; /* the event handed out last, so that asking twice counts once */
    double last_t;
    int32_t waiting;          /* an item whose event is still to be filed, or -1 */
    int32_t ahead, ahead_day; /* where a walk through the lists of the days to come is */
    struct mill_event *own;   /* the events, where nobody lent any */
    int32_t *head;            /* first items of the days' lists, [days] */
    struct mill_today todays; /* today's events, and where all events lie */
};

static struct mill_event *event_of(const struct mill_calendar *c, int32_t item)
{
    return mill_event_of(&c->todays.events, item);
}

static void link_into(struct mill_calendar *c, int32_t *head, int32_t item)
{
    struct mill_event *n = event_of(c, item);
    n->prev = -1;
    n->next = *head;
    if (*head >= 0)
        event_of(c, *head)->prev = item;
    *head = item;
}

static void unlink_from(struct mill_calendar *c, int32_t *head, int32_t item)
{
    const struct mill_event *n = event_of(c, item);
    if (n->prev >= 0)
        event_of(c, n->prev)->next = n->next;
    else
        *head = n->next;
    if (n->next >= 0)
        event_of(c, n->next)->prev = n->prev;
}

static void take_out(struct mill_calendar *c, int32_t item)
{
    struct mill_event *n = event_of(c, item);
    if (n->place >= 0) {
        unlink_from(c, &c->head[n->place], item);
        c->in_year--;
    } else if (n->place == OVERFLOW_LIST) {
        unlink_from(c, &c->overflow, item);
    } else if (n->place == TODAY) {
        mill_calendar_today_leave(&c->todays, n->next);
    } else if (n->place == WAITING) {
        c->waiting = -1;
    }
    n->place = NOWHERE;
}

/* Files an event that is in no list. The day is a monotone function of t, so the order between days
 * is the order of times whatever the rounding. */
static void file(struct mill_calendar *c, int32_t item)
{
    struct mill_event *n = event_of(c, item);
    const double day = (n->t - c->year_start) * c->per_width;
    if (day < (double)(c->today + 1)) {
        n->place = TODAY;
        mill_calendar_today_join(&c->todays, item);
    } else if (day < (double)c->days) {
        n->place = (int32_t)day;
        link_into(c, &c->head[n->place], item);
        c->in_year++;
    } else {
        n->place = OVERFLOW_LIST;
        link_into(c, &c->overflow, item);
    }
}

static void file_waiting(struct mill_calendar *c)
{
    const int32_t item = c->waiting;
    c->waiting = -1;
    if (item >= 0)
        file(c, item);
}

/* Files an event when the next one is set: by then the head of its list, anywhere in a table as
 * long as there are balls, is in the cache. */
static void file_later(struct mill_calendar *c, int32_t item)
{
    struct mill_event *n = event_of(c, item);
    const double day = (n->t - c->year_start) * c->per_width;
    file_waiting(c);
    if (!(day >= (double)(c->today + 1) && day < (double)c->days)) {
        file(c, item);
        return;
    }
    c->waiting = item;
    n->place = WAITING;
    __builtin_prefetch(&c->head[(int32_t)day], 1);
}

static void refile_overflow(struct mill_calendar *c)
{
    int32_t item = c->overflow;
    c->overflow = -1;
    while (item >= 0) {
        const int32_t next = event_of(c, item)->next;
        file(c, item);
        item = next;
    }
}

struct mill_calendar *mill_calendar_create(int32_t items, struct mill_event *event, size_t stride)
{
    assert(items >= 0 && (!event || stride >= sizeof *event));
    struct mill_calendar *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    c->items = items;
    c->days = 16;
    while (c->days < items && c->days < (1 << 29))
        c->days *= 2;
    c->own = event ? NULL : malloc(sizeof *c->own * ((size_t)items + 1));
    c->todays.events.first = event ? event : c->own;
    c->todays.events.stride = event ? stride : sizeof *c->own;
    c->head = mill_memory_get((size_t)c->days, sizeof *c->head);
    c->todays.entry = malloc(sizeof *c->todays.entry * ((size_t)items + 1));
    if (!c->todays.events.first || !c->head || !c->todays.entry) {
        mill_calendar_free(c);
        return NULL;
    }
    c->width = 1e-6; /* any guess: it adapts within the first year */
    c->per_width = 1.0 / c->width;
    mill_calendar_clear(c, 0.0);
    return c;
}

void mill_calendar_free(struct mill_calendar *c)
{
    if (!c)
        return;
    free(c->own);
    free(c->head);
    free(c->todays.entry);
    free(c);
}

/* Forgets what is filed where; the nodes keep their times and whether they have an event. */
static void empty(struct mill_calendar *c, double start)
{
    for (int32_t d = 0; d < c->days; d++)
        c->head[d] = -1;
    c->overflow = -1;
    c->waiting = -1;
    mill_calendar_today_clear(&c->todays);
    c->in_year = 0;
    c->today = 0;
    c->taken = 0;
    c->ahead = -1;
    c->ahead_day = 0;
    c->year_start = start;
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
    if (n->place == TODAY && (t - c->year_start) * c->per_width < (double)(c->today + 1)) {
        n->t = t;
        mill_calendar_today_change(&c->todays, n->next);
        return;
    }
    take_out(c, item);
    n->t = t;
    if (t < HUGE_VAL)
        file_later(c, item);
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

/* Files every event again from `start` on. */
static void refile_all(struct mill_calendar *c, double start)
{
    empty(c, start);
    for (int32_t i = 0; i < c->items; i++) {
        if (event_of(c, i)->place != NOWHERE)
            file(c, i);
    }
}

void mill_calendar_set_width(struct mill_calendar *c, double width)
{
    assert(width > 0.0);
    const double now = c->year_start + (double)c->today * c->width;
    c->width = width;
    c->per_width = 1.0 / width;
    refile_all(c, now);
}

/* Changes the width when days have become too full or too empty: `days_passed` held c->taken
 * events. */
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

static void begin_year(struct mill_calendar *c, double start)
{
    c->year_start = start;
    c->today = 0;
    c->taken = 0;
    c->ahead = -1;
    c->ahead_day = 0;
    refile_overflow(c);
}

/* Begins the next year, or the one of the earliest event when nothing happens until then. */
static void next_year(struct mill_calendar *c)
{
    begin_year(c, c->year_start + (double)c->days * c->width);
    if (c->todays.count > 0 || c->in_year > 0)
        return;
    double first = HUGE_VAL;
    for (int32_t i = c->overflow; i >= 0; i = event_of(c, i)->next)
        first = event_of(c, i)->t < first ? event_of(c, i)->t : first;
    if (first < HUGE_VAL)
        begin_year(c, first);
}

/* Makes today the first day that has events. False when there are none at all. */
static bool turn_pages(struct mill_calendar *c)
{
    file_waiting(c);
    while (c->todays.count == 0) {
        if (c->in_year == 0) {
            if (c->overflow < 0)
                return false;
            c->today = c->days - 1;
            if (!adapt(c, (double)c->days))
                next_year(c);
            continue;
        }
        c->today++;
        int32_t item = c->head[c->today];
        c->head[c->today] = -1;
        while (item >= 0) {
            const int32_t next = event_of(c, item)->next;
            event_of(c, item)->place = TODAY;
            mill_calendar_today_join(&c->todays, item);
            c->in_year--;
            item = next;
        }
    }
    return true;
}

int32_t mill_calendar_next(struct mill_calendar *c, double *t)
{
    if (c->todays.count == 0 && !turn_pages(c))
        return -1;
    const int32_t item = mill_calendar_today_first(&c->todays);
    *t = event_of(c, item)->t;
    if (item != c->last_item || *t != c->last_t) {
        c->last_item = item;
        c->last_t = *t;
        c->taken++;
        /* a rate that rose by far within the year must not wait for the year's end */
        if (c->taken > 4 * (uint64_t)EVENTS_A_DAY * ((uint64_t)c->today + 64))
            adapt(c, (double)c->today + 1.0);
    }
    return item;
}

/* The records of a list lie anywhere in memory, so each is asked for at least one call before its
 * successor is read from it. Whatever happens to the list meanwhile, `ahead` is an item or -1, or a
 * place among today's events, which is less than the number of items: only speed depends on it. */
int32_t mill_calendar_ahead(struct mill_calendar *c)
{
    if (c->ahead_day <= c->today)
        c->ahead = -1; /* overtaken */
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
