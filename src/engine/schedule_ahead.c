/* Foresight. In a large mill nothing that an event needs is in the cache, and one thing leads to
 * the next: the event to its ball, the ball to its cell, the cells around it to their balls. So
 * every event asks for a part of what later ones need, in three steps, each when the memory asked
 * for in the step before has arrived. Nothing is changed and no result depends on it. */
#include "engine/schedule.h"

#define STEP 2 /* items between the steps */

/* The empty statement for the assembler is for the compiler: functions that do nothing but prefetch
 * are without effect to it, and their calls would be left out. */
static void fetch(const void *address)
{
    __builtin_prefetch(address, 0);
    __asm__ volatile("");
}

static void fetch_ball(const struct mill_schedule *p, int32_t i)
{
    fetch(&p->world->ball[i]);
    fetch(&p->world->spin[i]);
    fetch(&p->cells.cell[i]);
}

/* The partner of a ball's event, MILL_NOBODY when the event is another one */
static int32_t partner_of(const struct mill_plan *plan)
{
    return plan->next == MILL_NEXT_PAIR ? plan->partner : MILL_NOBODY;
}

/* The ball and its partner; its plan has just come. */
static void fetch_balls(const struct mill_schedule *p, int32_t i)
{
    const int32_t partner = partner_of(&p->plan[i]);
    fetch_ball(p, i);
    if (partner >= 0) {
        fetch_ball(p, partner);
        fetch(&p->plan[partner]);
    }
}

/* Cells that a search will look into: offsets from a cell, in words */
struct region {
    int32_t cell, count;
    const int64_t *offset;
};

/* Their rows, and the list of surfaces there. */
static void fetch_cells(const struct mill_schedule *p, const struct region *region)
{
    const struct mill_cells *c = &p->cells;
    const size_t word = mill_cells_word_size(c);
    const char *base = (const char *)c->bucket + (size_t)region->cell * (size_t)c->row * word;
    for (int32_t k = 0; k < region->count; k++)
        fetch(base + region->offset[k] * (int64_t)word);
    fetch(&p->surface_start[region->cell]);
}

/* The balls in them. Their numbers are copied first, without a branch: to go through the rows, of
 * which most hold none or one, would be mispredicted at every second. */
static void fetch_neighbours(const struct mill_schedule *p, const struct region *region)
{
    int32_t *near = p->pairs.near;
    const int32_t n =
        mill_cells_gather(&p->cells, region->cell, region->offset, region->count, 1, near);
    for (int32_t k = 0; k < n; k++)
        fetch(&p->world->ball[near[k]]);
}

/* Where ball i's event will look: around the ball and, where that is another cell, around its
 * partner; after a crossing only into the cells that came near. */
static void look(const struct mill_schedule *p, int32_t i,
                 void (*fetch_region)(const struct mill_schedule *, const struct region *))
{
    const struct mill_plan *plan = &p->plan[i];
    const struct mill_cells *c = &p->cells;
    const int32_t cell = c->cell[i], partner = partner_of(plan);
    if (plan->next == MILL_NEXT_EXIT) {
        const struct region new = {cell + mill_cells_step(c, plan->face), 9, c->ahead[plan->face]};
        fetch_region(p, &new);
        return;
    }
    const struct region here = {cell, 27, c->around};
    fetch_region(p, &here);
    if (partner >= 0 && c->cell[partner] != cell) {
        const struct region there = {c->cell[partner], 27, c->around};
        fetch_region(p, &there);
    }
}

/* Takes the next item of the calendar's walk through all steps; false when there is none. */
static bool foresee(struct mill_schedule *p)
{
    const int32_t next = mill_calendar_ahead(p->calendar);
    if (next < 0)
        return false;
    const uint32_t slot = p->foresights++;
    const int32_t second = p->foreseen[(slot - STEP) % MILL_SCHEDULE_FORESEEN];
    const int32_t third = p->foreseen[(slot - 2 * STEP) % MILL_SCHEDULE_FORESEEN];
    p->foreseen[slot % MILL_SCHEDULE_FORESEEN] = next;
    fetch_balls(p, next);
    if (second >= 0)
        look(p, second, fetch_cells);
    if (third >= 0)
        look(p, third, fetch_neighbours);
    return true;
}

void mill_schedule_ahead(struct mill_schedule *p)
{
    if (foresee(p)) /* two an event: the walk begins behind, and days differ */
        foresee(p);
}
