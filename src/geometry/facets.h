/* What files about meshes share: which facets meet at corners and edges, and the tree of boxes */
#ifndef MILL_FACETS_H
#define MILL_FACETS_H

#include "base/elementary.h"
#include "geometry/shape.h"
#include "millsim/setup.h"

/* Numbers of facets have 32 bits; the number of a leaf also contains its count. */
enum { MILL_FACETS_MOST = 1 << 27 };

/* ---- joints ---- */

/* One side of a facet */
struct mill_facets_edge {
    int32_t low, high; /* its corners, the smaller number first */
    int32_t facet;
    int16_t side;    /* from corner `side` of the facet to the next one */
    int16_t forward; /* 1: it goes from low to high */
};

/* Corners with equal coordinates have one number. */
struct mill_facets_joints {
    size_t edges;
    int32_t (*corner)[3];          /* numbers of a facet's corners */
    struct mill_facets_edge *edge; /* [3 n] sorted by low, high, facet */
    int32_t *pair;                 /* [3 n] for who looks for the shells of the mesh */
};

/* false: out of memory. Owner: the caller, in any case. */
bool mill_facets_join(const vec3 (*facet)[3], size_t n, struct mill_facets_joints *joints);
void mill_facets_part(struct mill_facets_joints *joints);

/* The number of sides, from side k on, that share the edge of side k */
static inline size_t mill_facets_sharing(const struct mill_facets_joints *j, size_t k)
{
    size_t end = k + 1;
    while (end < j->edges && j->edge[end].low == j->edge[k].low &&
           j->edge[end].high == j->edge[k].high)
        end++;
    return end - k;
}

/* ---- tree ---- */

/* A box around facets. Nodes have the order of a walk: the first child follows its parent. */
struct mill_facets_node {
    float lo[3], hi[3]; /* [m] rounded outwards */
    int32_t skip;       /* the next node of a walk that skips all nodes within this box */
    int32_t leaf;       /* 8 * first facet + number of facets; MILL_FACETS_INNER: it has children */
};
enum { MILL_FACETS_INNER = -1, MILL_FACETS_DEEPEST = 64 /* maximum number of levels of nodes */ };

/* What the facets of a node have in common (facets_dress.c). Boxes along the axes around long
 * facets, as those of a fan, overlap all the others. */
struct mill_facets_sheath {
    float way[3][3];    /* directions of a box along the longest of their sides */
    float lo[3], hi[3]; /* [m] along these */
    int32_t hub;        /* a corner of all of them, if they are many; -1: none */
};

struct mill_facets_tree {
    int32_t nodes;
    struct mill_facets_node *node;
    struct mill_facets_sheath *sheath; /* of each node; NULL: no facets are that long */
    int32_t *order; /* [n] facets in the order of the leaves, which give indices into this list */
    double size;    /* [m] the maximum of all coordinates */
};

/* false: out of memory. Owner: the caller, in any case. */
bool mill_facets_plant(const vec3 (*facet)[3], size_t n, struct mill_facets_tree *tree);
void mill_facets_fell(struct mill_facets_tree *tree);

/* [m] Bound of the error of a distance from a place due to rounding to floats */
static inline double mill_facets_blur(const struct mill_facets_tree *tree, vec3 place)
{
    return 1e-6 * (tree->size + fabs(place.x) + fabs(place.y) + fabs(place.z));
}

/* Square of the distance of a place from a box [m^2] */
static inline float mill_facets_away(const struct mill_facets_node *n, const float p[3])
{
    float square = 0.0F;
    for (int k = 0; k < 3; k++) {
        const float below = n->lo[k] - p[k], above = p[k] - n->hi[k];
        const float beyond = below > above ? below : above;
        const float twice = beyond + fabsf(beyond); /* no branch: it would be mispredicted */
        square += twice * twice;
    }
    return 0.25F * square;
}

/* A walk through all facets whose boxes intersect a sphere */
struct mill_facets_walk {
    const struct mill_facets_node *node;
    int32_t at, nodes, next, last;
    float p[3], square;
};

static inline struct mill_facets_walk mill_facets_set_out(const struct mill_facets_tree *tree,
                                                          vec3 place, double radius)
{
    const double far = radius + mill_facets_blur(tree, place);
    return (struct mill_facets_walk){tree->node, .nodes = tree->nodes,
                                     .p = {(float)place.x, (float)place.y, (float)place.z},
                                     .square = (float)(far * far * (1.0 + 1e-5))};
}

/* The next facet, as an index in the tree's order; -1: the walk is at its end */
static inline int32_t mill_facets_walk_on(struct mill_facets_walk *w)
{
    while (w->next >= w->last) {
        if (w->at >= w->nodes)
            return -1;
        const struct mill_facets_node *n = &w->node[w->at];
        const bool meets = mill_facets_away(n, w->p) <= w->square;
        w->at = meets ? w->at + 1 : n->skip;
        if (meets && n->leaf != MILL_FACETS_INNER) {
            w->next = n->leaf >> 3;
            w->last = w->next + (n->leaf & 7);
        }
    }
    return w->next++;
}

/* Adds sheaths to a tree. hub: [n] a corner of each facet; NULL: sheaths are only added if there
 * are many long facets. false: out of memory. */
bool mill_facets_dress(struct mill_facets_tree *tree, const vec3 (*facet)[3], const int32_t *hub);

static inline double mill_facets_along(const float way[3], vec3 p)
{
    return (double)way[0] * p.x + (double)way[1] * p.y + (double)way[2] * p.z;
}

/* [rad] Half of the solid angle of a facet, with its corners relative to a place; > 0: seen from
 * behind (A. van Oosterom & J. Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125) */
static inline double mill_facets_angle(vec3 a, vec3 b, vec3 c)
{
    const double x = vec3_norm(a), y = vec3_norm(b), z = vec3_norm(c);
    return mill_elementary_atan2(vec3_dot(a, vec3_cross(b, c)), x * y * z + vec3_dot(a, b) * z +
                                                                    vec3_dot(b, c) * x +
                                                                    vec3_dot(c, a) * y);
}

#endif
