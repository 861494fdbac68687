/* Real roots of a quadratic, accurate to the last bits. The first root is the one whose terms have
 * equal signs; the other follows from the product of the roots. If the discriminant cancels, it is
 * computed with exact products (Kahan 2004, "On the cost of floating-point computation without
 * extra-precise arithmetic"), so that its sign is right and a double root is found as one root.
 * Numbers that are too large or too small to be squared are treated by their exponents. */
#include "millsim/poly.h"

#include <math.h>

/* Numbers that can be squared without leaving the range of doubles */
static bool is_tame(double x)
{
    double m = fabs(x);
    return m == 0.0 || (m > 1e-70 && m < 1e70);
}

static double discriminant(double a, double b, double c)
{
    double bb = b * b, ac = a * c, d = bb - ac;
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

/* Uses a, b, c as mantissas and exponents: with a = ma 2^ea and so on, all terms are divided by the
 * power k of the larger of b^2 and ac. The exponents are added to the roots at the end. */
static int quadratic_by_exponents(double a, double b, double c, double x[2])
{
    if (c == 0.0)
        return keep_finite_ascending(0.0, -2.0 * (b / a), x);
    int ea, eb, ec;
    double ma = frexp(a, &ea), mb = frexp(b, &eb), mc = frexp(c, &ec);
    int k = (ea + ec) / 2;
    if (b != 0.0 && eb > k)
        k = eb;
    double sb = ldexp(mb, eb - k), d = discriminant(ldexp(ma, ea + ec - 2 * k), sb, mc);
    if (d < 0.0)
        return 0;
    double q = -(sb + copysign(sqrt(d), sb));
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
    double d = discriminant(a, b, c);
    if (d < 0.0)
        return 0;
    double q = -(b + copysign(sqrt(d), b));
    if (q == 0.0)
        return keep_finite_ascending(0.0, 0.0, x);
    return keep_finite_ascending(q / a, d == 0.0 ? q / a : c / q, x);
}
