/* How many contacts the event loop makes in a CPU second: a smooth elastic gas in a drum as long as
 * it is wide, nothing observed. Speeds are Maxwell's when the measuring begins. One line of JSON
 * for each repeat; the repeats follow each other in one run.
 * The places are settled too, but their order in memory is still that of the start, as in all runs
 * of less than some thousand contacts of each ball.
 *
 * The drum's size follows from the balls' number N and the packing fraction eta wanted away from
 * the walls. Centres have the volume V = 2 pi r^3 and the surface A = 6 pi r^2, r = R - d/2, and
 * the gas is denser next to it: N = 6 eta / (pi d^3) (V + A d s). Scaled-particle theory (Reiss,
 * Frisch, Helfand & Lebowitz 1960) has, for a flat hard wall, the surface tension of the centres'
 * surface - 9 eta^2 (1 + eta) / (2 pi (1 - eta)^3) kT/d^2; its derivative by the chemical potential
 * of the same theory gives the surplus s = 3 eta / (2 + 4 eta) used here.
 *
 * A mixture has two kinds of balls that take the same volume. Each kind is to have half of the
 * packing fraction in its own V, with the surplus of its own d at the whole eta: an estimate, good
 * enough for a rate. */
#include "deck/deck.h"
#include "millsim/sim.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SET_LENGTH = 96 };

struct job {
    const char *deck;
    long balls;
    double packing;
    double ratio; /* diameter of the large balls over that of the small ones; 1: all are equal */
    bool gravity;
    double settle;   /* contacts of each ball before measuring begins */
    double contacts; /* of all balls in one repeat */
    int repeats;
    bool print; /* the deck only */
};

struct gas {
    struct mill_deck *deck;
    struct mill_world *world;
    struct mill_sim *sim;
    struct mill_error error;
};

static const char usage[] =
    "usage: bench_engine [options] BALLS PACKING [gravity]\n"
    "  --ratio X       half of the balls' volume in balls X times smaller in diameter; default 1: "
    "none\n"
    "  --deck FILE     all that the other arguments leave open; default tests/bench/gas.ini\n"
    "  --settle X      contacts of each ball before measuring begins\n"
    "  --contacts N    of all balls in one repeat; default 500000\n"
    "  --repeats N     default 5\n"
    "  --print         print the deck of this gas and end\n";

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Number of the large balls; the rest are small and have the same volume in all. */
static long large_balls(const struct job *job)
{
    return job->ratio == 1.0 ? job->balls
                             : lround((double)job->balls / (1.0 + pow(job->ratio, 3.0)));
}

/* Radius of the drum, as long as it is wide, in diameters of a large ball: see above. */
static double drum_radius(const struct job *job)
{
    const double surplus = 3.0 * job->packing / (2.0 + 4.0 * job->packing),
                 small = 1.0 / job->ratio;
    const double number = (double)large_balls(job),
                 few = ((double)job->balls - number) * pow(small, 3.0);
    const double room = (number + few) / (12.0 * job->packing); /* r^3 + 3 s r^2, the kinds' mean */
    double wall = cbrt(room) + 0.5;
    for (int k = 0; k < 50; k++) { /* Newton: convex, from above */
        double filled = 0.0, slope = 0.0;
        for (int kind = 0; kind < 2; kind++) {
            const double d = kind == 0 ? 1.0 : small, r = wall - 0.5 * d, s = surplus * d;
            filled += 0.5 * r * r * (r + 3.0 * s);
            slope += 0.5 * r * (3.0 * r + 6.0 * s);
        }
        wall -= (filled - room) / slope;
    }
    return wall;
}

/* Packing fraction in the part of the drum that is more than two diameters away from its walls. Of
 * a mixture that has few large balls there, it is left to chance. */
static double bulk_packing(const struct gas *gas)
{
    const struct mill_world *w = gas->world;
    const double t = mill_sim_local_time(gas->sim), d = 2.0 * w->species[0].radius; /* the large */
    const double radius = w->drum_radius - 2.0 * d, half = 0.5 * w->drum_length - 2.0 * d;
    double filled = 0.0; /* d^3 of the balls inside */
    for (int32_t i = 0; i < w->balls; i++) {
        const vec3 r = mill_world_position(w, i, t);
        if (fabs(r.x) < half && r.y * r.y + r.z * r.z < radius * radius)
            filled += pow(2.0 * w->species[w->ball[i].species].radius, 3.0);
    }
    return filled / (12.0 * radius * radius * half);
}

static uint64_t contacts(const struct mill_world *w)
{
    uint64_t all = 0;
    for (int k = 0; k < MILL_KINDS; k++)
        all += w->account.collisions[k];
    return all;
}

static uint64_t events(const struct mill_world *w)
{
    return contacts(w) + w->counts.cell_crossings + w->counts.stale;
}

/* On until `wanted` more contacts have happened; false when the run failed. */
static bool run_on(struct gas *gas, double wanted)
{
    const double end = (double)contacts(gas->world) + wanted;
    while ((double)contacts(gas->world) < end) {
        const double missing = end - (double)contacts(gas->world);
        const uint64_t budget = (uint64_t)fmax(missing, 100.0);
        if (mill_sim_run(gas->sim, (double)INFINITY, budget, NULL, &gas->error) != MILL_OK)
            return false;
    }
    return true;
}

static enum mill_status read_deck(struct gas *gas, const struct job *job)
{
    enum { KEYS = 10 };
    char set[KEYS][SET_LENGTH];
    const char *sets[KEYS];
    const double d = 0.005, radius = d * drum_radius(job);
    /* with gravity: the gas would thin out by 1/e over the drum's length if it were ideal */
    const double g = 9.81, speed = job->gravity ? sqrt(3.0 * g * 2.0 * radius) : 1.0;
    const long large = large_balls(job);
    int keys = 0;
    snprintf(set[keys++], SET_LENGTH, "drum.radius=%.17g m", radius);
    snprintf(set[keys++], SET_LENGTH, "drum.length=%.17g m", 2.0 * radius);
    snprintf(set[keys++], SET_LENGTH, "balls.speed=%.17g m/s", speed);
    snprintf(set[keys++], SET_LENGTH, "gravity.acceleration=%.17g 0 0 m/s^2",
             job->gravity ? -g : 0.0);
    const bool mixed = large < job->balls;
    for (int kind = 0; kind < 1 + mixed; kind++) {
        const char *name = !mixed ? "balls" : kind == 0 ? "balls.large" : "balls.small";
        snprintf(set[keys++], SET_LENGTH, "%s.count=%ld", name,
                 kind == 0 ? large : job->balls - large);
        snprintf(set[keys++], SET_LENGTH, "%s.diameter=%.17g m", name,
                 kind == 0 ? d : d / job->ratio);
        snprintf(set[keys++], SET_LENGTH, "%s.density=7800 kg/m^3", name);
    }
    for (int k = 0; k < keys; k++)
        sets[k] = set[k];
    return mill_deck_read(job->deck, keys, sets, NULL, NULL, NULL, &gas->deck, &gas->error);
}

static bool open_gas(struct gas *gas)
{
    return mill_deck_setup_world(gas->deck, NULL, &gas->world, &gas->error) == MILL_OK &&
           mill_sim_create(gas->world, &gas->sim, &gas->error) == MILL_OK;
}

static void close_gas(struct gas *gas)
{
    if (gas->sim)
        mill_sim_free(gas->sim);
    if (gas->world)
        mill_world_free(gas->world);
    if (gas->deck)
        mill_deck_free(gas->deck);
}

static bool measure(struct gas *gas, const struct job *job, double started, double settled)
{
    enum { LOOKS = 4 }; /* at the packing, in one repeat; their time does not count */
    const struct mill_world *w = gas->world;
    for (int repeat = 0; repeat < job->repeats; repeat++) {
        const uint64_t *ball_ball = &w->account.collisions[MILL_BALL_BALL];
        const uint64_t before = contacts(w), events_before = events(w), balls_before = *ball_ball;
        const double from = mill_sim_time(gas->sim);
        double cpu = 0.0, packing = 0.0;
        for (int look = 0; look < LOOKS; look++) {
            const double begin = seconds();
            if (!run_on(gas, job->contacts / LOOKS))
                return false;
            cpu += seconds() - begin;
            packing += bulk_packing(gas) / LOOKS;
        }
        const double n = (double)(contacts(w) - before);
        printf("{\"balls\": %ld, \"packing\": %g, \"ratio\": %g, \"gravity\": %s, \"repeat\": %d, "
               "\"contacts\": %.0f, \"ball_contacts\": %llu, \"events\": %llu, \"cpu\": %.6f, "
               "\"simulated\": %.9g, "
               "\"contacts_per_second\": %.0f, \"events_per_contact\": %.4f, "
               "\"bulk_packing\": %.5f, \"start_cpu\": %.3f, \"settle_cpu\": %.3f}\n",
               job->balls, job->packing, job->ratio, job->gravity ? "true" : "false", repeat + 1, n,
               (unsigned long long)(*ball_ball - balls_before),
               (unsigned long long)(events(w) - events_before), cpu, mill_sim_time(gas->sim) - from,
               n / cpu, (double)(events(w) - events_before) / n, packing, started, settled);
        fflush(stdout);
    }
    return true;
}

static bool read_option(struct job *job, const char *name, const char *value)
{
    if (strcmp(name, "--deck") == 0)
        job->deck = value;
    else if (strcmp(name, "--ratio") == 0)
        job->ratio = strtod(value, NULL);
    else if (strcmp(name, "--settle") == 0)
        job->settle = strtod(value, NULL);
    else if (strcmp(name, "--contacts") == 0)
        job->contacts = strtod(value, NULL);
    else if (strcmp(name, "--repeats") == 0)
        job->repeats = (int)strtol(value, NULL, 10);
    else
        return false;
    return true;
}

static bool read_job(struct job *job, int argc, char **argv)
{
    int k = 1;
    for (; k < argc && strncmp(argv[k], "--", 2) == 0; k++) {
        if (strcmp(argv[k], "--print") == 0)
            job->print = true;
        else if (k + 1 == argc || !read_option(job, argv[k], argv[k + 1]))
            return false;
        else
            k++;
    }
    if (argc - k < 2 || argc - k > 3 || (argc - k == 3 && strcmp(argv[k + 2], "gravity") != 0))
        return false;
    job->balls = strtol(argv[k], NULL, 10);
    job->packing = strtod(argv[k + 1], NULL);
    job->gravity = argc - k == 3;
    if (job->settle <
        0.0) /* speeds need four, the places of a dense gas more; for few balls they cost nothing */
        job->settle = 4.0 + 80.0 * fmax(job->packing - 0.3, 0.0) + 2e5 / (double)job->balls;
    return job->balls > 0 && job->packing > 0.0 && job->packing < 0.5 && job->ratio >= 1.0 &&
           large_balls(job) > 0;
}

int main(int argc, char **argv)
{
    struct job job = {"tests/bench/gas.ini", 0, 0.0, 1.0, false, -1.0, 500000.0, 5, false};
    struct gas gas = {NULL, NULL, NULL, {""}};
    if (!read_job(&job, argc, argv)) {
        fputs(usage, stderr);
        return 2;
    }
    bool good = read_deck(&gas, &job) == MILL_OK;
    if (good && job.print) {
        mill_deck_print(gas.deck, stdout);
    } else if (good) {
        const double begin = seconds();
        good = open_gas(&gas);
        const double started = seconds();
        good = good && run_on(&gas, 0.5 * job.settle * (double)job.balls) &&
               measure(&gas, &job, started - begin, seconds() - started);
    }
    if (!good)
        fprintf(stderr, "bench_engine: %s\n", gas.error.text);
    close_gas(&gas);
    return good ? 0 : 1;
}
