/* When may the run end, and where does its window begin? If run.precision is given without
 * run.sample_from, the length of the start-up is not known while the statistics are gathered. They
 * cannot be subtracted later, because rounded sums do not cancel exactly. So they are kept in
 * separate portions of a few batches, at most MILL_TALLY_PORTIONS, which are joined as the run
 * becomes longer. At the end only the portions after the cut are added up; a cut inside a portion
 * is moved to its end. The program looks for the cut at the ends of portions, every 8th to 24th
 * part of the run (3 portions become one where 3 make a period, else 2). */
#include "observe/tally.h"

#include <stdlib.h>
#include <string.h>

/* ---- portions ---- */

/* A run that ends early needs only the first portions. */
bool mill_tally_window_portion(struct mill_tally *t, uint64_t number)
{
    struct mill_gathered *portion = &t->portion[number];
    return portion->impacts || mill_gathered_make(portion, &t->plan, t->plan.kinds);
}

/* Moves statistics; `from` gets the memory that `to` had. */
static void move(struct mill_gathered *to, struct mill_gathered *from)
{
    const struct mill_gathered room = *to;
    *to = *from;
    *from = room;
    from->last = to->last;
}

static void join_portions(struct mill_tally *t)
{
    const uint64_t length = t->at.length, period = t->batches.at.period;
    /* or more, so that whole portions make a period, or periods make a portion */
    uint64_t many = 2;
    while (length < period && period % (length * many) != 0)
        many++;
    for (uint64_t k = 0; t->search && k < t->at.portions / many; k++) {
        struct mill_gathered *first = &t->portion[many * k];
        for (uint64_t m = 1; m < many; m++)
            mill_gathered_add(first, &first[m]);
        first->last = first[many - 1].last;
        if (k > 0)
            move(&t->portion[k], first);
    }
    t->at.portions /= many;
    t->at.length *= many;
}

struct mill_speeds *mill_tally_window_strikes(struct mill_tally *t, int32_t portion)
{
    for (uint64_t i = 0; t->portion && i < t->at.portions; i++)
        if (portion <= t->portion[i].last)
            return t->portion[i].strikes;
    return t->gathered.strikes;
}

/* ---- the window ---- */

uint64_t mill_tally_window_find(const struct mill_tally *t, struct mill_tally_progress *at)
{
    const uint64_t n = t->batches.at.batches, period = t->batches.at.period, length = t->at.length;
    uint64_t from = 0;
    at->settled = true;
    if (t->search)
        from = (mill_precision_cut(&t->batches, &at->settled) + length - 1) / length * length;
    const uint64_t turns = period > 0 && n > from ? (n - from) / period : 0;
    const uint64_t start = n - turns * period;
    if (t->search && turns >= 2 && start % length == 0)
        from = start;
    at->known = mill_precision_tell(&t->batches, from);
    return from;
}

bool mill_tally_window_batch(struct mill_tally *t, const struct mill_account *account)
{
    struct mill_gathered *gathered = &t->gathered;
    uint64_t count[MILL_SPECTRUM_SLOTS];
    for (int i = 0; i < MILL_SPECTRUM_SLOTS; i++) {
        uint64_t now = 0;
        for (int kind = 0; kind < t->plan.kinds; kind++)
            now += gathered->impacts[kind].normal.slot[i].count;
        count[i] = now - t->before[i];
        t->before[i] = now;
    }
    mill_precision_close(&t->batches, count, account);
    if (t->batches.at.batches % t->blocks.length == 0)
        mill_energies_blocks_close(&t->blocks, gathered->pair, t->batches.at.period);
    if (t->batches.at.batches % t->at.length != 0)
        return true;
    if (t->search && !mill_tally_window_portion(t, t->at.portions))
        return false;
    if (t->search) { /* the statistics since the last portion become a new portion */
        move(&t->portion[t->at.portions], gathered);
        mill_gathered_clear(gathered);
        gathered->last++;
        memset(t->before, 0, sizeof t->before);
        mill_energies_blocks_restart(&t->blocks);
    }
    if (++t->at.portions == MILL_TALLY_PORTIONS)
        join_portions(t);
    const uint64_t joined = mill_precision_join(&t->batches);
    t->at.length /= joined;
    t->blocks.length /= joined;
    if (t->precision > 0) {
        mill_tally_window_find(t, &t->at);
        if (t->at.settled && mill_precision_reached(&t->at.known, t->precision))
            t->at.ended = MILL_TALLY_PRECISION;
    }
    return true;
}
