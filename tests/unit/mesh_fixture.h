/* Triangles of outlines: where they face, what they enclose, and whether they have gaps. */
#ifndef MESH_FIXTURE_H
#define MESH_FIXTURE_H

#include "geometry/mesh.h"
#include "unit.h"

#include <stdlib.h>

static inline vec3 corner(const struct mill_mesh *mesh, size_t triangle, int k)
{
    const int64_t point = mesh->corner[triangle][k];
    ck_assert(point >= 0 && point < (int64_t)mesh->points);
    return mesh->point[point];
}

/* Half the cross product of two sides: its length is the area, its direction where it faces */
static inline vec3 facing(const struct mill_mesh *mesh, size_t t)
{
    const vec3 a = corner(mesh, t, 0);
    return vec3_scale(vec3_cross(vec3_sub(corner(mesh, t, 1), a), vec3_sub(corner(mesh, t, 2), a)),
                      0.5);
}

/* Of the body that the triangles enclose, counter-clockwise seen from outside [m^3] */
static inline double enclosed_by(const struct mill_mesh *mesh)
{
    double sum = 0.0;
    for (size_t t = 0; t < mesh->triangles; t++)
        sum +=
            vec3_dot(corner(mesh, t, 0), vec3_cross(corner(mesh, t, 1), corner(mesh, t, 2))) / 6.0;
    return sum;
}

/* ---- edges ---- */

struct edge {
    vec3 from, to;
    int way; /* +1 as it is, -1 turned round */
};

static inline int order(vec3 a, vec3 b)
{
    if (a.x != b.x)
        return a.x < b.x ? -1 : 1;
    if (a.y != b.y)
        return a.y < b.y ? -1 : 1;
    return a.z == b.z ? 0 : (a.z < b.z ? -1 : 1);
}

static inline int compare(const void *one, const void *two)
{
    const struct edge *a = one, *b = two;
    const int from = order(a->from, b->from);
    return from ? from : order(a->to, b->to);
}

static inline size_t add_edges(const struct mill_mesh *mesh, struct edge *edge)
{
    size_t n = 0;
    for (size_t t = 0; t < mesh->triangles; t++) {
        for (int k = 0; k < 3; k++) {
            const struct edge e = {corner(mesh, t, k), corner(mesh, t, (k + 1) % 3), 1};
            const struct edge turned = {e.to, e.from, -1};
            const int way = order(e.from, e.to);
            if (way != 0) /* a flat of no length joins what is one */
                edge[n++] = way < 0 ? e : turned;
        }
    }
    return n;
}

/* Every edge is walked once each way, its ends being the same to the bit. */
static inline void assert_closed(const struct mill_mesh *mesh, size_t meshes)
{
    size_t n = 0, room = 0;
    for (size_t k = 0; k < meshes; k++)
        room += 3 * mesh[k].triangles;
    struct edge *edge = malloc(room * sizeof *edge);
    for (size_t k = 0; k < meshes; k++)
        n += add_edges(&mesh[k], edge + n);
    qsort(edge, n, sizeof *edge, compare);
    for (size_t i = 0; i < n;) {
        int sum = 0;
        size_t k = i;
        for (; k < n && compare(&edge[i], &edge[k]) == 0; k++)
            sum += edge[k].way;
        ck_assert_msg(sum == 0 && k - i >= 2, "edge (%g %g %g)-(%g %g %g) is open", edge[i].from.x,
                      edge[i].from.y, edge[i].from.z, edge[i].to.x, edge[i].to.y, edge[i].to.z);
        i = k;
    }
    free(edge);
}

#endif
