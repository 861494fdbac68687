/* Today's events. The earliest of a few is found fastest by comparing all, without a branch; where
 * many fall on one day (balls that start in step) they become a binary heap. */
#include "engine/calendar_today.h"

#include <assert.h>
#include <string.h>

#define CROWD 24 /* from so many events on today is a heap */

/* Whole numbers in the order of the times: the bits of a double, those of negative ones turned
 * round; 0.0 makes one of the two zeros. */
static struct mill_today_entry entry_of(const struct mill_today *d, int32_t item)
{
    struct mill_today_entry e = {0, item};
    const double t = mill_event_of(&d->events, item)->t + 0.0;
    memcpy(&e.order, &t, sizeof e.order);
    e.order ^= -(int64_t)(e.order < 0) & INT64_MAX;
    return e;
}

static bool before(struct mill_today_entry a, struct mill_today_entry b)
{
    return (a.order < b.order) | ((a.order == b.order) & (a.item < b.item));
}

static void put(struct mill_today *d, int32_t at, struct mill_today_entry e)
{
    d->entry[at] = e;
    mill_event_of(&d->events, e.item)->next = at;
}

static void heap_up(struct mill_today *d, int32_t at, struct mill_today_entry e)
{
    while (at > 0) {
        const int32_t parent = (at - 1) / 2;
        if (!before(e, d->entry[parent]))
            break;
        put(d, at, d->entry[parent]);
        at = parent;
    }
    put(d, at, e);
}

static void heap_down(struct mill_today *d, int32_t at, struct mill_today_entry e)
{
    for (;;) {
        int32_t child = 2 * at + 1;
        if (child >= d->count)
            break;
        if (child + 1 < d->count && before(d->entry[child + 1], d->entry[child]))
            child++;
        if (!before(d->entry[child], e))
            break;
        put(d, at, d->entry[child]);
        at = child;
    }
    put(d, at, e);
}

/* Today has become a crowd. */
static void make_heap(struct mill_today *d)
{
    const int32_t n = d->count;
    d->heaped = true;
    for (d->count = 1; d->count < n; d->count++)
        heap_up(d, d->count, d->entry[d->count]);
}

void mill_calendar_today_clear(struct mill_today *d)
{
    d->count = 0;
    d->heaped = false;
}

void mill_calendar_today_join(struct mill_today *d, int32_t item)
{
    const struct mill_today_entry e = entry_of(d, item);
    if (d->heaped) {
        d->count++;
        heap_up(d, d->count - 1, e);
        return;
    }
    put(d, d->count++, e);
    if (d->count == CROWD)
        make_heap(d);
}

/* The entry at `at` is another one now. */
static void replace(struct mill_today *d, int32_t at, struct mill_today_entry e)
{
    if (!d->heaped)
        put(d, at, e);
    else if (at > 0 && before(e, d->entry[(at - 1) / 2]))
        heap_up(d, at, e);
    else
        heap_down(d, at, e);
}

void mill_calendar_today_change(struct mill_today *d, int32_t place)
{
    assert(place >= 0 && place < d->count);
    replace(d, place, entry_of(d, d->entry[place].item));
}

void mill_calendar_today_leave(struct mill_today *d, int32_t place)
{
    assert(place >= 0 && place < d->count);
    const struct mill_today_entry last = d->entry[--d->count];
    if (place < d->count)
        replace(d, place, last);
    if (d->count == 0)
        d->heaped = false;
}

int32_t mill_calendar_today_first(const struct mill_today *d)
{
    assert(d->count > 0);
    struct mill_today_entry first = d->entry[0];
    for (int32_t k = 1; !d->heaped && k < d->count; k++) {
        const struct mill_today_entry e = d->entry[k];
        /* masks: a compiler makes a branch of a choice, and half of them are mispredicted */
        const int64_t take = -(int64_t)before(e, first);
        first.order ^= (first.order ^ e.order) & take;
        first.item ^= (first.item ^ e.item) & (int32_t)take;
    }
    return first.item;
}
