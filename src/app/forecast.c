/* How long will the run take? The start of the run shows it, if it lasts until the rate of contacts
 * has settled: a charge at rest has few contacts until the mill has swept it up. So the trial lasts
 * a period of the motions at least, and until the rate of its second half is that of its second
 * quarter, or nearly so. Where it ends before that, the forecast is a lower bound. */
#include "app/forecast.h"

#include "app/record.h"
#include "millsim/sim.h"
#include "observe/observers.h"
#include "observe/outline.h"

/* The trial ends after so many contacts, or later, if the rate changes: so a deck has the same
 * forecast and notes on any machine, slow or busy. Where contacts are rare, time ends it. */
#define CONTACTS 1.5e6
#define MOST 4e6
#define PATIENCE 20.0 /* [s] of processor time */
#define SHORT 2.0     /* [s] the same of soft spheres, whose steps all cost the same */
#define SLICE 5000    /* events between two readings of the clock; time steps: a hundredth */
/* a rate is steady if it changes by less in a doubling of the time, or in all that are left */
#define EACH 1.25
#define ALL 1.5
#define FRAME 36.0       /* [byte] for a ball in a frame */
#define POINT 4.0        /* [byte] for a point of a moving body in a frame: between 1.5 and 9.5 */
#define ROW 300.0        /* [byte] for a row of the series */
#define IMPACT 80.0      /* [byte] for a row of the log */
#define STATISTICS 3.5e6 /* [byte] for a file's histograms, maps and wear */
#define LATER 10e6       /* [byte] of memory for a start's observers, which --check does not make */
#define SEARCH 7e6       /* [byte] of memory for a start's search of its start-up; alone: */
#define SEARCH_ALONE 40e6
#define WRITING 1e-9 /* [s/byte] of processor time */

/* Progress of the trial at some moment */
struct point {
    double time, contacts, cpu; /* [s] simulated, [1], [s] */
};

static struct point look(const struct mill_sim *sim)
{
    const struct mill_world *world = mill_sim_world(sim);
    struct point p = {mill_sim_time(sim), 0, mill_record_clock(CLOCK_PROCESS_CPUTIME_ID)};
    for (int kind = 0; kind < world->kinds.count; kind++)
        p.contacts += (double)world->account.collisions[kind];
    return p;
}

enum { POINTS = 512 };
struct trial {
    struct point at[POINTS + 1]; /* the last one is the end */
    int n, every, missed;        /* points; of so many slices one is kept */
};

static void keep(struct trial *trial, const struct point *now)
{
    trial->at[trial->n] = *now;
    if (++trial->missed < trial->every)
        return;
    trial->missed = 0;
    if (++trial->n < POINTS)
        return;
    for (trial->n = 0; trial->n < POINTS / 2; trial->n++)
        trial->at[trial->n] = trial->at[2 * trial->n];
    trial->every *= 2;
    trial->at[trial->n] = *now;
}

static const struct point *point_at(const struct trial *trial, double time)
{
    const struct point *p = trial->at;
    while (p < trial->at + trial->n && p->time < time)
        p++;
    return p;
}

static double rate_between(const struct point *from, const struct point *to)
{
    return to->time > from->time ? (to->contacts - from->contacts) / (to->time - from->time) : 0;
}

/* By what factor the rate of contacts changes until `until`, if it goes on to change with each
 * doubling of the time as in the last one. 1: it is steady */
static double change(const struct trial *trial, double until)
{
    const struct point *end = trial->at + trial->n;
    const struct point *half = point_at(trial, 0.5 * end->time);
    const double one = rate_between(point_at(trial, 0.25 * end->time), half);
    const double ratio = rate_between(half, end) / one, doublings = log2(until / end->time);
    const double all = pow(ratio, fmax(0, doublings));
    const bool steady = fabs(log(ratio)) < log(EACH) || fabs(log(all)) < log(ALL);
    return steady || !(doublings > 0) ? 1 : one > 0 ? all : (double)INFINITY;
}

double mill_forecast_early(const struct mill_world *world)
{
    return isfinite(world->period) ? world->period : 0;
}

/* Runs the trial. */
static enum mill_status go(struct mill_sim *sim, double until, struct trial *trial,
                           struct mill_error *error)
{
    const struct mill_world *world = mill_sim_world(sim);
    const double early = fmin(mill_forecast_early(world), until);
    struct point now = look(sim);
    const double cpu = now.cpu;
    enum mill_status status = MILL_OK;
    const bool soft = world->soft.on;
    *trial = (struct trial){.every = 1};
    keep(trial, &now);
    while (status == MILL_OK && now.time < until && now.contacts < MOST &&
           now.cpu - cpu < (soft ? SHORT : PATIENCE) &&
           (now.contacts < CONTACTS || now.time < early || change(trial, until) != 1)) {
        status = mill_sim_run(sim, until, soft ? SLICE / 100 : SLICE, NULL, error);
        now = look(sim);
        keep(trial, &now);
    }
    trial->at[trial->n] = now;
    return status;
}

/* Number of points that are stored again in every frame */
static double points_of(const struct mill_world *world)
{
    double points = 0;
    for (int k = 0; k < world->motions; k++) {
        struct mill_outline outline;
        mill_outline_make(world, world->motion[k], &outline);
        points += (double)outline.mesh.points;
        mill_outline_free(&outline);
    }
    return points;
}

/* Computes the forecast from a trial. Returns the rate of contacts [1/s] in the steady mill. */
static double work_out(const struct mill_deck *deck, const struct mill_world *world,
                       const struct trial *trial, const struct mill_energies *energies,
                       struct mill_forecast *forecast)
{
    const struct point *to = trial->at + trial->n, *from = point_at(trial, 0.5 * to->time);
    struct mill_forecast f = {.trial = to->time, .contacts = to->contacts};
    const double end = deck->observe.end, rate = rate_between(from, to);
    const double limit = deck->observe.max_collisions, most = limit > 0 ? limit : (double)INFINITY;
    const double early = fmin(mill_forecast_early(world), end);
    const double factor = world->soft.on ? 1 : change(trial, end);
    f.bound = factor != 1 || to->time < early || (rate == 0 && to->time < end);
    const double rest = fmax(0, fmin(rate * fmin(factor, 1) * (end - to->time), most - f.contacts));
    f.contacts = fmin(f.contacts + rest, most);
    f.file = STATISTICS + mill_energies_cost(energies) + end / deck->observe.series * ROW +
             (deck->observe.log_impacts ? f.contacts * IMPACT : 0);
    if (deck->observe.frames > 0)
        f.file += (floor(end / deck->observe.frames) + 1) *
                  (world->balls * FRAME + points_of(world) * POINT);
    /* without contacts only the simulated time can be used */
    const double cost = to->cpu - from->cpu, met = to->contacts - from->contacts;
    const bool counted = met > 0 && !world->soft.on;
    const double took = to->time - from->time;
    f.cpu = to->cpu + (counted ? rest / met * cost : took > 0 ? (end - f.trial) / took * cost : 0);
    f.contacts *= (double)deck->observe.starts;
    f.cpu = f.cpu * (double)deck->observe.starts + f.file * WRITING;
    f.memory = mill_record_peak_memory() + (double)deck->observe.starts * LATER;
    if (deck->observe.sample_found)
        f.memory += deck->observe.starts > 1 ? (double)deck->observe.starts * SEARCH : SEARCH_ALONE;
    *forecast = f;
    return rate;
}

enum mill_status mill_forecast_make(const struct mill_deck *deck, struct mill_world *world,
                                    struct mill_forecast *forecast, struct mill_error *error)
{
    /* its statistics are gathered from the start */
    const struct mill_observe asked = {.end = deck->observe.end,
                                       .strike_window = deck->observe.strike_window};
    struct mill_observer *observer = mill_observers_one(&mill_tally_type, &asked, world, error);
    const struct mill_tally *tally = (struct mill_tally *)observer;
    struct mill_tally_results *results = NULL;
    struct mill_sim *sim = NULL;
    struct trial trial;
    double rate = NAN;
    enum mill_status status = observer ? mill_sim_create(world, &sim, error) : MILL_FAILED;
    if (status == MILL_OK)
        status = mill_sim_observe(sim, observer);
    if (status == MILL_OK)
        status = go(sim, deck->observe.end, &trial, error);
    if (status == MILL_OK)
        status = mill_tally_results_make(tally, world, mill_sim_local_time(sim), &results, error);
    mill_sim_free(sim);
    if (status == MILL_OK)
        rate = work_out(deck, world, &trial, &tally->plan.energies, forecast);
    mill_notes_expect(&forecast->notes, world, results, rate);
    mill_tally_results_free(results);
    if (observer)
        mill_observers_free_one(observer);
    return status;
}
