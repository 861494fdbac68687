/* How many real roots lie in an interval, and, built on that, the first rise with certainty.
 * Sturm's theorem: the number of distinct roots in (lo, hi] is the loss of sign changes along the
 * chain p, p', -(p mod p'), ... . The chain is computed in double-double with running error bounds
 * and powers of two as scale factors; a remainder that its bound cannot tell from zero ends the
 * chain with a common divisor, which is divided out (multiple roots), so the counts also hold when
 * an endpoint is a multiple root. Roots closer than some 1e-15 of their size may count as one. */
#include "poly_sturm.h"

#include <float.h>
#include <math.h>

#include "millsim/poly.h"
#include "poly_dd.h"

/* In the scaled variable; farther out the leading coefficients rule. Its fourth power is finite. */
#define FAR 0x1p200
#define CANDIDATE_TRIES 8

struct poly {
    int degree;
    struct bounded c[5];
};

struct chain {
    int length;
    struct poly p[5];
};

/* Drops leading coefficients that may be zero and brings the largest one to about 1. */
static void normalise(struct poly *p)
{
    while (p->degree >= 0 && bounded_sign(p->c[p->degree]) == 0)
        p->degree--;
    double largest = 0.0;
    for (int k = 0; k <= p->degree; k++)
        largest = fmax(largest, fabs(p->c[k].v.hi));
    if (!(largest > 0.0 && largest <= DBL_MAX))
        return;
    double scale = ldexp(1.0, -ilogb(largest));
    for (int k = 0; k <= p->degree; k++)
        p->c[k] = bounded_scale(p->c[k], scale);
}

static struct poly derivative(const struct poly *p)
{
    struct poly d = {.degree = p->degree - 1};
    for (int k = 1; k <= p->degree; k++)
        d.c[k - 1] = bounded_mul(bounded_from(k), p->c[k]);
    return d;
}

/* a = quotient b + remainder; the remainder replaces a */
static struct poly divide(struct poly *a, const struct poly *b)
{
    struct poly quotient = {.degree = a->degree - b->degree};
    for (int k = quotient.degree; k >= 0; k--) {
        struct bounded q = bounded_div(a->c[k + b->degree], b->c[b->degree]);
        quotient.c[k] = q;
        for (int j = 0; j < b->degree; j++)
            a->c[k + j] = bounded_add(a->c[k + j], bounded_neg(bounded_mul(q, b->c[j])));
    }
    a->degree = b->degree - 1;
    return quotient;
}

static void chain_of(struct chain *s, struct poly p)
{
    for (;;) {
        normalise(&p);
        s->p[0] = p;
        s->length = 1;
        if (p.degree < 1)
            return;
        s->p[1] = derivative(&p);
        normalise(&s->p[1]);
        s->length = 2;
        while (s->p[s->length - 1].degree > 0) {
            struct poly rest = s->p[s->length - 2];
            divide(&rest, &s->p[s->length - 1]);
            for (int k = 0; k <= rest.degree; k++)
                rest.c[k] = bounded_neg(rest.c[k]);
            normalise(&rest);
            if (rest.degree < 0)
                break;
            s->p[s->length++] = rest;
        }
        const struct poly *divisor = &s->p[s->length - 1];
        if (divisor->degree == 0)
            return;
        p = divide(&p, divisor);
    }
}

static struct bounded value(const struct poly *p, double x)
{
    struct bounded v = p->c[p->degree], at = bounded_from(x);
    for (int k = p->degree - 1; k >= 0; k--)
        v = bounded_add(bounded_mul(v, at), p->c[k]);
    return v;
}

static int sign_at(const struct poly *p, double x)
{
    if (p->degree < 0)
        return 0;
    if (fabs(x) <= FAR)
        return bounded_sign(value(p, x));
    int lead = bounded_sign(p->c[p->degree]);
    return x < 0.0 && (p->degree & 1) ? -lead : lead;
}

static int sign_changes(const struct chain *s, double x)
{
    int changes = 0, last = 0;
    for (int i = 0; i < s->length; i++) {
        int sign = sign_at(&s->p[i], x);
        if (sign == 0)
            continue;
        changes += last != 0 && sign != last;
        last = sign;
    }
    return changes;
}

static int count(const struct chain *s, double lo, double hi)
{
    return sign_changes(s, lo) - sign_changes(s, hi);
}

/* Power of two for the variable: it balances the lowest and the leading term, but an interval that
 * ends nearer to zero than that becomes the unit (terms of the far roots may then underflow). */
static int variable_exponent(const double *c, int degree, double reach)
{
    int low = 0;
    while (low < degree && c[low] == 0.0)
        low++;
    int s = low == degree ? 0 : (ilogb(c[low]) - ilogb(c[degree])) / (degree - low);
    if (reach > 0.0 && reach <= DBL_MAX && ilogb(reach) < s)
        s = ilogb(reach);
    return s;
}

/* p(2^s x) up to a positive factor */
static struct poly scaled(const double *c, int degree, int s)
{
    struct poly p = {.degree = degree};
    int top = -100000;
    for (int k = 0; k <= degree; k++)
        if (c[k] != 0.0 && ilogb(c[k]) + k * s > top)
            top = ilogb(c[k]) + k * s;
    for (int k = 0; k <= degree; k++)
        p.c[k] = bounded_from(c[k] == 0.0 ? 0.0 : ldexp(c[k], k * s - top));
    return p;
}

int mill_poly_sturm_count(const double *c, int degree, double lo, double hi)
{
    while (degree >= 0 && c[degree] == 0.0)
        degree--;
    if (degree < 1 || !(lo < hi))
        return 0;
    int s = variable_exponent(c, degree, fmax(fabs(lo), fabs(hi)));
    struct chain chain;
    chain_of(&chain, scaled(c, degree, s));
    return count(&chain, ldexp(lo, -s), ldexp(hi, -s));
}

/* sign of p just to the right of x */
static int sign_after(struct poly p, double x)
{
    int sign = sign_at(&p, x);
    while (sign == 0 && p.degree > 0) {
        p = derivative(&p);
        sign = sign_at(&p, x);
    }
    return sign;
}

static double middle(double lo, double hi)
{
    if (lo == 0.0)
        return hi * 0x1p-8;
    return hi > 16.0 * lo ? sqrt(lo) * sqrt(hi) : lo + 0.5 * (hi - lo);
}

/* Ascending real parts of the closed-form roots: where to cut, never what to believe. */
static void closed_form(const struct poly *p, double at[4])
{
    double c[5] = {0.0}, im[4];
    for (int k = 0; k <= p->degree; k++)
        c[4 - p->degree + k] = p->c[k].v.hi;
    mill_poly_quartic_roots(c, at, im);
    for (int i = 1; i < 4; i++)
        for (int j = i; j > 0 && at[j] < at[j - 1]; j--) {
            double swap = at[j];
            at[j] = at[j - 1];
            at[j - 1] = swap;
        }
}

/* Between the first two candidates in (lo, hi), or halfway where they are of no help. */
static double cut(const double at[4], double lo, double hi, int tries)
{
    double first = 0.0;
    int seen = 0;
    for (int i = 0; i < 4 && tries < CANDIDATE_TRIES; i++) {
        if (!(at[i] > lo && at[i] < hi))
            continue;
        if (seen++ == 1) {
            double m = first + 0.5 * (at[i] - first);
            return m > lo && m < hi ? m : middle(lo, hi);
        }
        first = at[i];
    }
    return middle(lo, hi);
}

/* The end of an interval that begins at lo and holds the first of the roots in (lo, hi] only. */
static double isolate(const struct chain *s, const double at[4], double *lo, double hi)
{
    int tries = 0, from = sign_changes(s, *lo);
    while (from - sign_changes(s, hi) > 1) {
        double mid = cut(at, *lo, hi, tries++);
        if (!(mid > *lo && mid < hi))
            break;
        if (sign_changes(s, mid) < from)
            hi = mid;
        else
            *lo = mid;
    }
    return hi;
}

/* The one simple root of p in (lo, hi]: Newton in double-double, bisection where it strays. */
static double refine(const struct poly *p, const double at[4], double lo, double hi)
{
    struct poly slope = derivative(p);
    int before = sign_after(*p, lo);
    double x = middle(lo, hi), last = hi - lo;
    for (int i = 0; i < 4; i++)
        if (at[i] > lo && at[i] <= hi)
            x = at[i];
    for (;;) {
        struct bounded v = value(p, x);
        int sign = bounded_sign(v);
        if (sign == 0)
            return x;
        *(sign == before ? &lo : &hi) = x;
        double step = v.v.hi / value(&slope, x).v.hi, next = x - step;
        if (fabs(step) <= 0.5 * DBL_EPSILON * x && next >= lo && next <= hi)
            return next;
        if (!(next > lo && next < hi && fabs(step) <= 0.5 * last)) {
            next = middle(lo, hi);
            step = 0.5 * (hi - lo);
        }
        if (!(next > lo && next < hi))
            return hi;
        last = fabs(step);
        x = next;
    }
}

/* First place in (lo, hi] where p, negative just after lo, turns positive. */
static double first_up(const struct poly *p, double lo, double hi)
{
    struct chain s;
    double at[4];
    chain_of(&s, *p);
    if (count(&s, lo, hi) <= 0)
        return INFINITY;
    closed_form(&s.p[0], at);
    do {
        double end = isolate(&s, at, &lo, hi);
        if (sign_after(*p, end) > 0)
            return refine(&s.p[0], at, lo, end);
        lo = end;
    } while (count(&s, lo, hi) > 0);
    return INFINITY;
}

double mill_poly_sturm_rise(const double f[5], double t_end)
{
    int degree = 4;
    while (degree > 0 && f[degree] == 0.0)
        degree--;
    int s = variable_exponent(f, degree, t_end);
    struct poly p = scaled(f, degree, s);
    double end = fmin(ldexp(t_end, -s), FAR), from = 0.0;
    if (f[0] > 0.0) {
        struct poly slope = derivative(&p);
        from = first_up(&slope, 0.0, end);
        if (!(from <= end) || sign_at(&p, from) >= 0)
            return ldexp(from, s);
    }
    return ldexp(first_up(&p, from, end), s);
}
