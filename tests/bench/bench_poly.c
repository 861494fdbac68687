/* Nanoseconds per contact-time solve: first_rise and the closed form beside GSL's companion-matrix
 * solver, on the polynomials of a ball in a drum with a shaft. `bench_poly [--json FILE]`. */
#include <gsl/gsl_poly.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../unit/poly_cases.h"
#include "millsim/poly.h"

#define CASES 4096
#define REPEATS 7

struct workload {
    const char *name;
    double t_lo, t_hi; /* window, log-uniform */
    bool needed;       /* only cases that get past the cheap rejections */
    bool grazing;      /* paths that miss or hit by a relative 1e-17..1e-1 */
};

struct row {
    const char *name;
    double first_rise, quartic, gsl, solved, found, fallbacks;
};

static const struct workload workloads[] = {
    {"windows 1e-4..1e-2 s", 1e-4, 1e-2, false, false},
    {"same, not rejected", 1e-4, 1e-2, true, false},
    {"windows 1e-2..1 s", 1e-2, 1.0, false, false},
    {"no window", INFINITY, INFINITY, false, false},
    {"grazing, 1e-4..1e-2 s", 1e-4, 1e-2, true, true},
};
#define WORKLOADS ((int)(sizeof workloads / sizeof workloads[0]))

static double seconds_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static struct rise_case draw(gsl_rng *rng, const struct workload *w)
{
    const double g[2] = {0.0, -9.81};
    struct rise_case q = {.at_root = false};
    struct mill_poly_counts counts;
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
        counts = (struct mill_poly_counts){0, 0};
        mill_poly_first_rise(q.c, q.t_end, q.at_root, &counts);
    } while (w->needed && counts.solves == 0);
    return q;
}

/* Best of REPEATS passes over the cases, in ns a case */
static double time_first_rise(const struct rise_case *q, double *found,
                              struct mill_poly_counts *counts)
{
    double best = INFINITY;
    for (int i = 0; i < REPEATS; i++) {
        int hits = 0;
        *counts = (struct mill_poly_counts){0, 0};
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
            mill_poly_quartic_roots(q[k].c, re, im);
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

static struct row measure(const struct workload *w, struct rise_case *q)
{
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, 20070301);
    for (int k = 0; k < CASES; k++)
        q[k] = draw(rng, w);
    gsl_rng_free(rng);
    struct row row = {.name = w->name};
    struct mill_poly_counts counts;
    row.first_rise = time_first_rise(q, &row.found, &counts);
    row.solved = (double)counts.solves / CASES;
    row.fallbacks = (double)counts.fallbacks / CASES;
    row.quartic = time_quartic(q);
    row.gsl = time_gsl(q);
    return row;
}

static int write_json(const char *path, const struct row *rows)
{
    FILE *file = fopen(path, "w");
    if (!file)
        return 1;
    fprintf(file, "{\"unit\": \"ns\", \"rows\": [");
    for (int i = 0; i < WORKLOADS; i++)
        fprintf(file,
                "%s\n  {\"name\": \"%s\", \"first_rise\": %.1f, \"quartic_roots\": %.1f, "
                "\"gsl\": %.1f, \"solved\": %.4f, \"found\": %.4f, \"fallbacks\": %.6f}",
                i ? "," : "", rows[i].name, rows[i].first_rise, rows[i].quartic, rows[i].gsl,
                rows[i].solved, rows[i].found, rows[i].fallbacks);
    fprintf(file, "\n]}\n");
    return fclose(file) != 0;
}

int main(int argc, char **argv)
{
    static struct rise_case cases[CASES];
    struct row rows[WORKLOADS];
    printf("%-24s %10s %10s %10s %8s %8s %9s\n", "ns per call", "first_rise", "quartic", "gsl",
           "solved", "found", "fallback");
    for (int i = 0; i < WORKLOADS; i++) {
        rows[i] = measure(&workloads[i], cases);
        printf("%-24s %10.1f %10.1f %10.1f %7.1f%% %7.1f%% %8.3f%%\n", rows[i].name,
               rows[i].first_rise, rows[i].quartic, rows[i].gsl, 100.0 * rows[i].solved,
               100.0 * rows[i].found, 100.0 * rows[i].fallbacks);
    }
    if (argc == 3 && strcmp(argv[1], "--json") == 0)
        return write_json(argv[2], rows);
    return 0;
}
