/* Where do impacts hit the parts of the mill, and how much energy do they leave on each facet? */
#ifndef MILL_WEAR_H
#define MILL_WEAR_H

#include "geometry/mesh.h"
#include "millsim/observer.h"
#include "observe/observe.h"
#include "observe/sums.h"

/* ---- triangles cut into small pieces ---- */

/* Half of the cross product of two edges: as long as the area [m^2], along the normal */
static inline vec3 mill_wear_pieces_area(const vec3 c[3])
{
    return vec3_scale(vec3_cross(vec3_sub(c[1], c[0]), vec3_sub(c[2], c[0])), 0.5);
}

static inline vec3 mill_wear_pieces_middle(const vec3 c[3])
{
    return vec3_scale(vec3_add(c[0], vec3_add(c[1], c[2])), 1.0 / 3.0);
}

/* Calls `on` for pieces, with edges of at most `size` [m], of a triangle or of all of a mesh.
 * Pieces of pieces are those of the whole. Inline: there are hundreds of thousands. */
typedef void mill_wear_pieces_on(void *to, const vec3 corner[3]);
static inline void mill_wear_pieces_of_triangle(const vec3 corner[3], double size,
                                                mill_wear_pieces_on *on, void *to)
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
        mill_wear_pieces_of_triangle((const vec3[3]){p, m, r}, size, on, to);
        part[0] = m;
        part[1] = q;
        part[2] = r;
    }
    on(to, part);
}

static inline void mill_wear_pieces_of(const struct mill_mesh *mesh, double size,
                                       mill_wear_pieces_on *on, void *to)
{
    for (size_t i = 0; i < mesh->triangles; i++) {
        const int64_t *c = mesh->corner[i];
        mill_wear_pieces_of_triangle(
            (const vec3[3]){mesh->point[c[0]], mesh->point[c[1]], mesh->point[c[2]]}, size, on, to);
    }
}

/* ---- facets (wear_facets.c) ---- */

/* The facets of a mill: each surface is divided into what lies in one cell of a lattice and faces
 * in one of six directions. The lattice is along the part's own axes, or length, radius and angle
 * if it can turn about its axis without a change. So the facet of an impact needs no search. */
enum { MILL_WEAR_FACES = 6 };

struct mill_wear_facet {
    int32_t part;
    int32_t face; /* 0..5: it faces -1, +1, -2, +2, -3 or +3 of the chart's coordinates */
    double area;  /* [m^2] */
    vec3 centre;  /* [m] in the frame of the part's motion */
};

/* One surface, or the walls of a body that holds the balls. Coordinates of the chart: x, y, z of
 * its frame; or, if it is round, x, the distance from x, and the angle about x times `radius`. */
struct mill_wear_part {
    int shape;            /* that draws it */
    int32_t first, count; /* its facets */
    struct mill_pose chart;
    bool round;
    double radius, cut; /* [m]; [m] size of a cell */
    int n[3];
    double from[3], size[3], per[3]; /* [m], [m], [1/m] of the lattice */
    int *joined; /* [n[1]] of a round part: cells along the angle that are one, near to the axis */
    int32_t *cell; /* [n[0]][n[1]][n[2]][6] number of the facet; -1: no surface is there */
};

struct mill_contour;

/* The facets of a world. They do not change. */
struct mill_wear_plan {
    int parts;
    int32_t facets;
    double area; /* [m^2] of all parts */
    struct mill_wear_part *part;
    int32_t *part_of; /* [shapes of the world] */
    struct mill_wear_facet *facet;
    const struct mill_world *world;
    const struct mill_contour *contour; /* that holds the balls; NULL: no contour does */
    double *along;                      /* [m] from its first corner to the ends of its pieces */
    struct mill_pose start[MILL_MOTIONS_MOST + 1]; /* at t = 0: what stands still, the motions */
};

/* Makes the facets of a world. false: out of memory. The caller frees the plan in both cases. */
bool mill_wear_facets_make(struct mill_wear_plan *plan, const struct mill_world *world);
void mill_wear_facets_free(struct mill_wear_plan *plan);

/* The facet at a place and direction in the frame of the part's motion; -1: the part has none */
int32_t mill_wear_facets_find(const struct mill_wear_plan *plan, int part, vec3 place, vec3 facing);

/* Number of the bin of the contour's developed length that an impact is in; -1: it is not on it */
enum { MILL_WEAR_BINS = 2000 };
int mill_wear_facets_bin(const struct mill_wear_plan *plan, const struct mill_impact *impact);

/* Length of the list of cells of a part, with a place for each face; 0: it has no facets */
size_t mill_wear_facets_cells(const struct mill_wear_part *part);

/* Draws all surfaces of a part in the frame of its motion. The caller frees the mesh. */
void mill_wear_facets_draw(const struct mill_wear_plan *plan, int part, struct mill_mesh *mesh);

/* [m] Longest edge of the pieces of mill_wear_pieces_of that the facets of a part are made of */
static inline double mill_wear_facets_piece(const struct mill_wear_part *part)
{
    return 0.5 * part->cut;
}

/* All surfaces as they are at t = 0, motion by motion, in triangles about as small as facets, one
 * or more for each facet, whose number is in `facet`. false: out of memory. Owner: the caller */
bool mill_wear_outline(const struct mill_wear_plan *plan, struct mill_mesh *mesh, int32_t **facet);

/* ---- sums ---- */

/* Sums of the impacts on a facet */
struct mill_wear_sum {
    uint64_t count;
    double normal, sliding; /* [J] lost along the normal, and in the surface */
    double slid;            /* [J] part of `sliding` of impacts that did not stick */
    double carved;          /* [J] Finnie's m g^2 f(angle); see wear.c */
};

extern const struct mill_sums_list mill_wear_sums, mill_wear_along_sums;

/* Of sum[facets], those of the impact's facet; NULL: it is not on a surface of this world. They are
 * requested from memory, so that a later call of mill_wear_impact need not wait for them. */
struct mill_wear_sum *mill_wear_facet(const struct mill_wear_plan *plan, struct mill_wear_sum *sum,
                                      const struct mill_impact *impact);
void mill_wear_impact(const struct mill_wear_plan *plan, struct mill_wear_sum *sum,
                      const struct mill_impact *impact);

/* Path of the triangles in the file, and the names of the numbers of each triangle */
#define MILL_WEAR_MESH "/statistics/wear/mesh"
enum { MILL_WEAR_SHOWN = 5 };
const char *mill_wear_shown(int k);

/* Writes the group "wear" of a window [s]. sum: [facets]; along: [bins]; law: [kinds] */
void mill_wear_tell(const struct mill_wear_plan *plan, struct mill_wear_sum *sum,
                    struct mill_wear_sum *along, double duration, const struct mill_wear_law *law,
                    struct mill_sink *sink);

#endif
