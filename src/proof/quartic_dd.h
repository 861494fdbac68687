/* Double-double arithmetic: a value is the sum of two doubles, of about 106 bits. Dekker, Numer.
 * Math. 18 (1971) 224 (products); Knuth, TAOCP 2, 4.2.2 (sums); Joldes, Muller and Popescu, ACM
 * TOMS 44:15 (2017): errors below 2^-101, to nearest, without contraction, of 1e-140 to 1e290. */
#ifndef MILL_QUARTIC_DD_H
#define MILL_QUARTIC_DD_H

#include <math.h>

struct dd {
    double hi, lo;
};

static inline struct dd dd_from(double x)
{
    return (struct dd){x, 0.0};
}

/* a + b exactly; needs |a| >= |b| */
static inline struct dd dd_renormalise(double a, double b)
{
    double s = a + b;
    return (struct dd){s, b - (s - a)};
}

static inline struct dd dd_sum2(double a, double b)
{
    double s = a + b, t = s - a;
    return (struct dd){s, (a - (s - t)) + (b - t)};
}

static inline struct dd dd_product2(double a, double b)
{
    double p = a * b, x = 134217729.0 * a, y = 134217729.0 * b;
    double ah = x - (x - a), bh = y - (y - b), al = a - ah, bl = b - bh;
    return (struct dd){p, ((ah * bh - p) + ah * bl + al * bh) + al * bl};
}

static inline struct dd dd_neg(struct dd a)
{
    return (struct dd){-a.hi, -a.lo};
}

static inline struct dd dd_add(struct dd a, struct dd b)
{
    struct dd s = dd_sum2(a.hi, b.hi), t = dd_sum2(a.lo, b.lo);
    s = dd_renormalise(s.hi, s.lo + t.hi);
    return dd_renormalise(s.hi, s.lo + t.lo);
}

static inline struct dd dd_sub(struct dd a, struct dd b)
{
    return dd_add(a, dd_neg(b));
}

static inline struct dd dd_mul(struct dd a, struct dd b)
{
    struct dd p = dd_product2(a.hi, b.hi);
    return dd_renormalise(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}

static inline struct dd dd_scale(struct dd a, double power_of_two)
{
    return (struct dd){a.hi * power_of_two, a.lo * power_of_two};
}

static inline struct dd dd_div(struct dd a, struct dd b)
{
    double q1 = a.hi / b.hi;
    struct dd r = dd_sub(a, dd_mul(b, dd_from(q1)));
    double q2 = r.hi / b.hi;
    r = dd_sub(r, dd_mul(b, dd_from(q2)));
    return dd_add(dd_renormalise(q1, q2), dd_from(r.hi / b.hi));
}

static inline struct dd dd_sqrt(struct dd a)
{
    if (!(a.hi > 0.0))
        return dd_from(0.0);
    double x = sqrt(a.hi);
    struct dd r = dd_sub(a, dd_product2(x, x));
    return dd_renormalise(x, r.hi / (2.0 * x));
}

#endif
