/* The polynomial solvers against exact signs (exact.h). First rise: the time returned is a rise
 * through zero (or the minimum waited for), within the rounding of the terms; no earlier one; and
 * where none is returned there is none; GSL agrees with it. Sturm counts are the sign changes. All
 * roots leave residuals of the size of rounding. */
#include "fuzz.h"

#include "exact.h"
#include "millsim/poly.h"
#include "proof/paranoid.h"

/* A time right to one unit in the last place leaves a residual of 4 of these at degree 4. */
#define UNITS 4.0L
/* The range in which poly.h vouches for the first rise */
#define CERTAIN 1e30
/* The oracle's own doubt, about turning points that it knows to a unit in the last place */
#define DOUBT (16.0L * LDBL_EPSILON)

struct question {
    double c[5];
    double t_end;
    bool at_root;
    bool is_flight;
};

/* ---- coefficients from bytes ---- */

/* |r + v t + g t^2/2|^2 = rho^2, near the circle in one of many ways: whatever lengths, speeds and
 * gravities a deck may have */
static void flight(struct fuzz_bytes *b, double c[5])
{
    const double rho = fuzz_choice(b, 2) ? 0.0725 : fuzz_log(b, 1e-9, 1e9);
    const double sign = fuzz_choice(b, 2) ? -1.0 : 1.0;
    const double off =
        fuzz_choice(b, 2) ? 0.0 : fuzz_log(b, 1e-18, 1.0) * (fuzz_choice(b, 2) ? -1 : 1);
    const double a = fuzz_uniform(b, 0.0, 2.0 * MILL_PI), k = fuzz_uniform(b, 0.0, 2.0 * MILL_PI);
    const double speed = fuzz_choice(b, 4) ? fuzz_log(b, 1e-15, 1e9) : 0.0;
    const double w = fuzz_choice(b, 3) ? k : a + 0.5 * MILL_PI; /* along the wall */
    const double g = fuzz_choice(b, 3) ? 9.81 : fuzz_log(b, 1e-290, 1e9);
    const double r[2] = {rho * (1.0 + off) * cos(a), rho * (1.0 + off) * sin(a)};
    const double v[2] = {speed * cos(w), speed * sin(w)};
    c[4] = sign * 0.25 * g * g;
    c[3] = -sign * v[1] * g;
    c[2] = sign * (v[0] * v[0] + v[1] * v[1] - r[1] * g);
    c[1] = sign * 2.0 * (r[0] * v[0] + r[1] * v[1]);
    c[0] = sign * (r[0] * r[0] + r[1] * r[1] - rho * rho);
}

/* Exact coefficients of known roots, then perhaps one bit off */
static void from_roots(struct fuzz_bytes *b, double c[5])
{
    double p[6] = {0.0, fuzz_choice(b, 2) ? -1.0 : 1.0};
    const int degree = 4 - fuzz_choice(b, 3);
    double root = 0.0;
    for (int n = 0; n < degree; n++) {
        if (fuzz_choice(b, 3))
            root = fuzz_choice(b, 256) / 16.0 - 4.0;
        for (int k = n + 2; k > 0; k--)
            p[k] = p[k - 1] - root * p[k];
    }
    for (int k = 0; k < 5; k++)
        c[k] = p[k + 1];
    const int off = fuzz_choice(b, 16);
    if (off < 5)
        c[off] *= 1.0 + (fuzz_choice(b, 2) ? DBL_EPSILON : -DBL_EPSILON);
}

static struct question ask(struct fuzz_bytes *b)
{
    struct question q = {{0.0}, 0.0, false, false};
    const int how = fuzz_choice(b, 4);
    if (how == 0)
        flight(b, q.c);
    else if (how == 1)
        from_roots(b, q.c);
    else
        for (int k = 0; k < 5; k++)
            q.c[k] = how == 2 ? fuzz_finite(b)
                              : fuzz_log(b, 1e-30, 1e30) * (fuzz_choice(b, 2) ? -1.0 : 1.0);
    switch (fuzz_choice(b, 4)) {
    case 0:
        q.t_end = (double)INFINITY;
        break;
    case 1:
        q.t_end = fuzz_log(b, 1e-12, 1e3);
        break;
    case 2:
        q.t_end = fuzz_choice(b, 256) / 16.0;
        break;
    default:
        q.t_end = fabs(fuzz_finite(b));
    }
    q.at_root = fuzz_choice(b, 4) == 3;
    q.is_flight = how == 0 && q.t_end <= 1e3;
    return q;
}

/* All coefficients are zero or from 1/most to most */
static bool within(const double c[5], double most)
{
    for (int k = 0; k < 5; k++)
        if (c[k] != 0.0 && !(fabs(c[k]) >= 1.0 / most && fabs(c[k]) <= most))
            return false;
    return true;
}

/* ---- first rise ---- */

struct answer {
    bool any, doubtful;
    bool lowest;     /* not a rise through zero, but the minimum of a positive polynomial */
    double from, to; /* the monotone piece that holds it */
    double t;        /* the double just above it */
};

static bool in_doubt(const struct exact_poly *p, double t)
{
    long double size;
    return fabsl(exact_rounded(p, t, &size)) <= DOUBT * size;
}

/* Is p zero at t and rising: is the first derivative that does not vanish positive? */
static bool rises_from(struct exact_poly p, double t)
{
    int sign = 0;
    while (sign == 0 && p.degree > 0) {
        p = exact_derivative(&p);
        sign = exact_sign(&p, t);
    }
    return sign > 0;
}

/* The first rise through zero in (lo, hi] of p, which is negative just behind lo. */
static struct answer first_up(const struct exact_poly *p, double lo, double hi)
{
    struct answer a = {false, false, false, 0.0, 0.0, 0.0};
    double cut[6];
    const int turns = exact_turns(p, lo, hi, cut + 1);
    cut[0] = lo;
    cut[turns + 1] = hi;
    for (int i = 0; i <= turns; i++) {
        const int sign = exact_sign(p, cut[i + 1]);
        if (i < turns && in_doubt(p, cut[i + 1]))
            a.doubtful = true;
        if (sign < 0 || (sign == 0 && (i < turns || !rises_from(*p, hi))))
            continue;
        a.any = true;
        a.from = cut[i];
        a.to = cut[i + 1];
        /* just behind lo p is negative, at lo it may be zero */
        a.t = i == 0 && exact_sign(p, lo) >= 0
                  ? exact_cross(p, exact_ranked(exact_rank(lo) + 1), cut[i + 1])
                  : exact_cross(p, cut[i], cut[i + 1]);
        return a;
    }
    return a;
}

/* p without the zeros at t = 0, with the sign of what is just behind it in c[0] */
static struct exact_poly without_zero(struct exact_poly p)
{
    while (p.degree >= 0 && p.c[0] == 0.0L) {
        for (int k = 0; k < 4; k++)
            p.c[k] = p.c[k + 1];
        p.c[4] = 0.0L;
        p.degree--;
    }
    return p;
}

static struct answer oracle(const struct question *q, struct exact_poly *p)
{
    const double hi = fmin(q->t_end, DBL_MAX);
    const struct answer none = {false, false, false, 0.0, 0.0, 0.0};
    const struct answer now = {true, false, false, 0.0, 0.0, 0.0};
    *p = exact_poly_from(q->c, 4);
    if (q->at_root && p->degree >= 0)
        p->c[0] = 0.0L;
    const bool at_zero = p->degree >= 0 && p->c[0] == 0.0L;
    *p = without_zero(*p);
    const struct exact_poly slope = exact_derivative(p), d = without_zero(slope);
    if (p->degree < 0)
        return none;
    if (p->c[0] > 0.0L && (at_zero || (d.degree >= 0 && d.c[0] > 0.0L)))
        return now;
    if (d.degree < 0 || hi == 0.0)
        return none;
    if (p->c[0] < 0.0L)
        return first_up(p, 0.0, hi);
    struct answer low = first_up(&d, 0.0, hi);
    low.lowest = true;
    if (!low.any)
        return low;
    if (in_doubt(p, low.t))
        low.doubtful = true;
    if (exact_sign(p, low.t) >= 0)
        return low;
    struct answer up = first_up(p, low.t, hi);
    up.doubtful = up.doubtful || low.doubtful;
    return up;
}

static void show(const struct question *q, double t, const struct answer *a)
{
    fprintf(stderr, "c = {%a, %a, %a, %a, %a} (%g %g %g %g %g), t_end = %.17g%s\n", q->c[0],
            q->c[1], q->c[2], q->c[3], q->c[4], q->c[0], q->c[1], q->c[2], q->c[3], q->c[4],
            q->t_end, q->at_root ? ", at root" : "");
    fprintf(stderr, "answer %.17g, oracle %.17g in [%.17g, %.17g]%s%s\n", t,
            a->any ? a->t : (double)INFINITY, a->from, a->to, a->lowest ? ", lowest" : "",
            a->doubtful ? ", doubtful" : "");
}

static const char *fault(double t, const struct answer *a, const struct exact_poly *p)
{
    if (a->doubtful)
        return NULL;
    if (a->any != !isinf(t))
        return a->any ? "missed" : "invented";
    if (!a->any)
        return NULL;
    if (a->to == 0.0 || t == 0.0)
        return t == a->t ? NULL : "at 0 or not";
    if (t < a->from * (1.0 - 4.0 * DBL_EPSILON) || t > a->to * (1.0 + 4.0 * DBL_EPSILON))
        return "not the first";
    if (t >= exact_ranked(exact_rank(a->t) - 1) && t <= a->t)
        return NULL;
    const struct exact_poly d = exact_derivative(p);
    long double size;
    const long double value = exact_rounded(a->lowest ? &d : p, t, &size);
    return fabsl(value) <= UNITS * DBL_EPSILON * size ? NULL : "inaccurate";
}

static void check_first_rise(const struct question *q)
{
    struct exact_poly p;
    const double t = mill_poly_first_rise(q->c, q->t_end, q->at_root, NULL);
    fuzz_require(t >= 0.0 && (isinf(t) || t <= q->t_end), "%g is no time in [0, %g]", t, q->t_end);
    if (!q->is_flight && !within(q->c, CERTAIN))
        return;
    const struct answer a = oracle(q, &p);
    const char *why = fault(t, &a, &p);
    if (why || fuzz_shown())
        show(q, t, &a);
    fuzz_require(!why, "first rise: %s", why ? why : "");
}

/* ---- counts and roots ---- */

static void check_sturm(const struct question *q)
{
    const struct exact_poly p = exact_poly_from(q->c, 4);
    const double hi = fmin(q->t_end, DBL_MAX), lo = fmin(fabs(q->c[3]), 0.5 * hi);
    double cut[6];
    if (p.degree < 1 || !(lo < hi) || !within(q->c, CERTAIN))
        return;
    const int turns = exact_turns(&p, lo, hi, cut + 1);
    cut[0] = lo;
    cut[turns + 1] = hi;
    int count = 0, last = exact_sign(&p, lo);
    for (int i = 1; i <= turns + 1; i++) {
        const int sign = exact_sign(&p, cut[i]);
        if (last == 0 || (i <= turns && in_doubt(&p, cut[i])))
            return;
        count += sign != last;
        last = sign;
    }
    const int got = mill_poly_sturm_count(q->c, 4, lo, hi);
    fuzz_require(got == count, "Sturm counts %d instead of %d in (%g, %g] of %a %a %a %a %a", got,
                 count, lo, hi, q->c[0], q->c[1], q->c[2], q->c[3], q->c[4]);
}

/* |p(z)| in units of the rounding of its terms */
static double residual(const double c[5], double re, double im)
{
    long double x = 0.0L, y = 0.0L, size = 0.0L;
    const long double r = hypotl(re, im);
    for (int k = 4; k >= 0; k--) {
        const long double next = x * re - y * im + c[k];
        y = x * im + y * re;
        x = next;
        size = size * r + fabsl((long double)c[k]);
    }
    return size > 0.0L ? (double)(hypotl(x, y) / (size * DBL_EPSILON)) : 0.0;
}

static void check_roots(const struct question *q)
{
    double re[4], im[4];
    if (q->c[4] == 0.0)
        return;
    mill_quartic_roots(q->c, re, im);
    for (int k = 0; k < 4; k++) {
        const int pair = k ^ 1;
        fuzz_require(!isnan(re[k]) && !isnan(im[k]), "root %d of %a %a %a %a %a is not a number", k,
                     q->c[0], q->c[1], q->c[2], q->c[3], q->c[4]);
        fuzz_require(im[k] == -im[pair] && (im[k] == 0.0 || re[k] == re[pair]),
                     "conjugates are not adjacent");
    }
    if (!within(q->c, 1e8))
        return;
    for (int k = 0; k < 4; k++) {
        const double units = residual(q->c, re[k], im[k]);
        fuzz_require(units <= 8.0, "root %d of %a %a %a %a %a, %.17g + %.17g i, is %g units off", k,
                     q->c[0], q->c[1], q->c[2], q->c[3], q->c[4], re[k], im[k], units);
    }
}

static void check_opinion(const struct question *q)
{
    struct mill_paranoid_quartics check = {{mill_paranoid_look}, mill_opinion_agrees, 0, 0, 0};
    struct mill_poly_counts counts = {.check = &check.check};
    if (!within(q->c, CERTAIN))
        return;
    const double t = mill_poly_first_rise(q->c, q->t_end, q->at_root, &counts);
    fuzz_require(check.doubted == 0,
                 "GSL does not share %.17g, t_end %.17g, at_root %d: %a %a %a %a %a", t, q->t_end,
                 q->at_root, q->c[0], q->c[1], q->c[2], q->c[3], q->c[4]);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_bytes b = {data, size};
    /* several questions an input: mutations carry over from one to the next */
    for (int i = 0; i < 4 && (i == 0 || b.left > 0); i++) {
        const struct question q = ask(&b);
        check_first_rise(&q);
        check_sturm(&q);
        check_roots(&q);
        check_opinion(&q);
    }
    return 0;
}
