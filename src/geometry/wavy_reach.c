/* Which arcs of the wavy drum can a ball in a cell touch? Those between the directions in which the
 * cell lies, less those at either end that are too far. */
#include "base/elementary.h"
#include "geometry/wavy_private.h"

#define DEPTH 3 /* quarterings of a box before an arc counts as in reach */

/* The part of the y-z plane that a box takes, no more than the drum needs */
struct patch {
    double y, z, half_y, half_z; /* [m] centre and half sides */
};

static void clamp(double lo, double hi, double far, double *centre, double *half)
{
    lo = fmin(fmax(lo, -far), far);
    hi = fmin(fmax(hi, -far), far);
    *centre = 0.5 * (lo + hi);
    *half = 0.5 * (hi - lo);
}

static bool outer_in_reach(const struct wavy *w, const struct arc *a, struct patch p, double rho,
                           int depth)
{
    const double half = sqrt(p.half_y * p.half_y + p.half_z * p.half_z);
    const bool before = beyond_edge(a, 0, p.y, p.z) > -half;
    const bool after = beyond_edge(a, 1, p.y, p.z) > -half;
    if (w->overhangs ? !before && !after : !before || !after)
        return false;
    if (distance(a, p.y, p.z) + half < rho)
        return false;
    if (depth == 0)
        return true;
    for (int quarter = 0; quarter < 4; quarter++) {
        const double y = p.y + (quarter % 2 ? 0.5 : -0.5) * p.half_y;
        const double z = p.z + (quarter / 2 ? 0.5 : -0.5) * p.half_z;
        const struct patch part = {y, z, 0.5 * p.half_y, 0.5 * p.half_z};
        if (outer_in_reach(w, a, part, rho, depth - 1))
            return true;
    }
    return false;
}

static bool arc_in_reach(const struct wavy *w, int arc, struct patch p, double radius)
{
    const struct arc *a = &w->arc[arc];
    const double margin = 1e-6 * w->far + 1e-3 * radius;
    if (inward(arc) > 0.0)
        return outer_in_reach(w, a, p, w->radius - radius - margin, DEPTH);
    const double y = fmax(fabs(p.y - a->y) - p.half_y, 0.0);
    const double z = fmax(fabs(p.z - a->z) - p.half_z, 0.0);
    return sqrt(y * y + z * z) <= w->radius + radius + margin;
}

/* Arcs between the directions in which the box lies, less those at either end that are too far. */
struct mill_span mill_wavy_parts(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct wavy *w = (const struct wavy *)shape;
    struct patch p;
    clamp(lo.y, hi.y, 1.5 * w->far, &p.y, &p.half_y);
    clamp(lo.z, hi.z, 1.5 * w->far, &p.z, &p.half_z);
    const double half = sqrt(p.half_y * p.half_y + p.half_z * p.half_z) * (1.0 + 1e-9);
    const double away = sqrt(p.y * p.y + p.z * p.z);
    int first = 0, count = w->arcs;
    if (away > half) {
        const double at = (mill_elementary_atan2(p.z, p.y) - w->angle) / w->half_pitch;
        const double wide = mill_elementary_asin(half / away) / w->half_pitch + 1e-6;
        const double from = floor(at - wide), to = ceil(at + wide);
        if (to - from + 1.0 < w->arcs) {
            first = (int)(from - w->arcs * floor(from / w->arcs)) % w->arcs;
            count = (int)(to - from) + 1;
        }
    }
    while (count > 0 && !arc_in_reach(w, first, p, radius)) {
        first = (first + 1) % w->arcs;
        count--;
    }
    while (count > 0 && !arc_in_reach(w, (first + count - 1) % w->arcs, p, radius))
        count--;
    const struct mill_span span = {(int16_t)first, (int16_t)count};
    return span;
}
