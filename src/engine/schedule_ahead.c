/* Foresight: in a large mill, the data of the next event are not in the cache, and each address
 * comes from the previous data: from the event to its ball, from the ball to its cell, from the
 * cells around it to their balls. So every event prefetches a part of the data of later events, in
 * three steps, each after the data of the one before have arrived. No result depends on it. */
#include "engine/slabs.h"

#include <stdlib.h>

#define STEP 2 /* items from one step to the next */

/* The empty asm keeps the calls: compilers omit calls of functions that only prefetch. */
static void fetch(const void *address)
{
    __builtin_prefetch(address, 0);
    __asm__ volatile("");
}

static void fetch_ball(const struct mill_schedule *p, int32_t i)
{
    fetch(&p->world->ball[i]);
    fetch(&p->world->spin[i]);
    fetch(&p->cells->cell[i]);
}

/* The partner of a ball's event; MILL_NOBODY if the event is not a pair contact */
static int32_t partner_of(const struct mill_plan *plan)
{
    return plan->next == MILL_NEXT_PAIR ? plan->partner : MILL_NOBODY;
}

/* Fetches the rows of the cells that a search will read */
static void fetch_cells(const struct mill_schedule *p, const struct mill_grids_look *l)
{
    const int64_t word = (int64_t)mill_cells_word_size(l->cells);
    const char *row = (const char *)l->cells->bucket + l->cell * (int64_t)l->cells->row * word;
    (void)p;
    for (int32_t k = 0; k < l->count; k++)
        fetch(row + l->offset[k] * word);
}

/* Fetches the balls in these cells. Their numbers are copied first, without a branch: most rows
 * hold no ball or one, so that a loop over the rows would be mispredicted in half of them. */
static void fetch_neighbours(const struct mill_schedule *p, const struct mill_grids_look *l)
{
    int32_t *near = p->pairs->near;
    const int n = mill_cells_gather(l->cells, l->cell, l->offset, l->count, false, 1, near);
    for (int32_t k = 0; k < n; k++)
        fetch(&p->world->ball[near[k]]);
}

/* Calls a function for the cells that ball i's event will search: the cells around the ball and, if
 * it is in another cell, around its partner; after a crossing, only the cells that are new around
 * it. A partner that is no longer near has had another contact; another thread may have it. */
static void look(const struct mill_schedule *p, int32_t i,
                 void (*fetch_these)(const struct mill_schedule *, const struct mill_grids_look *))
{
    const struct mill_plan *plan = &p->plan[i];
    const int32_t *cell = p->cells->cell;
    const int32_t partner = partner_of(plan), exit = plan->next == MILL_NEXT_EXIT;
    double shift;
    const int32_t at = exit ? mill_grids_across(&p->grids, cell[i], plan->face, &shift) : cell[i];
    struct mill_grids_look look[2 * MILL_GRIDS_LOOKS];
    const struct mill_ball *ball = p->world->ball;
    int looks = mill_grids_look(&p->grids, ball[i].species, at, exit ? plan->face : -1, look);
    const int32_t other = partner >= 0 ? __atomic_load_n(&cell[partner], __ATOMIC_RELAXED) : at;
    const bool near = abs(other - at) <= mill_cells_step(p->cells, 1);
    if (partner >= 0 && near && (other != at || ball[partner].species != ball[i].species))
        looks += mill_grids_look(&p->grids, ball[partner].species, other, -1, look + looks);
    if (p->marks)
        fetch(&p->marks[at]);
    fetch(&p->surface_start[at]);
    fetch(&p->surface_start[other]);
    for (int k = 0; k < looks; k++)
        fetch_these(p, &look[k]);
}

void mill_schedule_ahead_again(struct mill_schedule *p)
{
    for (int k = 0; k < MILL_SCHEDULE_FORESEEN; k++)
        p->foreseen[k] = MILL_NOBODY;
}

/* Advances the calendar's walk by two items: it begins late, and the lengths of days differ. */
void mill_schedule_ahead(struct mill_schedule *p)
{
    for (int items = 0; items < 2; items++) {
        const int32_t next = mill_calendar_ahead(p->calendar);
        if (next < 0)
            return;
        const uint32_t slot = p->foresights++;
        const int32_t second = p->foreseen[(slot - STEP) % MILL_SCHEDULE_FORESEEN];
        const int32_t third = p->foreseen[(slot - 2 * STEP) % MILL_SCHEDULE_FORESEEN];
        const int32_t partner = partner_of(&p->plan[next]); /* its plan has arrived in the cache */
        p->foreseen[slot % MILL_SCHEDULE_FORESEEN] = next;
        fetch_ball(p, next);
        if (partner >= 0) {
            fetch_ball(p, partner);
            fetch(&p->plan[partner]);
        }
        if (second >= 0)
            look(p, second, fetch_cells);
        if (third >= 0)
            look(p, third, fetch_neighbours);
    }
}
