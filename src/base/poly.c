/* Real roots of a quadratic to the last bits, and the second opinion on a quartic's first rise.
 * The root whose terms have equal signs comes first, the other from the product of the roots; the
 * discriminant is formed with exact products where it cancels (Kahan 2004, "On the cost of
 * floating-point computation without extra-precise arithmetic"), so its sign is right and a double
 * root is seen as one. Numbers too large or small to be squared are handled by their exponents. */
#include "millsim/poly.h"

#include <math.h>

/* x can be squared, and what rounding leaves of that, without leaving the range of doubles */
static bool is_tame(double x)
{
    const double m = fabs(x);
    return m == 0.0 || (m > 1e-70 && m < 1e70);
}

static double discriminant(double a, double b, double c)
{
    const double bb = b * b, ac = a * c, d = bb - ac;
    if (3.0 * fabs(d) >= bb + fabs(ac))
        return d;
    return d + (fma(b, b, -bb) - fma(a, c, -ac));
}

static int keep_finite_ascending(double x0, double x1, double x[2])
{
    int n = 0;
    if (isfinite(x0))
        x[n++] = x0;
    if (isfinite(x1) && !(n == 1 && x1 == x0))
        x[n++] = x1;
    if (n == 2 && x[0] > x[1]) {
        x[0] = x1;
        x[1] = x0;
    }
    return n;
}

/* a, b, c as mantissas and exponents: with a = ma 2^ea and so on, everything is divided by the
 * power k of the larger of b^2 and ac, and the roots are put together by their exponents. */
static int quadratic_by_exponents(double a, double b, double c, double x[2])
{
    if (c == 0.0)
        return keep_finite_ascending(0.0, -2.0 * (b / a), x);
    int ea, eb, ec;
    const double ma = frexp(a, &ea), mb = frexp(b, &eb), mc = frexp(c, &ec);
    const int half = (ea + ec) / 2, k = b != 0.0 && eb > half ? eb : half;
    const double sb = ldexp(mb, eb - k), d = discriminant(ldexp(ma, ea + ec - 2 * k), sb, mc);
    if (d < 0.0)
        return 0;
    const double q = -(sb + copysign(sqrt(d), sb));
    return keep_finite_ascending(ldexp(q / ma, k - ea), ldexp(mc / q, ec - k), x);
}

int mill_poly_quadratic(double a, double b, double c, double x[2])
{
    if (a == 0.0) {
        if (b == 0.0)
            return 0;
        x[0] = -0.5 * (c / b);
        return isfinite(x[0]) ? 1 : 0;
    }
    if (!is_tame(a) || !is_tame(b) || !is_tame(c))
        return quadratic_by_exponents(a, b, c, x);
    const double d = discriminant(a, b, c);
    if (d < 0.0)
        return 0;
    const double q = -(b + copysign(sqrt(d), b));
    if (q == 0.0)
        return keep_finite_ascending(0.0, 0.0, x);
    return keep_finite_ascending(q / a, d == 0.0 ? q / a : c / q, x);
}

/* p(t), t >= 0, as a share of the sum of its terms' sizes */
static double share_at(const double *p, int degree, double t)
{
    double value = 0.0, terms = 0.0;
    for (int k = degree; k >= 0; k--) {
        value = value * t + p[k];
        terms = terms * t + fabs(p[k]);
    }
    return value / terms;
}

/* Where p turns within (0, end), ascending: between two turns of its slope this passes zero at most
 * once, which halving finds. */
static int turns(const double *p, int degree, double end, double *x)
{
    double slope[4], bound[5] = {0.0};
    int found = 0;
    if (degree < 2)
        return 0;
    for (int k = 1; k <= degree; k++)
        slope[k - 1] = k * p[k];
    const int pieces = turns(slope, degree - 1, end, bound + 1) + 1;
    bound[pieces] = end;
    for (int i = 0; i < pieces; i++) {
        double lo = bound[i], hi = bound[i + 1];
        const bool rises = share_at(slope, degree - 1, hi) > 0.0;
        if ((share_at(slope, degree - 1, lo) > 0.0) == rises)
            continue;
        for (double mid = 0.5 * (lo + hi); mid > lo && mid < hi; mid = 0.5 * (lo + hi)) {
            if ((share_at(slope, degree - 1, mid) > 0.0) == rises)
                hi = mid;
            else
                lo = mid;
        }
        x[found++] = hi;
    }
    return found;
}

bool mill_poly_agrees(const double c[5], double t_end, bool at_root, double t)
{
    const double allowed = 1e-9, end = t < t_end ? t : t_end;
    const double p[5] = {at_root ? 0.0 : c[0], c[1], c[2], c[3], c[4]};
    double highest[4];
    /* what begins above zero may stay there until it rises */
    if (p[0] > 0.0 || (p[0] == 0.0 && p[1] >= 0.0) || !(end < HUGE_VAL))
        return true;
    const int n = turns(p, 4, end, highest);
    highest[n] = end;
    for (int i = 0; i <= n; i++)
        if (share_at(p, 4, highest[i]) > allowed)
            return false;
    return t > t_end || !(share_at(p, 4, t) < -allowed);
}
