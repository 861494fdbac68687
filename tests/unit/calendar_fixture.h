/* What the tests of the event list share: the same questions to the calendar and to a plain array
 * of times that is searched from end to end. */
#ifndef CALENDAR_FIXTURE_H
#define CALENDAR_FIXTURE_H

#include "engine/calendar.h"

#include "draws.h"

struct twin {
    struct mill_calendar *calendar;
    struct mill_event *event;
    double *time; /* of each item, INFINITY: absent */
    int32_t items;
    double now;
    long wrong; /* answers that differ */
};

static inline struct twin make_twin(int32_t items)
{
    struct twin twin = {.items = items};
    twin.event = calloc((size_t)items, sizeof *twin.event);
    twin.calendar = mill_calendar_create(items, twin.event, sizeof *twin.event);
    twin.time = malloc(sizeof *twin.time * (size_t)items);
    if (!twin.calendar || !twin.time)
        ck_abort_msg("out of memory");
    for (int32_t i = 0; i < items; i++)
        twin.time[i] = INFINITY;
    return twin;
}

static inline void free_twin(struct twin *twin)
{
    mill_calendar_free(twin->calendar);
    free(twin->event);
    free(twin->time);
}

static inline void set(struct twin *twin, int32_t item, double t)
{
    twin->time[item] = t;
    mill_calendar_set(twin->calendar, item, t);
}

static inline void clear(struct twin *twin, double start)
{
    mill_calendar_clear(twin->calendar, start);
    for (int32_t i = 0; i < twin->items; i++)
        twin->time[i] = INFINITY;
    twin->now = start;
}

/* The earliest item by the calendar, compared with the array's; -1 when there is none. */
static inline int32_t next(struct twin *twin)
{
    double t = NAN;
    const int32_t item = mill_calendar_next(twin->calendar, &t);
    int32_t first = -1;
    double least = INFINITY;
    for (int32_t i = 0; i < twin->items; i++) {
        if (twin->time[i] < least) {
            least = twin->time[i];
            first = i;
        }
    }
    if (item != first || (first >= 0 && t != least))
        twin->wrong++;
    if (first >= 0)
        twin->now = least;
    return first;
}

enum gaps { EXPONENTIAL, UNIFORM, BIMODAL, GAPS };

static inline double gap(uint64_t *seed, enum gaps kind, double mean)
{
    switch (kind) {
    case EXPONENTIAL:
        return -mean * log(1.0 - uniform(seed, 0.0, 1.0));
    case UNIFORM:
        return uniform(seed, 0.0, 2.0 * mean);
    default:
        return (below(seed, 2) ? 1e-4 : 1.0) * uniform(seed, 0.0, 2.0 * mean);
    }
}

/* What happens to a ball's partners: moves, removals, ties, times that have passed, bursts. */
static inline void disturb(struct twin *twin, uint64_t *seed, enum gaps kind, double mean)
{
    const int32_t item = below(seed, twin->items);
    switch (below(seed, 64)) {
    case 0:
        set(twin, item, INFINITY);
        break;
    case 1:
        set(twin, item, twin->now);
        break;
    case 2:
        set(twin, item, twin->now - gap(seed, kind, mean));
        break;
    case 3:
        set(twin, item, twin->time[below(seed, twin->items)]);
        break;
    case 4:
        if (below(seed, 50) == 0) {
            const double t = twin->now + gap(seed, kind, mean);
            for (int32_t n = 0; n < twin->items / 5 + 2; n++)
                set(twin, below(seed, twin->items), t + (below(seed, 2) ? 0.0 : 1e-6 * mean));
        }
        break;
    case 5:
        next(twin); /* asking twice changes nothing */
        break;
    default:
        if (below(seed, 2))
            set(twin, item, twin->now + gap(seed, kind, mean));
    }
}

#endif
