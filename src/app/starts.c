/* Starts do not know each other, so their bits do not depend on the number of threads. A round
 * lasts a fraction of a second; then all threads have ended, and results can be written. */
#define _GNU_SOURCE /* the cores that this process may use */
#include "app/starts.h"

#include "base/random.h"

#include <sched.h>
#include <unistd.h>

#define MANY_BALLS 20000 /* from this number on, a single start uses all cores */
#define LEAST 100        /* events of a slice */
#define MOST 1e8
/* With run.precision: batches until results are looked at first; how much longer starts become */
#define FIRST 60
#define ENOUGH 2 /* times these, until the starts may become more */
#define LONGER 1.2
#define LONGEST 1.5
#define MORE 1.5 /* the same of their number */
/* Variance between starts over that which their own errors imply: above it, more starts help and
 * longer ones do not. It is the quantile for 75 % of F with 7 and 56 degrees of freedom. */
#define APART 1.4

/* A batch system gives a process some of the machine's cores. */
static int cores(void)
{
#ifdef CPU_COUNT
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0)
        return CPU_COUNT(&set);
#endif
    return (int)sysconf(_SC_NPROCESSORS_ONLN);
}

/* run.threads; else a small mill leaves the cores to other runs, not a large one or many starts */
static int threads_of(const struct mill_deck *deck, int starts)
{
    if (deck->given.threads > 0)
        return (int)deck->given.threads;
    return starts > 1 || deck->mill.all >= MANY_BALLS ? cores() : 1;
}

/* ---- making ---- */

static struct mill_tally *tally_of(const struct mill_starts_one *one)
{
    return (struct mill_tally *)one->observers.each[0];
}

/* Makes a start whose seed is known. Only the first one warns, and has all observers. */
static enum mill_status make(const struct mill_deck *deck, struct mill_starts_one *one, bool first,
                             const struct mill_start_watch *watch, struct mill_error *error)
{
    struct mill_deck own = *deck;
    own.setup.seed = one->seed;
    own.warn = first ? deck->warn : NULL;
    one->slice = 1000;
    enum mill_status status = mill_deck_setup_world(&own, watch, &one->world, error);
    if (status == MILL_OK)
        status = mill_sim_create(one->world, &one->sim, error);
    if (status != MILL_OK || first)
        return status == MILL_OK
                   ? mill_observers_create(&own.observe, one->world, &one->observers, error)
                   : status;
    struct mill_observer *t = mill_observers_one(&mill_tally_type, &own.observe, one->world, error);
    one->observers = (struct mill_observers){t != NULL, {t}};
    return t ? mill_sim_observe(one->sim, t) : MILL_FAILED;
}

static void make_part(void *self, int part)
{
    struct mill_starts *s = self;
    (void)part;
    for (int k; (k = __atomic_fetch_add(&s->next, 1, __ATOMIC_SEQ_CST)) < s->count;)
        s->one[k].status = make(s->deck, &s->one[k], false, NULL, &s->one[k].error);
}

/* Does the work on all threads; on this one, if there are no others. */
static void share(struct mill_starts *s, mill_crew_fn *work, int next)
{
    s->next = next;
    if (s->crew && mill_crew_begin(s->crew) == s->workers)
        mill_crew_do(s->crew, work, s);
    else
        work(s, 0);
    if (s->crew)
        mill_crew_end(s->crew);
}

/* The first bad status of the starts, with the words of its start */
static enum mill_status first_of(const struct mill_starts *s, struct mill_error *error)
{
    for (int k = 0; k < s->count; k++) {
        const struct mill_starts_one *one = &s->one[k];
        if (one->status != MILL_OK && k == 0)
            return mill_error_set(error, one->status, "%s", one->error.text);
        if (one->status != MILL_OK && one->status != MILL_STOPPED)
            return mill_error_set(error, one->status, "start %d (run.seed = %lu): %s", k + 1,
                                  one->seed, one->error.text);
        if (one->status != MILL_OK)
            return one->status;
    }
    return MILL_OK;
}

enum mill_status mill_starts_grow(struct mill_starts *s, struct mill_error *error)
{
    const int made = s->count;
    struct mill_random random;
    if (made >= (int)s->plan.count)
        return MILL_OK;
    s->count = (int)s->plan.count;
    mill_random_seed(&random, s->deck->setup.seed);
    for (int k = 1; k < s->count; k++)
        s->one[k].seed = (unsigned long)ldexp(mill_random_uniform(&random), 32);
    if (!s->crew) {
        const int threads = threads_of(s->deck, s->count);
        s->workers = threads < s->count ? threads : s->count;
        s->workers = s->workers < MILL_CREW_MOST ? s->workers : MILL_CREW_MOST;
        if (s->workers > 1 && !(s->crew = mill_crew_create(s->workers)))
            return mill_error_set(error, MILL_FAILED, "out of memory for the starts");
    }
    share(s, make_part, made);
    return first_of(s, error);
}

enum mill_status mill_starts_make(struct mill_starts *s, const struct mill_deck *deck,
                                  const struct mill_start_watch *watch, struct mill_error *error)
{
    *s = (struct mill_starts){.deck = deck,
                              .plan = {deck->observe.end, (uint64_t)deck->observe.starts, false},
                              .count = 1};
    s->one[0].seed = deck->setup.seed;
    enum mill_status status = make(deck, &s->one[0], true, watch, error);
    if (status == MILL_OK)
        status = mill_starts_grow(s, error);
    if (status != MILL_OK)
        return status;
    const struct mill_precision *batches = &tally_of(&s->one[0])->batches;
    if (s->count == 1)
        mill_sim_use_threads(s->one[0].sim, threads_of(deck, 1));
    if (deck->observe.precision > 0)
        s->plan.until = fmin(deck->observe.end, batches->origin + FIRST * batches->at.batch);
    s->least = ENOUGH * FIRST * batches->at.batch;
    return MILL_OK;
}

void mill_starts_free(struct mill_starts *s)
{
    for (int k = 0; k < s->count; k++) {
        mill_observers_free(&s->one[k].observers);
        mill_sim_free(s->one[k].sim);
        mill_world_free(s->one[k].world);
    }
    mill_crew_free(s->crew);
}

/* ---- running ---- */

/* Runs a start in slices of events. The clock determines their size, for any cost of an event. */
static void advance(const struct mill_starts *s, struct mill_starts_one *one)
{
    double now = mill_record_clock(CLOCK_MONOTONIC);
    const double aim = s->due - now;
    if (one->status != MILL_OK || one->reached >= s->plan.until)
        return;
    do { /* the first slice in any case: a run that is stopped at once has its first frame */
        const double before = now, reached = mill_sim_time(one->sim);
        one->status = mill_sim_run(one->sim, s->plan.until, one->slice, s->stop, &one->error);
        now = mill_record_clock(CLOCK_MONOTONIC);
        /* the end was reached before this slice, too: nothing that is due at the end is left */
        if (reached >= s->plan.until)
            one->reached = s->plan.until;
        else if (mill_sim_time(one->sim) < s->plan.until) /* the slice was not cut off by the end */
            one->slice = (uint64_t)fmin(
                fmax((double)one->slice * aim / fmax(now - before, 1e-6), LEAST), MOST);
    } while (one->status == MILL_OK && one->reached < s->plan.until && now < s->due);
}

static void run_part(void *self, int part)
{
    struct mill_starts *s = self;
    (void)part;
    for (int k; (k = __atomic_fetch_add(&s->next, 1, __ATOMIC_SEQ_CST)) < s->count;) {
        advance(s, &s->one[k]);
        if (mill_record_clock(CLOCK_MONOTONIC) >= s->due)
            break;
    }
}

enum mill_status mill_starts_go(struct mill_starts *s, double wall,
                                const volatile sig_atomic_t *stop, struct mill_error *error)
{
    s->due = mill_record_clock(CLOCK_MONOTONIC) + wall;
    s->stop = stop;
    share(s, run_part, 0);
    const enum mill_status status = first_of(s, error);
    return status == MILL_OK && *stop ? MILL_STOPPED : status;
}

/* Variance between the losses of the starts, over the mean of what their own pieces imply */
static double variance_ratio(const struct mill_starts *s, uint64_t from)
{
    const struct mill_precision_rate *loss = &mill_precision_rates[MILL_PRECISION_LOSS];
    double mean[MILL_PRECISION_STARTS], each[MILL_PRECISION_BATCHES], own = 0;
    for (int k = 0; k < s->count; k++) {
        const struct mill_precision *p = &tally_of(&s->one[k])->batches;
        const uint64_t n = p->at.batches - from;
        for (uint64_t i = 0; i < n; i++)
            each[i] = mill_precision_one(p, from + i, from + i + 1, loss, p->kinds, 0);
        const struct mill_spread_mean of =
            mill_spread_mean(each, (struct mill_spread_of){1, n, p->at.period});
        own += of.error * of.error;
        mean[k] = of.value;
    }
    const struct mill_spread_of starts = {(size_t)s->count, 1, 0};
    const double error = mill_spread_mean(mean, starts).error;
    return s->count * error * s->count * error / own;
}

bool mill_starts_extend(struct mill_starts *s)
{
    struct mill_tally *first = tally_of(&s->one[0]);
    struct mill_starts_plan *plan = &s->plan;
    const double wanted = s->deck->observe.precision, end = s->deck->observe.end;
    for (int k = 0; k < s->count; k++)
        if (s->one[k].reached < plan->until)
            return true;
    if (!(wanted > 0))
        return false;
    mill_starts_join(s);
    struct mill_tally_results *results;
    struct mill_error error;
    if (mill_tally_results_make(first, first->world, mill_sim_local_time(s->one[0].sim), &results,
                                &error) != MILL_OK)
        return false; /* out of memory: the run ends with what is known */
    const uint64_t from = results->from;
    first->at.known = results->at.known;
    first->at.settled = results->at.settled;
    plan->known = results->reached;
    mill_tally_results_free(results);
    if (plan->known) {
        first->at.ended = MILL_TALLY_PRECISION;
        return false;
    }
    const struct mill_precision_known *known = &first->at.known;
    const double power = known->idle ? 0 : known->drive.error / fabs(known->drive.value);
    const double median = known->slips ? 0 : known->median_fast.error / known->median_fast.value;
    const double off = isnan(power + median) ? (double)INFINITY : fmax(power, median) / wanted;
    const double origin = first->batches.origin, batch = first->batches.at.batch;
    const double begin = origin + (double)from * batch;
    /* Pieces shorter than what the mill remembers make starts seem apart: they become longer. */
    const bool apart = first->at.settled && off > 1 && plan->until - begin >= s->least &&
                       variance_ratio(s, from) > APART;
    const double many = apart ? fmin(off * off, MORE) : 1;
    plan->count = (uint64_t)fmin(ceil(s->count * many), MILL_PRECISION_STARTS);
    const double times = isfinite(off) ? fmin(fmax(off * off / many, LONGER), LONGEST) : LONGEST;
    const double aim = begin + times * (plan->until - begin);
    const double until = fmin(origin + ceil((aim - origin) / batch - 1e-9) * batch, end);
    const bool more = until > plan->until || plan->count > (uint64_t)s->count;
    plan->until = until;
    return more;
}

/* ---- results ---- */

void mill_starts_join(struct mill_starts *s)
{
    struct mill_tally *first = tally_of(&s->one[0]);
    first->starts = 0;
    for (int k = 0; k < s->count; k++) {
        struct mill_tally *one = tally_of(&s->one[k]);
        one->seed = s->one[k].seed;
        if (k == 0 || mill_sim_time(s->one[k].sim) == mill_sim_time(s->one[0].sim))
            first->start[first->starts++] = one;
    }
}

struct mill_world mill_starts_sum(const struct mill_starts *s, struct mill_totals *totals)
{
    struct mill_world sum = *s->one[0].world;
    *totals = mill_record_add(&sum, mill_sim_local_time(s->one[0].sim));
    for (int k = 1; k < s->count; k++) {
        const struct mill_world *w = s->one[k].world;
        const struct mill_totals more = mill_record_add(w, mill_sim_local_time(s->one[k].sim));
        mill_world_add_account(&sum.account, &w->account);
        mill_world_add_counts(&sum.counts, &w->counts);
        sum.counts.asleep = s->one[0].world->counts.asleep; /* of the balls that are told */
        totals->contacts += more.contacts;
        totals->anomalies += more.anomalies;
        totals->dissipation += more.dissipation;
        totals->balance_error += more.balance_error;
        totals->turnover += more.turnover;
    }
    return sum;
}
