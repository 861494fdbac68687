/* How long will the run take? The start of the run shows the speed. But in a drum at rest, a charge
 * at rest has few contacts until the rotor has swept it up. Their rate grows by a factor of 3 to 30
 * within a turn, faster in a fuller drum, and more for less elastic balls. Then it is constant. The
 * forecast assumes that the logarithm of the rate grows linearly with time. The three constants
 * below come from fifteen charges of the reference mill (validation/forecast tests them with
 * fifteen others). */
#include "app/forecast.h"

#include "app/record.h"
#include "millsim/sim.h"
#include "observe/observers.h"
#include "observe/outline.h"

#include <math.h>

/* The trial ends after so many contacts: the same deck has the same forecast of contacts and the
 * same notes on any machine, slow or busy. Where contacts are rare, it ends after so much time. */
#define CONTACTS 1.5e6
#define PATIENCE 20.0 /* [s] of processor time */
#define SHORT 2.0     /* [s] the same of soft spheres, whose steps all cost the same */
#define SLICE 5000    /* events between two readings of the clock; time steps: a hundredth */
/* turns until the charge is swept up: SWEPT over the part of the drum that it fills, */
#define SWEPT 0.15
/* maximum of these turns; the rate grows by exp(1 + LOSS (1 - restitution)) */
#define MOST_TURNS 1.2
#define LOSS 6.0
/* ratio of centripetal to gravitational acceleration; above it the charge is swept up */
#define RAPID 10.0
#define FRAME 36.0       /* [byte] for a ball in a frame */
#define POINT 4.0        /* [byte] for a point of a moving body in a frame: between 1.5 and 9.5 */
#define ROW 300.0        /* [byte] for a row of the series */
#define IMPACT 80.0      /* [byte] for a row of the log */
#define STATISTICS 3.5e6 /* [byte] for a file's histograms, maps and wear */
#define LATER 10e6       /* [byte] of memory for a start's observers, which --check does not make */
#define WRITING 1e-9     /* [s/byte] of processor time */

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

/* Runs the trial. ends: a point before its end and its end; between them were a fifth to two fifths
 * of the contacts. */
static enum mill_status go(struct mill_sim *sim, double until, struct point ends[2],
                           struct mill_error *error)
{
    struct point now = look(sim), then[2] = {now, now};
    const double cpu = now.cpu;
    enum mill_status status = MILL_OK;
    const bool soft = mill_sim_world(sim)->soft.on;
    while (status == MILL_OK && now.time < until && now.contacts < CONTACTS &&
           now.cpu - cpu < (soft ? SHORT : PATIENCE)) {
        status = mill_sim_run(sim, until, soft ? SLICE / 100 : SLICE, NULL, error);
        now = look(sim);
        if (now.contacts - then[1].contacts > 0.2 * now.contacts) {
            then[0] = then[1];
            then[1] = now;
        }
    }
    ends[0] = then[0];
    ends[1] = now;
    return status;
}

/* Runs the trial with its statistics, gathered from the start. The caller frees both
 * in all cases. */
static enum mill_status try(const struct mill_deck *deck, struct mill_world *world,
                            struct point ends[2], struct mill_observer **tally,
                            struct mill_tally_results **results, struct mill_error *error)
{
    const struct mill_observe asked = {.end = deck->observe.end,
                                       .strike_window = deck->observe.strike_window};
    struct mill_sim *sim = NULL;
    *tally = mill_observers_one(&mill_tally_type, &asked, world, error);
    enum mill_status status = *tally ? mill_sim_create(world, &sim, error) : MILL_FAILED;
    if (status == MILL_OK)
        status = mill_sim_observe(sim, *tally);
    if (status == MILL_OK)
        status = go(sim, deck->observe.end, ends, error);
    if (status == MILL_OK)
        status = mill_tally_results_make((struct mill_tally *)*tally, world,
                                         mill_sim_local_time(sim), results, error);
    mill_sim_free(sim);
    return status;
}

struct mill_forecast_growth mill_forecast_growth(const struct mill_world *world)
{
    const double r = world->drum_radius, speed = fabs(world->rotor_speed);
    double balls = 0, mass = 0; /* [m^3], [kg] */
    for (int32_t i = 0; i < world->balls; i++) {
        const struct mill_species *of = &world->species[world->ball[i].species];
        balls += 4 * MILL_PI / 3 * pow(of->radius, 3);
        mass += of->mass;
    }
    const bool rests =
        world->container.still && world->start.kinetic <= 0.5 * mass * pow(0.1 * speed * r, 2);
    if (!rests || !(speed * speed * r > RAPID * vec3_norm(world->g)))
        return (struct mill_forecast_growth){0, 1};
    const double turns = SWEPT * MILL_PI * r * r * world->drum_length / balls;
    return (struct mill_forecast_growth){fmin(MOST_TURNS, turns) * 2 * MILL_PI / speed,
                                         1 + LOSS * (1 - world->law[MILL_BALL_BALL].restitution)};
}

double mill_forecast_work(const struct mill_forecast_growth *growth, double time)
{
    const double swept = growth->swept, power = growth->power;
    if (time >= swept)
        return time - swept + swept / power;
    return swept / power * exp(power * (time / swept - 1));
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

/* Computes the forecast from the two points of a trial. Returns the rate of contacts [1/s] in the
 * steady mill. */
static double work_out(const struct mill_deck *deck, const struct mill_world *world,
                       const struct point ends[2], const struct mill_energies *energies,
                       struct mill_forecast *forecast)
{
    struct mill_forecast f = {.trial = ends[1].time, .contacts = ends[1].contacts};
    const double met = ends[1].contacts - ends[0].contacts, end = deck->observe.end;
    const double most =
        deck->observe.max_collisions > 0 ? deck->observe.max_collisions : (double)INFINITY;
    const struct mill_forecast_growth growth = mill_forecast_growth(world);
    const double from = mill_forecast_work(&growth, ends[0].time);
    const double work = mill_forecast_work(&growth, ends[1].time) - from;
    const double rate = work > 0 ? met / work : 0;
    double rest = rate * (mill_forecast_work(&growth, end) - from) - met;
    rest = fmax(0, fmin(rest, most - f.contacts));
    f.contacts = fmin(f.contacts + rest, most);
    f.file = STATISTICS + mill_energies_cost(energies) + end / deck->observe.series * ROW +
             (deck->observe.log_impacts ? f.contacts * IMPACT : 0);
    if (deck->observe.frames > 0)
        f.file += (floor(end / deck->observe.frames) + 1) *
                  (world->balls * FRAME + points_of(world) * POINT);
    /* without contacts only the simulated time can be used */
    const double cost = ends[1].cpu - ends[0].cpu;
    const bool by_contacts = met > 0 && !world->soft.on;
    const double took = ends[1].time - ends[0].time;
    f.cpu = ends[1].cpu + (by_contacts ? rest / met * cost : (end - f.trial) / took * cost);
    f.contacts *= (double)deck->observe.starts;
    f.cpu = f.cpu * (double)deck->observe.starts + f.file * WRITING;
    f.memory = mill_record_peak_memory() + (double)deck->observe.starts * LATER;
    *forecast = f;
    return rate;
}

enum mill_status mill_forecast_make(const struct mill_deck *deck, struct mill_world *world,
                                    struct mill_forecast *forecast, struct mill_error *error)
{
    struct mill_observer *tally = NULL;
    struct mill_tally_results *results = NULL;
    struct point ends[2];
    const enum mill_status status = try(deck, world, ends, &tally, &results, error);
    const double rate =
        status == MILL_OK
            ? work_out(deck, world, ends, &((struct mill_tally *)tally)->plan.energies, forecast)
            : (double)NAN;
    mill_notes_expect(&forecast->notes, world, results, rate);
    mill_tally_results_free(results);
    if (tally)
        mill_observers_free_one(tally);
    return status;
}
