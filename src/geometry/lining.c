/* The corners of contours. A free line is made of biarcs through points on it, with its directions
 * there: two arcs between two points, tangent to each other and to their neighbours (K. M. Bolton,
 * Computer-Aided Design 7 (1975) 89; both with the same length of tangent). */
#include "millsim/lining.h"

#include "base/elementary.h"
#include "base/profile.h"
#include "millsim/setup.h"

#include <assert.h>

enum { POINTS = 8 /* of a free line, in each of the shortest waves */ };
#define SHORTEST 1e-9 /* [m] of a side */

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

/* Outer and inner arcs by turns. Inner arcs that are too short for sides are left out: they are
 * corners. */
static size_t add_buckles(const struct mill_lining *is, struct mill_corner *corner)
{
    const struct mill_profile p =
        mill_profile_make((int)is->count, is->radius, is->height, is->angle);
    const double half_pitch = MILL_PI / (double)is->count;
    const bool inner = 2.0 * p.half_inner * p.arc >= SHORTEST;
    size_t n = 0;
    for (long k = 0; k < is->count; k++) {
        const double ray = is->angle + 2.0 * half_pitch * (double)k;
        for (int side = -1; side <= 1; side += 2) {
            /* the end of an outer arc, in the middle between its centre and that of the next one */
            const struct mill_corner to = at(0.0, 0.5 * p.inner, ray + side * half_pitch, 0.0);
            const struct mill_corner from = at(0.0, 0.5 * p.outer, ray, 0.0);
            if (side > 0 && !inner)
                continue;
            corner[n++] = (struct mill_corner){from.x + to.x, from.y + to.y,
                                               side < 0 ? tangent(0.5 * p.half_outer)
                                                        : -tangent(0.5 * p.half_inner)};
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
        if (!sharp)
            corner[n++] = at(-back->end[0], back->end[1], angle, 0.0);
        corner[n++] = at(front->end[0], front->end[1], angle, sharp ? 0.0 : front->bulge);
        if (!sharp)
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
        corner[2 * k] = (struct mill_corner){from.x, from.y,
                                             bulge_of(from.u, from.v, mx - from.x, my - from.y)};
        corner[2 * k + 1] =
            (struct mill_corner){mx, my, -bulge_of(-to.u, -to.v, mx - to.x, my - to.y)};
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
    switch (is->form) {
    case MILL_LINING_WAVY:
        return add_buckles(is, corner);
    case MILL_LINING_LIFTERS:
        return add_lifters(is, corner);
    case MILL_LINING_HARMONICS:
        return add_line(is, corner);
    default:
        return 0;
    }
}
