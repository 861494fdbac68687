/* The event loop on several threads, in windows of time. In each the threads carry out the events
 * inside their slabs, in order of time; then one thread carries out those that were put off. All
 * this is written down. If nothing came too early, the contacts go to the account and the observers
 * in the order in which one thread would have come to them, so that all results have the same bits:
 * in the next window, by a thread that has nothing else to do. If something came too early, or the
 * run ends at one of the contacts, the window is undone, and one thread does it again. */
#include "engine/crew.h"
#include "engine/sim_lane.h"

#include <stdlib.h>
#include <time.h>

#define SHARE 0.002 /* events of a window, per ball: with more, more of them are put off, */
#define FEWEST 90   /* and this number: with fewer, threads would mostly wait for each other */
#define RUNAWAY 100 /* times as many events as expected: the window is given up */
#define PATIENCE 64 /* windows after a failed one until they grow again */
#define WINDOWS 200 /* after so many, the work of the threads is compared */
#define UNEVEN 1.15 /* times as much as the mean for one thread: the mill is cut again */
/* Several threads are compared with one by stretches of so long [s]. The other way is better if it
 * needs less than BETTER times as long. One thread looks at the clock after CHUNK events. */
#define STRETCH 0.01
#define BETTER 0.97
#define CHUNK 2000
enum { LEAST_HOLD = 8, MOST_HOLD = 64 }; /* stretches between two comparisons */

/* What several threads cost, and what one thread costs */
struct mill_pace {
    bool alone;      /* one thread goes on */
    bool tries;      /* this is tried at present */
    bool insists;    /* never try */
    int left, hold;  /* stretches until the next trial; between trials */
    double began;    /* [s] of the clock: the present stretch */
    uint64_t events; /* in this stretch */
    double cost[2];  /* [s] of an event: of several threads, of one */
};

struct mill_sim_slabs {
    struct mill_lanes of;
    struct mill_crew *crew;
    bool refused; /* not all threads could be started: one goes on alone */
    struct mill_window now, last;
    bool pending;    /* the last window has not been settled yet */
    bool good;       /* nothing in the present window came too early */
    bool settled;    /* it has been settled, and the run goes on */
    double duration; /* [s] of the next window */
    struct mill_pace pace;
    bool cut_short; /* the present window is shorter */
    int patience;   /* windows until it may grow */
};

/* Events of a window */
static double aim_of(const struct mill_sim_slabs *s)
{
    return SHARE * (double)s->of.sim->world->balls + FEWEST;
}

/* Enters the contacts of the last window into the account and tells them to the observers, in the
 * order in which one thread comes to them; each lane has its own in this order. false: the run ends
 * at one of them, their order is not certain from there on, or one thread would then not have done
 * the same. One thread does the window again, and must not tell these contacts a second time. */
static bool settle(struct mill_sim_slabs *s)
{
    struct mill_sim *sim = s->of.sim;
    struct mill_world *w = sim->world;
    struct mill_watch watch = sim->watch;
    const struct mill_account account = w->account;
    const struct mill_counts counts = w->counts;
    size_t at[MILL_CREW_MOST + 1] = {0}, entry[MILL_CREW_MOST + 1] = {0};
    uint64_t told = 0, left = mill_sim_lane_events(&s->of, &s->last);
    double now = sim->now;
    for (; left > 0 && sim->status == MILL_OK; left--) {
        const int k = mill_sim_lane_first(&s->of, &s->last, at);
        if (k < 0)
            break;
        const struct mill_lane_log *l = &s->of.lane[k].log[s->last.number % 2];
        const struct mill_lane_event *e = (const struct mill_lane_event *)l->event.item + at[k]++;
        now = e->t;
        mill_sim_watch(&watch, now);
        if (mill_sim_hastes(&watch))
            break;
        for (int32_t m = 0; m < e->entries && sim->status == MILL_OK; m++, told++)
            mill_sim_record(sim, (const struct mill_sim_entry *)l->entry.item + entry[k]++);
    }
    if (left > 0 || sim->status != MILL_OK) {
        sim->told = told;
        sim->told_status = sim->status;
        sim->status = MILL_OK;
        w->account = account;
        w->counts = counts;
        return false;
    }
    for (int k = 0; k < s->of.count; k++)
        mill_world_add_counts(&w->counts, &s->of.lane[k].log[s->last.number % 2].counts);
    sim->watch = watch;
    sim->now = now;
    return true;
}

/* First part of a window: every thread carries out the events inside its slab. */
static void do_inside(void *slabs, int k)
{
    struct mill_sim_slabs *s = slabs;
    mill_sim_lane_work(&s->of, k, &s->now, RUNAWAY * aim_of(s));
}

/* Second part: one thread does what was put off; a second one settles the last window. */
static void do_rest(void *slabs, int k)
{
    struct mill_sim_slabs *s = slabs;
    if (k == 0)
        s->good = mill_sim_lane_work_off(&s->of, &s->now);
    else if (k == 1 && s->pending)
        s->settled = settle(s);
}

/* Does a window again on one thread. */
static void do_again(struct mill_sim_slabs *s, const struct mill_window *window, uint64_t *budget)
{
    /* while the observers are ahead of the balls, the run must not pause */
    uint64_t all = UINT64_MAX;
    mill_sim_take_events(s->of.sim, window->end, s->of.sim->told > 0 ? &all : budget);
    s->duration *= 0.5;
    s->patience = PATIENCE;
}

/* Settles the last window if this has not been done. false: it was done again on one thread */
static bool flush(struct mill_sim_slabs *s, uint64_t *budget)
{
    const bool good = !s->pending || settle(s);
    s->pending = false;
    if (good)
        return true;
    mill_sim_lane_undo(&s->of, &s->last);
    do_again(s, &s->last, budget);
    return false;
}

/* Compares what the threads had to do, and cuts the mill again if it was not the same. */
static void balance(struct mill_sim_slabs *s)
{
    uint64_t most = 0, all = 0;
    for (int k = 0; k < s->of.slabs->count; k++) {
        const uint64_t done = s->of.lane[k].done;
        most = done > most ? done : most;
        all += done;
        s->of.lane[k].done = 0;
    }
    if ((double)most > UNEVEN * (double)all / s->of.slabs->count)
        mill_slabs_cut(s->of.slabs);
}

/* Carries out a window on all threads, and settles the last one. */
static void share(struct mill_sim_slabs *s, uint64_t *budget)
{
    if (++s->now.number % WINDOWS == 0)
        balance(s);
    mill_slabs_open(s->of.slabs, s->now.begin);
    mill_sim_lane_begin(&s->of, &s->now);
    mill_crew_do(s->crew, do_inside, s);
    mill_crew_do(s->crew, do_rest, s);
    const bool good = s->good, before = !s->pending || s->settled;
    s->pending = good && before;
    if (!s->pending)
        mill_sim_lane_undo(&s->of, &s->now);
    if (!before) {
        mill_sim_lane_undo(&s->of, &s->last);
        do_again(s, &s->last, budget);
        s->now.end = s->last.end;
    } else if (!good) {
        do_again(s, &s->now, budget);
    } else {
        const uint64_t events = mill_sim_lane_events(&s->of, &s->now);
        for (int k = 0; k < s->of.count; k++) {
            struct mill_lane *l = &s->of.lane[k];
            l->log[s->now.number % 2].counts = l->world.counts;
            l->done += l->log[s->now.number % 2].event.count;
        }
        *budget -= events < *budget ? events : *budget;
        const double factor = aim_of(s) / mill_greatest((double)events, 1.0);
        if (s->patience > 0)
            s->patience--;
        else if (!s->cut_short)
            s->duration *= mill_least(mill_greatest(factor, 0.5), 2.0);
        s->last = s->now;
    }
}

/* ---- one thread or several ---- */

static double clock_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* So many events are done. Sometimes tries whether one thread is faster than several, or vice
 * versa: small mills, piles in one place, other programs slow several. No result depends on it. */
static void keep_pace(struct mill_pace *p, uint64_t events)
{
    p->events += events;
    const double passed = clock_now() - p->began;
    if (passed < STRETCH)
        return;
    p->cost[p->alone] = passed / ((double)p->events + 1.0);
    if (p->tries) {
        const bool better = p->cost[p->alone] < BETTER * p->cost[!p->alone];
        p->left = p->hold = better ? LEAST_HOLD : p->hold < MOST_HOLD ? 2 * p->hold : MOST_HOLD;
        p->alone = better ? p->alone : !p->alone;
        p->tries = false;
    } else if (--p->left <= 0 && !p->insists) {
        p->tries = true;
        p->alone = !p->alone;
    }
    p->began = clock_now();
    p->events = 0;
}

void mill_sim_slabs_run(struct mill_sim *sim, double limit, uint64_t *budget)
{
    struct mill_sim_slabs *s = sim->slabs;
    s->now.end = sim->now;
    s->pace.began = clock_now();
    s->pace.events = 0;
    while (sim->status == MILL_OK && *budget > 0 && s->now.end < limit && !mill_sim_stops(sim)) {
        const uint64_t before = *budget;
        const bool shares = !s->refused && !s->pace.alone && sim->world->counts.asleep == 0 &&
                            !mill_sim_hastes(&sim->watch) && (double)*budget > 4.0 * aim_of(s);
        s->now.begin = s->now.end;
        s->now.end = mill_least(limit, s->now.begin + s->duration);
        s->cut_short = s->now.end == limit;
        if (shares) {
            share(s, budget);
        } else if (flush(s, budget)) { /* one thread goes on */
            uint64_t left = *budget < CHUNK ? *budget : CHUNK;
            *budget -= left;
            mill_sim_take_events(sim, limit, &left);
            *budget += left;
            s->now.end = left > 0 ? limit : sim->now;
        } else {
            s->now.end = s->last.end;
        }
        keep_pace(&s->pace, before - *budget);
    }
    flush(s, budget);
    if (mill_sim_stops(sim) && sim->status == MILL_OK)
        sim->status = MILL_STOPPED;
}

/* ---- begin and end ---- */

struct mill_sim_slabs *mill_sim_slabs_create(struct mill_sim *sim, int threads, bool insists)
{
    struct mill_sim_slabs *s = calloc(1, sizeof *s);
    struct mill_slabs *slabs = NULL;
    bool made = s && mill_slabs_create(sim->schedule, threads, &slabs) && slabs;
    if (made) {
        s->duration = 1e-6; /* any value: it is adapted */
        s->pace.hold = LEAST_HOLD;
        s->pace.insists = insists;
        s->crew = mill_crew_create(slabs->count);
        made = mill_sim_lane_create(&s->of, sim, slabs) && s->crew;
    }
    if (made)
        return s;
    mill_sim_slabs_free(s);
    return NULL;
}

void mill_sim_slabs_free(struct mill_sim_slabs *s)
{
    if (!s)
        return;
    mill_sim_lane_free(&s->of);
    mill_crew_free(s->crew);
    mill_slabs_free(s->of.slabs);
    free(s);
}

int mill_sim_slabs_count(const struct mill_sim_slabs *s)
{
    return s->refused ? 1 : s->of.slabs->count;
}

void mill_sim_slabs_begin(struct mill_sim_slabs *s)
{
    s->refused = mill_crew_begin(s->crew) < s->of.slabs->count;
}

void mill_sim_slabs_end(struct mill_sim_slabs *s)
{
    mill_crew_end(s->crew);
}
