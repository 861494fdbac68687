/* Contact polynomials as a mill asks for them, and a slow oracle for their first rise: pieces
 * between the turning points, found by bisection in long double. Shared by the unit test and the
 * benchmark. */
#ifndef MILLSIM_POLY_CASES_H
#define MILLSIM_POLY_CASES_H

#include <float.h>
#include <gsl/gsl_rng.h>
#include <math.h>
#include <stdbool.h>

#define DRUM_RHO 0.0725
#define SHAFT_RHO 0.0175

struct rise_case {
    double c[5];
    double t_end;
    bool at_root;
};

static inline gsl_rng *seeded(unsigned long seed)
{
    gsl_rng *rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, seed);
    return rng;
}

static inline double uniform(gsl_rng *rng, double lo, double hi)
{
    return lo + (hi - lo) * gsl_rng_uniform(rng);
}

static inline double log_uniform(gsl_rng *rng, double lo, double hi)
{
    return lo * pow(hi / lo, gsl_rng_uniform(rng));
}

/* |r + v t + g t^2/2|^2 - rho^2, with the sign turned for the shaft (contact from outside) */
static inline void contact_polynomial(const double r[2], const double v[2], const double g[2],
                                      double rho, bool inside, double c[5])
{
    double sign = inside ? 1.0 : -1.0;
    c[4] = sign * 0.25 * (g[0] * g[0] + g[1] * g[1]);
    c[3] = sign * (v[0] * g[0] + v[1] * g[1]);
    c[2] = sign * (v[0] * v[0] + v[1] * v[1] + r[0] * g[0] + r[1] * g[1]);
    c[1] = sign * 2.0 * (r[0] * v[0] + r[1] * v[1]);
    c[0] = sign * (r[0] * r[0] + r[1] * r[1] - rho * rho);
}

static inline void random_direction(gsl_rng *rng, double length, double x[2])
{
    double angle = uniform(rng, 0.0, 6.283185307179586);
    x[0] = length * cos(angle);
    x[1] = length * sin(angle);
}

/* From a path that touches the circle at a later time t0 tangentially, but for a relative miss */
static inline void grazing_state(gsl_rng *rng, double rho, const double g[2], double r[2],
                                 double v[2])
{
    double miss = log_uniform(rng, 1e-17, 1e-1), t0 = log_uniform(rng, 1e-5, 1e-1), n[2];
    double speed = log_uniform(rng, 1e-3, 10.0) * (gsl_rng_uniform(rng) < 0.5 ? -1.0 : 1.0);
    random_direction(rng, 1.0, n);
    rho *= 1.0 + (gsl_rng_uniform(rng) < 0.5 ? -miss : miss);
    const double w[2] = {-n[1] * speed, n[0] * speed};
    for (int k = 0; k < 2; k++) {
        r[k] = rho * n[k] - w[k] * t0 + 0.5 * g[k] * t0 * t0;
        v[k] = w[k] - g[k] * t0;
    }
}

/* Free flight, on the surface or within ulps of it, overlapping, or grazing; drum or shaft; with
 * and without gravity; windows from a microsecond to for ever. */
static inline struct rise_case mill_case(gsl_rng *rng)
{
    struct rise_case q = {.at_root = false};
    bool inside = gsl_rng_uniform(rng) < 0.5;
    double rho = inside ? DRUM_RHO : SHAFT_RHO, kind = gsl_rng_uniform(rng),
           tilt = gsl_rng_uniform(rng);
    double r[2], v[2], g[2];
    random_direction(rng, tilt < 0.2 ? 0.0 : tilt < 0.3 ? log_uniform(rng, 1e-17, 1.0) : 9.81, g);
    random_direction(
        rng, gsl_rng_uniform(rng) < 0.3 ? log_uniform(rng, 1e-6, 10.0) : uniform(rng, 0.0, 10.0),
        v);
    random_direction(rng, uniform(rng, SHAFT_RHO, DRUM_RHO), r);
    if (kind < 0.3)
        random_direction(rng, rho, r);
    else if (kind < 0.4)
        random_direction(rng, rho * (1.0 + uniform(rng, -1e-3, 1e-3)), r);
    else if (kind < 0.6)
        grazing_state(rng, rho, g, r, v);
    contact_polynomial(r, v, g, rho, inside, q.c);
    q.at_root = kind < 0.25 && q.c[1] < 0.0;
    q.t_end = gsl_rng_uniform(rng) < 0.2 ? (double)INFINITY : log_uniform(rng, 1e-6, 10.0);
    return q;
}

/* Sixteenths up to 4, so that the coefficients are exact; repeats are common */
static inline void dyadic_quartic(gsl_rng *rng, double root[4], double c[5])
{
    double p[6] = {0.0, gsl_rng_uniform(rng) < 0.5 ? -1.0 : 1.0};
    for (int n = 0; n < 4; n++) {
        root[n] = ((double)gsl_rng_uniform_int(rng, 129) - 64.0) / 16.0;
        if (n > 0 && gsl_rng_uniform(rng) < 0.4)
            root[n] = root[gsl_rng_uniform_int(rng, (unsigned long)n)];
        for (int k = n + 2; k > 0; k--)
            p[k] = p[k - 1] - root[n] * p[k];
    }
    for (int k = 0; k < 5; k++)
        c[k] = p[k + 1];
}

struct oracle_answer {
    double t;
    long double from, to; /* the rising piece that holds the answer */
    bool close_call;      /* a decision hung on less than the rounding of long double */
};

static inline long double oracle_value(const long double *c, int n, long double x)
{
    long double v = 0.0L;
    for (int k = n; k >= 0; k--)
        v = v * x + c[k];
    return v;
}

static inline long double oracle_noise(const long double *c, int n, long double x)
{
    long double v = 0.0L;
    for (int k = n; k >= 0; k--)
        v = v * fabsl(x) + fabsl(c[k]);
    return 16.0L * LDBL_EPSILON * v;
}

static inline long double oracle_bisect(const long double *c, int n, long double lo, long double hi)
{
    bool up = oracle_value(c, n, hi) > 0.0L;
    for (int i = 0; i < 16400; i++) {
        long double mid = lo + 0.5L * (hi - lo);
        if (mid <= lo || mid >= hi)
            break;
        if ((oracle_value(c, n, mid) > 0.0L) == up)
            hi = mid;
        else
            lo = mid;
        if (hi - lo <= 2.0L * LDBL_EPSILON * hi)
            break;
    }
    return hi;
}

/* Sign changes of c in (lo, hi), ascending: between those of the derivative it is monotone. */
static inline int oracle_roots(const long double *c, int n, long double lo, long double hi,
                               long double *x)
{
    while (n > 0 && c[n] == 0.0L)
        n--;
    if (n == 0)
        return 0;
    long double d[5] = {0.0L}, cut[6];
    for (int k = 1; k <= n; k++)
        d[k - 1] = k * c[k];
    int cuts = oracle_roots(d, n - 1, lo, hi, cut), found = 0;
    cut[cuts] = hi;
    for (int i = 0; i <= cuts; i++) {
        long double a = i ? cut[i - 1] : lo, fa = oracle_value(c, n, a),
                    fb = oracle_value(c, n, cut[i]);
        if ((fa < 0.0L && fb > 0.0L) || (fa > 0.0L && fb < 0.0L))
            x[found++] = oracle_bisect(c, n, a, cut[i]);
        else if (fb == 0.0L && cut[i] < hi)
            x[found++] = cut[i];
    }
    return found;
}

static inline long double oracle_reach(const long double *c, int n)
{
    while (n > 0 && c[n] == 0.0L)
        n--;
    long double reach = 0.0L;
    for (int k = 0; k < n; k++)
        reach = fmaxl(reach, powl(fabsl(c[k] / c[n]), 1.0L / (n - k)));
    return 2.5L * reach;
}

static inline struct oracle_answer oracle_first_rise(const struct rise_case *q)
{
    long double c[5] = {0.0L}, cut[6];
    int n = q->at_root ? 3 : 4, zero = q->at_root;
    for (int k = 0; k <= n; k++)
        c[k] = q->c[k + zero];
    for (int i = 0; i < 5 && c[0] == 0.0L; i++, zero = 1)
        for (int k = 0; k < 4; k++)
            c[k] = c[k + 1], c[k + 1] = 0.0L;
    struct oracle_answer none = {(double)INFINITY, 0.0L, 0.0L, false};
    if (c[0] > 0.0L && zero)
        return (struct oracle_answer){0.0, 0.0L, 0.0L, false};
    long double end = fminl(q->t_end, oracle_reach(c, 4)),
                d[4] = {c[1], 2 * c[2], 3 * c[3], 4 * c[4]};
    int cuts = oracle_roots(d, 3, 0.0L, end, cut + 1);
    cut[0] = 0.0L;
    cut[cuts + 1] = end;
    for (int i = 0; i <= cuts; i++) {
        long double a = cut[i], b = cut[i + 1], fa = oracle_value(c, 4, a),
                    fb = oracle_value(c, 4, b);
        if (fb <= fa)
            continue;
        none.close_call = none.close_call || fabsl(fb) <= oracle_noise(c, 4, b) ||
                          (a > 0.0L && fabsl(fa) <= oracle_noise(c, 4, a));
        if (fa >= 0.0L)
            return (struct oracle_answer){(double)a, a, b, none.close_call};
        if (fb >= 0.0L)
            return (struct oracle_answer){(double)oracle_bisect(c, 4, a, b), a, b, none.close_call};
    }
    return none;
}

#endif
