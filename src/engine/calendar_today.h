/* Today's events in the calendar: the only ones that are looked at one by one. */
#ifndef MILLSIM_CALENDAR_TODAY_H
#define MILLSIM_CALENDAR_TODAY_H

#include "engine/calendar.h"

#include <stdbool.h>

/* The events of all items, wherever they lie */
struct mill_events {
    struct mill_event *first; /* item 0's */
    size_t stride;            /* bytes from one to the next */
};

static inline struct mill_event *mill_event_of(const struct mill_events *e, int32_t item)
{
    return (struct mill_event *)((char *)e->first + (size_t)item * e->stride);
}

struct mill_today_entry {
    int64_t order; /* the time as a whole number: comparing these needs no branch */
    int32_t item;
};

struct mill_today {
    struct mill_events events;
    struct mill_today_entry *entry; /* room for all items */
    int32_t count;
    bool heaped; /* they form a heap, else they are in no order */
};

/* Forgets all of today's events. */
void mill_calendar_today_clear(struct mill_today *today);

/* Puts an item's event among them; its `next` tells where it stands. */
void mill_calendar_today_join(struct mill_today *today, int32_t item);

/* Takes out the event at a place; another one may stand there then. */
void mill_calendar_today_leave(struct mill_today *today, int32_t place);

/* The event at a place has another time now. */
void mill_calendar_today_change(struct mill_today *today, int32_t place);

/* The item with the earliest event, of equally early ones the smaller item; there must be one. */
int32_t mill_calendar_today_first(const struct mill_today *today);

#endif
