/* Foresight: in a large mill nothing that an event needs is in the cache, and one thing leads
 * to the next: the event to its ball, the ball to its cell, the cells around it to their balls. So
 * every event asks for a part of what later ones need, in three steps, each when the memory asked
 * for in the step before has arrived. Nothing is changed and no result depends on it. */
#include "engine/schedule.h"

#define STEP 2 /* items between the steps */

/* The empty statement is for the compiler: to it functions that do nothing but prefetch are without
 * effect, and their calls would be left out. */
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

/* The rows of `count` cells that a search will look into (offsets from `cell`, in words), and the
 * list of surfaces there */
static void fetch_cells(const struct mill_schedule *p, int32_t cell, const int64_t *offset,
                        int32_t count)
{
    const size_t word = mill_cells_word_size(&p->cells);
    const char *row = (const char *)p->cells.bucket + (size_t)cell * (size_t)p->cells.row * word;
    for (int32_t k = 0; k < count; k++)
        fetch(row + offset[k] * (int64_t)word);
    fetch(&p->surface_start[cell]);
}

/* The balls in them. Their numbers are copied first, without a branch: to go through the rows, of
 * which most hold none or one, would be mispredicted at every second. */
static void fetch_neighbours(const struct mill_schedule *p, int32_t cell, const int64_t *offset,
                             int32_t count)
{
    const int32_t *near = p->pairs.near;
    const int32_t n = mill_cells_gather(&p->cells, cell, offset, count, 1, p->pairs.near);
    for (int32_t k = 0; k < n; k++)
        fetch(&p->world->ball[near[k]]);
}

/* Where ball i's event will look: around the ball and, where that is another cell, around its
 * partner; after a crossing only into the cells that came near. */
static void look(const struct mill_schedule *p, int32_t i,
                 void (*fetch_these)(const struct mill_schedule *, int32_t, const int64_t *,
                                     int32_t))
{
    const struct mill_plan *plan = &p->plan[i];
    const struct mill_cells *c = &p->cells;
    const int32_t cell = c->cell[i], partner = partner_of(plan);
    if (plan->next == MILL_NEXT_EXIT) {
        fetch_these(p, cell + mill_cells_step(c, plan->face), c->ahead[plan->face], 9);
        return;
    }
    fetch_these(p, cell, c->around, 27);
    if (partner >= 0 && c->cell[partner] != cell)
        fetch_these(p, c->cell[partner], c->around, 27);
}

/* Takes the calendar's walk two items on through all steps: it begins behind, and days differ. */
void mill_schedule_ahead(struct mill_schedule *p)
{
    for (int items = 0; items < 2; items++) {
        const int32_t next = mill_calendar_ahead(p->calendar);
        if (next < 0)
            return;
        const uint32_t slot = p->foresights++;
        const int32_t second = p->foreseen[(slot - STEP) % MILL_SCHEDULE_FORESEEN];
        const int32_t third = p->foreseen[(slot - 2 * STEP) % MILL_SCHEDULE_FORESEEN];
        const int32_t partner = partner_of(&p->plan[next]); /* its plan has just come */
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
