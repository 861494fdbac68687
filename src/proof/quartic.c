/* All four roots of a quartic in closed form. The monic quartic is split into two real quadratics
 * by an LDL^T factorisation of its matrix in the basis (x^2, x, 1), which the largest real root of
 * the resolvent cubic makes singular (Orellana and De Michele, ACM TOMS 46:20, 2020; Strobach, J.
 * Comput. Appl. Math. 234, 2010).
 *
 * The factors can be computed in several ways. The program compares their residuals and refines the
 * best factors by Newton's method on the four coefficient equations. The residuals and the
 * discriminants are computed in double-double. So the roots are those of the given doubles, even if
 * the problem is ill-conditioned. If this does not converge, the program tries the same about the
 * mean of the roots (for clusters) and for 1/x (for tiny roots together with large ones). */
#include <float.h>
#include <math.h>

#include "proof/paranoid.h"
#include "proof/quartic_dd.h"

#define NEWTON_STEPS 32  /* near common roots the residual first rises and then falls slowly */
#define GOOD_START 1e-10 /* relative residual of the first factors */
#define CONVERGED 1e-28

/* x^4 + a x^3 + b x^2 + c x + d */
struct monic {
    struct dd a, b, c, d;
};

/* (x^2 + a1 x + b1)(x^2 + a2 x + b2); the first factor has the smaller roots */
struct factors {
    struct dd a1, b1, a2, b2;
};

struct residual {
    double r1, r2, r3, r4;
    double size; /* sum of all, each relative to its largest term; infinite if not a number */
};

static double relative(struct dd r, double m1, double m2, double m3)
{
    double m = fmax(fabs(m1), fmax(fabs(m2), fabs(m3)));
    return m > 0.0 ? fabs(r.hi) / m : 0.0;
}

static struct residual residual_of(const struct factors *f, const struct monic *p)
{
    struct dd aa = dd_mul(f->a1, f->a2), ab = dd_mul(f->a1, f->b2), ba = dd_mul(f->a2, f->b1);
    struct dd r1 = dd_sub(dd_add(f->a1, f->a2), p->a);
    struct dd r2 = dd_sub(dd_add(dd_add(f->b1, f->b2), aa), p->b);
    struct dd r3 = dd_sub(dd_add(ab, ba), p->c);
    struct dd r4 = dd_sub(dd_mul(f->b1, f->b2), p->d);
    double size = relative(r1, f->a1.hi, f->a2.hi, 0.0) + relative(r2, f->b1.hi, f->b2.hi, aa.hi) +
                  relative(r3, ab.hi, ba.hi, 0.0) + relative(r4, p->d.hi, 0.0, 0.0);
    return (struct residual){r1.hi, r2.hi, r3.hi, r4.hi, isnan(size) ? HUGE_VAL : size};
}

/* Factors with linear terms a/2 -+ s and constants m -+ w. A term that cancels is computed from the
 * product, and from the coefficient equation with the smallest residual. */
static void consider(const struct monic *p, double s, double m, double w, struct factors *best,
                     double *size)
{
    if (fabs(m - w) > fabs(m + w)) { /* the factors change places */
        s = -s;
        w = -w;
    }
    double b = p->b.hi, c = p->c.hi;
    double a1 = 0.5 * p->a.hi - s, a2 = 0.5 * p->a.hi + s, b1 = m - w, b2 = m + w;
    if (b2 != 0.0)
        b1 = p->d.hi / b2;
    bool first = fabs(a1) < fabs(a2);
    double large = first ? a2 : a1, small[3] = {first ? a1 : a2};
    double beside_small = first ? b2 : b1, beside_large = first ? b1 : b2;
    small[1] = large != 0.0 ? (b - b1 - b2) / large : small[0];
    small[2] = beside_small != 0.0 ? (c - large * beside_large) / beside_small : small[0];
    for (int i = 0; i < 3; i++) {
        a1 = first ? small[i] : large;
        a2 = first ? large : small[i];
        double trial = relative(dd_from(a1 + a2 - p->a.hi), a1, a2, p->a.hi) +
                       relative(dd_from(b1 + b2 + a1 * a2 - b), b1, b2, b) +
                       relative(dd_from(a1 * b2 + a2 * b1 - c), a1 * b2, a2 * b1, c) +
                       relative(dd_from(b1 * b2 - p->d.hi), 0.0, 0.0, p->d.hi);
        if (trial < *size) {
            *size = trial;
            *best = (struct factors){dd_from(a1), dd_from(b1), dd_from(a2), dd_from(b2)};
        }
    }
}

/* All ways to compute the factors from the resolvent root phi */
static void consider_root(const struct monic *p, double phi, struct factors *best, double *size)
{
    double a = p->a.hi, b = p->b.hi, c = p->c.hi, d = p->d.hi;
    double m = b / 6.0 + 0.5 * phi, cross = 0.5 * (a * m - c);
    double s = sqrt(fmax(phi - b / 1.5 + 0.25 * a * a, 0.0)), w = sqrt(fmax(m * m - d, 0.0));
    consider(p, s, m, s > 0.0 ? cross / s : 0.0, best, size);
    consider(p, w > 0.0 ? cross / w : 0.0, m, w, best, size);
    consider(p, s, m, copysign(w, cross), best, size);
}

/* One Newton step for the four coefficient equations; false if the Jacobian is singular */
static bool correct(struct factors *f, const struct residual *r)
{
    double a1 = f->a1.hi, b1 = f->b1.hi, da = a1 - f->a2.hi, db = f->b2.hi - b1;
    double h = a1 * r->r1 - r->r2, m11 = db + a1 * da, m21 = b1 * da;
    double y1 = b1 * r->r1 - r->r3 - a1 * h, y2 = -r->r4 - b1 * h;
    double det = m11 * db + m21 * da;
    if (!(fabs(det) > 0.0 && fabs(det) <= DBL_MAX))
        return false;
    double u = (y1 * db + y2 * da) / det, v = (m11 * y2 - m21 * y1) / det;
    f->a1 = dd_add(f->a1, dd_from(u));
    f->b1 = dd_add(f->b1, dd_from(v));
    f->a2 = dd_sub(f->a2, dd_add(dd_from(r->r1), dd_from(u)));
    f->b2 = dd_add(f->b2, dd_from(h - v + da * u));
    return isfinite(u) && isfinite(v);
}

/* Newton's method. It keeps the best factors and returns the size of their residual. */
static double refine(struct factors *best, const struct monic *p)
{
    struct factors f = *best;
    struct residual r = residual_of(&f, p);
    double size = r.size;
    for (int i = 0; i < NEWTON_STEPS && size > CONVERGED; i++) {
        if (!correct(&f, &r))
            break;
        r = residual_of(&f, p);
        if (r.size < size) {
            size = r.size;
            *best = f;
        }
    }
    return size;
}

/* For two roots at or near zero, and one large root on each side. The resolvent then has a double
 * root and puts one small and one large root into each factor, from which Newton's method does not
 * converge. Puts the small roots into one: x^2 + (c/b) x + d/b. Returns the residual's size. */
static double part_small_pair(const struct monic *p, struct factors *best, double size)
{
    if (p->b.hi == 0.0)
        return size;
    struct factors f = {dd_div(p->c, p->b), dd_div(p->d, p->b), p->a, p->b};
    const double other = refine(&f, p);
    if (!(other < size))
        return size;
    *best = f;
    return other;
}

/* The largest real root of the resolvent t^3 + g t + h = 0 splits the quartic into real quadratics.
 * Near a double root, rounding may leave only the other root; then the turning point is tried. */
static double factorise(const struct monic *p, struct factors *best)
{
    double a = p->a.hi, b = p->b.hi, c = p->c.hi, d = p->d.hi;
    double g = a * c - 4.0 * d - b * b / 3.0;
    double h = (8.0 * d + a * c - b * b / 4.5) * (b / 3.0) - c * c - a * a * d;
    double q = g / 3.0, r = 0.5 * h, disc = r * r + q * q * q, turn = sqrt(fmax(-q, 0.0));
    double size = INFINITY, t;
    *best = (struct factors){p->a, p->b, dd_from(0.0), dd_from(0.0)};
    if (disc < 0.0) {
        double cosine = fmax(-1.0, fmin(1.0, -r / (turn * turn * turn)));
        t = 2.0 * turn * cos(acos(cosine) / 3.0);
    } else {
        double k = copysign(cbrt(fabs(r) + sqrt(disc)), -r);
        t = k != 0.0 ? k - q / k : 0.0;
    }
    for (int i = 0; i < 2; i++) { /* Newton's method */
        double slope = 3.0 * t * t + g;
        if (slope != 0.0)
            t -= ((t * t + g) * t + h) / slope;
    }
    consider_root(p, t, best, &size);
    if (disc >= 0.0 && size > GOOD_START)
        consider_root(p, turn, best, &size);
    size = refine(best, p);
    return size > CONVERGED ? part_small_pair(p, best, size) : size;
}

/* For a cluster of roots, whose factors cannot be found from the coefficients: factorises about the
 * mean of the roots, -a/4. Double-double computes the shifts there and back without loss. */
static struct factors factorise_about_mean(const struct monic *p)
{
    struct dd h = dd_scale(p->a, -0.25), c[4] = {p->d, p->c, p->b, p->a};
    for (int i = 0; i < 4; i++) /* synthetic division by x - h */
        for (int k = 3; k >= i; k--)
            c[k] = dd_add(c[k], k == 3 ? h : dd_mul(h, c[k + 1]));
    struct monic centred = {dd_from(0.0), c[2], c[1], c[0]};
    struct factors f;
    factorise(&centred, &f);
    f.b1 = dd_add(f.b1, dd_mul(h, dd_sub(h, f.a1)));
    f.b2 = dd_add(f.b2, dd_mul(h, dd_sub(h, f.a2)));
    f.a1 = dd_sub(f.a1, dd_scale(h, 2.0));
    f.a2 = dd_sub(f.a2, dd_scale(h, 2.0));
    return f;
}

/* For two small roots together with far larger ones, which the resolvent may put into different
 * factors: factorises the polynomial of 1/x, for which they are the large roots. */
static struct factors factorise_inverse(const struct monic *p)
{
    struct dd one = dd_from(1.0);
    struct monic inverse = {dd_div(p->c, p->d), dd_div(p->b, p->d), dd_div(p->a, p->d),
                            dd_div(one, p->d)};
    struct factors f;
    factorise(&inverse, &f);
    return (struct factors){dd_div(f.a2, f.b2), dd_div(one, f.b2), dd_div(f.a1, f.b1),
                            dd_div(one, f.b1)};
}

static struct factors best_factors(const struct monic *p)
{
    struct factors best, f;
    double size = factorise(p, &best);
    int ways = p->d.hi != 0.0 ? 2 : 1;
    for (int i = 0; i < ways && size > CONVERGED; i++) {
        f = i == 0 ? factorise_about_mean(p) : factorise_inverse(p);
        double trial = refine(&f, p);
        if (trial < size) {
            size = trial;
            best = f;
        }
    }
    if (p->d.hi == 0.0) /* a root at zero is exact */
        *(fabs(best.b1.hi) <= fabs(best.b2.hi) ? &best.b1 : &best.b2) = dd_from(0.0);
    return best;
}

/* x^2 + a x + b */
static void quadratic_pair(struct dd a, struct dd b, int s, double re[2], double im[2])
{
    struct dd half = dd_scale(a, 0.5), disc = dd_sub(dd_mul(half, half), b);
    im[0] = im[1] = 0.0;
    if (b.hi == 0.0) { /* here a^2 may be too small for a double */
        re[0] = ldexp(-a.hi, s);
        re[1] = 0.0;
        return;
    }
    if (disc.hi < 0.0) {
        re[0] = re[1] = ldexp(-half.hi, s);
        im[0] = ldexp(dd_sqrt(dd_neg(disc)).hi, s);
        im[1] = -im[0];
        return;
    }
    struct dd root = dd_sqrt(disc);
    struct dd x = dd_neg(half.hi < 0.0 ? dd_sub(half, root) : dd_add(half, root));
    re[0] = ldexp(x.hi, s);
    re[1] = x.hi != 0.0 ? ldexp(dd_div(b, x).hi, s) : 0.0;
}

/* c[k] / c[4] in the variable 2^-s x, where 2^s makes the largest |c[4-k] / c[4]|^(1/k) about 1 */
static struct dd ratio(const double c[5], int k, int s)
{
    int lead = ilogb(c[4]);
    if (c[k] == 0.0)
        return dd_from(0.0);
    return dd_div(dd_from(ldexp(c[k], -lead - (4 - k) * s)), dd_from(ldexp(c[4], -lead)));
}

void mill_quartic_roots(const double c[5], double re[4], double im[4])
{
    int s = -100000;
    for (int k = 0; k < 4; k++)
        if (c[k] != 0.0) {
            int e = ilogb(c[k]) - ilogb(c[4]) + 1, n = 4 - k;
            int ceiling = e > 0 ? (e + n - 1) / n : -(-e / n);
            s = ceiling > s ? ceiling : s;
        }
    if (s == -100000)
        s = 0;
    struct monic p = {ratio(c, 3, s), ratio(c, 2, s), ratio(c, 1, s), ratio(c, 0, s)};
    struct factors f = best_factors(&p);
    quadratic_pair(f.a1, f.b1, s, re, im);
    quadratic_pair(f.a2, f.b2, s, re + 2, im + 2);
}

/* p(t), and the size of its terms */
static double value_at(const double p[5], double t, double *terms)
{
    double value = p[4], size = fabs(p[4]);
    for (int k = 3; k >= 0; k--) {
        value = value * t + p[k];
        size = size * fabs(t) + fabs(p[k]);
    }
    *terms = size;
    return value;
}

bool mill_quartic_agrees(const double c[5], double t_end, bool at_root, double t)
{
    const double allowed = 1e-9;
    const double p[5] = {at_root ? 0.0 : c[0], c[1], c[2], c[3], c[4]};
    const double end = t < t_end ? t : t_end;
    double terms, to[5] = {[4] = end}, im[4];
    mill_quartic_roots(p, to, im);
    for (int i = 0; i < 5; i++) { /* to each root, or the end, from the next smaller root */
        double from = 0.0;
        for (int k = 0; k < 4; k++)
            from = to[k] < to[i] ? fmax(from, to[k]) : from;
        if (to[i] > 0.0 && to[i] <= end &&
            value_at(p, 0.5 * (from + to[i]), &terms) > allowed * terms)
            return false;
    }
    return !(t <= t_end) || fabs(value_at(p, t, &terms)) <= allowed * terms;
}
