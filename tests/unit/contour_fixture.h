/* Random contours, */
#ifndef CONTOUR_FIXTURE_H
#define CONTOUR_FIXTURE_H

#include "contour_oracle.h"
#include "extended.h"
#include "lone_shape.h"
#include "shape_fixture.h"

#include "millsim/lining.h"

enum { STAR, BENT, SPIKES, FINS, HOOKS, FILLETS, LIFTERS, HARMONICS, WAVY, LENS, CONTOURS };

/* ---- contours ---- */

static inline void add_at(struct contour *c, double r, double angle, double bulge)
{
    c->corner[c->n++] = (struct mill_corner){r * cos(angle), r * sin(angle), bulge};
}

static inline double random_bulge(uint64_t *seed)
{
    const double size = below(seed, 3) ? uniform(seed, 0.0, 0.8) : log_uniform(seed, 1e-12, 4.0);
    return below(seed, 4) == 0 ? 0.0 : below(seed, 2) ? size : -size;
}

static inline void make_star(uint64_t *seed, struct contour *c, int kind)
{
    const int n = 3 + below(seed, 20);
    const double turn = uniform(seed, -4.0, 4.0), far = log_uniform(seed, 0.04, 0.5);
    const double in = uniform(seed, 0.3, 0.9), thin = log_uniform(seed, 1e-6, 0.2);
    for (int k = 0; k < n; k++) {
        const double pitch = 2.0 * PI / n, a = turn + pitch * (k + uniform(seed, 0.0, 0.5));
        const double r = far * uniform(seed, in, 1.0), w = 0.2 * pitch;
        switch (kind) {
        case SPIKES:
            add_at(c, far * uniform(seed, 0.9, 1.0), a, 0.0);
            add_at(c, far * in * uniform(seed, 0.5, 1.0), a + thin * pitch, 0.0);
            break;
        case FINS: /* of any thickness, pointing inwards */
            add_at(c, far, a, 0.0);
            add_at(c, far * in, a, below(seed, 2) ? -1.0 : 0.0);
            add_at(c, far * in, a + thin * w, 0.0);
            add_at(c, far, a + thin * w, below(seed, 2) ? 0.05 : 0.0);
            break;
        case HOOKS:
            add_at(c, far, a - w, 0.0);
            add_at(c, far * 0.8, a - w, 0.0);
            add_at(c, far * 0.8, a - 2.0 * w, random_bulge(seed));
            add_at(c, far * 0.7, a - 2.0 * w, 0.0);
            add_at(c, far * 0.7, a + w, 0.0);
            add_at(c, far, a + w, 0.0);
            break;
        default:
            add_at(c, r, a, kind == BENT ? random_bulge(seed) : 0.0);
        }
    }
}

/* All corners of a polygon rounded by arcs that are tangent to its sides, but for rounding */
static inline void round_corners(uint64_t *seed, struct contour *c)
{
    struct contour out = {.n = 0};
    for (size_t k = 0; k < c->n; k++) {
        const struct mill_corner p = c->corner[k], a = c->corner[(k + c->n - 1) % c->n],
                                 b = c->corner[(k + 1) % c->n];
        const double ax = p.x - a.x, ay = p.y - a.y, bx = b.x - p.x, by = b.y - p.y;
        const double la = hypot(ax, ay), lb = hypot(bx, by);
        const double turn = atan2(ax * by - ay * bx, ax * bx + ay * by);
        const double cut =
            0.49 * fmin(la, lb) *
            (below(seed, 2) ? log_uniform(seed, 1e-6, 1.0) : uniform(seed, 0.1, 1.0));
        out.corner[out.n++] =
            (struct mill_corner){p.x - cut * ax / la, p.y - cut * ay / la, tan(0.25 * turn)};
        out.corner[out.n++] = (struct mill_corner){p.x + cut * bx / lb, p.y + cut * by / lb, 0.0};
    }
    *c = out;
}

static inline struct mill_lining random_lining(uint64_t *seed, int kind)
{
    struct mill_lining is = {.form = kind == LIFTERS     ? MILL_LINING_LIFTERS
                                     : kind == HARMONICS ? MILL_LINING_HARMONICS
                                                         : MILL_LINING_WAVY,
                             .radius = log_uniform(seed, 0.04, 0.5),
                             .count = 2 + below(seed, 14),
                             .angle = uniform(seed, -4.0, 4.0)};
    const double r = is.radius;
    is.height = uniform(seed, 0.01, kind == LIFTERS ? 0.3 : 0.1) * r;
    is.second = below(seed, 2) ? is.height : uniform(seed, 0.01, 0.3) * r;
    is.width = uniform(seed, 0.01, 0.2) * r;
    is.front = uniform(seed, 0.0, 1.0);
    is.back = uniform(seed, 0.0, 1.0);
    is.rounding = below(seed, 2) ? uniform(seed, 0.0, 0.3) * is.width : 0.0;
    for (int k = 0; k < MILL_LINING_WAVES; k++) {
        is.wave[k] = uniform(seed, -0.03, 0.03) * r;
        is.lean[k] = below(seed, 2) ? uniform(seed, -0.03, 0.03) * r : 0.0;
    }
    if (kind == HARMONICS)
        is.count = 1 + is.count % 6;
    return is;
}

/* false: these numbers make none */
static inline bool try_contour(uint64_t *seed, struct contour *c, int kind)
{
    size_t at[2];
    c->n = 0;
    if (kind == LENS) {
        const double turn = uniform(seed, -4.0, 4.0), r = log_uniform(seed, 0.04, 0.3);
        add_at(c, r, turn, uniform(seed, 0.1, 1.5));
        add_at(c, r, turn + PI, uniform(seed, -0.09, 1.5));
    } else if (kind < LIFTERS) {
        make_star(seed, c, kind == FILLETS ? (below(seed, 2) ? STAR : HOOKS) : kind);
        if (kind == FILLETS) {
            for (size_t k = 0; k < c->n; k++)
                c->corner[k].bulge = 0.0;
            round_corners(seed, c);
        }
    } else {
        const struct mill_lining is = random_lining(seed, kind);
        ck_assert_uint_le(mill_lining_most(&is), MOST_CORNERS);
        c->n = mill_lining_corners(&is, c->corner);
    }
    for (size_t k = 0; k < c->n; k++) {
        const struct mill_corner *a = &c->corner[k], *b = &c->corner[(k + 1) % c->n];
        if (hypot(b->x - a->x, b->y - a->y) < 1e-7)
            return false;
    }
    contour_measure(c);
    return c->n > 1 && mill_lining_area(c->corner, c->n) > 0.0 &&
           !mill_lining_crosses(c->corner, c->n, at);
}

static inline void random_contour(uint64_t *seed, struct contour *c, int kind)
{
    while (!try_contour(seed, c, kind))
        ;
}

/* [m] from the surface of a body of this contour, in the motion's frame; > 0 where balls may be. A
 * container has no ends. */
static inline real contour_gap(const struct contour *c, const struct mill_body *is, struct wide p)
{
    const struct wide q = wide_axpy(p, -1.0L, wide_of(is->centre));
    const real d = contour_distance(c, wide_dot(q, wide_of(is->x)), wide_dot(q, wide_of(is->y)));
    const real past = fabsl(wide_dot(q, wide_of(is->z))) - 0.5L * is->length;
    if (is->inside)
        return d;
    if (past > 0.0L)
        return d > 0.0L ? past : hypotl(d, past);
    return d > 0.0L ? -fminl(d, -past) : -d;
}

#endif
