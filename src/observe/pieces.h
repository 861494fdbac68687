/* Triangles cut into small pieces, for facets */
#ifndef MILL_PIECES_H
#define MILL_PIECES_H

#include "geometry/mesh.h"

/* Half of the cross product of two edges: as long as the area [m^2], along the normal */
static inline vec3 mill_pieces_area(const vec3 c[3])
{
    return vec3_scale(vec3_cross(vec3_sub(c[1], c[0]), vec3_sub(c[2], c[0])), 0.5);
}

static inline vec3 mill_pieces_middle(const vec3 c[3])
{
    return vec3_scale(vec3_add(c[0], vec3_add(c[1], c[2])), 1.0 / 3.0);
}

/* Calls `on` for pieces, with edges of at most `size` [m], of a triangle or of all of a mesh.
 * Pieces of pieces are those of the whole. Inline: there are hundreds of thousands. */
typedef void mill_pieces_on(void *to, const vec3 corner[3]);
static inline void mill_pieces_of_triangle(const vec3 corner[3], double size, mill_pieces_on *on,
                                           void *to)
{
    vec3 part[3] = {corner[0], corner[1], corner[2]};
    for (;;) {
        const vec3 a = part[0], b = part[1], c = part[2];
        const vec3 ab = vec3_sub(b, a), bc = vec3_sub(c, b), ca = vec3_sub(a, c);
        const double x = vec3_dot(ab, ab), y = vec3_dot(bc, bc), z = vec3_dot(ca, ca);
        const double later = y > z ? y : z, longest = x > later ? x : later;
        if (!(longest > size * size))
            break;
        /* halve the longest edge, from p to q */
        const vec3 p = x == longest ? a : y == longest ? b : c;
        const vec3 q = x == longest ? b : y == longest ? c : a;
        const vec3 r = x == longest ? c : y == longest ? a : b;
        const vec3 m = vec3_scale(vec3_add(p, q), 0.5);
        mill_pieces_of_triangle((const vec3[3]){p, m, r}, size, on, to);
        part[0] = m;
        part[1] = q;
        part[2] = r;
    }
    on(to, part);
}

static inline void mill_pieces_of(const struct mill_mesh *mesh, double size, mill_pieces_on *on,
                                  void *to)
{
    for (size_t i = 0; i < mesh->triangles; i++) {
        const int64_t *c = mesh->corner[i];
        mill_pieces_of_triangle(
            (const vec3[3]){mesh->point[c[0]], mesh->point[c[1]], mesh->point[c[2]]}, size, on, to);
    }
}

#endif
