/* What the threads of the event loop do in a window, and how it is taken back */
#include "engine/sim_lane.h"

#include <stdlib.h>

bool mill_sim_lane_create(struct mill_lanes *s, struct mill_sim *sim, struct mill_slabs *slabs)
{
    s->sim = sim;
    s->slabs = slabs;
    s->lane = calloc((size_t)slabs->count + 1, sizeof *s->lane);
    for (s->count = 0; s->lane && s->count <= slabs->count; s->count++) {
        struct mill_lane *l = &s->lane[s->count];
        for (int n = 0; n < 2; n++) {
            l->log[n].event.size = sizeof(struct mill_lane_event);
            l->log[n].entry.size = sizeof(struct mill_sim_entry);
            l->log[n].before.size = sizeof(struct mill_lane_before);
            l->log[n].late.size = sizeof(int32_t);
        }
        l->world = *sim->world;
        if (!mill_schedule_share(sim->schedule, &l->world, &l->schedule))
            return false;
        const bool last = s->count == slabs->count;
        l->schedule.calendar = last ? slabs->late : slabs->slab[s->count].calendar;
        l->schedule.slabs = last ? slabs : NULL;
        l->sim =
            (struct mill_sim){.world = &l->world, .schedule = &l->schedule, .error = &l->error};
    }
    return s->lane;
}

void mill_sim_lane_free(struct mill_lanes *s)
{
    for (int k = 0; s->lane && k <= s->slabs->count; k++) {
        struct mill_lane *l = &s->lane[k];
        mill_schedule_unshare(&l->schedule);
        for (int n = 0; n < 2; n++) {
            free(l->log[n].event.item);
            free(l->log[n].entry.item);
            free(l->log[n].before.item);
            free(l->log[n].late.item);
        }
    }
    free(s->lane);
}

void mill_sim_lane_begin(struct mill_lanes *s, const struct mill_window *window)
{
    for (int k = 0; k < s->count; k++) {
        struct mill_lane *l = &s->lane[k];
        struct mill_lane_log *log = &l->log[window->number % 2];
        log->event.count = log->entry.count = log->before.count = log->late.count = 0;
        l->failed = false;
        if (l->world.base != s->sim->world->base)
            mill_schedule_forget(&l->schedule);
        l->world.base = s->sim->world->base;
        l->world.counts = (struct mill_counts){.largest_overlap = -INFINITY};
        l->sim.pinches = s->sim->pinches;
        l->sim.bridges = s->sim->bridges;
        l->sim.met = s->sim->met;
        l->sim.touch = s->sim->touch;
        l->sim.now = window->begin;
        l->sim.status = MILL_OK;
        l->sim.log = &log->entry;
        l->schedule.horizon = s->sim->schedule->horizon;
        mill_schedule_ahead_again(&l->schedule);
    }
}

/* Can the event of this plan change how its ball is pressed? */
static bool presses(const struct mill_sim *sim, const struct mill_plan *plan)
{
    return sim->pinches.ball && plan->next == MILL_NEXT_SURFACE;
}

/* Writes down what ball i is now. */
static void remember(struct mill_lane *l, struct mill_lane_log *log, int32_t i)
{
    struct mill_lane_before *b = mill_memory_add(&log->before);
    l->failed = l->failed || !b;
    if (!b)
        return;
    b->ball = i;
    b->cell = l->schedule.cells->cell[i];
    b->record = l->world.ball[i];
    b->spin = l->world.spin[i];
    b->met = l->sim.met[i];
    b->plan = l->schedule.plan[i];
    if (l->sim.bridges.ball)
        b->bridge = l->sim.bridges.ball[i];
    if (presses(&l->sim, &b->plan))
        b->pinch = l->sim.pinches.ball[i];
}

/* Carries out ball i's event, due at local time t, and writes it down. */
static void carry_out(struct mill_lane *l, struct mill_lane_log *log, int32_t i, double t)
{
    const struct mill_plan *plan = l->schedule.plan;
    const int32_t partner = plan[i].next == MILL_NEXT_PAIR ? plan[i].partner : MILL_NOBODY;
    const size_t before = log->entry.count;
    struct mill_lane_event *e = mill_memory_add(&log->event);
    remember(l, log, i);
    if (partner != MILL_NOBODY)
        remember(l, log, partner);
    l->failed = l->failed || !e || t < l->sim.now;
    if (l->failed)
        return;
    l->sim.now = t;
    mill_sim_happen(&l->sim, i);
    *e = (struct mill_lane_event){t, i, (int32_t)(log->entry.count - before)};
    l->failed = l->sim.status != MILL_OK || mill_plan_time(&plan[i]) < t ||
                (partner != MILL_NOBODY && mill_plan_time(&plan[partner]) < t);
}

void mill_sim_lane_work(struct mill_lanes *s, int k, const struct mill_window *window, double most)
{
    struct mill_lane *l = &s->lane[k];
    struct mill_lane_log *log = &l->log[window->number % 2];
    const struct mill_slab *slab = &s->slabs->slab[k];
    const bool large = l->world.balls >= MILL_SIM_LARGE;
    while (!l->failed) {
        double t;
        const int32_t i = mill_calendar_next(slab->calendar, &t);
        if (i < 0 || t >= window->end)
            return;
        l->failed = (double)log->event.count > most;
        if (large)
            mill_schedule_ahead(&l->schedule);
        if (mill_slabs_claim(s->slabs, slab, i, t)) {
            carry_out(l, log, i, t);
            continue;
        }
        int32_t *late = mill_memory_add(&log->late);
        l->failed = l->failed || !late;
        if (late)
            *late = i;
    }
}

bool mill_sim_lane_work_off(struct mill_lanes *s, const struct mill_window *window)
{
    struct mill_slabs *slabs = s->slabs;
    struct mill_lane *l = &s->lane[slabs->count];
    struct mill_lane_log *own = &l->log[window->number % 2];
    slabs->end = window->end;
    for (int k = 0; k < slabs->count; k++) {
        const struct mill_memory_list *late = &s->lane[k].log[window->number % 2].late;
        const int32_t *ball = late->item;
        l->failed = l->failed || s->lane[k].failed;
        for (size_t n = 0; n < late->count; n++)
            mill_slabs_enter(slabs, ball[n], mill_plan_time(&l->schedule.plan[ball[n]]));
    }
    double t;
    int32_t i;
    while (!l->failed && (i = mill_calendar_next(slabs->late, &t)) >= 0) {
        l->failed = mill_slabs_passed(slabs, i, t);
        if (!l->failed)
            carry_out(l, own, i, t);
    }
    slabs->end = -INFINITY;
    return !l->failed;
}

/* Takes back what a ball's event has done. */
static void take_back(struct mill_sim *sim, const struct mill_lane_before *b)
{
    struct mill_schedule *p = sim->schedule;
    const struct mill_event event = p->plan[b->ball].event;
    if (p->cells->cell[b->ball] != b->cell) {
        mill_grids_remove(&p->grids, b->ball, b->record.species);
        mill_grids_insert(&p->grids, b->ball, b->record.species, b->cell);
    }
    sim->world->ball[b->ball] = b->record;
    sim->world->spin[b->ball] = b->spin;
    sim->met[b->ball] = b->met;
    p->plan[b->ball] = b->plan;
    p->plan[b->ball].event = event;
    if (sim->bridges.ball)
        sim->bridges.ball[b->ball] = b->bridge;
    if (!presses(sim, &b->plan))
        return;
    sim->pinches.ball[b->ball] = b->pinch;
    mill_pinches_hold(&sim->pinches, sim->world, b->ball);
}

void mill_sim_lane_undo(struct mill_lanes *s, const struct mill_window *window)
{
    struct mill_schedule *p = s->sim->schedule;
    for (int k = s->count - 1; k >= 0; k--) {
        const struct mill_memory_list *before = &s->lane[k].log[window->number % 2].before;
        for (size_t n = before->count; n > 0; n--)
            take_back(s->sim, (const struct mill_lane_before *)before->item + n - 1);
    }
    for (int k = 0; k < s->count; k++) {
        const struct mill_lane_log *log = &s->lane[k].log[window->number % 2];
        const struct mill_lane_before *before = log->before.item;
        const int32_t *late = log->late.item;
        for (size_t n = 0; n < log->before.count + log->late.count; n++) {
            const int32_t i = n < log->before.count ? before[n].ball : late[n - log->before.count];
            mill_schedule_enter(p, i, mill_plan_time(&p->plan[i]));
        }
    }
}

uint64_t mill_sim_lane_events(const struct mill_lanes *s, const struct mill_window *window)
{
    uint64_t all = 0;
    for (int k = 0; k < s->count; k++)
        all += s->lane[k].log[window->number % 2].event.count;
    return all;
}

int mill_sim_lane_first(const struct mill_lanes *s, const struct mill_window *window,
                        const size_t *at)
{
    int first = -1;
    double earliest = INFINITY;
    bool tie = false;
    for (int k = 0; k < s->count; k++) {
        const struct mill_memory_list *list = &s->lane[k].log[window->number % 2].event;
        if (at[k] == list->count)
            continue;
        const double t = ((const struct mill_lane_event *)list->item)[at[k]].t;
        tie = t < earliest ? false : tie || t == earliest;
        first = t < earliest ? k : first;
        earliest = mill_least(t, earliest);
    }
    return tie ? -1 : first;
}
