/* Triangles of a surface, for other programs. A mesh grows point by point. */
#ifndef MILL_MESH_H
#define MILL_MESH_H

#include "geometry/solid.h"

struct mill_mesh {
    size_t points, triangles;
    vec3 *point;          /* [m] */
    int64_t (*corner)[3]; /* [triangles] points, counter-clockwise as balls see them */
    bool failed;          /* out of memory: later points and triangles are missing */
};

/* An empty mesh is {0}. */
void mill_mesh_free(struct mill_mesh *mesh);

/* A closed line in a body's own x and y, counter-clockwise. fan: triangles from the axis fill it */
struct mill_ring {
    size_t points;
    double (*at)[2]; /* [m] */
    bool fan, failed;
};

void mill_mesh_ring_add(struct mill_ring *ring, double x, double y);
void mill_mesh_ring_free(struct mill_ring *ring);

/* Adds the prism over a ring, as long as the body, seen from the side of the balls. wall: see
 * `outline` of struct mill_solid; 0 is its side, 1 and 2 are its ends at own z < 0 and > 0. */
void mill_mesh_prism(struct mill_mesh *mesh, const struct mill_body *body, int wall,
                     const struct mill_ring *ring);

/* Adds the surface that a line in the half plane of (radius, axis) makes when it turns about the
 * body's own axis. line[n][2] [m] goes upwards, from the axis to the axis. Seen from the balls. */
void mill_mesh_turned(struct mill_mesh *mesh, const struct mill_body *body, const double (*line)[2],
                      int n, double tolerance);

/* Adds a triangle with its own points, counter-clockwise as seen */
void mill_mesh_triangle(struct mill_mesh *mesh, vec3 a, vec3 b, vec3 c);

/* Adds a box with sharp edges, seen from the side of the balls */
void mill_mesh_box(struct mill_mesh *mesh, const struct mill_body *box);

#endif
