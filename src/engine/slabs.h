/* Slabs: the mill is cut along x into slabs. Each has a calendar of its own, so that several
 * threads can carry out events at the same time. A thread works inside its slab, away from the
 * others. What happens near them is put off, with all that could depend on it, until the threads
 * have come to the end of a window of time; then one thread does it. Marks in the blocks tell what
 * must wait, and show afterwards whether an event came too early. A block is a cell of the coarsest
 * grid: until a ball leaves its cell, it touches only balls in blocks next to its own. */
#ifndef MILLSIM_SLABS_H
#define MILLSIM_SLABS_H

#include "engine/crew.h"
#include "engine/schedule.h"

struct mill_slab {
    int32_t lo, hi;             /* the calendar has the balls in the blocks lo .. hi - 1 */
    int32_t inner_lo, inner_hi; /* the thread works in the blocks inner_lo .. inner_hi - 1 */
    struct mill_calendar *calendar;
};

/* What happened in a block. Windows have tags: the search for marks is mostly one for memory. */
struct mill_slab_mark {
    float done; /* [s] since the begin of the window, rounded up: a thread's last event here, */
    uint16_t window; /* in the window with this tag */
    uint16_t waits;  /* tag of the window in which events here must wait */
};

struct mill_slabs {
    struct mill_memory_pool memory;
    struct mill_schedule *schedule;
    int count;
    struct mill_slab slab[MILL_CREW_MOST];
    struct mill_calendar *late;  /* events that were put off: the schedule's calendar */
    int8_t *home;                /* of each ball: number of its slab's calendar; count: `late` */
    struct mill_slab_mark *mark; /* of each block */
    uint32_t *contacts;          /* of each ball, when the mill was last cut */
    int32_t layer;               /* [blocks] in a layer of the mill across x */
    int32_t layers, margin;      /* of the grid; of empty layers at both ends */
    uint16_t tag;                /* of the present window; 0: none */
    double begin;                /* [s] local time of its begin */
    double end;                  /* [s] local time: earlier events are late. -INFINITY: none are */
};

/* The number of slabs with which the run is fastest on so many threads */
int mill_slabs_worth(const struct mill_schedule *schedule, int threads);

/* Cuts the mill into slabs, `threads` at most. The schedule's events go into their calendars.
 * *slabs NULL: the mill is too short for two. False when out of memory */
bool mill_slabs_create(struct mill_schedule *schedule, int threads, struct mill_slabs **slabs);

/* Brings all events back into the schedule's calendar. */
void mill_slabs_free(struct mill_slabs *slabs);

/* Empties all calendars, and cuts the mill again. */
void mill_slabs_begin(struct mill_slabs *slabs);

/* Cuts the mill again, where all slabs had equally many contacts since the last cut. */
void mill_slabs_cut(struct mill_slabs *slabs);

/* Begins a window at this local time [s]. */
void mill_slabs_open(struct mill_slabs *slabs, double begin);

/* Sets the time of ball i's event [s]; INFINITY removes it. One thread at a time may call it. */
void mill_slabs_enter(struct mill_slabs *slabs, int32_t i, double t);

/* The same for a schedule with slabs or without */
static inline void mill_schedule_enter(struct mill_schedule *p, int32_t i, double t)
{
    if (p->slabs)
        mill_slabs_enter(p->slabs, i, t);
    else
        mill_calendar_set(p->calendar, i, t);
}

/* The first of all events. -1: none */
int32_t mill_slabs_next(struct mill_slabs *slabs, double *t);

/* May the thread of this slab carry out ball i's event, due at local time t, now? If so, marks it
 * as done. If not, marks all events near it as waiting, and takes it out of the calendar. */
bool mill_slabs_claim(struct mill_slabs *slabs, const struct mill_slab *slab, int32_t i, double t);

/* Has a thread carried out a later event that ball i's event, due at t, can depend on or change? */
bool mill_slabs_passed(const struct mill_slabs *slabs, int32_t i, double t);

#endif
