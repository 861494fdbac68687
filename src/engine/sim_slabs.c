/* The event loop on several threads. It goes through the events in windows of time. In each window
 * the threads carry out the events inside their slabs, in order of time; then one thread carries
 * out those that were put off. All this is written down. If nothing came too early, the contacts
 * are entered into the account and told to the observers in the order in which one thread would
 * have come to them, so that all results have the same bits. If something did, the window is
 * undone, and one thread does it again. */
#include "base/memory.h"
#include "engine/crew.h"
#include "engine/sim_private.h"
#include "engine/slabs.h"

#include <stdlib.h>
#include <string.h>

#define SHARE 0.02 /* events of a window, per ball */
#define FEWEST 100 /* events of a window */
#define RUNAWAY 64 /* times as many events as expected: the window is given up */
#define PAUSE 64   /* windows after a failed one until they grow again */

/* An event that was carried out. entry: of its contact; -1: it was none */
struct event {
    double t;
    int32_t ball, entry;
};

/* A ball before an event has changed it */
struct before {
    int32_t ball, cell;
    struct mill_ball record;
    vec3 spin;
    struct mill_plan plan;
    struct mill_pinch pinch;
};

/* What one thread works with: copies of world, schedule and loop, which share the balls, and the
 * log of a window. The last lane is for the events that were put off. */
struct lane {
    struct mill_sim sim;
    struct mill_world world;
    struct mill_schedule schedule;
    struct mill_error error;
    struct mill_list event, entry, before, late;
    bool failed;
};

struct mill_sim_slabs {
    struct mill_sim *sim;
    struct mill_slabs *slabs;
    struct mill_crew *crew;
    int threads;                         /* at present */
    struct lane *lane;                   /* [slabs + 1] */
    const struct mill_sim_entry **order; /* the contacts of a window in order */
    size_t order_room, ordered;
    double end;                  /* [s] local time of the window */
    double duration;             /* [s] of the next window */
    int patience;                /* windows until it may grow */
    struct mill_account account; /* before the contacts of the window */
    struct mill_watch watch;     /* after the window */
    double last;                 /* [s] local time of its last event */
};

static int lanes(const struct mill_sim_slabs *s)
{
    return s->slabs->count + 1;
}

/* ---- one lane ---- */

static bool make_lane(struct lane *l, struct mill_sim *sim, struct mill_slabs *slabs, int k)
{
    const struct mill_schedule *p = sim->schedule;
    l->event.size = sizeof(struct event);
    l->entry.size = sizeof(struct mill_sim_entry);
    l->before.size = sizeof(struct before);
    l->late.size = sizeof(int32_t);
    l->world = *sim->world;
    if (!mill_schedule_share(p, &l->world, &l->schedule))
        return false;
    l->schedule.calendar = k < slabs->count ? slabs->slab[k].calendar : slabs->late;
    l->schedule.slabs = k < slabs->count ? NULL : slabs;
    l->sim = (struct mill_sim){.world = &l->world, .schedule = &l->schedule, .log = &l->entry};
    return true;
}

static void free_lane(struct lane *l)
{
    mill_schedule_unshare(&l->schedule);
    free(l->event.item);
    free(l->entry.item);
    free(l->before.item);
    free(l->late.item);
}

static void begin_lane(struct lane *l, const struct mill_sim *sim)
{
    const struct mill_counts *counts = &sim->world->counts;
    l->event.count = l->entry.count = l->before.count = l->late.count = 0;
    l->failed = false;
    if (l->world.base != sim->world->base)
        mill_schedule_forget(&l->schedule);
    l->world.base = sim->world->base;
    l->world.counts = (struct mill_counts){.largest_overlap = counts->largest_overlap};
    l->sim.pinches = sim->pinches;
    l->sim.watch = sim->watch;
    l->sim.now = sim->now;
    l->sim.status = MILL_OK;
    l->sim.error = &l->error;
    l->schedule.horizon = sim->schedule->horizon;
}

/* Writes down what ball i is now. */
static void remember(struct lane *l, int32_t i)
{
    struct before *b = mill_list_add(&l->before);
    l->failed = l->failed || !b;
    if (!b)
        return;
    b->ball = i;
    b->cell = l->schedule.cells->cell[i];
    b->record = l->world.ball[i];
    b->spin = l->world.spin[i];
    b->plan = l->schedule.plan[i];
    if (l->sim.pinches.ball)
        b->pinch = l->sim.pinches.ball[i];
}

/* Carries out ball i's event, due at local time t, and writes it down. */
static void carry_out(struct lane *l, int32_t i, double t)
{
    const struct mill_plan *plan = l->schedule.plan;
    const int32_t partner = plan[i].next == MILL_NEXT_PAIR ? plan[i].partner : MILL_NOBODY;
    const int32_t entry = (int32_t)l->entry.count;
    struct event *e = mill_list_add(&l->event);
    remember(l, i);
    if (partner != MILL_NOBODY)
        remember(l, partner);
    l->failed = l->failed || !e || t < l->sim.now;
    if (l->failed)
        return;
    l->sim.now = t;
    mill_sim_happen(&l->sim, i);
    *e = (struct event){t, i, (int32_t)l->entry.count > entry ? entry : -1};
    l->failed = l->sim.status != MILL_OK || mill_plan_time(&plan[i]) < t ||
                (partner != MILL_NOBODY && mill_plan_time(&plan[partner]) < t);
}

/* The part of one slab's thread: all events of the window inside the slab */
static void work(void *all, int k)
{
    struct mill_sim_slabs *s = all;
    struct lane *l = &s->lane[k];
    const struct mill_slab *slab = &s->slabs->slab[k];
    const double most = (double)RUNAWAY * (SHARE * (double)l->world.balls + FEWEST);
    begin_lane(l, s->sim);
    while (!l->failed) {
        double t;
        const int32_t i = mill_calendar_next(slab->calendar, &t);
        if (i < 0 || t >= s->end)
            return;
        l->failed = (double)l->event.count > most;
        if (l->world.balls >= MILL_SIM_LARGE)
            mill_schedule_ahead(&l->schedule);
        if (mill_slabs_claim(s->slabs, slab, i, t)) {
            carry_out(l, i, t);
            continue;
        }
        int32_t *late = mill_list_add(&l->late);
        l->failed = l->failed || !late;
        if (late)
            *late = i;
    }
}

/* Carries out the events that were put off, and those that come from them. */
static bool work_off(struct mill_sim_slabs *s)
{
    struct mill_slabs *slabs = s->slabs;
    struct lane *l = &s->lane[slabs->count];
    begin_lane(l, s->sim);
    slabs->end = s->end;
    for (int k = 0; k < slabs->count; k++) {
        const int32_t *late = s->lane[k].late.item;
        l->failed = l->failed || s->lane[k].failed;
        for (size_t n = 0; n < s->lane[k].late.count; n++)
            mill_slabs_enter(slabs, late[n], mill_plan_time(&l->schedule.plan[late[n]]));
    }
    double t;
    int32_t i;
    while (!l->failed && (i = mill_calendar_next(slabs->late, &t)) >= 0) {
        l->failed = mill_slabs_passed(slabs, i, t);
        if (!l->failed)
            carry_out(l, i, t);
    }
    slabs->end = -INFINITY;
    return !l->failed;
}

/* ---- the whole window ---- */

/* Takes back all events of the window. */
static void undo(struct mill_sim_slabs *s)
{
    struct mill_schedule *p = s->sim->schedule;
    struct mill_world *w = s->sim->world;
    for (int k = lanes(s) - 1; k >= 0; k--) {
        const struct before *before = s->lane[k].before.item;
        for (size_t n = s->lane[k].before.count; n > 0; n--) {
            const struct before *b = &before[n - 1];
            const struct mill_event event = p->plan[b->ball].event;
            if (p->cells->cell[b->ball] != b->cell) {
                mill_grids_remove(&p->grids, b->ball, b->record.species);
                mill_grids_insert(&p->grids, b->ball, b->record.species, b->cell);
            }
            w->ball[b->ball] = b->record;
            w->spin[b->ball] = b->spin;
            p->plan[b->ball] = b->plan;
            p->plan[b->ball].event = event;
            if (s->sim->pinches.ball)
                s->sim->pinches.ball[b->ball] = b->pinch;
        }
    }
    for (int k = 0; k < lanes(s); k++) {
        const struct before *before = s->lane[k].before.item;
        const int32_t *late = s->lane[k].late.item;
        for (size_t n = 0; n < s->lane[k].before.count; n++)
            mill_schedule_enter(p, before[n].ball, mill_plan_time(&p->plan[before[n].ball]));
        for (size_t n = 0; n < s->lane[k].late.count; n++)
            mill_schedule_enter(p, late[n], mill_plan_time(&p->plan[late[n]]));
    }
}

/* Lists the contacts of all lanes in the order in which one thread comes to them: each lane has its
 * own in this order. false: it cannot be known, or one thread would not have done the same. */
static bool put_in_order(struct mill_sim_slabs *s, uint64_t *events)
{
    size_t at[MILL_SLABS_MOST + 1] = {0}, all = 0;
    s->ordered = 0;
    s->watch = s->sim->watch;
    s->last = s->sim->now;
    for (int k = 0; k < lanes(s); k++)
        all += s->lane[k].event.count;
    if (all > s->order_room) {
        free(s->order);
        s->order_room = 2 * all;
        s->order = malloc(s->order_room * sizeof *s->order);
        if (!s->order)
            s->order_room = 0;
    }
    for (size_t n = 0; n < all; n++) {
        const struct lane *from = NULL;
        const struct event *first = NULL;
        int of = 0;
        bool tie = false;
        for (int k = 0; k < lanes(s); k++) {
            const struct lane *l = &s->lane[k];
            const struct event *e = (const struct event *)l->event.item + at[k];
            if (at[k] == l->event.count)
                continue;
            tie = first && (e->t == first->t || (tie && e->t > first->t));
            if (!first || e->t < first->t) {
                first = e;
                from = l;
                of = k;
            }
        }
        at[of]++;
        mill_sim_watch(&s->watch, first->t);
        if (tie || !s->order || mill_sim_hastes(&s->watch))
            return false;
        s->last = first->t;
        if (first->entry >= 0)
            s->order[s->ordered++] = (const struct mill_sim_entry *)from->entry.item + first->entry;
    }
    *events = all;
    return true;
}

/* Enters the contacts of the window into the account and tells them to the observers. false: the
 * run ends at one of them. */
static bool settle(struct mill_sim_slabs *s)
{
    struct mill_sim *sim = s->sim;
    s->account = sim->world->account;
    const struct mill_counts counts = sim->world->counts;
    for (size_t n = 0; n < s->ordered; n++) {
        mill_sim_record(sim, s->order[n]);
        if (sim->status == MILL_OK)
            continue;
        /* one thread goes there again; it must not tell these contacts a second time */
        sim->told = n + 1;
        sim->told_status = sim->status;
        sim->status = MILL_OK;
        sim->world->account = s->account;
        sim->world->counts = counts;
        return false;
    }
    for (int k = 0; k < lanes(s); k++)
        mill_counts_add(&sim->world->counts, &s->lane[k].world.counts);
    sim->watch = s->watch;
    sim->now = s->last;
    return true;
}

#include <stdio.h>
static unsigned long DW,DF[4],DE,DL,DN;
static void choose_duration(struct mill_sim_slabs *s, bool done, uint64_t events)
{
    const double aim = SHARE * (double)s->sim->world->balls + FEWEST;
    if (!done) {
        s->duration *= 0.5;
        s->patience = PAUSE;
    } else if (s->patience > 0) {
        s->patience--;
    } else {
        const double factor = aim / mill_greatest((double)events, 1.0);
        s->duration *= mill_least(mill_greatest(factor, 0.5), 2.0);
    }
}

bool mill_sim_slabs_window(struct mill_sim *sim, double limit, uint64_t *budget, double *until)
{
    struct mill_sim_slabs *s = sim->slabs;
    const double aim = SHARE * (double)sim->world->balls + FEWEST;
    uint64_t events = 0;
    *until = limit;
    if (s->threads < 2 || sim->world->counts.asleep > 0 || mill_sim_hastes(&sim->watch) ||
        (double)*budget < 4.0 * aim)
        return false;
    s->end = *until = mill_least(limit, sim->now + s->duration);
    s->slabs->window++;
    mill_crew_do(s->crew, work, s);
    const bool g1 = work_off(s), g2 = g1 && put_in_order(s,&events), good = g2 && events <= *budget;
    const bool done = good && settle(s);
    DW++; DF[0]+=!g1; DF[1]+= g1&&!g2; DF[2]+=g2&&!good; DF[3]+=good&&!done; if(done){DE+=events; DL+=s->lane[s->slabs->count].event.count;}
    for(int k=0;k<s->slabs->count;k++) DN+=s->lane[k].failed;
    if (!done)
        undo(s);
    else
        *budget -= events;
    if (s->end < limit || !good)
        choose_duration(s, good, events);
    return done;
}



struct mill_sim_slabs *mill_sim_slabs_create(struct mill_sim *sim, int threads)
{
    struct mill_sim_slabs *s = calloc(1, sizeof *s);
    bool made = s && mill_slabs_create(sim->schedule, threads, &s->slabs);
    if (made && s->slabs) {
        s->sim = sim;
        s->duration = 1e-6; /* any value: it is adapted */
        s->crew = mill_crew_create(s->slabs->count);
        s->lane = calloc((size_t)lanes(s), sizeof *s->lane);
        made = s->crew && s->lane;
        for (int k = 0; k < lanes(s) && made; k++)
            made = make_lane(&s->lane[k], sim, s->slabs, k);
    }
    if (made && s->slabs)
        return s;
    mill_sim_slabs_free(s);
    return NULL;
}

void mill_sim_slabs_free(struct mill_sim_slabs *s)
{
    if (!s)
        return;
    fprintf(stderr,"windows %lu conflict %lu order %lu budget %lu ended %lu lanefail %lu; events per window %g late %g dur %g\n",DW,DF[0],DF[1],DF[2],DF[3],DN,(double)DE/DW,(double)DL/DE,s->duration);
    for (int k = 0; s->lane && k < lanes(s); k++)
        free_lane(&s->lane[k]);
    mill_crew_free(s->crew);
    mill_slabs_free(s->slabs);
    free(s->lane);
    free(s->order);
    free(s);
}

int mill_sim_slabs_count(const struct mill_sim_slabs *s)
{
    return s->slabs->count;
}

void mill_sim_slabs_begin(struct mill_sim_slabs *s)
{
    s->threads = mill_crew_begin(s->crew);
}

void mill_sim_slabs_end(struct mill_sim_slabs *s)
{
    mill_crew_end(s->crew);
    s->threads = 0;
}
