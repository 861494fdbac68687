/* The event list. Time is cut into days of equal width; a year of days is held in an array of
 * unordered lists, what lies beyond the year in one overflow list. Only today's events are ordered,
 * in a small binary heap. Inserting and removing is O(1) for all but today's events, of which there
 * are about EVENTS_A_DAY whatever the number of balls: the width follows the event rate. Method: G.
 * Paul, J. Comput. Phys. 221 (2007) 615. Order: (time, item), so runs repeat exactly. */
#include "calendar.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#define EVENTS_A_DAY 8.0 /* more: larger heaps; fewer: more empty days to step over */
#define NOWHERE (-1)
#define OVERFLOW_LIST (-2)
#define TODAY (-3)

struct node {
    double t;
    int32_t next, prev; /* in its list, -1 at the ends */
    int32_t place;      /* list number, or NOWHERE, OVERFLOW_LIST, TODAY */
    int32_t heap_at;    /* index in today's heap */
};

struct entry {
    double t;
    int32_t item;
};

struct mill_calendar {
    int32_t items;
    int32_t days;    /* in a year, a power of two */
    int32_t today;   /* 0 .. days - 1 */
    int32_t in_year; /* events in lists after today */
    int32_t heap_size;
    int32_t overflow; /* head of the overflow list */
    double width, per_width;
    double year_start; /* [s] */
    uint64_t taken;    /* events that came up in this year */
    int32_t last_item; /* the event handed out last, so that asking twice counts once */
    double last_t;
    int32_t
        ahead; /* a walk through tomorrow's list that fetches its nodes before they are needed */
    struct node *node;
    int32_t *head;
    struct entry *heap;
};

static bool before(struct entry a, struct entry b)
{
    return a.t < b.t || (a.t == b.t && a.item < b.item);
}

static void heap_put(struct mill_calendar *c, int32_t at, struct entry e)
{
    c->heap[at] = e;
    c->node[e.item].heap_at = at;
}

static void heap_up(struct mill_calendar *c, int32_t at, struct entry e)
{
    while (at > 0) {
        const int32_t parent = (at - 1) / 2;
        if (!before(e, c->heap[parent]))
            break;
        heap_put(c, at, c->heap[parent]);
        at = parent;
    }
    heap_put(c, at, e);
}

static void heap_down(struct mill_calendar *c, int32_t at, struct entry e)
{
    for (;;) {
        int32_t child = 2 * at + 1;
        if (child >= c->heap_size)
            break;
        if (child + 1 < c->heap_size && before(c->heap[child + 1], c->heap[child]))
            child++;
        if (!before(c->heap[child], e))
            break;
        heap_put(c, at, c->heap[child]);
        at = child;
    }
    heap_put(c, at, e);
}

static void heap_remove(struct mill_calendar *c, int32_t at)
{
    const struct entry last = c->heap[--c->heap_size];
    if (at == c->heap_size)
        return;
    if (at > 0 && before(last, c->heap[(at - 1) / 2]))
        heap_up(c, at, last);
    else
        heap_down(c, at, last);
}

static void link_into(struct mill_calendar *c, int32_t *head, int32_t item)
{
    struct node *n = &c->node[item];
    n->prev = -1;
    n->next = *head;
    if (*head >= 0)
        c->node[*head].prev = item;
    *head = item;
}

static void unlink_from(struct mill_calendar *c, int32_t *head, int32_t item)
{
    const struct node *n = &c->node[item];
    if (n->prev >= 0)
        c->node[n->prev].next = n->next;
    else
        *head = n->next;
    if (n->next >= 0)
        c->node[n->next].prev = n->prev;
}

static void take_out(struct mill_calendar *c, int32_t item)
{
    struct node *n = &c->node[item];
    if (n->place >= 0) {
        unlink_from(c, &c->head[n->place], item);
        c->in_year--;
    } else if (n->place == OVERFLOW_LIST) {
        unlink_from(c, &c->overflow, item);
    } else if (n->place == TODAY) {
        heap_remove(c, n->heap_at);
    }
    n->place = NOWHERE;
}

/* Files an event that is in no list. The day is a monotone function of t, so the order between days
 * is the order of times whatever the rounding. */
static void file(struct mill_calendar *c, int32_t item)
{
    struct node *n = &c->node[item];
    const double day = (n->t - c->year_start) * c->per_width;
    if (day < (double)(c->today + 1)) {
        n->place = TODAY;
        const struct entry e = {n->t, item};
        heap_up(c, c->heap_size++, e);
    } else if (day < (double)c->days) {
        n->place = (int32_t)day;
        link_into(c, &c->head[n->place], item);
        c->in_year++;
    } else {
        n->place = OVERFLOW_LIST;
        link_into(c, &c->overflow, item);
    }
}

static void refile_overflow(struct mill_calendar *c)
{
    int32_t item = c->overflow;
    c->overflow = -1;
    while (item >= 0) {
        const int32_t next = c->node[item].next;
        file(c, item);
        item = next;
    }
}

struct mill_calendar *mill_calendar_create(int32_t items)
{
    struct mill_calendar *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    c->items = items;
    c->days = 16;
    while (c->days < items / 2 && c->days < (1 << 29))
        c->days *= 2;
    c->node = malloc(sizeof *c->node * ((size_t)items + 1));
    c->head = malloc(sizeof *c->head * (size_t)c->days);
    c->heap = malloc(sizeof *c->heap * ((size_t)items + 1));
    if (!c->node || !c->head || !c->heap) {
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
    free(c->node);
    free(c->head);
    free(c->heap);
    free(c);
}

/* Forgets what is filed where; the nodes keep their times and whether they have an event. */
static void empty(struct mill_calendar *c, double start)
{
    for (int32_t d = 0; d < c->days; d++)
        c->head[d] = -1;
    c->overflow = -1;
    c->heap_size = 0;
    c->in_year = 0;
    c->today = 0;
    c->taken = 0;
    c->ahead = -1;
    c->year_start = start;
}

void mill_calendar_clear(struct mill_calendar *c, double start)
{
    for (int32_t i = 0; i < c->items; i++)
        c->node[i].place = NOWHERE;
    c->last_item = -1;
    empty(c, start);
}

void mill_calendar_set(struct mill_calendar *c, int32_t item, double t)
{
    struct node *n = &c->node[item];
    if (n->place == TODAY && (t - c->year_start) * c->per_width < (double)(c->today + 1)) {
        const struct entry e = {t, item};
        const int32_t at = n->heap_at;
        n->t = t;
        if (at > 0 && before(e, c->heap[(at - 1) / 2]))
            heap_up(c, at, e);
        else
            heap_down(c, at, e);
        return;
    }
    take_out(c, item);
    n->t = t;
    if (t < HUGE_VAL)
        file(c, item);
}

double mill_calendar_time(const struct mill_calendar *c, int32_t item)
{
    return c->node[item].place == NOWHERE ? HUGE_VAL : c->node[item].t;
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
        if (c->node[i].place != NOWHERE)
            file(c, i);
    }
}

void mill_calendar_set_width(struct mill_calendar *c, double width)
{
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

/* Begins the next year, or the one of the earliest event when nothing happens until then. */
static void next_year(struct mill_calendar *c)
{
    double first = HUGE_VAL;
    for (int32_t i = c->overflow; i >= 0; i = c->node[i].next)
        first = fmin(first, c->node[i].t);
    const double next = c->year_start + (double)c->days * c->width;
    if (first < HUGE_VAL && first - next > (double)c->days * c->width)
        c->year_start = first;
    else
        c->year_start = next;
    c->today = 0;
    c->taken = 0;
    refile_overflow(c);
}

/* The nodes of a list lie anywhere in memory, so walking it waits for each of them in turn; they
 * are asked for one at an event while today lasts. Whatever happens to the list meanwhile, `ahead`
 * is an item or -1, and only speed depends on it. */
static void fetch_ahead(struct mill_calendar *c)
{
    if (c->ahead >= 0)
        __builtin_prefetch(&c->node[c->ahead], 1);
}

/* Makes today the first day that has events. False when there are none at all. */
static bool turn_pages(struct mill_calendar *c)
{
    while (c->heap_size == 0) {
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
            const int32_t next = c->node[item].next;
            c->node[item].place = TODAY;
            const struct entry e = {c->node[item].t, item};
            heap_up(c, c->heap_size++, e);
            c->in_year--;
            item = next;
        }
        c->ahead = c->today + 1 < c->days ? c->head[c->today + 1] : -1;
        fetch_ahead(c);
    }
    return true;
}

int32_t mill_calendar_next(struct mill_calendar *c, double *t)
{
    if (c->heap_size == 0 && !turn_pages(c))
        return -1;
    const struct entry e = c->heap[0];
    if (e.item != c->last_item || e.t != c->last_t) {
        c->last_item = e.item;
        c->last_t = e.t;
        c->taken++;
        if (c->ahead >= 0) {
            c->ahead = c->node[c->ahead].next;
            fetch_ahead(c);
        }
        /* a rate that rose by far within the year must not wait for the year's end */
        if (c->taken > 4 * (uint64_t)EVENTS_A_DAY * ((uint64_t)c->today + 64))
            adapt(c, (double)c->today + 1.0);
    }
    *t = e.t;
    return e.item;
}
