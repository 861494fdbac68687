/* Exact signs of polynomials at doubles, and from them all sign changes: the oracle of the quartic
 * solvers, which shares nothing with them. Values are sums of long doubles that do not overlap
 * (Shewchuk, Discrete Comput. Geom. 18 (1997) 305); long double's exponents are wide enough that no
 * quartic of doubles at a double overflows or loses a bit (where they are those of double, as on
 * some machines, keep to coefficients and times between 1e-30 and 1e30). */
#ifndef FUZZ_EXACT_H
#define FUZZ_EXACT_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { EXACT_TERMS = 64 };

struct exact {
    int n;
    long double term[EXACT_TERMS]; /* ascending, not overlapping, no zeros */
};

static inline void exact_push(struct exact *e, long double x)
{
    if (x != 0.0L)
        e->term[e->n++] = x;
}

/* sum + *rest = a + b */
static inline long double exact_sum2(long double a, long double b, long double *rest)
{
    const long double s = a + b, t = s - a;
    *rest = (a - (s - t)) + (b - t);
    return s;
}

/* product + *rest = a b; Dekker's split at half the mantissa */
static inline long double exact_product2(long double a, long double b, long double *rest)
{
    const long double split = ldexpl(1.0L, (LDBL_MANT_DIG + 1) / 2) + 1.0L;
    const long double p = a * b, x = split * a, y = split * b;
    const long double ah = x - (x - a), bh = y - (y - b), al = a - ah, bl = b - bh;
    *rest = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
    return p;
}

static inline void exact_add(struct exact *e, long double x)
{
    struct exact out = {0, {0.0L}};
    for (int i = 0; i < e->n; i++) {
        long double rest;
        x = exact_sum2(x, e->term[i], &rest);
        exact_push(&out, rest);
    }
    exact_push(&out, x);
    *e = out;
}

static inline void exact_scale(struct exact *e, long double x)
{
    struct exact out = {0, {0.0L}};
    for (int i = 0; i < e->n; i++) {
        long double rest;
        const long double p = exact_product2(e->term[i], x, &rest);
        exact_add(&out, rest);
        exact_add(&out, p);
    }
    *e = out;
}

/* A polynomial c[0] + ... + c[degree] t^degree whose coefficients are exact */
struct exact_poly {
    int degree; /* -1: zero */
    long double c[5];
};

static inline struct exact_poly exact_poly_from(const double *c, int degree)
{
    struct exact_poly p = {degree, {0.0L}};
    for (int k = 0; k <= degree; k++)
        p.c[k] = c[k];
    while (p.degree >= 0 && p.c[p.degree] == 0.0L)
        p.degree--;
    return p;
}

/* Exact: a double times a small whole number fits a long double. */
static inline struct exact_poly exact_derivative(const struct exact_poly *p)
{
    struct exact_poly d = {p->degree - 1, {0.0L}};
    for (int k = 1; k <= p->degree; k++)
        d.c[k - 1] = k * p->c[k];
    if (d.degree < -1)
        d.degree = -1;
    return d;
}

/* The value, rounded, and a bound of its terms' sizes */
static inline long double exact_rounded(const struct exact_poly *p, long double t,
                                        long double *size)
{
    long double v = 0.0L;
    *size = 0.0L;
    for (int k = p->degree; k >= 0; k--) {
        v = v * t + p->c[k];
        *size = *size * fabsl(t) + fabsl(p->c[k]);
    }
    return v;
}

/* sign of p(t), exactly */
static inline int exact_sign(const struct exact_poly *p, double t)
{
    long double size;
    const long double v = exact_rounded(p, t, &size);
    if (fabsl(v) > 16.0L * LDBL_EPSILON * size)
        return v > 0.0L ? 1 : -1;
    struct exact e = {0, {0.0L}};
    for (int k = p->degree; k >= 0; k--) {
        exact_scale(&e, t);
        exact_add(&e, p->c[k]);
    }
    /* the largest term is the last, and outweighs the rest */
    return e.n == 0 ? 0 : e.term[e.n - 1] > 0.0L ? 1 : -1;
}

/* Doubles >= 0 in their order, as whole numbers: halving intervals reaches neighbours in 64 steps
 * whatever the magnitude. */
static inline uint64_t exact_rank(double t)
{
    uint64_t bits;
    t = fabs(t); /* -0 */
    memcpy(&bits, &t, sizeof bits);
    return bits;
}

static inline double exact_ranked(uint64_t rank)
{
    double t;
    memcpy(&t, &rank, sizeof t);
    return t;
}

/* Where the sign of p goes over between lo and hi, at which it differs: the first double (from lo)
 * found to have the sign that hi has, or zero. */
static inline double exact_cross(const struct exact_poly *p, double lo, double hi)
{
    const int from = exact_sign(p, lo);
    uint64_t a = exact_rank(lo), b = exact_rank(hi);
    while (b - a > 1) {
        const uint64_t mid = a + (b - a) / 2;
        if (exact_sign(p, exact_ranked(mid)) == from)
            a = mid;
        else
            b = mid;
    }
    return exact_ranked(b);
}

/* Ascending doubles in (lo, hi) that part it into pieces in which p is monotone but for the last
 * bit: each is the upper end of the interval between neighbouring doubles that holds a turning
 * point, so p may turn within one unit in the last place below it. Turning points that leave no
 * sign change behind (p' touches zero) are no turning points. lo >= 0. */
static inline int exact_turns(const struct exact_poly *p, double lo, double hi, double turn[4])
{
    const struct exact_poly d = exact_derivative(p);
    double cut[6];
    int n = 0;
    if (d.degree < 1)
        return 0;
    cut[0] = lo;
    const int cuts = 1 + exact_turns(&d, lo, hi, cut + 1);
    cut[cuts] = hi;
    for (int i = 0; i < cuts; i++) {
        const int a = exact_sign(&d, cut[i]), b = exact_sign(&d, cut[i + 1]);
        if (a * b < 0)
            turn[n++] = exact_cross(&d, cut[i], cut[i + 1]);
        else if (b == 0 && cut[i + 1] < hi)
            turn[n++] = cut[i + 1];
    }
    return n;
}

#endif
