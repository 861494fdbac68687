/* How long will it take? The first of the run tells, but a charge at rest has few contacts until
 * the rotor has swept it up: then their rate grows 3 to 30 times within a revolution, the less the
 * more balls there are, and is steady. Where the trial ends before that, the rate goes on to grow
 * as it does in the reference mill with other charges (validation/forecast): its logarithm linearly
 * with the rotor's angle. */
#include "app/forecast.h"

#include "app/record.h"
#include "millsim/sim.h"

#include <math.h>

#define TRIAL 1.5        /* [s] of processor time */
#define SLICE 5000       /* events between two looks at the clock */
#define SWEPT 0.15       /* turns until the charge is swept up, times its share of the drum; */
#define MOST_TURNS 1.0   /* at most */
#define RAPID 10.0       /* centripetal over gravitational acceleration from which it is swept up */
#define FRAME 36.0       /* [byte] of a ball in a frame */
#define ROW 300.0        /* [byte] of a row of the series */
#define IMPACT 80.0      /* [byte] of a row of the log */
#define STATISTICS 1.2e6 /* [byte] of a file's histograms and maps */
#define GATHERED 8e6      /* [byte] of memory for statistics and the file's library */
#define WRITING 1e-9     /* [s/byte] of processor time */

/* How far the trial was at some moment */
struct point {
    double time, contacts, cpu; /* [s] simulated, [1], [s] */
};

static struct point look(const struct mill_sim *sim)
{
    const struct mill_world *world = mill_sim_world(sim);
    struct point p = {mill_sim_time(sim), 0, mill_record_clock(CLOCK_PROCESS_CPUTIME_ID)};
    for (int kind = 0; kind < MILL_KINDS; kind++)
        p.contacts += (double)world->account.collisions[kind];
    return p;
}

/* Its end, and a point before it: since then there was a fifth to two fifths of the contacts. */
static enum mill_status try(struct mill_sim *sim, double until, struct point ends[2],
                            struct mill_error *error)
{
    struct point now = look(sim), then[2] = {now, now};
    const double cpu = now.cpu;
    enum mill_status status = MILL_OK;
    while (status == MILL_OK && now.time < until && now.cpu - cpu < TRIAL) {
        status = mill_sim_run(sim, until, SLICE, NULL, error);
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

/* By what factor, as a logarithm, the rate of contacts is short of that of a steady mill. */
static double short_of(const struct mill_world *world, double time)
{
    double volume = 0;
    for (int32_t i = 0; i < world->balls; i++)
        volume += 4 * MILL_PI / 3 * pow(world->species[world->ball[i].species].radius, 3);
    const double radius = world->drum_radius, turn = 2 * MILL_PI / fabs(world->rotor_speed);
    const double share = volume / (MILL_PI * radius * radius * world->drum_length);
    const double swept = fmin(MOST_TURNS, SWEPT / share) * turn;
    const double loss = 1 + 6 * (1 - world->law[MILL_BALL_BALL].restitution);
    if (!(pow(world->rotor_speed, 2) * radius > RAPID * vec3_norm(world->g)))
        return 0;
    return loss * fmax(0, 1 - time / swept);
}

/* Contacts from the trial's end to the run's. */
static double extrapolate(const struct mill_world *world, const struct point ends[2], double end,
                          double *rate)
{
    enum { STEPS = 200 };
    const double step = (end - ends[1].time) / STEPS, took = ends[1].time - ends[0].time;
    const double now = short_of(world, 0.5 * (ends[0].time + ends[1].time));
    const double known = took > 0 ? (ends[1].contacts - ends[0].contacts) / took : 0;
    double sum = 0;
    for (int i = 0; i < STEPS; i++) {
        *rate = known * exp(now - short_of(world, ends[1].time + (i + 0.5) * step));
        sum += *rate * step;
    }
    return sum;
}

enum mill_status mill_forecast_make(const struct mill_deck *deck, struct mill_world *world,
                                    struct mill_forecast *forecast, struct mill_error *error)
{
    struct mill_sim *sim = NULL;
    struct point ends[2];
    enum mill_status status = mill_sim_create(world, &sim, error);
    if (status == MILL_OK)
        status = try(sim, deck->time, ends, error);
    mill_sim_free(sim);
    if (status != MILL_OK)
        return status;
    struct mill_forecast f = {.trial = ends[1].time, .contacts = ends[1].contacts};
    const double met = ends[1].contacts - ends[0].contacts, end = deck->time;
    double rest = extrapolate(world, ends, end, &f.rate);
    if (deck->max_collisions > 0)
        rest = fmin(rest, fmax(0, deck->max_collisions - f.contacts));
    f.contacts += rest;
    f.file = STATISTICS + end / deck->series * ROW + (deck->log_impacts ? f.contacts * IMPACT : 0);
    if (deck->frames > 0)
        f.file += (floor(end / deck->frames) + 1) * world->balls * FRAME;
    /* without contacts there is only the time to go by */
    f.cpu = ends[1].cpu + f.file * WRITING;
    f.cpu += met > 0 ? rest * (ends[1].cpu - ends[0].cpu) / met
                     : (end / f.trial - 1) * (ends[1].cpu - ends[0].cpu);
    f.memory = mill_record_peak_memory() + GATHERED;
    *forecast = f;
    return MILL_OK;
}
