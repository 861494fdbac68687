/* The distance of a place from a contour, from its corners alone: of each side in turn, in extended
 * precision. Shared by the unit tests and the fuzz target of contours. */
#ifndef CONTOUR_ORACLE_H
#define CONTOUR_ORACLE_H

#include "millsim/setup.h"

#include <math.h>
#include <stdbool.h>

enum { MOST_CORNERS = 1024 };

struct contour {
    struct mill_corner corner[MOST_CORNERS];
    size_t n;
    double far;                 /* [m] none of its corners is farther from the origin */
    double reach[MOST_CORNERS]; /* [m] no point of a side is farther from its corner */
};

/* How far a place is beside a side and from its chord */
struct seen_side {
    long double d; /* [m] > 0 */
    bool within;   /* between chord and arc */
};

/* The power of a place q with respect to the circle through a and b, over the diameter, is
 * w (q - a) . (q - b) - cosine n . (q - a), where 1 / w is the diameter: it has no far centre. */
static inline struct seen_side see_side(const struct mill_corner *from,
                                        const struct mill_corner *to, long double x, long double y)
{
    const long double ex = (long double)to->x - from->x, ey = (long double)to->y - from->y,
                      c = sqrtl(ex * ex + ey * ey);
    const long double u = from->bulge, per = 1.0L / (1.0L + u * u);
    const long double cosine = (1.0L - u * u) * per, sine = 2.0L * u * per, w = sine / c;
    const long double ax = x - from->x, ay = y - from->y, bx = x - to->x, by = y - to->y;
    const long double left = (ex * ay - ey * ax) / c;
    const long double power = w * (ax * bx + ay * by) - cosine * left;
    /* along the tangents of both ends */
    const long double a = cosine * (ax * ex + ay * ey) + sine * (ax * ey - ay * ex);
    const long double b = -(cosine * (bx * ex + by * ey) - sine * (bx * ey - by * ex));
    const bool beside = fabsl(u) <= 1.0L ? a >= 0.0L && b >= 0.0L : a >= 0.0L || b >= 0.0L;
    /* the place from the centre of the circle, over the radius */
    const long double gx = w * (ax + bx) + cosine * ey / c, gy = w * (ay + by) - cosine * ex / c;
    const long double root = sqrtl(gx * gx + gy * gy);
    return (struct seen_side){beside ? fabsl(2.0L * power / (1.0L + root))
                                     : sqrtl(fminl(ax * ax + ay * ay, bx * bx + by * by)),
                              u > 0.0L ? power < 0.0L && left < 0.0L
                                       : u < 0.0L && power > 0.0L && left > 0.0L};
}

/* [m] the distance of a place from a contour; < 0: it is outside of the area */
/* The point at a share of a side, and the normal there: to the left. In the drum's plane, x = 0 */
static inline vec3 contour_at(const struct mill_corner *from, const struct mill_corner *to,
                              double share, vec3 *normal)
{
    const double x = to->x - from->x, y = to->y - from->y, l = hypot(x, y), u = from->bulge;
    const double half = 2.0 * atan(u), a = half * (2.0 * share - 1.0);
    const bool flat = fabs(u) < 1e-12;
    const double along = flat ? share : 0.5 * (1.0 + sin(a) / sin(half));
    const double down = flat ? 0.0 : 0.5 * (cos(a) - cos(half)) / sin(half);
    *normal = vec3_make(0.0, (-y * cos(a) - x * sin(a)) / l, (x * cos(a) - y * sin(a)) / l);
    return vec3_make(0.0, from->x + along * x + down * y, from->y + along * y - down * x);
}

/* Sets what is not a corner. */
static inline void contour_measure(struct contour *c)
{
    c->far = 0.0;
    for (size_t k = 0; k < c->n; k++) {
        const struct mill_corner *a = &c->corner[k], *b = &c->corner[(k + 1) % c->n];
        const double u = fabs(a->bulge), l = hypot(b->x - a->x, b->y - a->y);
        c->far = fmax(c->far, hypot(a->x, a->y));
        c->reach[k] = (u > 1.0 ? 0.5 * (u + 1.0 / u) : 1.0) * l * (1.0 + 1e-9);
    }
}

/* [m] < 0: the place is outside of the area */
static inline long double contour_distance(const struct contour *c, long double x, long double y)
{
    static size_t hint; /* the side that was the nearest one */
    long double least = INFINITY;
    bool in = false;
    const size_t first = hint;
    for (size_t i = 0; i < c->n; i++) {
        const size_t k = (first + i) % c->n;
        const struct mill_corner *a = &c->corner[k], *b = &c->corner[(k + 1) % c->n];
        const long double ax = x - a->x, ay = y - a->y, most = least + c->reach[k];
        if ((a->y > y) != (b->y > y))
            in = in !=
                 (a->x + (y - a->y) / ((long double)b->y - a->y) * ((long double)b->x - a->x) > x);
        if (ax * ax + ay * ay > most * most && ax * ax + ay * ay > c->reach[k] * c->reach[k])
            continue;
        const struct seen_side s = see_side(a, b, x, y);
        in = in != s.within;
        if (s.d < least) {
            least = s.d;
            hint = k;
        }
    }
    return in ? least : -least;
}

#endif
