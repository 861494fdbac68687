/* Triangles of prisms and boxes. A profile (a circle is a profile of height 0) is divided into
 * pitches, each an outer arc and the inner arc after it. Arcs are divided into an even number of
 * equal chords, so that every half pitch is the mirror image of the next.
 *
 * The end of a prism consists of two parts in each half pitch. One is the fan of half an outer arc
 * from its centre. The other is the strip between half an inner arc and the line from the outer
 * centre to the axis, cut by rays from the inner centre. These rays meet both the arc and the line
 * once, so the strip has no folds, even if arcs overhang. */
#include "geometry/mesh.h"

#include "base/elementary.h"

#include <assert.h>
#include <stdlib.h>

/* ---- growing ---- */

/* Makes room for one more element of an array. The room doubles if the count is a power of two.
 * NULL when out of memory; then the old array remains. */
static void *more(void *array, size_t count, size_t size)
{
    const bool full = (count & (count - 1)) == 0;
    return full ? realloc(array, (count > 0 ? 2 * count : 1) * size) : array;
}

static int64_t add_point(struct mill_mesh *mesh, vec3 point)
{
    vec3 *grown = more(mesh->point, mesh->points, sizeof *grown);
    mesh->failed = mesh->failed || !grown;
    if (!grown)
        return 0;
    mesh->point = grown;
    mesh->point[mesh->points] = point;
    return (int64_t)mesh->points++;
}

/* Adds a triangle, counter-clockwise or, if turned, clockwise */
static void triangle(struct mill_mesh *mesh, bool turned, int64_t a, int64_t b, int64_t c)
{
    int64_t(*grown)[3] = more(mesh->corner, mesh->triangles, sizeof *grown);
    mesh->failed = mesh->failed || !grown;
    if (!grown)
        return;
    mesh->corner = grown;
    int64_t *corner = mesh->corner[mesh->triangles++];
    corner[0] = a;
    corner[1] = turned ? c : b;
    corner[2] = turned ? b : c;
}

void mill_mesh_free(struct mill_mesh *mesh)
{
    free(mesh->point);
    free(mesh->corner);
}

static void quad(struct mill_mesh *mesh, bool turned, int64_t a, int64_t b, int64_t c, int64_t d)
{
    triangle(mesh, turned, a, b, c);
    triangle(mesh, turned, a, c, d);
}

/* ---- prisms ---- */

/* The number of chords of half an outer and half an inner arc */
struct cut {
    int outer, inner;
    int pitch; /* chords of a whole pitch */
};

static int chords(double half, double widest)
{
    return half > 0.0 ? (int)fmax(ceil(half / widest), 1.0) : 0;
}

static struct cut cut(const struct mill_profile *p, double tolerance)
{
    assert(tolerance > 0.0);
    const double share = fmin(tolerance / p->arc, 0.01);
    const double widest = 4.0 * mill_elementary_asin(sqrt(0.5 * share));
    const int outer = chords(p->half_outer, widest), inner = chords(p->half_inner, widest);
    return (struct cut){outer, inner, 2 * (outer + inner)};
}

static vec3 polar(double x, double radius, double angle)
{
    const struct mill_heading at = mill_elementary_heading(angle);
    return vec3_make(x, radius * at.cos, radius * at.sin);
}

static double direction(const struct mill_profile *p, int pitch)
{
    return p->angle + 2.0 * MILL_PI * pitch / p->buckles;
}

/* Corner j of a pitch: on its outer arc, and after the joint on its inner arc */
static vec3 corner(const struct mill_profile *p, struct cut c, double x, int pitch, int j)
{
    const double ray = direction(p, pitch);
    if (j <= 2 * c.outer) {
        const double angle = ray + p->half_outer * (j - c.outer) / c.outer;
        return vec3_add(polar(x, p->outer, ray), polar(0.0, p->arc, angle));
    }
    const double between = ray + MILL_PI / p->buckles;
    const double angle = between + MILL_PI - p->half_inner * (j - 2 * c.outer - c.inner) / c.inner;
    return vec3_add(polar(x, p->inner, between), polar(0.0, p->arc, angle));
}

/* Adds all corners at x, counter-clockwise seen from greater x; returns the number of the first */
static int64_t ring(struct mill_mesh *mesh, const struct mill_profile *p, struct cut c, double x)
{
    const int64_t first = (int64_t)mesh->points;
    for (int k = 0; k < p->buckles; k++)
        for (int j = 0; j < c.pitch; j++)
            add_point(mesh, corner(p, c, x, k, j));
    return first;
}

void mill_mesh_mantle(struct mill_mesh *mesh, const struct mill_profile *p, double half_length,
                      double tolerance, bool within)
{
    const struct cut c = cut(p, tolerance);
    const int64_t count = (int64_t)p->buckles * c.pitch;
    const int64_t low = ring(mesh, p, c, -half_length), high = ring(mesh, p, c, half_length);
    for (int64_t k = 0; k < count; k++) {
        const int64_t next = (k + 1) % count;
        quad(mesh, within, low + k, low + next, high + next, high + k);
    }
}

/* Adds the points on the line from an outer centre to the axis: the centre, and the points on rays
 * from the inner centre to the corners of its arc (law of sines). The point on the axis exists
 * already. */
static void rung(struct mill_mesh *mesh, const struct mill_profile *p, struct cut c, double x,
                 int pitch)
{
    for (int i = 0; i < c.inner; i++) {
        const double at = p->half_inner * i / c.inner;
        const double way = 2.0 * p->arc * mill_elementary_heading(at).sin /
                           mill_elementary_heading(p->half_outer - at).sin;
        add_point(mesh, polar(x, p->outer - way, direction(p, pitch)));
    }
}

void mill_mesh_lid(struct mill_mesh *mesh, const struct mill_profile *p, double x, double side,
                   double tolerance)
{
    const struct cut c = cut(p, tolerance);
    const int64_t count = (int64_t)p->buckles * c.pitch;
    const bool turned = side < 0.0;
    const int64_t axis = add_point(mesh, vec3_make(x, 0.0, 0.0));
    const int64_t rim = ring(mesh, p, c, x);
    for (int k = 0; k < p->buckles; k++) {
        /* the arcs of a circle have their centre on the axis, so there is no line */
        const int64_t line = c.inner > 0 ? (int64_t)mesh->points : axis;
        const int64_t begin = (int64_t)k * c.pitch, joint = begin + 2 * c.outer;
        rung(mesh, p, c, x, k);
        for (int j = 0; j < 2 * c.outer; j++)
            triangle(mesh, turned, line, rim + begin + j, rim + (begin + j + 1) % count);
        for (int i = 0; i < c.inner; i++) {
            const int64_t near = i + 1 < c.inner ? line + i + 1 : axis;
            const int64_t before = begin + count - i;
            quad(mesh, turned, line + i, rim + joint + i, rim + (joint + i + 1) % count, near);
            quad(mesh, turned, line + i, near, rim + (before - 1) % count, rim + before % count);
        }
    }
}

/* ---- bodies ---- */

void mill_mesh_triangle(struct mill_mesh *mesh, vec3 a, vec3 b, vec3 c)
{
    const int64_t first = add_point(mesh, a);
    add_point(mesh, b);
    add_point(mesh, c);
    triangle(mesh, false, first, first + 1, first + 2);
}

/* Is a point of a line in the half plane off the axis? */
static bool is_off(const double at[2], double widest)
{
    return at[0] > 1e-9 * widest;
}

/* Adds m points around the axis, or one for a point on the axis; returns the number of the first */
static int64_t turned_ring(struct mill_mesh *mesh, const struct mill_body *is, const double at[2],
                           int m, double widest)
{
    const int64_t first = (int64_t)mesh->points;
    for (int k = 0; k < (is_off(at, widest) ? m : 1); k++) {
        const struct mill_heading to = mill_elementary_heading(2.0 * MILL_PI * k / m);
        const double r = is_off(at, widest) ? at[0] : 0.0;
        add_point(mesh, mill_body_out(is, vec3_make(r * to.cos, r * to.sin, at[1])));
    }
    return first;
}

void mill_mesh_turned(struct mill_mesh *mesh, const struct mill_body *is, const double (*line)[2],
                      int n, double tolerance)
{
    double widest = 0.0;
    for (int i = 0; i < n; i++)
        widest = fmax(widest, line[i][0]);
    /* every frame stores the points of moving bodies, so their number is limited to what a picture
     * needs */
    const double share = fmin(fmax(tolerance / widest, 3e-3), 0.05);
    const int m = 4 * (int)ceil(0.25 * MILL_PI / mill_elementary_asin(sqrt(0.5 * share)) / 2.0);
    const double *from = line[0];
    int64_t last = turned_ring(mesh, is, from, m, widest);
    for (int i = 1; i < n; i++) {
        const double *to = line[i], dr = to[0] - from[0], dz = to[1] - from[1];
        if (dr * dr + dz * dz < 1e-18 * widest * widest) /* the same point twice */
            continue;
        const int64_t ring = turned_ring(mesh, is, to, m, widest);
        for (int k = 0; k < m; k++) {
            const int64_t next = (k + 1) % m;
            if (is_off(from, widest) && is_off(to, widest))
                quad(mesh, is->inside, last + k, last + next, ring + next, ring + k);
            else if (is_off(from, widest))
                triangle(mesh, is->inside, last + k, last + next, ring);
            else
                triangle(mesh, is->inside, last, ring + next, ring + k);
        }
        last = ring;
        from = to;
    }
}

/* ---- boxes ---- */

/* Corner i has the greater coordinate along the first, second, third axis if bit 0, 1, 2 of i is
 * set. A container is mirrored, to be seen from inside. */
void mill_mesh_box(struct mill_mesh *mesh, const struct mill_body *is)
{
    static const int face[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                   {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    const int64_t first = (int64_t)mesh->points;
    const vec3 half = vec3_scale(is->size, 0.5);
    for (int i = 0; i < 8; i++) {
        const int k = i ^ (is->inside != 0);
        add_point(mesh,
                  mill_body_out(is, vec3_make(k & 1 ? half.x : -half.x, k & 2 ? half.y : -half.y,
                                              k & 4 ? half.z : -half.z)));
    }
    for (int i = 0; i < 6; i++)
        quad(mesh, false, first + face[i][0], first + face[i][1], first + face[i][2],
             first + face[i][3]);
}
