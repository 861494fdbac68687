/* The corners of contours. A free line is made of biarcs through points on it, with its directions
 * there: two arcs between two points, tangent to each other and to their neighbours (K. M. Bolton,
 * Computer-Aided Design 7 (1975) 89; both with the same length of tangent). */
#include "millsim/lining.h"

#include "base/elementary.h"
#include "millsim/setup.h"

#include <assert.h>

enum { POINTS = 8 /* of a free line, in each of the shortest waves */ };
#define SHORTEST 1e-9 /* [m] of a side */
#define FINEST 1e-12  /* relative to the size: more than rounding of a place */

static double tangent(double angle)
{
    const struct mill_heading at = mill_elementary_heading(angle);
    return at.sin / at.cos;
}

/* The point at these coordinates around and along a direction */
static struct mill_corner at(double around, double outward, double angle, double bulge)
{
    const struct mill_heading to = mill_elementary_heading(angle);
    return (struct mill_corner){outward * to.cos - around * to.sin,
                                outward * to.sin + around * to.cos, bulge};
}

/* ---- buckles ---- */

/* The formulas avoid cancellation for all heights, and for any number of buckles. */
struct mill_profile mill_lining_profile(int buckles, double radius, double height, double angle)
{
    assert(buckles >= 2 && radius > 0.0 && height >= 0.0);
    const double half_pitch = MILL_PI / buckles, s = mill_elementary_heading(0.5 * half_pitch).sin;
    const double q = 2.0 * s * s, h = height, rest = q * radius * radius - 2.0 * h * h;
    const double u = rest / (2.0 * h + sqrt(4.0 * h * h + q * rest));
    const struct mill_heading half = mill_elementary_heading(half_pitch);
    struct mill_profile p = {buckles, radius, height, angle, .arc = u + h, .inner = radius + u};
    /* R - u would cancel if h is small; this form follows from the equation of u */
    p.outer = u > 0.0 ? (4.0 * h * u + 2.0 * h * h) / (q * (radius + u)) : radius - u;
    /* at an inner centre, between the axis and the next outer centre */
    p.half_inner = mill_elementary_atan2(p.outer * half.sin, p.inner - p.outer * half.cos);
    p.half_outer = p.half_inner + half_pitch;
    /* An arc meets its mirror image in the neighbouring half pitch if it covers the direction
     * normal to the ray between them and its radius reaches this ray. */
    p.sound = h < radius && !(p.half_outer >= 0.5 * MILL_PI && p.inner * half.sin <= p.arc) &&
              !(p.half_inner >= 0.5 * MILL_PI && p.outer * half.sin <= p.arc);
    return p;
}

/* Outer and inner arcs by turns. Inner arcs that are too short for sides are corners. */
static size_t add_buckles(const struct mill_lining *is, struct mill_corner *corner)
{
    const struct mill_profile p =
        mill_lining_profile((int)is->count, is->radius, is->height, is->angle);
    const double half_pitch = MILL_PI / (double)is->count;
    const bool inner = 2.0 * p.half_inner * p.arc >= SHORTEST;
    size_t n = 0;
    for (long k = 0; k < is->count; k++) {
        const double ray = is->angle + 2.0 * half_pitch * (double)k;
        const struct mill_corner from = at(0.0, 0.5 * p.outer, ray, 0.0);
        for (int side = -1; side <= (inner ? 1 : -1); side += 2) {
            /* the end of an outer arc, in the middle between its centre and that of the next one */
            corner[n] = at(0.0, 0.5 * p.inner, ray + side * half_pitch,
                           side < 0 ? tangent(0.5 * p.half_outer) : -tangent(0.5 * p.half_inner));
            corner[n].x += from.x;
            corner[n++].y += from.y;
        }
    }
    return n;
}

/* ---- lifters ---- */

/* One flank of a lifter in coordinates around (towards the flank) and outward: where it meets the
 * plate, where the rounding of its edge begins and ends */
struct flank {
    double foot[2], begin[2], end[2], bulge;
};

/* false: the flank does not meet the plate, or the edge is rounded by more than there is */
static bool set_flank(const struct mill_lining *is, double height, double face, struct flank *f)
{
    const double slope = tangent(face), half = 0.5 * is->width, top = is->radius - height;
    /* (half + slope s)^2 + (top + s)^2 = radius^2 */
    const double a = 1.0 + slope * slope, b = half * slope + top;
    const double c = half * half + top * top - is->radius * is->radius, square = b * b - a * c;
    if (!(square > 0.0 && c < 0.0))
        return false;
    const double s = -c / (b + sqrt(square)), length = s * sqrt(a);
    const double cut = is->rounding * tangent(0.25 * MILL_PI - 0.5 * face);
    f->foot[0] = half + slope * s;
    f->foot[1] = top + s;
    f->begin[0] = half + slope * cut / sqrt(a);
    f->begin[1] = top + cut / sqrt(a);
    f->end[0] = half - cut;
    f->end[1] = top;
    f->bulge = -tangent(0.125 * MILL_PI - 0.25 * face);
    return cut <= half * (1.0 - SHORTEST) && cut <= length * (1.0 - SHORTEST);
}

static size_t add_lifters(const struct mill_lining *is, struct mill_corner *corner)
{
    const bool sharp = is->rounding < SHORTEST;
    const double pitch = 2.0 * MILL_PI / (double)is->count;
    double around[2][2]; /* [rad] from the middle to the feet; of even and odd lifters */
    struct flank flank[2][2];
    size_t n = 0;
    for (int k = 0; k < 4; k++) {
        struct flank *f = &flank[k / 2][k % 2];
        if (!set_flank(is, k < 2 ? is->height : is->second, k % 2 ? is->front : is->back, f))
            return 0;
        around[k / 2][k % 2] = mill_elementary_atan2(f->foot[0], f->foot[1]);
    }
    for (long k = 0; k < is->count; k++) {
        const int own = k % 2, next = (k + 1) % is->count % 2;
        const struct flank *back = &flank[own][0], *front = &flank[own][1];
        const double angle = is->angle + pitch * (double)k;
        const double plate = pitch - around[own][1] - around[next][0];
        if (!(plate * is->radius >= SHORTEST))
            return 0;
        corner[n++] = at(-back->foot[0], back->foot[1], angle, 0.0);
        corner[n++] = at(-back->begin[0], back->begin[1], angle, sharp ? 0.0 : back->bulge);
        if (!sharp) {
            corner[n++] = at(-back->end[0], back->end[1], angle, 0.0);
            corner[n++] = at(front->end[0], front->end[1], angle, front->bulge);
        }
        corner[n++] = at(front->begin[0], front->begin[1], angle, 0.0);
        corner[n++] = at(front->foot[0], front->foot[1], angle, tangent(0.25 * plate));
    }
    return n;
}

/* ---- a free line ---- */

/* A point of the line, and its direction */
struct point {
    double x, y, u, v; /* [m], unit */
};

static struct point point_at(const struct mill_lining *is, double share)
{
    const double angle = is->angle + 2.0 * MILL_PI * share;
    double r = is->radius, slope = 0.0;
    for (int k = 0; k < MILL_LINING_WAVES; k++) {
        const double by = (double)is->count * (k + 1), turns = by * share;
        const struct mill_heading a =
            mill_elementary_heading(2.0 * MILL_PI * (turns - floor(turns)));
        r += is->wave[k] * a.cos + is->lean[k] * a.sin;
        slope += by * (is->lean[k] * a.cos - is->wave[k] * a.sin);
    }
    const double long_by = sqrt(r * r + slope * slope);
    const struct mill_corner p = at(0.0, r, angle, 0.0);
    const struct mill_corner d = at(r / long_by, slope / long_by, angle, 0.0);
    return (struct point){p.x, p.y, d.x, d.y};
}

/* Of the arc that begins in the direction (u, v) and ends at (x, y) from there */
static double bulge_of(double u, double v, double x, double y)
{
    return (u * y - v * x) / (sqrt(x * x + y * y) + u * x + v * y);
}

static size_t add_line(const struct mill_lining *is, struct mill_corner *corner)
{
    const size_t n = mill_lining_most(is) / 2;
    struct point from = point_at(is, 0.0);
    for (size_t k = 0; k < n; k++) {
        const struct point to = point_at(is, k + 1 < n ? (double)(k + 1) / (double)n : 0.0);
        const double x = to.x - from.x, y = to.y - from.y;
        const double along = x * (from.u + to.u) + y * (from.v + to.v);
        const double apart = (from.u - to.u) * (from.u - to.u) + (from.v - to.v) * (from.v - to.v);
        const double square = x * x + y * y;
        const double d = square / (along + sqrt(along * along + apart * square));
        const double mx = 0.5 * (from.x + to.x + d * (from.u - to.u));
        const double my = 0.5 * (from.y + to.y + d * (from.v - to.v));
        const double first = bulge_of(from.u, from.v, mx - from.x, my - from.y);
        const double last = -bulge_of(-to.u, -to.v, mx - to.x, my - to.y);
        corner[2 * k] = (struct mill_corner){from.x, from.y, first};
        corner[2 * k + 1] = (struct mill_corner){mx, my, last};
        from = to;
    }
    return 2 * n;
}

/* ---- all ---- */

size_t mill_lining_most(const struct mill_lining *is)
{
    size_t waves = 1;
    for (size_t k = 1; k < MILL_LINING_WAVES; k++)
        if (is->wave[k] != 0.0 || is->lean[k] != 0.0)
            waves = k + 1;
    return (size_t)is->count * (is->form == MILL_LINING_WAVY      ? 2
                                : is->form == MILL_LINING_LIFTERS ? 6
                                                                  : 2 * POINTS * waves);
}

size_t mill_lining_corners(const struct mill_lining *is, struct mill_corner *corner)
{
    assert(is->count <= MILL_LINING_MOST);
    return is->form == MILL_LINING_WAVY        ? add_buckles(is, corner)
           : is->form == MILL_LINING_LIFTERS   ? add_lifters(is, corner)
           : is->form == MILL_LINING_HARMONICS ? add_line(is, corner)
                                               : 0;
}

/* ---- any contour ---- */

struct mill_corner mill_lining_halve(struct mill_corner *a, const struct mill_corner *b)
{
    const double s = 0.5 * a->bulge;
    a->bulge /= 1.0 + sqrt(1.0 + a->bulge * a->bulge);
    return (struct mill_corner){0.5 * (a->x + b->x) + s * (b->y - a->y),
                                0.5 * (a->y + b->y) - s * (b->x - a->x), a->bulge};
}

/* Twice the area between a side and the origin [m^2] */
static double twice_area(const struct mill_corner *a, const struct mill_corner *b)
{
    const double square = (b->x - a->x) * (b->x - a->x) + (b->y - a->y) * (b->y - a->y);
    const double u = fabs(a->bulge);
    /* r^2 (angle - sin(angle)); a series where the two cancel */
    double segment = u * (2.0 / 3.0 + u * u * (2.0 / 15.0 - u * u * (2.0 / 105.0)));
    if (u >= 1e-2) {
        const double r = 0.25 * (1.0 + u * u) / u, angle = 4.0 * mill_elementary_atan2(u, 1.0);
        segment = r * r * (angle - mill_elementary_heading(angle).sin);
    }
    return a->x * b->y - a->y * b->x + copysign(segment, a->bulge) * square;
}

double mill_lining_area(const struct mill_corner *corner, size_t n)
{
    double twice = 0.0;
    for (size_t k = 0; k < n; k++)
        twice += twice_area(&corner[k], &corner[(k + 1) % n]);
    return 0.5 * twice;
}

/* ---- does it cross itself? ---- */

/* A side or a part of it, from a to b */
struct share {
    struct mill_corner a, b;
    double half; /* [m] of its points, none is farther from the middle of the chord */
};

static struct share share_of(struct mill_corner a, struct mill_corner b)
{
    const double dx = b.x - a.x, dy = b.y - a.y;
    return (struct share){a, b, 0.5 * sqrt(dx * dx + dy * dy) * fmax(1.0, fabs(a.bulge))};
}

/* Does the second of two sides begin where the first one ends; does it end where that begins? */
struct order {
    bool follows, leads;
};

static bool is_same(const struct mill_corner *a, const struct mill_corner *b)
{
    return a->x == b->x && a->y == b->y;
}

/* > 0: c is on the left of the line from a to b */
static double side_of(const struct mill_corner *a, const struct mill_corner *b,
                      const struct mill_corner *c)
{
    return (b->x - a->x) * (c->y - a->y) - (b->y - a->y) * (c->x - a->x);
}

/* Is all of q on one side of the strip between the chord of p and its arc? Without this, arcs that
 * are nearly parallel would be halved until their parts are as short as they are apart. */
static bool are_apart(const struct share *p, const struct share *q, double least)
{
    const double l = 2.0 * p->half / fmax(1.0, fabs(p->a.bulge));
    const double rise = q->half * fmin(1.0, fabs(q->a.bulge)) + least, own = -0.5 * p->a.bulge * l;
    const double a = side_of(&p->a, &p->b, &q->a), b = side_of(&p->a, &p->b, &q->b);
    return fmin(a, b) > l * (fmax(own, 0.0) + rise) || fmax(a, b) < l * (fmin(own, 0.0) - rise);
}

/* Do two shares touch, other than where one side ends and the next one begins? */
static bool touch(const struct share *p, const struct share *q, struct order order, double least)
{
    const double x = 0.5 * (p->a.x + p->b.x - q->a.x - q->b.x);
    const double y = 0.5 * (p->a.y + p->b.y - q->a.y - q->b.y), near = p->half + q->half;
    if (x * x + y * y > near * near || are_apart(p, q, least) || are_apart(q, p, least))
        return false;
    const bool line[2] = {fabs(p->a.bulge) * p->half <= least, fabs(q->a.bulge) * q->half <= least};
    if (line[0] && line[1]) {
        const double a = side_of(&p->a, &p->b, &q->a), b = side_of(&p->a, &p->b, &q->b);
        const double along =
            (p->b.x - p->a.x) * (q->b.x - q->a.x) + (p->b.y - p->a.y) * (q->b.y - q->a.y);
        if ((order.follows && is_same(&p->b, &q->a)) || (order.leads && is_same(&q->b, &p->a)))
            return a == 0.0 && b == 0.0 && along < 0.0; /* does one fold back onto the other? */
        return a * b <= 0.0 && side_of(&q->a, &q->b, &p->a) * side_of(&q->a, &q->b, &p->b) <= 0.0;
    }
    const bool first = !line[0] && (line[1] || p->half >= q->half);
    struct share part = first ? *p : *q;
    const struct mill_corner end = part.b, middle = mill_lining_halve(&part.a, &part.b);
    for (int k = 0; k < 2; k++) {
        part = k == 0 ? share_of(part.a, middle) : share_of(middle, end);
        if (first ? touch(&part, q, order, least) : touch(p, &part, order, least))
            return true;
    }
    return false;
}

bool mill_lining_crosses(const struct mill_corner *corner, size_t n, size_t at[2])
{
    double size = 0.0;
    for (size_t k = 0; k < n; k++)
        size = fmax(size, fmax(fabs(corner[k].x), fabs(corner[k].y)));
    for (at[0] = 0; at[0] < n; at[0]++) {
        const struct share p = share_of(corner[at[0]], corner[(at[0] + 1) % n]);
        for (at[1] = at[0] + 1; at[1] < n; at[1]++) {
            const struct share q = share_of(corner[at[1]], corner[(at[1] + 1) % n]);
            const struct order order = {at[1] == at[0] + 1, at[0] == 0 && at[1] == n - 1};
            if (touch(&p, &q, order, FINEST * size))
                return true;
        }
    }
    return false;
}
