/* The event list: a calendar queue (G. Paul, J. Comput. Phys. 221 (2007) 615) that holds at most
 * one event per ball. */
#ifndef MILLSIM_CALENDAR_H
#define MILLSIM_CALENDAR_H

#include <stddef.h>
#include <stdint.h>

struct mill_calendar;

/* An item's event. It lies where its owner wants it, beside what the event is about. */
struct mill_event {
    double t;           /* [s] */
    int32_t next, prev; /* in its list, -1 at the ends; today: next is its place among today's */
    int32_t place;      /* number of its list, or what calendar.c says below zero */
};

/* For items 0..items-1, all absent; NULL when out of memory. Item k's event lies `stride` bytes
 * times k after `event`. */
struct mill_calendar *mill_calendar_create(int32_t items, struct mill_event *event, size_t stride);
void mill_calendar_free(struct mill_calendar *calendar);

/* Empties the calendar; times from `start` [s] on may follow. */
void mill_calendar_clear(struct mill_calendar *calendar, double start);

/* Puts item's event at time t [s], moving it if it had one; INFINITY removes it. A t before the
 * last event taken is allowed and comes out next. */
void mill_calendar_set(struct mill_calendar *calendar, int32_t item, double t);

/* The item with the earliest event and its time, ties by the smaller item; -1 when there is none.
 * The event stays until it is set anew. */
int32_t mill_calendar_next(struct mill_calendar *calendar, double *t);

/* An item whose event comes up soon, -1: none now. Asked once an event, it names most items some
 * events before their turn, so that what they need can be fetched into the cache. */
int32_t mill_calendar_ahead(struct mill_calendar *calendar);

/* When the item's event is due [s], INFINITY: it has none. */
double mill_calendar_time(const struct mill_calendar *calendar, int32_t item);

/* Width of a day [s], for tests and tuning; setting it re-sorts everything. */
double mill_calendar_width(const struct mill_calendar *calendar);
void mill_calendar_set_width(struct mill_calendar *calendar, double width);

#endif
