/* The event loop on several threads. It goes through the events in windows of
 * time. In each window the threads carry out the events inside their slabs, in
 * order of time; then one thread carries out those that were put off. All this
 * is written down. If nothing came too early, the contacts are entered into the
 * account and told to the observers in the order in which one thread would have
 * come to them, so that all results have the same bits: the thread that is
 * first through with its slab does this for the window before. If something
 * came too early, or if the run ends at one of the contacts, the window is
 * undone, and one thread does it again. */
#include "base/memory.h"
#include "engine/crew.h"
#include "engine/sim_private.h"
#include "engine/slabs.h"

#include <stdlib.h>
#include <time.h>

#define SHARE 0.002 /* events of a window, per ball: more make more of them late, */
#define FEWEST 50   /* and this number more: less would be spent on waiting for each other */
#define RUNAWAY 100 /* times as many events as expected: the window is given up */
#define PATIENCE 64 /* windows after a failed one until they grow again */
#define WINDOWS 200 /* after so many, the work of the threads is compared */
#define UNEVEN 1.15 /* times as much as the mean for one thread: the mill is cut again */
#define IDLE 0.7    /* times as much as for another thread: there is time to settle */
#define STRETCH                                                                                    \
    0.01            /* [s] of the clock: what several threads cost is compared with one thread,    \
                     */
#define BETTER 0.97 /* which must need less than so many times as much */
#define CHUNK 2000  /* events of one thread until it looks at the clock */
enum { LEAST_HOLD = 8, MOST_HOLD = 64 }; /* stretches between two trials */

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
};

/* The same of a ball that meets a surface */
struct pressed {
    int32_t ball;
    struct mill_pinch pinch;
};

/* What a thread writes down in a window. late: balls whose events it has put
 * off */
struct log {
    struct mill_list event, entry, before, pressed, late;
};

/* What a thread works with: copies of world, schedule and loop, which share the
 * balls, and the logs of this window and the last. The last lane is for the
 * events that were put off. */
struct lane {
    struct mill_sim sim;
    struct mill_world world;
    struct mill_schedule schedule;
    struct mill_error error;
    struct log log[2];
    struct mill_counts counts[2];
    uint64_t done; /* events since the threads' work was last compared */
    bool failed;
};

/* A window. Its number modulo 2 is that of its logs. */
struct window {
    double begin, end; /* [s] local time */
    uint32_t number;
};

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
    struct mill_sim *sim;
    struct mill_slabs *slabs;
    struct mill_crew *crew;
    int threads;       /* at present */
    struct lane *lane; /* [slabs + 1] */
    struct window now, last;
    bool pending;    /* the last window has not been settled yet */
    int idle;        /* number of the thread that has least to do; -1: all have as much
                      */
    bool good;       /* nothing in the present window came too early */
    bool settled;    /* it has been settled, and the run goes on */
    double duration; /* [s] of the next window */
    struct mill_pace pace;
    bool cut_short;                      /* the present window is shorter */
    int patience;                        /* windows until it may grow */
    const struct mill_sim_entry **order; /* the contacts of a window in order */
    size_t order_room;
};

static int lanes(const struct mill_sim_slabs *s)
{
    return s->slabs->count + 1;
}

/* Events of a window */
static double aim_of(const struct mill_sim_slabs *s)
{
    return SHARE * (double)s->sim->world->balls + FEWEST;
}

/* ---- one lane ---- */

static bool make_lane(struct lane *l, struct mill_sim *sim, struct mill_slabs *slabs, int k)
{
    for (int n = 0; n < 2; n++) {
        l->log[n].event.size = sizeof(struct event);
        l->log[n].entry.size = sizeof(struct mill_sim_entry);
        l->log[n].before.size = sizeof(struct before);
        l->log[n].pressed.size = sizeof(struct pressed);
        l->log[n].late.size = sizeof(int32_t);
    }
    l->world = *sim->world;
    if (!mill_schedule_share(sim->schedule, &l->world, &l->schedule))
        return false;
    l->schedule.calendar = k < slabs->count ? slabs->slab[k].calendar : slabs->late;
    l->schedule.slabs = k < slabs->count ? NULL : slabs;
    l->sim = (struct mill_sim){.world = &l->world, .schedule = &l->schedule, .error = &l->error};
    return true;
}

static void free_lane(struct lane *l)
{
    mill_schedule_unshare(&l->schedule);
    for (int n = 0; n < 2; n++) {
        free(l->log[n].event.item);
        free(l->log[n].entry.item);
        free(l->log[n].before.item);
        free(l->log[n].pressed.item);
        free(l->log[n].late.item);
    }
}

static void begin_lane(struct lane *l, const struct mill_sim *sim, const struct window *window)
{
    struct log *log = &l->log[window->number % 2];
    log->event.count = log->entry.count = log->before.count = 0;
    log->pressed.count = log->late.count = 0;
    l->failed = false;
    if (l->world.base != sim->world->base)
        mill_schedule_forget(&l->schedule);
    l->world.base = sim->world->base;
    l->world.counts = (struct mill_counts){.largest_overlap = -INFINITY};
    l->sim.pinches = sim->pinches;
    l->sim.now = window->begin;
    l->sim.status = MILL_OK;
    l->sim.log = &log->entry;
    l->schedule.horizon = sim->schedule->horizon;
    mill_schedule_ahead_again(&l->schedule);
}

/* Writes down what ball i is now. */
static void remember(struct lane *l, struct log *log, int32_t i)
{
    struct before *b = mill_list_add(&log->before);
    l->failed = l->failed || !b;
    if (!b)
        return;
    b->ball = i;
    b->cell = l->schedule.cells->cell[i];
    b->record = l->world.ball[i];
    b->spin = l->world.spin[i];
    b->plan = l->schedule.plan[i];
    if (!l->sim.pinches.ball || b->plan.next != MILL_NEXT_SURFACE)
        return;
    struct pressed *p = mill_list_add(&log->pressed);
    l->failed = !p;
    if (p)
        *p = (struct pressed){i, l->sim.pinches.ball[i]};
}

/* Carries out ball i's event, due at local time t, and writes it down. */
static void carry_out(struct lane *l, struct log *log, int32_t i, double t)
{
    const struct mill_plan *plan = l->schedule.plan;
    const int32_t partner = plan[i].next == MILL_NEXT_PAIR ? plan[i].partner : MILL_NOBODY;
    const int32_t entry = (int32_t)log->entry.count;
    struct event *e = mill_list_add(&log->event);
    remember(l, log, i);
    if (partner != MILL_NOBODY)
        remember(l, log, partner);
    l->failed = l->failed || !e || t < l->sim.now;
    if (l->failed)
        return;
    l->sim.now = t;
    mill_sim_happen(&l->sim, i);
    *e = (struct event){t, i, (int32_t)log->entry.count > entry ? entry : -1};
    l->failed = l->sim.status != MILL_OK || mill_plan_time(&plan[i]) < t ||
                (partner != MILL_NOBODY && mill_plan_time(&plan[partner]) < t);
}

/* Carries out all events of the window inside a slab. */
static void work_inside(struct mill_sim_slabs *s, int k)
{
    struct lane *l = &s->lane[k];
    struct log *log = &l->log[s->now.number % 2];
    const struct mill_slab *slab = &s->slabs->slab[k];
    const double most = RUNAWAY * aim_of(s);
    const bool large = l->world.balls >= MILL_SIM_LARGE;
    while (!l->failed) {
        double t;
        const int32_t i = mill_calendar_next(slab->calendar, &t);
        if (i < 0 || t >= s->now.end)
            return;
        l->failed = (double)log->event.count > most;
        if (large)
            mill_schedule_ahead(&l->schedule);
        if (mill_slabs_claim(s->slabs, slab, i, t)) {
            carry_out(l, log, i, t);
            continue;
        }
        int32_t *late = mill_list_add(&log->late);
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
    struct log *own = &l->log[s->now.number % 2];
    slabs->end = s->now.end;
    for (int k = 0; k < slabs->count; k++) {
        const struct mill_list *late = &s->lane[k].log[s->now.number % 2].late;
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

/* ---- a whole window ---- */

/* Takes back what a ball's event has done. */
static void take_back(struct mill_sim *sim, const struct before *b)
{
    struct mill_schedule *p = sim->schedule;
    const struct mill_event event = p->plan[b->ball].event;
    if (p->cells->cell[b->ball] != b->cell) {
        mill_grids_remove(&p->grids, b->ball, b->record.species);
        mill_grids_insert(&p->grids, b->ball, b->record.species, b->cell);
    }
    sim->world->ball[b->ball] = b->record;
    sim->world->spin[b->ball] = b->spin;
    p->plan[b->ball] = b->plan;
    p->plan[b->ball].event = event;
}

static void enter_again(struct mill_schedule *p, int32_t i)
{
    mill_schedule_enter(p, i, mill_plan_time(&p->plan[i]));
}

/* Takes back all events of a window. */
static void undo(struct mill_sim_slabs *s, const struct window *window)
{
    struct mill_schedule *p = s->sim->schedule;
    for (int k = lanes(s) - 1; k >= 0; k--) {
        const struct mill_list *before = &s->lane[k].log[window->number % 2].before;
        for (size_t n = before->count; n > 0; n--)
            take_back(s->sim, (const struct before *)before->item + n - 1);
        const struct mill_list *pressed = &s->lane[k].log[window->number % 2].pressed;
        for (size_t n = pressed->count; n > 0; n--) {
            const struct pressed *before_it = (const struct pressed *)pressed->item + n - 1;
            s->sim->pinches.ball[before_it->ball] = before_it->pinch;
        }
    }
    for (int k = 0; k < lanes(s); k++) {
        const struct log *log = &s->lane[k].log[window->number % 2];
        for (size_t n = 0; n < log->before.count; n++)
            enter_again(p, ((const struct before *)log->before.item)[n].ball);
        for (size_t n = 0; n < log->late.count; n++)
            enter_again(p, ((const int32_t *)log->late.item)[n]);
    }
}

/* Number of events of a window */
static uint64_t events_of(const struct mill_sim_slabs *s, const struct window *window)
{
    uint64_t all = 0;
    for (int k = 0; k < lanes(s); k++)
        all += s->lane[k].log[window->number % 2].event.count;
    return all;
}

/* The lane with the first event from the numbers `at` on; -1: none, or it is
 * not certain */
static int first_lane(const struct mill_sim_slabs *s, int log, const size_t *at)
{
    int first = -1;
    double earliest = INFINITY;
    bool tie = false;
    for (int k = 0; k < lanes(s); k++) {
        const struct mill_list *list = &s->lane[k].log[log].event;
        if (at[k] == list->count)
            continue;
        const double t = ((const struct event *)list->item)[at[k]].t;
        tie = t < earliest ? false : tie || t == earliest;
        first = t < earliest ? k : first;
        earliest = mill_least(t, earliest);
    }
    return tie ? -1 : first;
}

/* Lists the contacts of the last window in the order in which one thread comes
 * to them; each lane has its own in this order. Returns their number. -1: the
 * order is not certain, or one thread would not have done the same. *watch,
 * *now: of the loop afterwards */
static long put_in_order(struct mill_sim_slabs *s, struct mill_watch *watch, double *now)
{
    const int log = (int)(s->last.number % 2);
    const uint64_t events = events_of(s, &s->last);
    size_t at[MILL_SLABS_MOST + 1] = {0};
    long contacts = 0;
    if (events > s->order_room) {
        free(s->order);
        s->order = malloc(2 * events * sizeof *s->order);
        s->order_room = s->order ? 2 * events : 0;
    }
    for (uint64_t n = 0; n < events; n++) {
        const int k = first_lane(s, log, at);
        if (k < 0 || !s->order)
            return -1;
        const struct log *l = &s->lane[k].log[log];
        const struct event *e = (const struct event *)l->event.item + at[k]++;
        mill_sim_watch(watch, e->t);
        if (mill_sim_hastes(watch))
            return -1;
        *now = e->t;
        if (e->entry >= 0)
            s->order[contacts++] = (const struct mill_sim_entry *)l->entry.item + e->entry;
    }
    return contacts;
}

/* Enters the contacts of the last window into the account and tells them to the
 * observers. false: the run ends at one of them, or their order is not certain.
 */
static bool settle(struct mill_sim_slabs *s)
{
    struct mill_sim *sim = s->sim;
    struct mill_watch watch = sim->watch;
    double now = sim->now;
    const struct mill_account account = sim->world->account;
    const struct mill_counts counts = sim->world->counts;
    const long contacts = put_in_order(s, &watch, &now);
    for (long n = 0; n < contacts; n++) {
        mill_sim_record(sim, s->order[n]);
        if (sim->status == MILL_OK)
            continue;
        /* one thread comes here again; it must not tell these contacts a second
         * time */
        sim->told = (uint64_t)n + 1;
        sim->told_status = sim->status;
        sim->status = MILL_OK;
        sim->world->account = account;
        sim->world->counts = counts;
        return false;
    }
    if (contacts < 0)
        return false;
    for (int k = 0; k < lanes(s); k++)
        mill_counts_add(&sim->world->counts, &s->lane[k].counts[s->last.number % 2]);
    sim->watch = watch;
    sim->now = now;
    return true;
}

/* First part of a window: every thread carries out the events inside its slab.
 * One that has far less to do than another one also settles the last window. */
static void do_inside(void *all, int k)
{
    struct mill_sim_slabs *slabs = all;
    work_inside(slabs, k);
    if (k == slabs->idle && slabs->pending)
        slabs->settled = settle(slabs);
}

/* Second part: one thread carries out the events that were put off. A second
 * one settles the last window, if this has not been done. */
static void do_rest(void *slabs, int k)
{
    struct mill_sim_slabs *s = slabs;
    if (k == 0)
        s->good = work_off(s);
    else if (k == 1 && s->pending && s->idle < 0)
        s->settled = settle(s);
}

/* Does a window again on one thread. */
static void do_again(struct mill_sim_slabs *s, const struct window *window, uint64_t *budget,
                     const volatile sig_atomic_t *stop)
{
    /* while the observers are ahead of the balls, the run must not pause */
    uint64_t all = UINT64_MAX;
    const bool ahead = s->sim->told > 0;
    mill_sim_take_events(s->sim, window->end, ahead ? &all : budget, ahead ? NULL : stop);
    s->duration *= 0.5;
    s->patience = PATIENCE;
}

/* Settles the last window if this has not been done. false: it was done again
 * on one thread */
static bool flush(struct mill_sim_slabs *s, uint64_t *budget, const volatile sig_atomic_t *stop)
{
    const bool good = !s->pending || settle(s);
    s->pending = false;
    if (good)
        return true;
    undo(s, &s->last);
    do_again(s, &s->last, budget, stop);
    return false;
}

static void choose_duration(struct mill_sim_slabs *s, uint64_t events)
{
    const double factor = aim_of(s) / mill_greatest((double)events, 1.0);
    if (s->patience > 0)
        s->patience--;
    else if (!s->cut_short)
        s->duration *= mill_least(mill_greatest(factor, 0.5), 2.0);
}

/* Compares what the threads had to do, and cuts the mill again if it was not
 * the same. */
static void balance(struct mill_sim_slabs *s)
{
    uint64_t most = 0, least = UINT64_MAX, all = 0;
    for (int k = 0; k < s->slabs->count; k++) {
        const uint64_t done = s->lane[k].done;
        s->idle = done < least ? k : s->idle;
        least = done < least ? done : least;
        most = done > most ? done : most;
        all += done;
        s->lane[k].done = 0;
    }
    s->idle = (double)least < IDLE * (double)most ? s->idle : -1;
    if ((double)most > UNEVEN * (double)all / s->slabs->count)
        mill_slabs_cut(s->slabs);
}

/* Carries out a window on all threads, and settles the last one. */
static void share(struct mill_sim_slabs *s, uint64_t *budget, const volatile sig_atomic_t *stop)
{
    if (++s->now.number % WINDOWS == 0)
        balance(s);
    mill_slabs_open(s->slabs, s->now.begin);
    for (int k = 0; k < lanes(s); k++)
        begin_lane(&s->lane[k], s->sim, &s->now);
    mill_crew_do(s->crew, do_inside, s);
    mill_crew_do(s->crew, do_rest, s);
    const bool good = s->good, before = !s->pending || s->settled;
    s->pending = good && before;
    if (!s->pending)
        undo(s, &s->now);
    if (!before) {
        undo(s, &s->last);
        do_again(s, &s->last, budget, stop);
        s->now.end = s->last.end;
    } else if (!good) {
        do_again(s, &s->now, budget, stop);
    } else {
        const uint64_t events = events_of(s, &s->now);
        for (int k = 0; k < lanes(s); k++) {
            s->lane[k].counts[s->now.number % 2] = s->lane[k].world.counts;
            s->lane[k].done += s->lane[k].log[s->now.number % 2].event.count;
        }
        *budget -= events < *budget ? events : *budget;
        choose_duration(s, events);
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

/* So many events are done. Sometimes tries whether one thread is faster than several, or the other
 * way round: small mills, piles of balls in one place and other programs on the same cores slow
 * down several threads. The results do not depend on it. */
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

/* Goes on with one thread. */
static void go_alone(struct mill_sim_slabs *s, double limit, uint64_t *budget,
                     const volatile sig_atomic_t *stop)
{
    const uint64_t part = *budget < CHUNK ? *budget : CHUNK;
    uint64_t left = part;
    mill_sim_take_events(s->sim, limit, &left, stop);
    *budget -= part - left;
    s->now.end = left > 0 ? limit : s->sim->now;
}

void mill_sim_slabs_run(struct mill_sim *sim, double limit, uint64_t *budget,
                        const volatile sig_atomic_t *stop)
{
    struct mill_sim_slabs *s = sim->slabs;
    s->now.end = sim->now;
    s->pace.began = clock_now();
    s->pace.events = 0;
    while (sim->status == MILL_OK && *budget > 0 && s->now.end < limit) {
        if (stop && *stop)
            break;
        const uint64_t before = *budget;
        const bool shares = s->threads > 1 && !s->pace.alone && sim->world->counts.asleep == 0 &&
                            !mill_sim_hastes(&sim->watch) && (double)*budget > 4.0 * aim_of(s);
        s->now.begin = s->now.end;
        s->now.end = mill_least(limit, s->now.begin + s->duration);
        s->cut_short = s->now.end == limit;
        if (shares)
            share(s, budget, stop);
        else if (flush(s, budget, stop))
            go_alone(s, limit, budget, stop);
        else
            s->now.end = s->last.end;
        keep_pace(&s->pace, before - *budget);
    }
    flush(s, budget, stop);
    if (stop && *stop && sim->status == MILL_OK)
        sim->status = MILL_STOPPED;
}

void mill_sim_slabs_insist(struct mill_sim_slabs *s)
{
    s->pace.insists = true;
}

/* ---- begin and end ---- */

struct mill_sim_slabs *mill_sim_slabs_create(struct mill_sim *sim, int threads)
{
    struct mill_sim_slabs *s = calloc(1, sizeof *s);
    bool made = s && mill_slabs_create(sim->schedule, threads, &s->slabs);
    if (made && s->slabs) {
        s->sim = sim;
        s->duration = 1e-6; /* any value: it is adapted */
        s->idle = -1;
        s->pace.hold = LEAST_HOLD;
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
