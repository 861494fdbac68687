/* Nanoseconds per contact-time solve: first_rise and the closed form beside GSL's companion-matrix
 * solver. First on what runs of two decks ask of their drum and shaft, call by call; "past the
 * bound" are those that are not dismissed by it, which nothing but a solve can answer. Then on
 * random flights in a drum with a shaft, with windows longer than a run's.
 * `bench_poly [--json FILE]`, from the folder that holds input/. */
#include <gsl/gsl_poly.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../unit/poly_cases.h"
#include "deck/deck.h"
#include "geometry/shape.h"
#include "millsim/poly.h"
#include "millsim/sim.h"
#include "proof/paranoid.h"

#define CASES 4096
#define REPEATS 7
#define BEGIN 0.03 /* [s] simulated before the calls are recorded */
#define EVERY 7    /* ... and of them, so that they cover some milliseconds */

struct workload {
    const char *name;
    const char *deck;  /* recorded from its run, or NULL: random flights, then */
    double t_lo, t_hi; /* window, log-uniform */
    bool needed;       /* only cases that get past the cheap rejections */
    bool grazing;      /* paths that miss or hit by a relative 1e-17..1e-1 */
};

struct row {
    const char *name;
    double first_rise, quartic, gsl, solved, found, fallbacks;
};

static const struct workload workloads[] = {
    {"mill, every call", "input/simoloyer.ini", 0.0, 0.0, false, false},
    {"mill, past the bound", "input/simoloyer.ini", 0.0, 0.0, true, false},
    {"gas, every call", "input/gas.ini", 0.0, 0.0, false, false},
    {"gas, past the bound", "input/gas.ini", 0.0, 0.0, true, false},
    {"windows 1e-4..1e-2 s", NULL, 1e-4, 1e-2, false, false},
    {"same, past the bound", NULL, 1e-4, 1e-2, true, false},
    {"windows 1e-2..1 s", NULL, 1e-2, 1.0, false, false},
    {"no window", NULL, INFINITY, INFINITY, false, false},
    {"grazing, 1e-4..1e-2 s", NULL, 1e-4, 1e-2, true, true},
};
#define WORKLOADS ((int)(sizeof workloads / sizeof workloads[0]))

static double seconds_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static bool is_solved(const struct rise_case *q)
{
    struct mill_poly_counts counts = {0};
    mill_poly_first_rise(q->c, q->t_end, q->at_root, &counts);
    return counts.solves > 0;
}

/* Stands for a cylinder's type and writes down what it is asked. */
struct recorder {
    struct mill_shape_type type; /* first: a shape's type leads back here */
    const struct mill_shape_type *real;
    double radius; /* [m] of the cylinder */
    struct recording {
        struct rise_case *q;
        int n;
        long calls;
        bool on, needed;
    } * tape;
};

static struct mill_hit record_contact(const struct mill_shape *shape, const struct mill_flight *f,
                                      double radius, double now, double horizon, bool touching)
{
    const struct recorder *r = (const struct recorder *)shape->type;
    struct recording *tape = r->tape;
    if (tape->on && tape->n < CASES && tape->calls++ % EVERY == 0) {
        const bool inside = shape->kind == MILL_BALL_DRUM;
        const double at[2] = {f->r.y, f->r.z}, v[2] = {f->v.y, f->v.z}, g[2] = {f->g.y, f->g.z};
        struct rise_case *q = &tape->q[tape->n];
        contact_polynomial(at, v, g, inside ? r->radius - radius : r->radius + radius, inside,
                           q->c);
        q->t_end = horizon;
        q->at_root = touching;
        tape->n += !tape->needed || is_solved(q);
    }
    return r->real->next_contact(shape, f, radius, now, horizon, touching);
}

/* Fills the tape from a run of the deck; false when it cannot run. */
static bool record_run(const struct workload *w, struct recording *tape)
{
    struct mill_error error;
    struct mill_deck *deck = NULL;
    struct mill_world *world = NULL;
    struct mill_sim *sim = NULL;
    struct recorder recorder[2];
    bool ok = mill_deck_read(w->deck, 0, NULL, NULL, NULL, NULL, &deck, &error) == MILL_OK &&
              mill_deck_setup_world(deck, NULL, &world, &error) == MILL_OK;
    for (int k = 0, n = 0; ok && k < world->shapes; k++) {
        const struct mill_shape_type *real = world->shape[k]->type;
        const int kind = world->shape[k]->kind;
        if (kind != MILL_BALL_DRUM && kind != MILL_BALL_SHAFT)
            continue;
        recorder[n] = (struct recorder){
            *real, real,
            kind == MILL_BALL_DRUM ? deck->setup.drum.radius : deck->given.shaft_radius, tape};
        recorder[n].type.next_contact = record_contact;
        world->shape[k]->type = &recorder[n++].type;
    }
    ok = ok && mill_sim_create(world, &sim, &error) == MILL_OK;
    for (double t = BEGIN; ok && tape->n < CASES; t += 1e-3) {
        ok = mill_sim_run(sim, t, UINT64_MAX, NULL, &error) == MILL_OK;
        tape->on = true;
    }
    mill_sim_free(sim);
    mill_world_free(world);
    mill_deck_free(deck);
    if (!ok)
        fprintf(stderr, "%s\n", error.text);
    return ok;
}

static struct rise_case draw(gsl_rng *rng, const struct workload *w)
{
    const double g[2] = {0.0, -9.81};
    struct rise_case q = {.at_root = false};
    do {
        bool inside = gsl_rng_uniform(rng) < 0.5, touching = gsl_rng_uniform(rng) < 0.1;
        double rho = inside ? DRUM_RHO : SHAFT_RHO, r[2], v[2];
        double span = DRUM_RHO * DRUM_RHO - SHAFT_RHO * SHAFT_RHO;
        double radius = sqrt(SHAFT_RHO * SHAFT_RHO + span * gsl_rng_uniform(rng));
        random_direction(rng, touching ? rho : radius, r);
        random_direction(rng, log_uniform(rng, 0.1, 10.0), v);
        if (w->grazing)
            grazing_state(rng, rho, g, r, v);
        contact_polynomial(r, v, g, rho, inside, q.c);
        q.at_root = touching && !w->grazing;
        if (q.at_root && q.c[1] > 0.0)
            for (int k = 1; k < 4; k += 2)
                q.c[k] = -q.c[k];
        q.t_end = isinf(w->t_hi) ? w->t_hi : log_uniform(rng, w->t_lo, w->t_hi);
    } while (w->needed && !is_solved(&q));
    return q;
}

/* Best of REPEATS passes over the cases, in ns a case */
static double time_first_rise(const struct rise_case *q, double *found,
                              struct mill_poly_counts *counts)
{
    double best = INFINITY;
    for (int i = 0; i < REPEATS; i++) {
        int hits = 0;
        *counts = (struct mill_poly_counts){0};
        double start = seconds_now();
        for (int k = 0; k < CASES; k++)
            hits += isfinite(mill_poly_first_rise(q[k].c, q[k].t_end, q[k].at_root, counts));
        best = fmin(best, seconds_now() - start);
        *found = (double)hits / CASES;
    }
    return 1e9 * best / CASES;
}

static double time_quartic(const struct rise_case *q)
{
    double best = INFINITY, re[4], im[4];
    for (int i = 0; i < REPEATS; i++) {
        double start = seconds_now();
        for (int k = 0; k < CASES; k++)
            mill_quartic_roots(q[k].c, re, im);
        best = fmin(best, seconds_now() - start);
    }
    return 1e9 * best / CASES;
}

static double time_gsl(const struct rise_case *q)
{
    gsl_poly_complex_workspace *w = gsl_poly_complex_workspace_alloc(5);
    double best = INFINITY, z[8];
    for (int i = 0; i < 3; i++) {
        double start = seconds_now();
        for (int k = 0; k < CASES; k++)
            gsl_poly_complex_solve(q[k].c, 5, w, z);
        best = fmin(best, seconds_now() - start);
    }
    gsl_poly_complex_workspace_free(w);
    return 1e9 * best / CASES;
}

static bool prepare(const struct workload *w, struct rise_case *q)
{
    struct recording tape = {q, 0, 0, false, w->needed};
    if (w->deck)
        return record_run(w, &tape);
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, 20070301);
    for (int k = 0; k < CASES; k++)
        q[k] = draw(rng, w);
    gsl_rng_free(rng);
    return true;
}

static struct row measure(const struct workload *w, const struct rise_case *q)
{
    struct row row = {.name = w->name};
    struct mill_poly_counts counts;
    row.first_rise = time_first_rise(q, &row.found, &counts);
    row.solved = (double)counts.solves / CASES;
    row.fallbacks = (double)counts.fallbacks / CASES;
    /* without gravity there is no quartic to solve */
    row.quartic = q->c[4] != 0.0 ? time_quartic(q) : (double)NAN;
    row.gsl = q->c[4] != 0.0 ? time_gsl(q) : (double)NAN;
    return row;
}

/* A time as text: `none` where there is none */
static const char *figure(char text[16], double ns, const char *none)
{
    snprintf(text, 16, "%.1f", ns);
    return isnan(ns) ? none : text;
}

static int write_json(const char *path, const struct row *rows)
{
    char quartic[16], gsl[16];
    FILE *file = fopen(path, "w");
    if (!file)
        return 1;
    fprintf(file, "{\"unit\": \"ns\", \"rows\": [");
    for (int i = 0; i < WORKLOADS; i++)
        fprintf(file,
                "%s\n  {\"name\": \"%s\", \"first_rise\": %.1f, \"quartic_roots\": %s, "
                "\"gsl\": %s, \"solved\": %.4f, \"found\": %.4f, \"fallbacks\": %.6f}",
                i ? "," : "", rows[i].name, rows[i].first_rise,
                figure(quartic, rows[i].quartic, "null"), figure(gsl, rows[i].gsl, "null"),
                rows[i].solved, rows[i].found, rows[i].fallbacks);
    fprintf(file, "\n]}\n");
    return fclose(file) != 0;
}

int main(int argc, char **argv)
{
    static struct rise_case cases[CASES];
    struct row rows[WORKLOADS];
    char quartic[16], gsl[16];
    printf("%-24s %10s %10s %10s %8s %8s %9s\n", "ns per call", "first_rise", "quartic", "gsl",
           "solved", "found", "fallback");
    for (int i = 0; i < WORKLOADS; i++) {
        if (!prepare(&workloads[i], cases))
            return 1;
        rows[i] = measure(&workloads[i], cases);
        printf("%-24s %10.1f %10s %10s %7.1f%% %7.1f%% %8.3f%%\n", rows[i].name, rows[i].first_rise,
               figure(quartic, rows[i].quartic, "-"), figure(gsl, rows[i].gsl, "-"),
               100.0 * rows[i].solved, 100.0 * rows[i].found, 100.0 * rows[i].fallbacks);
    }
    if (argc == 3 && strcmp(argv[1], "--json") == 0)
        return write_json(argv[2], rows);
    return 0;
}
