/* Triangles of a surface, for other programs. A mesh grows point by point. The bodies of a mill are
 * made from prisms over a drum's profile, their ends, and boxes. */
#ifndef MILL_MESH_H
#define MILL_MESH_H

#include "base/profile.h"
#include "geometry/solid.h"

struct mill_mesh {
    size_t points, triangles;
    vec3 *point;          /* [m] */
    int64_t (*corner)[3]; /* of each triangle: numbers of points, counter-clockwise as seen from
                             the side of the balls */
    bool failed;          /* out of memory: later points and triangles are missing */
};

/* An empty mesh is {0}. */
void mill_mesh_free(struct mill_mesh *mesh);

/* Adds the side of a prism over a profile, from x = -half_length to +half_length, seen from inside
 * (within) or from outside. Its corners are on the profile. No flat is farther from the profile
 * than the tolerance [m] or than a hundredth of an arc's radius. */
void mill_mesh_mantle(struct mill_mesh *mesh, const struct mill_profile *profile,
                      double half_length, double tolerance, bool within);

/* Adds the part of the plane x = `x` inside the profile, seen from greater x (side > 0) or smaller
 * x. Its corners are equal, to the bit, to the corners of a mantle with the same profile and
 * tolerance. */
void mill_mesh_lid(struct mill_mesh *mesh, const struct mill_profile *profile, double x,
                   double side, double tolerance);

/* Adds the surface that a line in the half plane of (radius, axis) makes when it turns about the
 * body's own axis. line[n][2] [m] begins and ends on the axis and goes upwards. Seen from the side
 * of the balls. */
void mill_mesh_turned(struct mill_mesh *mesh, const struct mill_body *body, const double (*line)[2],
                      int n, double tolerance);

/* Adds a triangle with its own points, counter-clockwise as seen */
void mill_mesh_triangle(struct mill_mesh *mesh, vec3 a, vec3 b, vec3 c);

/* Half of the cross product of two edges: its length is the triangle's area [m^2], its direction
 * the normal. */
static inline vec3 mill_mesh_area(const vec3 c[3])
{
    return vec3_scale(vec3_cross(vec3_sub(c[1], c[0]), vec3_sub(c[2], c[0])), 0.5);
}

static inline vec3 mill_mesh_middle(const vec3 c[3])
{
    return vec3_scale(vec3_add(c[0], vec3_add(c[1], c[2])), 1.0 / 3.0);
}

/* Calls `on` for pieces of a triangle, or of all triangles of a mesh, whose edges are at most
 * `size` [m]. Pieces of pieces are those of the whole. Inline, because there are hundreds of
 * thousands of pieces. */
typedef void mill_mesh_on_piece(void *to, const vec3 corner[3]);
static inline void mill_mesh_cut_triangle(const vec3 corner[3], double size, mill_mesh_on_piece *on,
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
        mill_mesh_cut_triangle((const vec3[3]){p, m, r}, size, on, to);
        part[0] = m;
        part[1] = q;
        part[2] = r;
    }
    on(to, part);
}

static inline void mill_mesh_cut(const struct mill_mesh *mesh, double size, mill_mesh_on_piece *on,
                                 void *to)
{
    for (size_t i = 0; i < mesh->triangles; i++) {
        const int64_t *c = mesh->corner[i];
        mill_mesh_cut_triangle(
            (const vec3[3]){mesh->point[c[0]], mesh->point[c[1]], mesh->point[c[2]]}, size, on, to);
    }
}

/* Adds a box seen from outside. Corner i has the greater coordinate along the first, second, third
 * axis (right-handed) if bit 0, 1, 2 of i is set. */
void mill_mesh_box(struct mill_mesh *mesh, const vec3 corner[8]);

#endif
