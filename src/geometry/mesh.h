/* Triangles: what a surface looks like to other programs. A mesh grows point by point; bodies of a
 * mill are made from prisms over a drum's profile, their ends, and boxes. */
#ifndef MILL_MESH_H
#define MILL_MESH_H

#include "geometry/shape.h"

struct mill_mesh {
    size_t points, triangles;
    vec3 *point;          /* [m] */
    int64_t (*corner)[3]; /* of each triangle: numbers of points, counter-clockwise as seen from the
                             side on which the balls are */
    bool failed;          /* out of memory: what came since is missing */
};

/* Starts empty as {0}. */
void mill_mesh_free(struct mill_mesh *mesh);

/* The side of a prism over a profile, from x = -half_length to +half_length, seen from within or
 * from outside. Its corners lie on the profile, no flat is farther from it than the tolerance [m],
 * nor than a hundredth of an arc's radius. */
void mill_mesh_mantle(struct mill_mesh *mesh, const struct mill_profile *profile,
                      double half_length, double tolerance, bool within);

/* What a drum draws (`draw` of struct mill_shape_type), whatever its profile: the chamber's wall.
 */
void mill_mesh_drum(const struct mill_shape *, const struct mill_chamber *, double tolerance,
                    struct mill_mesh *mesh);

/* The plane x = `x` as far as it lies within the profile, seen from where x is greater (side > 0)
 * or less. It meets the mantle of the same profile and tolerance corner by corner, to the bit. */
void mill_mesh_lid(struct mill_mesh *mesh, const struct mill_profile *profile, double x,
                   double side, double tolerance);

/* What a line in the half plane of (radius, axis) sweeps out about the body's own axis: line[n][2]
 * [m] from axis to axis, upwards. Seen from where the balls are. */
void mill_mesh_turned(struct mill_mesh *mesh, const struct mill_body *body, const double (*line)[2],
                      int n, double tolerance);

/* A triangle with corners of its own, counter-clockwise as seen */
void mill_mesh_triangle(struct mill_mesh *mesh, vec3 a, vec3 b, vec3 c);

/* A box seen from outside; corner i has the greater coordinate along its first, second, third axis
 * (right-handed) where bit 0, 1, 2 of i is set. */
void mill_mesh_box(struct mill_mesh *mesh, const vec3 corner[8]);

#endif
