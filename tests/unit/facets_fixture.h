/* Meshes for the tests of facets, and the distance to them in extended precision by another way:
 * all triangles one by one, inside or outside by the solid angle that the surface fills. */
#ifndef FACETS_FIXTURE_H
#define FACETS_FIXTURE_H

#include "extended.h"
#include "geometry/mesh.h"
#include "lone_shape.h"
#include "mesh/facets_unite.h"
#include "shape_fixture.h"

enum { MESH_ROOM = 20000 };

/* A form whose facets may be changed */
struct form {
    struct mill_body is;
    vec3 facet[MESH_ROOM][3];
};

static inline struct mill_body body_at_rest(void)
{
    return (struct mill_body){.x = {1.0, 0.0, 0.0}, .y = {0.0, 1.0, 0.0}, .z = {0.0, 0.0, 1.0}};
}

static inline void form_open(struct form *m)
{
    m->is = body_at_rest();
    m->is.facet = (const vec3(*)[3])m->facet;
}

static inline void form_add(struct form *m, vec3 a, vec3 b, vec3 c)
{
    ck_assert_uint_lt(m->is.facets, MESH_ROOM);
    vec3 *f = m->facet[m->is.facets++];
    f[0] = a;
    f[1] = b;
    f[2] = c;
}

static inline void form_add_quad(struct form *m, vec3 a, vec3 b, vec3 c, vec3 d)
{
    form_add(m, a, b, c);
    form_add(m, a, c, d);
}

static inline void form_add_box(struct form *m, vec3 centre, vec3 size)
{
    static const int face[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                   {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    vec3 c[8];
    for (int i = 0; i < 8; i++)
        c[i] =
            vec3_add(centre, vec3_make((i & 1 ? 0.5 : -0.5) * size.x, (i & 2 ? 0.5 : -0.5) * size.y,
                                       (i & 4 ? 0.5 : -0.5) * size.z));
    for (int i = 0; i < 6; i++)
        form_add_quad(m, c[face[i][0]], c[face[i][1]], c[face[i][2]], c[face[i][3]]);
}

/* Rings of `around` corners and two poles at random distances from the middle: edges and corners
 * that bulge, that are hollow, and both */
static inline void form_lump(uint64_t *seed, struct form *m, int around, int rings, double radius,
                             double rough)
{
    vec3 *at = malloc((size_t)(around * rings) * sizeof *at), pole[2];
    ck_assert_ptr_nonnull(at);
    for (int k = 0; k < 2; k++)
        pole[k] = vec3_make(0.0, 0.0, (k ? 1.0 : -1.0) * radius * uniform(seed, 1.0 - rough, 1.0));
    for (int i = 0; i < rings * around; i++) {
        const double up = PI * ((i / around + 1.0) / (rings + 1.0) - 0.5);
        const double to = 2.0 * PI * (i % around) / around;
        const double far = radius * uniform(seed, 1.0 - rough, 1.0);
        at[i] = vec3_make(far * cos(up) * cos(to), far * cos(up) * sin(to), far * sin(up));
    }
    form_open(m);
    for (int k = 0; k < around; k++) {
        const int next = (k + 1) % around, top = (rings - 1) * around;
        form_add(m, pole[0], at[next], at[k]);
        form_add(m, pole[1], at[top + k], at[top + next]);
        for (int ring = 0; ring + 1 < rings; ring++)
            form_add_quad(m, at[ring * around + k], at[ring * around + next],
                          at[(ring + 1) * around + next], at[(ring + 1) * around + k]);
    }
    free(at);
}

/* What is said about a form */
struct heard {
    char said[MILL_FACETS_TOLD][260];
    int count;
    struct mill_facets_report found;
};

static inline void hear_fault(void *self, const char *text)
{
    struct heard *h = self;
    ck_assert_int_lt(h->count, MILL_FACETS_TOLD);
    strcpy(h->said[h->count++], text);
}

/* Leaves of a form what balls can meet; coordinates are told in mm. */
static inline void form_unite(struct form *m, struct heard *h)
{
    *h = (struct heard){.found = {.unit = 1e-3, .fault = hear_fault, .self = h}};
    ck_assert(mill_facets_unite(&m->is, m->facet, &h->found));
}

static inline struct wide wide_cross(struct wide a, struct wide b)
{
    return (struct wide){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* From the line between two places */
static inline real wide_from_line(struct wide p, struct wide a, struct wide b)
{
    const struct wide way = wide_axpy(b, -1.0L, a), q = wide_axpy(p, -1.0L, a);
    const real share = fminl(fmaxl(wide_dot(q, way) / wide_dot(way, way), 0.0L), 1.0L);
    const struct wide rest = wide_axpy(q, -share, way);
    return sqrtl(wide_dot(rest, rest));
}

static inline real wide_from_facet(struct wide p, const vec3 f[3])
{
    const struct wide c[3] = {wide_of(f[0]), wide_of(f[1]), wide_of(f[2])};
    const struct wide n = wide_cross(wide_axpy(c[1], -1.0L, c[0]), wide_axpy(c[2], -1.0L, c[0]));
    bool over = true;
    real least = INFINITY;
    for (int k = 0; k < 3; k++) {
        const struct wide side = wide_axpy(c[(k + 1) % 3], -1.0L, c[k]);
        over = over && wide_dot(wide_cross(n, side), wide_axpy(p, -1.0L, c[k])) >= 0.0L;
        least = fminl(least, wide_from_line(p, c[k], c[(k + 1) % 3]));
    }
    return over ? fabsl(wide_dot(n, wide_axpy(p, -1.0L, c[0]))) / sqrtl(wide_dot(n, n)) : least;
}

/* Part of the full solid angle that a facet fills (van Oosterom and Strackee 1983) */
static inline real wide_filled(struct wide p, const vec3 f[3])
{
    struct wide a[3];
    real l[3];
    for (int k = 0; k < 3; k++) {
        a[k] = wide_axpy(wide_of(f[k]), -1.0L, p);
        l[k] = sqrtl(wide_dot(a[k], a[k]));
    }
    const real over = wide_dot(a[0], wide_cross(a[1], a[2]));
    const real under = l[0] * l[1] * l[2] + wide_dot(a[0], a[1]) * l[2] +
                       wide_dot(a[1], a[2]) * l[0] + wide_dot(a[2], a[0]) * l[1];
    return 2.0L * atan2l(over, under) / (2.0L * TWO_PI);
}

/* Signed distance from the surface, > 0 where balls may be; p in the motion's frame */
static inline real wide_from_mesh(const struct mill_body *is, struct wide p)
{
    const struct wide q = wide_axpy(p, -1.0L, wide_of(is->centre));
    const struct wide own = {wide_dot(q, wide_of(is->x)), wide_dot(q, wide_of(is->y)),
                             wide_dot(q, wide_of(is->z))};
    real least = INFINITY, filled = 0.0L;
    for (size_t k = 0; k < is->facets; k++) {
        least = fminl(least, wide_from_facet(own, is->facet[k]));
        filled += wide_filled(own, is->facet[k]);
    }
    return (filled > 0.5L) == is->inside ? least : -least;
}

#endif
