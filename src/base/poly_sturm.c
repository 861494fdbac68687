/* The number of real roots in an interval, and with it the first rise with certainty.
 *
 * Sturm's theorem: the number of distinct roots in (lo, hi] is the decrease of the number of sign
 * changes in the chain p, p', -(p mod p'), ... from lo to hi. Remainders are computed without
 * division, as positive multiples. The numbers have enough bits to be exact for all but absurd
 * coefficients, so that counts, multiple roots and signs are those of the given doubles. A zero
 * takes the sign just to its right: so the count is also right at multiple roots, in (lo, hi]. */
#include "millsim/poly.h"

#include <assert.h>
#include <float.h>
#include <math.h>

#include "base/poly_wide.h"

struct poly {
    int degree;
    struct wide c[5];
};

struct chain {
    int length;
    struct poly p[5];
};

static void drop_leading_zeros(struct poly *p)
{
    while (p->degree >= 0 && wide_sign(p->c[p->degree]) == 0)
        p->degree--;
}

static struct poly poly_from(const double *c, int degree)
{
    struct poly p = {.degree = degree};
    for (int k = 0; k <= degree; k++)
        p.c[k] = wide_from(c[k]);
    drop_leading_zeros(&p);
    return p;
}

static struct poly derivative(const struct poly *p)
{
    struct poly d = {.degree = p->degree - 1};
    for (int k = 1; k <= p->degree; k++)
        d.c[k - 1] = wide_product(wide_from(k), p->c[k]);
    return d;
}

/* n p - x p': divided by p' it has the same remainder as n p, but its degree is lower by one */
static struct poly shortened(const struct poly *p)
{
    struct poly e = {.degree = p->degree - 1};
    for (int k = 0; k <= e.degree; k++)
        e.c[k] = wide_product(wide_from(p->degree - k), p->c[k]);
    drop_leading_zeros(&e);
    return e;
}

/* -(a mod b) times a positive number: a <- |lead b| a - (+-lead a) x^k b until a's degree is low */
static struct poly negative_rest(struct poly a, const struct poly *b)
{
    struct wide scale = b->c[b->degree];
    const int sign = scale.sign;
    scale.sign = 1;
    while (a.degree >= b->degree) {
        const int shift = a.degree - b->degree;
        struct wide lead = a.c[a.degree--];
        lead.sign *= -sign;
        for (int k = 0; k <= a.degree; k++) {
            a.c[k] = wide_product(scale, a.c[k]);
            if (k >= shift)
                a.c[k] = wide_sum(a.c[k], wide_product(lead, b->c[k - shift]));
        }
        drop_leading_zeros(&a);
    }
    for (int k = 0; k <= a.degree; k++)
        a.c[k].sign *= -1;
    return a;
}

static void chain_of(const struct poly *p, struct chain *s)
{
    s->p[0] = *p;
    s->p[1] = derivative(p);
    for (s->length = p->degree < 1 ? 1 : 2; s->p[s->length - 1].degree > 0; s->length++) {
        struct poly *rest = &s->p[s->length];
        *rest = negative_rest(s->length == 2 ? shortened(p) : rest[-2], &rest[-1]);
        if (rest->degree < 0)
            return;
    }
}

static struct wide value(const struct poly *p, double x)
{
    const struct wide at = wide_from(x);
    struct wide v = p->c[p->degree];
    for (int k = p->degree - 1; k >= 0; k--)
        v = wide_sum(wide_product(v, at), p->c[k]);
    return v;
}

static int sign_at(const struct poly *p, double x)
{
    if (p->degree < 0)
        return 0;
    if (isinf(x)) {
        const int lead = wide_sign(p->c[p->degree]);
        return x < 0.0 && (p->degree & 1) ? -lead : lead;
    }
    return wide_sign(value(p, x));
}

/* sign of p just to the right of x */
static int sign_after(const struct poly *p, double x)
{
    int sign = sign_at(p, x);
    struct poly d = *p;
    while (sign == 0 && d.degree > 0) {
        d = derivative(&d);
        sign = sign_at(&d, x);
    }
    return sign;
}

static int sign_changes(const struct chain *s, double x)
{
    int changes = 0, last = 0;
    for (int i = 0; i < s->length; i++) {
        int sign = sign_after(&s->p[i], x);
        changes += sign * last < 0;
        last = sign != 0 ? sign : last;
    }
    return changes;
}

int mill_poly_sturm_count(const double *c, int degree, double lo, double hi)
{
    assert(degree >= 0 && degree <= 4);
    const struct poly p = poly_from(c, degree);
    struct chain s;
    chain_of(&p, &s);
    return lo < hi ? sign_changes(&s, lo) - sign_changes(&s, hi) : 0;
}

/* A point between lo and hi, 0 <= lo < hi: in the middle, of the exponents if they differ */
static double middle(double lo, double hi)
{
    if (isinf(hi))
        return fmax(2.0, lo < 1e150 ? lo * lo : DBL_MAX);
    if (lo == 0.0)
        return hi > 1.0 ? 1.0 : hi < 1e-150 ? 0.5 * hi : hi * hi * 0x1p-8;
    return hi > 16.0 * lo ? sqrt(lo) * sqrt(hi) : lo + 0.5 * (hi - lo);
}

/* The end of an interval that begins at lo and contains only the first of the roots in (lo, hi]; lo
 * may be increased. from and to are the sign changes at lo and hi. */
static double isolate(const struct chain *s, double *lo, double hi, int from, int to)
{
    while (from - to > 1) {
        double mid = middle(*lo, hi);
        if (!(mid > *lo && mid < hi))
            break;
        int changes = sign_changes(s, mid);
        if (changes < from) {
            hi = mid;
            to = changes;
        } else {
            *lo = mid;
        }
    }
    return hi;
}

/* a / b, also if a or b is outside of the range of doubles */
static double ratio(struct wide a, struct wide b)
{
    const int shift = wide_top(a) - wide_top(b);
    a.exponent = -a.size;
    b.exponent = -b.size;
    return ldexp(wide_to_double(a) / wide_to_double(b), 32 * shift);
}

/* The only root of p in (lo, hi], at which p becomes positive: Newton's method with exact values,
 * and bisection if a step leaves the bracket or does not shrink. hi may be INFINITY. */
static double refine(const struct poly *p, double lo, double hi)
{
    const struct poly slope = derivative(p);
    double x = middle(lo, hi), last = INFINITY;
    while (x > lo && x < hi) {
        const struct wide v = value(p, x);
        if (wide_sign(v) == 0)
            return x;
        if (wide_sign(v) < 0)
            lo = x;
        else
            hi = x;
        double step = ratio(v, value(&slope, x)), next = x - step;
        if (fabs(step) <= 0.5 * DBL_EPSILON * x && next >= lo && next <= hi)
            return next;
        if (!(next > lo && next < hi && fabs(step) <= 0.5 * last)) {
            next = middle(lo, hi);
            step = hi - lo;
        }
        last = fabs(step);
        x = next;
    }
    return hi;
}

/* First x in (lo, hi] at which p, negative just after lo, becomes positive */
static double first_up(const struct poly *p, double lo, double hi)
{
    struct chain s;
    chain_of(p, &s);
    int from = sign_changes(&s, lo), to = sign_changes(&s, hi);
    while (from > to) {
        double end = isolate(&s, &lo, hi, from, to);
        if (sign_after(p, end) > 0)
            return refine(p, lo, end);
        lo = end;
        from = sign_changes(&s, lo);
    }
    return INFINITY;
}

double mill_poly_sturm_rise(const double f[5], double t_end)
{
    const struct poly p = poly_from(f, 4), slope = derivative(&p);
    double from = 0.0;
    if (f[0] > 0.0) {
        from = first_up(&slope, 0.0, t_end);
        if (isinf(from) || sign_at(&p, from) >= 0)
            return from;
    }
    return first_up(&p, from, t_end);
}
