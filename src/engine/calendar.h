/* The calendar: at most one event per ball. Method: G. Paul, J. Comput. Phys. 221 (2007) 615. */
#ifndef MILLSIM_CALENDAR_H
#define MILLSIM_CALENDAR_H

#include <stddef.h>
#include <stdint.h>

struct mill_calendar;

/* The event of an item. It is part of its owner's record, next to the data that the event needs. */
struct mill_event {
    double t;           /* [s] */
    int32_t next, prev; /* neighbours in its list, -1: none; next of today's: index among them */
    int32_t place;      /* number of its list; negative values: see calendar.c */
};

/* An empty calendar; NULL: out of memory. Item k's event is k times `stride` bytes after `event` */
struct mill_calendar *mill_calendar_create(int32_t items, struct mill_event *event, size_t stride);
void mill_calendar_free(struct mill_calendar *calendar);

/* Several calendars can share the items; each item is in one of them at most. To create or to clear
 * one of them takes the events out of all: the caller must then clear all. */

/* Empties the calendar; afterwards it accepts times from `start` [s] on. */
void mill_calendar_clear(struct mill_calendar *calendar, double start);

/* Sets the event of an item to time t [s]; this replaces an earlier event. INFINITY removes it. A t
 * before the last event taken is allowed and comes out next. */
void mill_calendar_set(struct mill_calendar *calendar, int32_t item, double t);

/* Returns the item with the earliest event, and its time. Of equal times, the smaller item is
 * first. -1: no events. The event stays in the calendar until it is set again. */
int32_t mill_calendar_next(struct mill_calendar *calendar, double *t);

/* An item whose event is due soon; -1: none at present. Called once per event, it returns most
 * items a few events before they are due, so that the cache can load their data in advance. */
int32_t mill_calendar_ahead(struct mill_calendar *calendar);

/* The time of the item's event [s]; INFINITY: no event. */
double mill_calendar_time(const struct mill_calendar *calendar, int32_t item);

/* Length of a day [s], for tests and tuning. Setting it sorts all events again. */
double mill_calendar_width(const struct mill_calendar *calendar);
void mill_calendar_set_width(struct mill_calendar *calendar, double width);

#endif
