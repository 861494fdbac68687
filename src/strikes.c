/* Is this contact a new strike or a re-contact of the last one? Times never decrease, so contacts
 * form a queue: new ones are written behind, and when it is full, those older than the window are
 * dropped in front. Those whose pairs share a hash value are linked into a list, the newest first;
 * one glance at that one mostly settles the matter: it is too old, and so are all others. As few
 * contacts are young, some hundred whatever the number of balls, queue and lists stay in the cache.
 */
#include "strikes.h"

#include <assert.h>
#include <stdlib.h>

enum {
    FEWEST_BITS = 8,
    MOST_BITS = 28,
    LIST_BITS = 2 /* four times as many lists as entries: few young pairs share one */
};

/* No pair has this number: a later contact of the same pair stands for this one, too */
#define TAKEN_OVER UINT64_MAX

void mill_strikes_free(struct mill_strikes *strikes)
{
    free(strikes->entry);
    free(strikes->newest);
    strikes->entry = NULL;
    strikes->newest = NULL;
}

size_t mill_strikes_room(const struct mill_strikes *strikes)
{
    return (size_t)1 << strikes->bits;
}

size_t mill_strikes_lists(const struct mill_strikes *strikes)
{
    return (size_t)1 << (strikes->bits + LIST_BITS);
}

bool mill_strikes_resize(struct mill_strikes *strikes, int bits)
{
    if (bits < FEWEST_BITS || bits > MOST_BITS)
        return false;
    struct mill_strikes to = {.window = strikes->window, .bits = bits, .first = 1, .next = 1};
    const size_t room = mill_strikes_room(&to);
    to.entry = calloc(room, sizeof *to.entry);
    to.newest = calloc(mill_strikes_lists(&to), sizeof *to.newest);
    if (!to.entry || !to.newest) {
        mill_strikes_free(&to);
        return false;
    }
    mill_strikes_free(strikes);
    *strikes = to;
    return true;
}

bool mill_strikes_init(struct mill_strikes *strikes, double window)
{
    *strikes = (struct mill_strikes){.window = window};
    return mill_strikes_resize(strikes, FEWEST_BITS);
}

static struct mill_strike *entry_of(const struct mill_strikes *strikes, uint32_t number)
{
    return &strikes->entry[number & (((uint32_t)1 << strikes->bits) - 1)];
}

static uint64_t pair_number(enum mill_kind kind, int32_t ball, int32_t partner)
{
    assert(ball >= 0 && ball < 1 << 30 && partner >= -1 && partner < 1 << 30);
    return (uint64_t)kind << 61 | (uint64_t)ball << 31 | (uint64_t)(partner + 1);
}

/* The highest bits of a product with 2^64 over the golden ratio: neighbours are spread evenly */
static uint32_t *list_of(const struct mill_strikes *strikes, uint64_t pair)
{
    return &strikes
                ->newest[pair * UINT64_C(0x9E3779B97F4A7C15) >> (64 - LIST_BITS - strikes->bits)];
}

/* Copies what is still wanted of one queue, possibly to the front of itself; lists anew. */
static void move(const struct mill_strikes *from, struct mill_strikes *to)
{
    const uint32_t end = from->next;
    to->next = to->first;
    for (size_t i = 0; i < mill_strikes_lists(to); i++)
        to->newest[i] = to->first - 1; /* none that is kept */
    for (uint32_t k = from->first; k != end; k++) {
        const struct mill_strike old = *entry_of(from, k);
        if (old.pair == TAKEN_OVER)
            continue;
        struct mill_strike *strike = entry_of(to, to->next);
        uint32_t *newest = list_of(to, old.pair);
        *strike = old;
        strike->before = *newest;
        *newest = to->next++;
    }
}

/* At least half the room, so that this is seldom called. false: out of memory. */
static bool make_room(struct mill_strikes *strikes, double now)
{
    struct mill_strikes larger = {.window = strikes->window};
    const uint32_t half = (uint32_t)(mill_strikes_room(strikes) / 2);
    while (strikes->first != strikes->next &&
           !(now - entry_of(strikes, strikes->first)->time < strikes->window))
        strikes->first++;
    if (strikes->next - strikes->first <= half)
        return true;
    move(strikes, strikes);
    if (strikes->next - strikes->first <= half)
        return true;
    if (!mill_strikes_resize(&larger, strikes->bits + 1))
        return false;
    move(strikes, &larger);
    mill_strikes_free(strikes);
    *strikes = larger;
    return true;
}

/* The last contact of the pair within the window, or NULL. A number that was dropped may seem to be
 * kept once all numbers have gone around; then it is no contact of this pair, as all those are
 * newer, and the search ends because numbers decrease. */
static struct mill_strike *find(const struct mill_strikes *strikes, uint32_t k, uint64_t pair,
                                double now)
{
    const uint32_t first = strikes->first;
    uint32_t limit = strikes->next - first;
    for (;;) {
        struct mill_strike *strike = entry_of(strikes, k);
        /* both at once: whether a number is kept is hard to foresee, whether it is young is not */
        if (!((k - first < limit) & (now - strike->time < strikes->window)))
            return NULL;
        if (strike->pair == pair)
            return strike;
        limit = k - first;
        k = strike->before;
    }
}

struct mill_strike *mill_strikes_meet(struct mill_strikes *strikes, enum mill_kind kind,
                                      int32_t ball, int32_t partner, double time, bool *fresh)
{
    const uint64_t pair = pair_number(kind, ball, partner);
    if (strikes->next - strikes->first == mill_strikes_room(strikes) && !make_room(strikes, time))
        return NULL;
    uint32_t *newest = list_of(strikes, pair);
    struct mill_strike *last = find(strikes, *newest, pair, time);
    struct mill_strike *strike = entry_of(strikes, strikes->next);
    *fresh = !last;
    strike->pair = pair;
    strike->time = time;
    strike->normal = last ? last->normal : 0;
    strike->tangential = last ? last->tangential : 0;
    strike->before = *newest;
    *newest = strikes->next++;
    if (last)
        last->pair = TAKEN_OVER;
    return strike;
}
