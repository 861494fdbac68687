/* Slabs of the mill. Two events can influence each other only if blocks in which they change balls
 * are the same or next to each other. An event changes balls in the block of its ball and at most
 * in one block next to it. Hence the distances: an event that a thread puts off near the border of
 * its slab changes balls up to one layer beyond, and two layers further the other one may work. */
#include "engine/slabs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AROUND = 27 };           /* a block and those next to it */
#define STRIP 2                 /* layers at the border of a slab where its thread does not work */
#define LEAST 7                 /* layers of a slab: STRIP on both sides, and some to work in */
#define CUT 5                   /* layers, see mill_slabs_worth */
#define ROUNDED_UP (1.0 + 1e-6) /* more than a float is rounded down */
#define CROSSINGS 0.02          /* a ball costs as much as so many contacts, even if it has none */

static int32_t block_of(const struct mill_slabs *s, int32_t cell)
{
    return mill_grids_block(&s->schedule->grids, cell);
}

/* Another thread may move a ball of its slab at the same time. */
static int32_t block_of_ball(const struct mill_slabs *s, int32_t i)
{
    return block_of(s, __atomic_load_n(&s->schedule->cells->cell[i], __ATOMIC_RELAXED));
}

static int slab_of(const struct mill_slabs *s, int32_t block)
{
    int k = 0;
    while (block >= s->slab[k].hi)
        k++;
    return k;
}

/* Contacts since the last call of the balls below each layer of the mill. NULL: out of memory */
static double *contacts_below(struct mill_slabs *s)
{
    const struct mill_world *w = s->schedule->world;
    double *sum = calloc((size_t)s->layers + 1, sizeof *sum);
    for (int32_t i = 0; i < w->balls && sum; i++) {
        const uint32_t now = w->ball[i].contacts;
        sum[block_of_ball(s, i) / s->layer + 1] += CROSSINGS + (double)(now - s->contacts[i]);
        s->contacts[i] = now;
    }
    for (int32_t k = 0; k < s->layers && sum; k++)
        sum[k + 1] += sum[k];
    return sum;
}

/* The layer between `least` and `most` where a cut costs least: slabs below it should have `due`
 * contacts, few of them at the cut, because these are put off. sum: contacts below each layer */
static int32_t best_cut(const double *sum, int32_t least, int32_t most, double due)
{
    int32_t best = least;
    double cost = INFINITY;
    for (int32_t to = least; to <= most; to++) {
        const double own = fabs(sum[to] - due) + sum[to + STRIP] - sum[to - STRIP];
        best = own < cost ? to : best;
        cost = own < cost ? own : cost;
    }
    return best;
}

/* Cuts the mill where slabs had about equally many contacts. */
static void cut(struct mill_slabs *s)
{
    const bool periodic = s->schedule->grids.period > 0.0;
    const int32_t end = s->layers - s->margin;
    double *sum = contacts_below(s);
    int32_t at = s->margin;
    for (int k = 0; k < s->count; k++) {
        const int left = s->count - 1 - k;
        int32_t to = left > 0 ? at + LEAST : end;
        if (left > 0 && sum)
            to = best_cut(sum, to, end - LEAST * left, sum[s->layers] * (k + 1) / s->count);
        s->slab[k].lo = at * s->layer;
        s->slab[k].hi = to * s->layer;
        s->slab[k].inner_lo = (at + (k > 0 || periodic ? STRIP : 0)) * s->layer;
        s->slab[k].inner_hi = (to - (left > 0 || periodic ? STRIP : 0)) * s->layer;
        at = to;
    }
    free(sum);
}

static void clear_marks(struct mill_slabs *s)
{
    memset(s->mark, 0, (size_t)s->layers * (size_t)s->layer * sizeof *s->mark);
    s->tag = 0;
}

void mill_slabs_begin(struct mill_slabs *s)
{
    for (int k = 0; k < s->count; k++)
        mill_calendar_clear(s->slab[k].calendar, 0.0);
    mill_calendar_clear(s->late, 0.0);
    clear_marks(s);
    cut(s);
}

/* Enters the events of all balls into empty calendars. */
static void enter_all(struct mill_schedule *p)
{
    for (int32_t i = 0; i < p->world->balls; i++)
        mill_schedule_enter(p, i, mill_plan_time(&p->plan[i]));
}

/* Layers of the mill across x */
static int32_t layers_of(const struct mill_schedule *p)
{
    const struct mill_cells *c = &p->grids.own[p->grids.classes - 1];
    return c->n[0] - 2 * c->margin;
}

/* Each cut puts off about as many events as CUT layers have, which one thread carries out: with n
 * slabs, about 1 / n + n CUT / layers of the events are done one after the other. */
int mill_slabs_worth(const struct mill_schedule *p, int threads)
{
    const int32_t layers = layers_of(p);
    int n = 1;
    while (n < threads && n < MILL_CREW_MOST && (n + 1) * (n + 1) * CUT <= layers)
        n++;
    return n;
}

bool mill_slabs_create(struct mill_schedule *p, int threads, struct mill_slabs **slabs)
{
    const struct mill_cells *c = &p->grids.own[p->grids.classes - 1];
    const int most = threads < MILL_CREW_MOST ? threads : MILL_CREW_MOST;
    const int fit = layers_of(p) / LEAST, count = most < fit ? most : fit;
    struct mill_slabs *s = *slabs = NULL;
    if (count < 2)
        return true;
    s = calloc(1, sizeof *s);
    if (!s)
        return false;
    s->schedule = p;
    s->late = p->calendar;
    s->count = count;
    s->layers = c->n[0];
    s->layer = c->n[1] * c->n[2];
    s->margin = c->margin;
    s->end = -INFINITY;
    s->home = mill_memory_take(&s->memory, (size_t)p->world->balls, sizeof *s->home);
    s->mark = mill_memory_take(&s->memory, (size_t)mill_cells_count(c), sizeof *s->mark);
    s->contacts = mill_memory_take(&s->memory, (size_t)p->world->balls, sizeof *s->contacts);
    bool made = !s->memory.failed;
    for (int k = 0; k < s->count && made; k++) {
        s->slab[k].calendar =
            mill_calendar_create(p->world->balls, &p->plan->event, sizeof *p->plan);
        made = s->slab[k].calendar != NULL;
    }
    if (!made) {
        mill_slabs_free(s);
        return false;
    }
    p->slabs = *slabs = s;
    p->marks = p->grids.classes == 1 ? s->mark : NULL;
    mill_slabs_begin(s);
    enter_all(p);
    return true;
}

void mill_slabs_free(struct mill_slabs *s)
{
    if (!s)
        return;
    s->schedule->marks = NULL;
    s->schedule->slabs = NULL;
    mill_calendar_clear(s->late, 0.0);
    enter_all(s->schedule);
    for (int k = 0; k < s->count; k++)
        mill_calendar_free(s->slab[k].calendar);
    mill_memory_drop(&s->memory);
    free(s);
}

static struct mill_calendar *calendar_of(const struct mill_slabs *s, int home)
{
    return home < s->count ? s->slab[home].calendar : s->late;
}

void mill_slabs_enter(struct mill_slabs *s, int32_t i, double t)
{
    const int home = t < s->end ? s->count : slab_of(s, block_of_ball(s, i));
    if (home != s->home[i]) {
        mill_calendar_set(calendar_of(s, s->home[i]), i, INFINITY);
        s->home[i] = (int8_t)home;
    }
    mill_calendar_set(calendar_of(s, home), i, t);
}

void mill_slabs_cut(struct mill_slabs *s)
{
    const struct mill_schedule *p = s->schedule;
    cut(s);
    for (int32_t i = 0; i < p->world->balls; i++)
        if (slab_of(s, block_of_ball(s, i)) != s->home[i])
            mill_slabs_enter(s, i, mill_plan_time(&p->plan[i]));
}

void mill_slabs_open(struct mill_slabs *s, double begin)
{
    if (s->tag == UINT16_MAX)
        clear_marks(s);
    s->tag++;
    s->begin = begin;
}

int32_t mill_slabs_next(struct mill_slabs *s, double *t)
{
    int32_t first = -1;
    *t = INFINITY;
    for (int k = 0; k <= s->count; k++) {
        double own = INFINITY;
        const int32_t i = mill_calendar_next(calendar_of(s, k), &own);
        if (i >= 0 && (own < *t || (own == *t && (first < 0 || i < first)))) {
            first = i;
            *t = own;
        }
    }
    return first;
}

/* The blocks in which ball i's event changes balls; returns how many. *cell: the ball's then */
static int places_of(const struct mill_slabs *s, int32_t i, int32_t place[2], int32_t *cell)
{
    const struct mill_plan *plan = &s->schedule->plan[i];
    double shift;
    *cell = s->schedule->cells->cell[i];
    place[0] = block_of(s, *cell);
    if (plan->next == MILL_NEXT_EXIT)
        *cell = mill_grids_across(&s->schedule->grids, *cell, plan->face, &shift);
    place[1] = plan->next == MILL_NEXT_PAIR ? block_of_ball(s, plan->partner) : block_of(s, *cell);
    return plan->next == MILL_NEXT_PAIR || plan->next == MILL_NEXT_EXIT ? 2 : 1;
}

/* Lists a block and those next to it, in a periodic mill also at its other end. */
static void look_around(const struct mill_slabs *s, int32_t place, int32_t block[AROUND])
{
    const struct mill_grids *g = &s->schedule->grids;
    const int32_t row = g->own[g->classes - 1].n[2], inner = s->layers - 2 * s->margin;
    int n = 0;
    for (int32_t x = -1; x <= 1; x++) {
        int32_t layer = place / s->layer + x;
        if (g->period > 0.0)
            layer += layer < s->margin ? inner : layer >= s->margin + inner ? -inner : 0;
        for (int32_t y = -1; y <= 1; y++)
            for (int32_t z = -1; z <= 1; z++)
                block[n++] = layer * s->layer + place % s->layer + y * row + z;
    }
}

bool mill_slabs_claim(struct mill_slabs *s, const struct mill_slab *slab, int32_t i, double t)
{
    const struct mill_schedule *p = s->schedule;
    int32_t place[2], block[AROUND], cell;
    const int places = places_of(s, i, place, &cell);
    bool may = true;
    for (int k = 0; k < places && may; k++)
        may = place[k] >= slab->inner_lo && place[k] < slab->inner_hi &&
              s->mark[place[k]].waits != s->tag;
    /* no event may need more memory for the rows of the cell grid */
    may = may && (p->plan[i].next != MILL_NEXT_EXIT ||
                  mill_grids_has_room(&p->grids, p->world->ball[i].species, cell));
    const float done = (float)((t - s->begin) * ROUNDED_UP);
    for (int k = 0; k < places; k++) {
        struct mill_slab_mark *m = &s->mark[place[k]];
        if (may) {
            *m = (struct mill_slab_mark){done, s->tag, m->waits};
            continue;
        }
        look_around(s, place[k], block);
        for (int n = 0; n < AROUND; n++)
            if (block[n] >= slab->lo && block[n] < slab->hi)
                s->mark[block[n]].waits = s->tag;
    }
    if (!may)
        mill_calendar_set(slab->calendar, i, INFINITY);
    return may;
}

bool mill_slabs_passed(const struct mill_slabs *s, int32_t i, double t)
{
    int32_t place[2], block[AROUND], cell;
    const int places = places_of(s, i, place, &cell);
    for (int k = 0; k < places; k++) {
        look_around(s, place[k], block);
        for (int n = 0; n < AROUND; n++) {
            const struct mill_slab_mark *m = &s->mark[block[n]];
            if (m->window == s->tag && (double)m->done > t - s->begin)
                return true;
        }
    }
    return false;
}
