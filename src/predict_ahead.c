/* Foresight. In a large mill nothing that an event needs is in the cache, and one thing leads to
 * the next: the event to its ball, the ball to its cell, the cells around it to their balls. So
 * every event asks for a part of what later ones need, in three steps, each when the memory asked
 * for in the step before has arrived. Nothing is changed and no result depends on it. */
#include "predict.h"

#define LINE 64
#define STEP 3 /* items between the steps */

static void fetch(const void *address)
{
    __builtin_prefetch(address, 0);
}

static void fetch_ball(const struct mill_predict *p, int32_t i)
{
    fetch(&p->world->ball[i]);
    fetch(&p->world->spin[i]);
    fetch(&p->cells.cell[i]);
}

/* The partner of a ball's event, MILL_NOBODY when the event is another one */
static int32_t partner_of(const struct mill_plan *plan)
{
    return plan->pair_t <= plan->shape_t && plan->pair_t <= plan->exit_t ? plan->partner
                                                                         : MILL_NOBODY;
}

/* The cell in which a ball will be when its event is over */
static int32_t cell_after(const struct mill_predict *p, int32_t i)
{
    const struct mill_plan *plan = &p->plan[i];
    const bool leaves = plan->exit_t < plan->pair_t && plan->exit_t < plan->shape_t;
    return p->cells.cell[i] + (leaves ? mill_cells_step(&p->cells, plan->face) : 0);
}

/* The ball and its partner; its plan has just come. */
static void fetch_balls(const struct mill_predict *p, int32_t i)
{
    const int32_t partner = partner_of(&p->plan[i]);
    fetch_ball(p, i);
    if (partner >= 0) {
        fetch_ball(p, partner);
        fetch(&p->plan[partner]);
    }
}

/* The cells around it: nine columns of three, which lie one after the other. */
static void fetch_cells(const struct mill_predict *p, int32_t at)
{
    const struct mill_cells *c = &p->cells;
    const size_t word = mill_cells_word_size(c);
    const char *cell = (const char *)c->bucket + (size_t)at * (size_t)c->row * word;
    const size_t column = 3 * (size_t)c->row * word;
    for (int32_t k = 0; k < 27; k += 3) {
        const char *from = cell + c->around[k] * (int64_t)word;
        for (size_t b = 0; b < column + LINE - 1; b += LINE)
            fetch(from + (b < column ? b : column - 1));
    }
    fetch(&p->surface_start[at]);
}

/* The balls in them. */
static void fetch_neighbours(const struct mill_predict *p, int32_t cell)
{
    const struct mill_cells *c = &p->cells;
    for (int32_t k = 0; k < 27; k++) {
        const int32_t near = cell + c->neighbour[k];
        const int32_t held = mill_cells_held(c, near);
        for (int32_t m = 0; m < held; m++)
            fetch(&p->world->ball[mill_cells_ball(c, near, m)]);
    }
}

/* For the ball's cell and, where it is another, its partner's */
static void for_cells(const struct mill_predict *p, int32_t i,
                      void (*fetch_around)(const struct mill_predict *, int32_t))
{
    const int32_t partner = partner_of(&p->plan[i]), cell = cell_after(p, i);
    fetch_around(p, cell);
    if (partner >= 0 && p->cells.cell[partner] != cell)
        fetch_around(p, p->cells.cell[partner]);
}

/* Takes the next item of the calendar's walk through all steps; false when there is none. */
static bool foresee(struct mill_predict *p)
{
    const int32_t next = mill_calendar_ahead(p->calendar);
    if (next < 0)
        return false;
    const uint32_t turn = p->turns++;
    const int32_t second = p->foreseen[(turn - STEP) % MILL_PREDICT_FORESEEN];
    const int32_t third = p->foreseen[(turn - 2 * STEP) % MILL_PREDICT_FORESEEN];
    p->foreseen[turn % MILL_PREDICT_FORESEEN] = next;
    fetch_balls(p, next);
    if (second >= 0)
        for_cells(p, second, fetch_cells);
    if (third >= 0)
        for_cells(p, third, fetch_neighbours);
    return true;
}

void mill_predict_ahead(struct mill_predict *p)
{
    if (foresee(p)) /* two an event: the walk begins behind, and days differ */
        foresee(p);
}
