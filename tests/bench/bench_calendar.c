/* What an event costs in the calendar: the hold model (take the first, put it back a random gap
 * later) for three distributions of gaps and 10^2 .. 10^6 items; then with rates that change by a
 * million. Prints nanoseconds per event; memory latency is what grows with the items. */
#include "engine/calendar.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <time.h>

enum { EXPONENTIAL, UNIFORM, BIMODAL, GAPS };
enum { MOST = 1000000 };

static struct mill_event event[MOST];

/* splitmix64 (Steele, Lea & Flood 2014), uniform in [0, 1) */
static double uniform(uint64_t *seed)
{
    uint64_t z = *seed += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

static double gap(uint64_t *seed, int kind)
{
    if (kind == EXPONENTIAL)
        return -log(1.0 - uniform(seed));
    if (kind == UNIFORM)
        return 2.0 * uniform(seed);
    return (uniform(seed) < 0.5 ? 1e-4 : 1.0) * 2.0 * uniform(seed);
}

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* `scale` multiplies every gap; returns the time reached */
static double hold(struct mill_calendar *calendar, uint64_t *seed, int kind, double scale,
                   long events)
{
    double t = 0.0;
    for (long n = 0; n < events; n++) {
        const int32_t item = mill_calendar_next(calendar, &t);
        mill_calendar_set(calendar, item, t + scale * gap(seed, kind));
    }
    return t;
}

/* Best of several stretches [ns]; NaN when out of memory. */
static double steady(int32_t items, int kind)
{
    uint64_t seed = 1;
    const long events = 500000;
    double best = (double)INFINITY;
    struct mill_calendar *calendar = mill_calendar_create(items, event, sizeof event[0]);
    if (!calendar)
        return (double)NAN;
    for (int32_t i = 0; i < items; i++)
        mill_calendar_set(calendar, i, gap(&seed, kind));
    hold(calendar, &seed, kind, 1.0, 4L * items);
    for (int round = 0; round < 5; round++) {
        const double begin = seconds();
        hold(calendar, &seed, kind, 1.0, events);
        best = fmin(best, (seconds() - begin) / (double)events);
    }
    mill_calendar_free(calendar);
    return 1e9 * best;
}

/* Mean over phases whose gaps differ by a million [ns]; NaN when out of memory. */
static double changing(int32_t items)
{
    uint64_t seed = 1;
    const long events = 8L * items + 100000;
    struct mill_calendar *calendar = mill_calendar_create(items, event, sizeof event[0]);
    if (!calendar)
        return (double)NAN;
    double t = 0.0;
    const double begin = seconds();
    for (int phase = 0; phase < 4; phase++) {
        const double scale = phase % 2 ? 1e-6 : 1.0;
        for (int32_t i = 0; i < items; i++)
            mill_calendar_set(calendar, i, t + scale * gap(&seed, EXPONENTIAL));
        t = hold(calendar, &seed, EXPONENTIAL, scale, events);
    }
    const double took = seconds() - begin;
    mill_calendar_free(calendar);
    return 1e9 * took / (4.0 * (double)(events + items));
}

int main(void)
{
    printf("%10s %12s %12s %12s %12s   ns per event\n", "items", "exponential", "uniform",
           "bimodal", "changing");
    for (int32_t items = 100; items <= MOST; items *= 10) {
        printf("%10ld", (long)items);
        for (int kind = 0; kind < GAPS; kind++)
            printf(" %12.1f", steady(items, kind));
        printf(" %12.1f\n", changing(items));
        fflush(stdout);
    }
    return 0;
}
