/* Each function reduces its argument to a small interval and sums the Taylor series there, up to
 * the last that changes a double. Angles are reduced by a multiple of pi/2 in three parts, exactly
 * for two of them (Cody & Waite, Software Manual for the Elementary Functions, 1980). */
#include "base/elementary.h"

#include "millsim/vec3.h"

#include <assert.h>
#include <stdbool.h>
#include <stdint.h>

/* pi/2 to 118 bits: 33, 33 and the rest */
static const double half_pi[3] = {0x1.921fb544p+0, 0x1.0b4611a6p-34, 0x1.3198a2e037073p-69};
static const double ln2[2] = {0x1.62e42feep-1, 0x1.a39ef35793c76p-33}; /* 32 bits and the rest */

/* The nearest whole number, |x| < 2^51: the sum x + shift has no bits for a fraction. */
static double nearest(double x)
{
    const double shift = 0x1.8p52;
    return x + shift - shift;
}

struct mill_heading mill_elementary_heading(double angle)
{
    if (!(fabs(angle) < 1e6))
        angle = fmod(angle, 2.0 * MILL_PI);
    const double k = nearest(angle * (2.0 / MILL_PI));
    const double part = angle - k * half_pi[0], less = k * half_pi[1];
    const double near = part - less, back = part - near;
    const double far = (part - (near + back)) + (back - less) - k * half_pi[2];
    const double a = near + far, rest = (near - a) + far; /* the reduced angle is a + rest */
    const double z = a * a;
    const double s3 = -1.0 / 6.0, s5 = 1.0 / 120.0, s7 = -1.0 / 5040.0, s9 = 1.0 / 362880.0,
                 s11 = -1.0 / 39916800.0, s13 = 1.0 / 6227020800.0, s15 = -1.0 / 1307674368e3,
                 s17 = 1.0 / 355687428096e3;
    const double c4 = 1.0 / 24.0, c6 = -1.0 / 720.0, c8 = 1.0 / 40320.0, c10 = -1.0 / 3628800.0,
                 c12 = 1.0 / 479001600.0, c14 = -1.0 / 87178291200.0, c16 = 1.0 / 20922789888e3;
    const double odd =
        s3 + z * (s5 + z * (s7 + z * (s9 + z * (s11 + z * (s13 + z * (s15 + z * s17))))));
    const double even = c4 + z * (c6 + z * (c8 + z * (c10 + z * (c12 + z * (c14 + z * c16)))));
    const double half = 0.5 * z, most = 1.0 - half;
    const double sine = a + (a * z * odd + rest * most);
    const double cosine = most + (((1.0 - most) - half) + (z * z * even - a * rest));
    /* exchange of sine and cosine by quarter turns, without a branch */
    static const double of_cos[4] = {1.0, -1.0, -1.0, 1.0}, of_sin[4] = {1.0, 1.0, -1.0, -1.0};
    const double both[2] = {cosine, sine};
    const int quarter = (int)((int64_t)k & 3), swap = quarter & 1;
    return (struct mill_heading){of_cos[quarter] * both[swap], of_sin[quarter] * both[1 - swap]};
}

/* 0 <= t <= 1 */
static double arc_tangent(double t)
{
    const bool large = t > 0.41421356237309503; /* tan(pi/8) */
    const double u = large ? (t - 1.0) / (t + 1.0) : t, z = u * u;
    double sum = 0.0;
    for (int k = 22; k > 0; k--)
        sum = 1.0 / (2 * k + 1) - z * sum;
    return (large ? 0.25 * MILL_PI : 0.0) + (u - u * z * sum);
}

double mill_elementary_atan2(double y, double x)
{
    const double across = fabs(y), along = fabs(x);
    if (across == 0.0 && along == 0.0)
        return 0.0;
    double angle =
        across <= along ? arc_tangent(across / along) : 0.5 * MILL_PI - arc_tangent(along / across);
    if (x < 0.0)
        angle = MILL_PI - angle;
    return y < 0.0 ? -angle : angle;
}

double mill_elementary_asin(double s)
{
    assert(s >= -1.0 && s <= 1.0);
    return mill_elementary_atan2(s, sqrt((1.0 - s) * (1.0 + s)));
}

double mill_elementary_cbrt(double x)
{
    assert(x > 0.0);
    int e;
    double m = frexp(x, &e); /* 1/2 <= m < 1 */
    for (; e % 3 != 0; e++)
        m *= 0.5;
    double root = 0.4 + 0.6 * m; /* each step of Newton's method doubles the correct digits */
    for (int k = 0; k < 7; k++)
        root -= (root - m / (root * root)) / 3.0;
    return ldexp(root, e / 3);
}

double mill_elementary_root5(double x)
{
    assert(x > 0.0);
    int e;
    double m = frexp(x, &e);
    for (; e % 5 != 0; e++)
        m *= 0.5;
    double root = 1.0; /* 1/32 <= m < 1, so Newton's method converges from above */
    for (int k = 0; k < 10; k++)
        root -= (root - m / (root * root * (root * root))) / 5.0;
    return ldexp(root, e / 5);
}

double mill_elementary_exp(double x)
{
    assert(fabs(x) <= 700.0);
    const double k = nearest(x / (ln2[0] + ln2[1])), a = x - k * ln2[0], less = k * ln2[1];
    const double y = a - less, rest = (a - y) - less;
    double sum = 1.0;
    for (int n = 15; n > 1; n--)
        sum = 1.0 + sum * y / n;
    return ldexp(1.0 + (y * sum + rest), (int)k);
}
