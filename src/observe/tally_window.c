/* When may the run end, and where does its window begin? Where run.precision is given and
 * run.sample_from is not, nobody knows yet what belongs to the start-up while it is gathered, and
 * what is gathered cannot be taken out again: rounded sums do not subtract to nothing. So it is
 * kept apart by stretches of a few batches, at most MILL_TALLY_STRETCHES of them, joined as the run
 * gets longer, and only those behind the cut are added up. A cut inside a stretch goes to its end.
 * It is asked at ends of stretches: an 8th to a 24th of the run lies between two (3 become one
 * where they make a revolution, else 2). */
#include "observe/tally.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool mill_tally_window_init(struct mill_tally *t, const struct mill_observe *asked,
                            const struct mill_world *world)
{
    t->precision = asked->precision;
    t->collisions = asked->max_collisions > 0 ? (uint64_t)asked->max_collisions : UINT64_MAX;
    t->search = asked->sample_found;
    if (t->precision == 0 && asked->max_collisions == 0)
        return true;
    if (!mill_precision_init(&t->batches, t->begin, world->rotor_speed, &t->grid))
        return false;
    t->tick = t->batches.at.batch;
    t->at.length = 1;
    t->at.known = (struct mill_precision_known){{NAN, NAN}, {NAN, NAN}, 0, false, false};
    if (!t->search)
        return true;
    t->stretch = calloc(MILL_TALLY_STRETCHES, sizeof *t->stretch);
    for (int i = 0; t->stretch && i < MILL_TALLY_STRETCHES; i++)
        if (!(t->stretch[i].maps = mill_maps_like(t->maps)))
            return false;
    return t->stretch != NULL;
}

void mill_tally_window_free(struct mill_tally *t)
{
    for (int i = 0; t->stretch && i < MILL_TALLY_STRETCHES; i++)
        mill_maps_free(t->stretch[i].maps);
    free(t->stretch);
    mill_precision_free(&t->batches);
}

/* ---- stretches ---- */

void mill_tally_add(struct mill_speeds into[MILL_KINDS], const struct mill_speeds from[MILL_KINDS])
{
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        mill_spectrum_merge(&into[kind].normal, &from[kind].normal);
        mill_spectrum_merge(&into[kind].tangential[0], &from[kind].tangential[0]);
        mill_spectrum_merge(&into[kind].tangential[1], &from[kind].tangential[1]);
    }
}

/* How many stretches to join into one: so that whole ones make a revolution, or are made of some */
static uint64_t joined(uint64_t length, uint64_t period)
{
    uint64_t many = 2;
    while (length < period && period % (length * many) != 0)
        many++;
    return many;
}

static void join_stretches(struct mill_tally *t)
{
    const uint64_t many = joined(t->at.length, t->batches.at.period);
    for (uint64_t k = 0; t->search && k < t->at.stretches / many; k++) {
        struct mill_tally_stretch *first = &t->stretch[many * k];
        for (uint64_t m = 1; m < many; m++) {
            mill_tally_add(first->impacts, first[m].impacts);
            mill_tally_add(first->strikes, first[m].strikes);
            mill_maps_add(first->maps, first[m].maps);
            first->last = first[m].last;
        }
        if (k > 0) {
            struct mill_maps *free_one = t->stretch[k].maps;
            memcpy(&t->stretch[k], first, sizeof *first);
            first->maps = free_one;
        }
    }
    t->at.stretches /= many;
    t->at.length *= many;
}

/* What was gathered since the last one becomes a stretch of its own. */
static void keep_stretch(struct mill_tally *t)
{
    struct mill_tally_stretch *stretch = &t->stretch[t->at.stretches++];
    memcpy(stretch->impacts, t->impacts, sizeof stretch->impacts);
    memcpy(stretch->strikes, t->strikes, sizeof stretch->strikes);
    memset(t->impacts, 0, sizeof t->impacts);
    memset(t->strikes, 0, sizeof t->strikes);
    memset(t->before, 0, sizeof t->before);
    mill_maps_clear(stretch->maps);
    mill_maps_add(stretch->maps, t->maps);
    mill_maps_clear(t->maps);
    stretch->last = t->at.stretch++;
}

struct mill_speeds *mill_tally_window_strikes(struct mill_tally *t, int32_t stretch)
{
    for (uint64_t i = 0; t->stretch && i < t->at.stretches; i++)
        if (stretch <= t->stretch[i].last)
            return t->stretch[i].strikes;
    return t->strikes;
}

/* ---- the window ---- */

/* The window that ends with the last batch */
struct window {
    uint64_t from; /* its first batch */
    bool whole;    /* it is whole revolutions, two or more */
    bool settled;  /* the start-up is over */
};

/* It begins behind the start-up, and where that leaves two whole revolutions or more, as many as
 * there are. */
static struct window find_window(const struct mill_tally *t)
{
    const uint64_t n = t->batches.at.batches, period = t->batches.at.period, length = t->at.length;
    struct window window = {0, false, true};
    if (t->search)
        window.from =
            (mill_precision_cut(&t->batches, &window.settled) + length - 1) / length * length;
    const uint64_t turns = period > 0 && n > window.from ? (n - window.from) / period : 0;
    const uint64_t start = n - turns * period;
    window.whole = turns >= 2 && (start == window.from || (t->search && start % length == 0));
    window.from = window.whole ? start : window.from;
    return window;
}

static void end_batch(struct mill_tally *t, const struct mill_account *account)
{
    uint64_t count[MILL_PRECISION_SLOTS];
    for (int i = 0; i < MILL_PRECISION_SLOTS; i++) {
        uint64_t now = 0;
        for (int kind = 0; kind < MILL_KINDS; kind++)
            now += t->impacts[kind].normal.slot[MILL_SPECTRUM_FAST + i].count;
        count[i] = now - t->before[i];
        t->before[i] = now;
    }
    mill_precision_close(&t->batches, count, account);
    if (t->batches.at.batches % t->at.length != 0)
        return;
    if (t->search)
        keep_stretch(t);
    else
        t->at.stretches++;
    if (t->at.stretches == MILL_TALLY_STRETCHES)
        join_stretches(t);
    t->at.length /= mill_precision_join(&t->batches);
    if (t->precision > 0) {
        const struct window window = find_window(t);
        t->at.settled = window.settled;
        t->at.known = mill_precision_tell(&t->batches, window.from, window.whole);
        if (window.settled && mill_precision_reached(&t->at.known, t->precision))
            t->at.ended = MILL_TALLY_PRECISION;
    }
}

double mill_tally_window_next(const struct mill_tally *t)
{
    return t->at.open && t->tick > 0 ? mill_precision_next(&t->batches) : (double)INFINITY;
}

void mill_tally_window_sample(struct mill_tally *t, const struct mill_account *account, double now)
{
    if (mill_tally_window_next(t) <= now)
        end_batch(t, account);
}

/* Power and torque by whole revolutions, from the books. */
static void fill_blocks(const struct mill_precision *batches, uint64_t from,
                        struct mill_tally_results *r)
{
    const struct mill_precision_progress *at = &batches->at;
    struct mill_rotorstat *stat = &r->rotor;
    if (at->period == 0)
        return;
    const double turn = stat->block / stat->revolutions;
    stat->block = (double)at->period * at->batch;
    stat->revolutions = round(stat->block / turn);
    stat->blocks = 0;
    stat->power = r->power;
    stat->torque = r->torque;
    mill_rotorstat_open(stat, &batches->books[from]);
    for (uint64_t k = from + at->period; k <= at->batches && stat->blocks < stat->planned;
         k += at->period)
        mill_rotorstat_close(stat, &batches->books[k]);
}

bool mill_tally_window_results(const struct mill_tally *t, struct mill_tally_results *r)
{
    const struct mill_precision *batches = &t->batches;
    const uint64_t n = batches->at.batches;
    struct window window = {0, false, t->at.settled};
    if (t->precision > 0) {
        window = find_window(t);
        r->settled = window.settled;
        r->known = mill_precision_tell(batches, window.from, window.whole);
    }
    const uint64_t from = window.from;
    if (n > from) {
        r->at_late = batches->books[from + 9 * (n - from) / 10];
        r->late = true;
    }
    if (!t->search)
        return true;
    r->begin = batches->origin + (double)from * batches->at.batch;
    r->at_begin = batches->books[from];
    r->maps = r->sum = mill_maps_like(t->maps);
    if (!r->sum)
        return false;
    mill_maps_add(r->sum, t->maps);
    for (uint64_t i = from / t->at.length; i < t->at.stretches; i++) {
        mill_tally_add(r->impacts, t->stretch[i].impacts);
        mill_tally_add(r->strikes, t->stretch[i].strikes);
        mill_maps_add(r->sum, t->stretch[i].maps);
    }
    fill_blocks(batches, from, r);
    return true;
}
