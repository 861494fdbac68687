/* When does a gap first close? The first rise of a quartic through zero, fast and with certainty.
 *
 * A bound from the signs of the coefficients shows for most search intervals that there is no rise.
 * In almost all others the curvature does not change its sign, and the value at the end decides.
 * The rest is divided where the curvature changes its sign (closed form). On a convex piece the
 * values at the ends decide. On a concave piece that is negative at both ends, the tangents bound
 * the polynomial from above. They are moved towards each other until they meet below zero (no
 * contact) or a positive value is found (contact). Then a bracket contains one root. The search for
 * it starts from the local parabola and uses safeguarded Newton steps of third order (Chebyshev).
 *
 * Every decision is compared with a bound of the rounding error (Higham, Accuracy and Stability of
 * Numerical Algorithms, 2nd ed., eq. 5.3). Decisions below it are left to poly_sturm.c. */
#include <assert.h>
#include <float.h>
#include <math.h>

#include "millsim/poly.h"
#include "millsim/vec3.h"

/* Horner's rule with derivative needs 5 eps; the rest covers a curvature rounded to zero. */
#define ROUNDING (16.0 * DBL_EPSILON)
/* Limits of squares in the range of doubles. UNDERFLOW_ERROR: products that underflow, times t^4 */
#define LARGEST_COEFFICIENT 1e60
#define LONGEST_WINDOW 1e20
#define UNDERFLOW_ERROR 1e-240
#define MOST_PROBES 16

enum verdict { NONE, FOUND, UNSURE };

/* Value and slope at t with bounds on their rounding errors */
struct sample {
    double t, p, slope, p_error, slope_error;
};

static inline double value_at(const double f[5], double t)
{
    return (((f[4] * t + f[3]) * t + f[2]) * t + f[1]) * t + f[0];
}

static inline double slope_at(const double f[5], double t)
{
    return ((4.0 * f[4] * t + 3.0 * f[3]) * t + 2.0 * f[2]) * t + f[1];
}

/* Sum of the magnitudes of the terms that depend on t; t >= 0 */
static inline double size_at(const double f[5], double t)
{
    return (((fabs(f[4]) * t + fabs(f[3])) * t + fabs(f[2])) * t + fabs(f[1])) * t;
}

static struct sample sample_at(const double f[5], double t)
{
    const double slopes =
        ((4.0 * fabs(f[4]) * t + 3.0 * fabs(f[3])) * t + 2.0 * fabs(f[2])) * t + fabs(f[1]);
    return (struct sample){t, value_at(f, t), slope_at(f, t),
                           ROUNDING * (size_at(f, t) + fabs(f[0])) + UNDERFLOW_ERROR,
                           ROUNDING * slopes + UNDERFLOW_ERROR};
}

/* half the second derivative */
static double curvature(const double f[5], double t)
{
    return (6.0 * f[4] * t + 3.0 * f[3]) * t + f[2];
}

/* Zeros of the curvature in (lo, hi), ascending. Usually its three Bernstein coefficients over the
 * interval have one sign, which saves the square root. */
static int inflections(const double f[5], double lo, double hi, double x[2])
{
    double first = curvature(f, lo), last = curvature(f, hi);
    double middle = first + (6.0 * f[4] * lo + 1.5 * f[3]) * (hi - lo);
    if ((first >= 0.0 && middle >= 0.0 && last >= 0.0) ||
        (first <= 0.0 && middle <= 0.0 && last <= 0.0))
        return 0;
    double all[2];
    int found = mill_poly_quadratic(6.0 * f[4], 1.5 * f[3], f[2], all), n = 0;
    for (int i = 0; i < found; i++)
        if (all[i] > lo && all[i] < hi)
            x[n++] = all[i];
    return n;
}

/* The only root in (lo, hi), at which f becomes positive; the curvature does not change its sign.
 * at_lo, slope_lo, bend: value, slope and half of the second derivative at lo. */
static inline double refine(const double f[5], double lo, double at_lo, double slope_lo,
                            double bend, double hi)
{
    double disc = slope_lo * slope_lo - 4.0 * bend * at_lo;
    double t = disc >= 0.0 ? lo - 2.0 * at_lo / (slope_lo + sqrt(disc)) : hi;
    if (!(t > lo && t < hi))
        t = hi;
    for (;;) {
        const double p = value_at(f, t), slope = slope_at(f, t);
        if (fabs(p) <= 0.5 * DBL_EPSILON * (size_at(f, t) + fabs(f[0])))
            return t;
        const double inverse = 1.0 / slope, newton = p * inverse;
        const double second = curvature(f, t) * inverse * newton;
        const double third = (4.0 * f[4] * t + f[3]) * inverse * newton * newton;
        const double left = fabs(newton) * (2.0 * second * second + fabs(third));
        double next = t - newton * (1.0 + second);
        if (p < 0.0)
            lo = t;
        else
            hi = t;
        if (slope > 0.0 && left <= 0.25 * DBL_EPSILON * t)
            return next < lo ? lo : next > hi ? hi : next;
        if (!(slope > 0.0 && next > lo && next < hi)) {
            next = lo + 0.5 * (hi - lo);
            if (!(next > lo && next < hi))
                return hi;
        }
        t = next;
    }
}

/* f is concave on [a.t, b.t], negative at both ends, rises at a and falls at b. Does it reach zero?
 * Not to the left of the zero of a's tangent, nor to the right of that of b's. */
static enum verdict probe(const double f[5], struct sample a, struct sample b, double *t)
{
    for (int i = 0; i < MOST_PROBES; i++) {
        double left = a.t - (a.p + a.p_error) / (a.slope + a.slope_error);
        double right = b.t - (b.p + b.p_error) / (b.slope - b.slope_error);
        if (left > right * (1.0 + 4.0 * DBL_EPSILON))
            return NONE;
        double top = a.t + (b.t - a.t) * (a.slope / (a.slope - b.slope));
        top = top < left ? left : top > right ? right : top;
        if (!(top > a.t && top < b.t))
            return UNSURE;
        struct sample s = sample_at(f, top);
        if (s.p > s.p_error) {
            *t = refine(f, a.t, a.p, a.slope, curvature(f, a.t), s.t);
            return FOUND;
        }
        if (s.p >= -s.p_error)
            return UNSURE;
        if (fabs(s.slope) <= s.slope_error)
            return s.p + s.p_error + 2.0 * s.slope_error * (b.t - a.t) < 0.0 ? NONE : UNSURE;
        if (s.slope > 0.0)
            a = s;
        else
            b = s;
    }
    return UNSURE;
}

/* Searches one piece without inflection, where f is certainly negative at a. */
static enum verdict search_piece(const double f[5], const struct sample *a, const struct sample *b,
                                 double *t)
{
    if (b->p > b->p_error) {
        *t = refine(f, a->t, a->p, a->slope, curvature(f, a->t), b->t);
        return FOUND;
    }
    if (b->p >= -b->p_error)
        return UNSURE;
    if (curvature(f, a->t + 0.5 * (b->t - a->t)) >= 0.0 || b->slope > b->slope_error)
        return NONE;
    if (a->slope < -a->slope_error || (a->t == 0.0 && a->slope <= 0.0))
        return NONE;
    return b->slope < -b->slope_error ? probe(f, *a, *b, t) : UNSURE;
}

/* The usual case: f is negative at 0 and its curvature does not change its sign in the interval, so
 * that the value at the end decides. UNSURE: use the general search. */
static inline enum verdict plain_rise(const double f[5], double hi, double *t)
{
    double bend = f[2], middle = f[2] + 1.5 * f[3] * hi, last = curvature(f, hi);
    bool convex = bend >= 0.0 && middle >= 0.0 && last >= 0.0;
    if (!convex && !(bend <= 0.0 && middle <= 0.0 && last <= 0.0))
        return UNSURE;
    const double p = value_at(f, hi);
    const double error = ROUNDING * (size_at(f, hi) - f[0]) + UNDERFLOW_ERROR;
    if (p > error) {
        *t = refine(f, 0.0, f[0], f[1], bend, hi);
        return FOUND;
    }
    return convex && p < -error ? NONE : UNSURE;
}

/* First t in (lo, hi] at which f, negative at lo, becomes positive */
static enum verdict first_up(const double f[5], double lo, double hi, double *t)
{
    double x[3];
    int n = inflections(f, lo, hi, x);
    x[n++] = hi;
    struct sample a = sample_at(f, lo);
    if (!(a.p < -a.p_error))
        return UNSURE;
    for (int i = 0; i < n; i++) {
        struct sample b = sample_at(f, x[i]);
        enum verdict v = search_piece(f, &a, &b, t);
        if (v != NONE)
            return v;
        a = b;
    }
    return NONE;
}

/* For f positive and falling at 0: its first minimum if not below zero, else the rise after it */
static enum verdict wait_for_rise(const double f[5], double hi, double *t)
{
    double slope[6] = {f[1], 2.0 * f[2], 3.0 * f[3], 4.0 * f[4], 0.0, 0.0};
    while (slope[0] == 0.0)
        for (int k = 0; k < 5; k++)
            slope[k] = slope[k + 1];
    enum verdict v = first_up(slope, 0.0, hi, t);
    if (v != FOUND)
        return v;
    struct sample lowest = sample_at(f, *t);
    if (lowest.p > lowest.p_error)
        return FOUND;
    return lowest.p < -lowest.p_error ? first_up(f, *t, hi, t) : UNSURE;
}

static bool is_tame(const double f[5], double t_end)
{
    double sum = fabs(f[0]) + fabs(f[1]) + fabs(f[2]) + fabs(f[3]) + fabs(f[4]);
    return sum <= LARGEST_COEFFICIENT && t_end <= LONGEST_WINDOW;
}

/* Is an upper bound of f over [0, t_end] below zero? It is the sum, at t_end, of all terms that can
 * raise f. Its margin covers nine rounding errors of positive terms, half an eps each. */
static bool stays_below(const double f[5], double t_end)
{
    double rise = mill_greatest(f[3], 0.0) + t_end * mill_greatest(f[4], 0.0);
    rise = t_end * (mill_greatest(f[1], 0.0) + t_end * (mill_greatest(f[2], 0.0) + t_end * rise));
    return rise * (1.0 + 16.0 * DBL_EPSILON) + UNDERFLOW_ERROR < -f[0];
}

/* sign of the first coefficient from f[1] on that is not zero */
static int direction(const double f[5])
{
    for (int k = 1; k < 5; k++)
        if (f[k] != 0.0)
            return f[k] > 0.0 ? 1 : -1;
    return 0;
}

/* The general search: for a polynomial that is positive or near zero at 0 or at the end, or whose
 * curvature changes its sign. It is only used if the value at the end could not decide. */
static double search(const double c[5], double t_end, bool at_root, struct mill_poly_counts *counts)
{
    double f[6] = {c[0], c[1], c[2], c[3], at_root ? 0.0 : c[4], 0.0};
    bool at_zero = at_root;
    for (int zeros = 0; f[0] == 0.0; zeros++) {
        if (zeros == 5)
            return INFINITY;
        at_zero = true;
        for (int k = 0; k < 5; k++)
            f[k] = f[k + 1];
    }
    if (f[0] > 0.0 && (at_zero || direction(f) > 0))
        return 0.0;
    if (t_end == 0.0 || direction(f) == 0)
        return INFINITY;
    if (counts)
        counts->solves++;
    double t = INFINITY;
    enum verdict v = UNSURE;
    if (is_tame(f, t_end))
        v = f[0] > 0.0 ? wait_for_rise(f, t_end, &t) : first_up(f, 0.0, t_end, &t);
    if (v != UNSURE)
        return v == FOUND ? t : (double)INFINITY;
    if (counts)
        counts->fallbacks++;
    return mill_poly_sturm_rise(f, t_end);
}

static double first_rise(const double c[5], double t_end, bool at_root,
                         struct mill_poly_counts *counts)
{
    const double *from = at_root ? c + 1 : c;
    const double f[5] = {from[0], from[1], from[2], from[3], at_root ? 0.0 : c[4]};
    if (stays_below(f, t_end) || !(t_end >= 0.0))
        return INFINITY;
    if (!(f[0] < -2.0 * UNDERFLOW_ERROR && is_tame(f, t_end)))
        return search(from, t_end, at_root, counts);
    double t;
    enum verdict v = plain_rise(f, t_end, &t);
    if (v == UNSURE)
        return search(from, t_end, at_root, counts);
    if (counts)
        counts->solves++;
    return v == FOUND ? t : (double)INFINITY;
}

double mill_poly_first_rise(const double c[5], double t_end, bool at_root,
                            struct mill_poly_counts *counts)
{
    assert(t_end >= 0.0);
    const double t = first_rise(c, t_end, at_root, counts);
    if (counts && counts->check)
        counts->check->look(counts->check, c, t_end, at_root, t);
    return t;
}
