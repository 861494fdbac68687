/* Is a contact a new strike, or a re-contact in the last one? A hash table stores the last contact
 * of every pair for the length of the window. Entries are never deleted: one older than the window
 * may be overwritten, and the table grows if a bucket is full of younger ones. It stays small for
 * any number of balls, because only pairs that met within about 10 us are needed. */
#include "observe/strikes.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

enum { BUCKET = 8 /* entries */, FEWEST_BITS = 6, MOST_BITS = 40 };

static struct mill_strike *make_entries(int bits)
{
    const size_t room = ((size_t)1 << bits) * BUCKET;
    struct mill_strike *entry = calloc(room, sizeof *entry);
    if (entry)
        for (size_t i = 0; i < room; i++)
            entry[i].time = -INFINITY;
    return entry;
}

bool mill_strikes_init(struct mill_strikes *strikes, double window)
{
    *strikes = (struct mill_strikes){window, FEWEST_BITS, make_entries(FEWEST_BITS)};
    return strikes->entry != NULL;
}

void mill_strikes_free(struct mill_strikes *strikes)
{
    free(strikes->entry);
}

size_t mill_strikes_room(const struct mill_strikes *strikes)
{
    return ((size_t)1 << strikes->bits) * BUCKET;
}

/* Multiplies and folds, twice, so that neighbouring balls are in different buckets. The constants
 * are odd with well mixed bits (2^64 over the golden ratio, and 2^64 over the plastic number). */
static struct mill_strike *bucket_of(const struct mill_strikes *strikes, uint64_t pair)
{
    uint64_t h = pair ^ pair >> 32;
    h *= UINT64_C(0x9E3779B97F4A7C15);
    h ^= h >> 29;
    h *= UINT64_C(0xC13FA9A902A6328F);
    return strikes->entry + (h >> 1 >> (63 - strikes->bits)) * BUCKET;
}

/* Copies the entries not older than the window into an empty table. false: they do not fit. */
static bool spread(const struct mill_strikes *from, const struct mill_strikes *to, double now)
{
    const struct mill_strike *end = from->entry + mill_strikes_room(from);
    for (const struct mill_strike *old = from->entry; old < end; old++) {
        if (!(now - old->time < from->window))
            continue;
        struct mill_strike *bucket = bucket_of(to, old->pair);
        int k = 0;
        while (k < BUCKET && bucket[k].time > (double)-INFINITY)
            k++;
        if (k == BUCKET)
            return false;
        bucket[k] = *old;
    }
    return true;
}

bool mill_strikes_resize(struct mill_strikes *strikes, int bits, double now)
{
    for (; bits >= 0 && bits <= MOST_BITS; bits++) {
        const struct mill_strikes other = {strikes->window, bits, make_entries(bits)};
        if (!other.entry)
            return false;
        const bool fits = spread(strikes, &other, now);
        free(fits ? strikes->entry : other.entry);
        if (fits) {
            *strikes = other;
            return true;
        }
    }
    return false;
}

struct mill_strike *mill_strikes_meet(struct mill_strikes *strikes, int kind, int32_t ball,
                                      int32_t partner, double time, double *since)
{
    assert(kind >= 0 && kind < 1 << 5 && ball >= 0 && ball < 1 << 29);
    assert(partner >= -1 && partner < 1 << 29);
    const uint64_t pair = (uint64_t)kind << 59 | (uint64_t)ball << 30 | (uint64_t)(partner + 1);
    for (;;) {
        /* the entry of this pair, else the oldest one */
        struct mill_strike *bucket = bucket_of(strikes, pair), *one = bucket;
        for (int k = 0; k < BUCKET && one->pair != pair; k++)
            if (bucket[k].pair == pair || bucket[k].time < one->time)
                one = &bucket[k];
        const bool recent = time - one->time < strikes->window;
        if (one->pair == pair || !recent) {
            *since = recent ? time - one->time : (double)INFINITY;
            one->pair = pair;
            one->time = time;
            return one;
        }
        if (!mill_strikes_resize(strikes, strikes->bits + 1, time))
            return NULL;
    }
}
