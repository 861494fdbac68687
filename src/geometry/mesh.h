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

/* Adds a box with sharp edges, seen from the side of the balls */
void mill_mesh_box(struct mill_mesh *mesh, const struct mill_body *box);

#endif
