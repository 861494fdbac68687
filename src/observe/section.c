/* How much of a map's cell lies inside the drum? For the circle by integration in closed form; for
 * any other profile by asking the drum's own gap function, so that this file need not know the
 * profile. */
#include "observe/section.h"

#include "base/elementary.h"

#include "geometry/shape.h"

#include <math.h>

enum {
    ANGLES = 720, /* directions in which a profile is measured */
    SUBS = 32     /* sub-points of a cell or ring along each direction, a power of two */
};

/* The drum unless it is (within 1e-9 of its radius) the circle, or there is none to ask: then NULL.
 */
static const struct mill_shape *odd_drum(const struct mill_world *world)
{
    const double radius = world->drum_radius;
    for (int i = 0; i < world->shapes; i++) {
        const struct mill_shape *shape = world->shape[i];
        if (shape->type->kind != MILL_BALL_DRUM)
            continue;
        for (int k = 0; k < ANGLES; k++) {
            const double angle = 2 * MILL_PI * k / ANGLES;
            const struct mill_heading at = mill_elementary_heading(angle);
            const vec3 p = vec3_make(0, radius * at.cos, radius * at.sin);
            if (!(fabs(mill_shape_gap(shape, p, 0, &mill_pose_still)) < 1e-9 * radius))
                return shape;
        }
    }
    return NULL;
}

static double gap_at(const struct mill_shape *drum, double y, double z)
{
    return mill_shape_gap(drum, vec3_make(0, y, z), 0, &mill_pose_still);
}

double mill_section_radius(const struct mill_world *world)
{
    const struct mill_shape *drum = odd_drum(world);
    double farthest = world->drum_radius;
    if (!drum)
        return farthest;
    for (int k = 0; k < ANGLES; k++) {
        const struct mill_heading at = mill_elementary_heading(2 * MILL_PI * k / ANGLES);
        double r = 0; /* steps of the gap's length never pass the wall */
        for (int step = 0; step < 1000; step++) {
            const double gap = gap_at(drum, r * at.cos, r * at.sin);
            if (!(gap > 1e-9 * world->drum_radius) || r > 10 * world->drum_radius)
                break;
            r += gap;
        }
        farthest = fmax(farthest, r);
    }
    return farthest;
}

/* Integral of sqrt(R^2 - y^2) */
static double under_arc(double radius, double y)
{
    const double s = fmin(1, y / radius);
    return 0.5 * radius * radius * (s * sqrt(1 - s * s) + mill_elementary_asin(s));
}

/* Area of [y0, y1] x [z0, z1], all >= 0, inside the circle */
static double inside_circle(double radius, double y0, double y1, double z0, double z1)
{
    const double full = sqrt(fmax(0, radius * radius - z1 * z1)); /* y up to which all of it is */
    const double none = sqrt(fmax(0, radius * radius - z0 * z0)); /* y from which nothing is */
    const double a = fmin(fmax(full, y0), y1), b = fmin(fmax(none, a), y1);
    const double arc = under_arc(radius, b) - under_arc(radius, a) - z0 * (b - a);
    const double area = (a - y0) * (z1 - z0) + arc;
    return area > 1e-9 * (y1 - y0) * (z1 - z0) ? area : 0; /* a corner on the circle is no area */
}

/* How many of subs x subs sub-points of a square, the middles of equal parts, lie inside any
 * profile. subs is a power of two: squares that the wall does not come near are settled at once,
 * others are quartered. */
static int points_inside(const struct mill_shape *drum, double y0, double z0, double size, int subs)
{
    const double gap = gap_at(drum, y0 + size / 2, z0 + size / 2);
    if (subs == 1 || fabs(gap) > 0.71 * size)
        return gap > 0 ? subs * subs : 0;
    int inside = 0;
    for (int quarter = 0; quarter < 4; quarter++)
        inside += points_inside(drum, y0 + (quarter / 2 ? size / 2 : 0),
                                z0 + (quarter % 2 ? size / 2 : 0), size / 2, subs / 2);
    return inside;
}

static double inside_profile(const struct mill_shape *drum, double y0, double z0, double size)
{
    return size * size * points_inside(drum, y0, z0, size, SUBS) / (SUBS * SUBS);
}

void mill_section_cells(const struct mill_world *world, double radius, int n, double *area)
{
    const struct mill_shape *drum = odd_drum(world);
    const double size = 2 * radius / n;
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++) {
            if (drum) {
                area[i * n + k] = inside_profile(drum, i * size - radius, k * size - radius, size);
            } else { /* the quadrants are alike */
                const int p = i < n / 2 ? n / 2 - 1 - i : i - n / 2;
                const int q = k < n / 2 ? n / 2 - 1 - k : k - n / 2;
                area[i * n + k] = inside_circle(world->drum_radius, p * size, (p + 1) * size,
                                                q * size, (q + 1) * size);
            }
        }
    }
}

void mill_section_rings(const struct mill_world *world, double radius, int n, double *area)
{
    const struct mill_shape *drum = odd_drum(world);
    const double size = radius / n, bore = drum ? gap_at(drum, 0, 0) : 0;
    for (int i = 0; i < n; i++) {
        area[i] = 0;
        for (int j = 0; j < SUBS; j++) { /* of equal area */
            const double r0 = i * size, r1 = r0 + size;
            const double r = sqrt(r0 * r0 + (r1 * r1 - r0 * r0) * (j + 0.5) / SUBS);
            const bool whole = !drum || r < bore; /* the wall is no nearer to the axis */
            int inside = whole ? ANGLES : 0;
            for (int k = 0; !whole && k < ANGLES; k++) {
                const struct mill_heading at = mill_elementary_heading(2 * MILL_PI * k / ANGLES);
                inside += gap_at(drum, r * at.cos, r * at.sin) > 0;
            }
            area[i] += MILL_PI * (r1 * r1 - r0 * r0) / SUBS * inside / ANGLES;
        }
    }
}
