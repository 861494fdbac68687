/* Triangles of prisms, bodies of revolution and boxes. */
#include "geometry/mesh.h"

#include "base/elementary.h"

#include <assert.h>
#include <stdlib.h>

/* ---- growing ---- */

/* Makes room for one more element of an array. The room doubles if the count is a power of two.
 * NULL when out of memory; then the old array remains. */
static void *more(void *array, size_t count, size_t size, bool *failed)
{
    const bool full = (count & (count - 1)) == 0;
    void *grown = full ? realloc(array, (count > 0 ? 2 * count : 1) * size) : array;
    *failed = *failed || !grown;
    return grown;
}

static int64_t add_point(struct mill_mesh *mesh, vec3 point)
{
    vec3 *grown = more(mesh->point, mesh->points, sizeof *grown, &mesh->failed);
    if (!grown)
        return 0;
    mesh->point = grown;
    mesh->point[mesh->points] = point;
    return (int64_t)mesh->points++;
}

/* Adds a triangle, counter-clockwise or, if turned, clockwise */
static void triangle(struct mill_mesh *mesh, bool turned, int64_t a, int64_t b, int64_t c)
{
    int64_t(*grown)[3] = more(mesh->corner, mesh->triangles, sizeof *grown, &mesh->failed);
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

void mill_mesh_ring_add(struct mill_ring *ring, double x, double y)
{
    double(*grown)[2] = more(ring->at, ring->points, sizeof *grown, &ring->failed);
    if (!grown)
        return;
    ring->at = grown;
    ring->at[ring->points][0] = x;
    ring->at[ring->points++][1] = y;
}

void mill_mesh_ring_free(struct mill_ring *ring)
{
    free(ring->at);
}

/* > 0: the corner c is on the left of the line from a to b */
static double left_of(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Is the triangle of a corner and its neighbours within the line, and no other corner in it? */
static bool is_ear(const struct mill_ring *r, const size_t *last, const size_t *next, size_t k)
{
    const double *a = r->at[last[k]], *b = r->at[k], *c = r->at[next[k]];
    if (left_of(a, b, c) <= 0.0)
        return false;
    for (size_t i = next[next[k]]; i != last[k]; i = next[i]) {
        const double *p = r->at[i];
        if (left_of(r->at[last[i]], p, r->at[next[i]]) <= 0.0 && left_of(a, b, p) >= 0.0 &&
            left_of(b, c, p) >= 0.0 && left_of(c, a, p) >= 0.0)
            return false;
    }
    return true;
}

/* Fills a ring, whose first point in the mesh has this number, by cutting off ears (G. H. Meisters,
 * Amer. Math. Monthly 82 (1975) 648). Rounding may leave no ear: then any corner is cut off. */
static void cut_ears(struct mill_mesh *mesh, const struct mill_ring *ring, int64_t first,
                     bool turned)
{
    const size_t n = ring->points;
    size_t *next = malloc(2 * n * sizeof *next), *last = next + n, k = 0, failures = 0;
    mesh->failed = mesh->failed || !next;
    for (size_t i = 0; next && i < n; i++) {
        next[i] = (i + 1) % n;
        last[i] = (i + n - 1) % n;
    }
    for (size_t left = n; next && left > 2; k = next[k]) {
        if (!is_ear(ring, last, next, k) && failures++ < left)
            continue;
        triangle(mesh, turned, first + (int64_t)last[k], first + (int64_t)k,
                 first + (int64_t)next[k]);
        next[last[k]] = next[k];
        last[next[k]] = last[k];
        failures = 0;
        left--;
    }
    free(next);
}

static int64_t add_ring(struct mill_mesh *mesh, const struct mill_body *is,
                        const struct mill_ring *ring, double z)
{
    const int64_t first = (int64_t)mesh->points;
    for (size_t k = 0; k < ring->points; k++)
        add_point(mesh, mill_body_out(is, vec3_make(ring->at[k][0], ring->at[k][1], z)));
    return first;
}

void mill_mesh_prism(struct mill_mesh *mesh, const struct mill_body *is, int wall,
                     const struct mill_ring *ring)
{
    const double half = 0.5 * is->length;
    const int64_t n = (int64_t)ring->points;
    assert(ring->failed || n >= 3);
    mesh->failed = mesh->failed || ring->failed;
    if (mesh->failed)
        return;
    if (wall <= 0) {
        const int64_t low = add_ring(mesh, is, ring, -half), high = add_ring(mesh, is, ring, half);
        for (int64_t k = 0; k < n; k++) {
            const int64_t next = (k + 1) % n;
            quad(mesh, is->inside, low + k, low + next, high + next, high + k);
        }
    }
    for (int end = 0; end < 2; end++) {
        if (wall != MILL_SOLID_WHOLE && wall != 1 + end)
            continue;
        const double z = end == 0 ? -half : half;
        const bool turned = (end == 0) != (is->inside != 0);
        const int64_t axis =
            ring->fan ? add_point(mesh, mill_body_out(is, vec3_make(0.0, 0.0, z))) : 0;
        const int64_t rim = add_ring(mesh, is, ring, z);
        for (int64_t k = 0; ring->fan && k < n; k++)
            triangle(mesh, turned, axis, rim + k, rim + (k + 1) % n);
        if (!ring->fan)
            cut_ears(mesh, ring, rim, turned);
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
    /* every frame stores the points of moving bodies: no more than a picture needs */
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
