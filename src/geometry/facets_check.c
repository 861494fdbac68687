/* Is a mesh the surface of a solid? Three conditions:
 *
 * It is closed: each edge belongs to exactly two facets, which go along it in opposite directions.
 *
 * It faces outwards: the enclosed volume is positive, also of each connected part, except cavities.
 *
 * It does not cross itself: no side of a facet goes through the inside of another one, by more than
 * the rounding to single precision of an STL file can cause. */
#include "geometry/facets.h"
#include "geometry/solid.h"

#include <stdio.h>

/* Fraction of its longest side: a facet with less height has no area */
#define NO_AREA 1e-9
/* Fraction of the maximum coordinate: error of two surfaces rounded to single precision */
#define ROUNDED 2.5e-7
/* of facets whose boxes overlap; takes about 15 s */
enum { MOST_PAIRS = 1000000000 };

/* ---- facets and edges ---- */

static bool has_area(const vec3 p[3])
{
    const vec3 ab = vec3_sub(p[1], p[0]), ac = vec3_sub(p[2], p[0]), bc = vec3_sub(p[2], p[1]);
    const double longest = fmax(vec3_dot(ab, ab), fmax(vec3_dot(ac, ac), vec3_dot(bc, bc)));
    return vec3_norm(vec3_cross(ab, ac)) > NO_AREA * longest;
}

static const char *find_flat(const struct mill_body *is, char text[MILL_SHAPE_FAULT])
{
    for (size_t k = 0; k < is->facets; k++) {
        if (has_area(is->facet[k]))
            continue;
        snprintf(text, MILL_SHAPE_FAULT,
                 "facet %zu has no area: take it out in the program that made the mesh (often "
                 "called \"remove degenerate faces\")",
                 k + 1);
        return text;
    }
    return NULL;
}

/* What is wrong with an edge that is shared by `sides` sides, of which *e is the first */
static const char *judge_edge(const struct mill_body *is, const struct mill_facets_edge *e,
                              size_t sides, char text[MILL_SHAPE_FAULT])
{
    const vec3 from = is->facet[e->facet][e->side], to = is->facet[e->facet][(e->side + 1) % 3];
    if (sides == 2 && e[0].forward != e[1].forward)
        return NULL;
    if (sides == 1)
        snprintf(text, MILL_SHAPE_FAULT,
                 "facet %d has no neighbour along its edge from (%.6g, %.6g, %.6g) to (%.6g, "
                 "%.6g, %.6g) m: the mesh is not closed; fill the hole",
                 e->facet + 1, from.x, from.y, from.z, to.x, to.y, to.z);
    else if (sides == 2)
        snprintf(text, MILL_SHAPE_FAULT,
                 "facets %d and %d share an edge, but one faces outwards and the other inwards: "
                 "turn one over (swap two of its corners)",
                 e[0].facet + 1, e[1].facet + 1);
    else
        snprintf(text, MILL_SHAPE_FAULT,
                 "%zu facets share one edge, %d, %d and %d among them, where there must be two: "
                 "part the solids that touch there, or unite them",
                 sides, e[0].facet + 1, e[1].facet + 1, e[2].facet + 1);
    return text;
}

static const char *find_open(const struct mill_body *is, const struct mill_facets_joints *j,
                             char text[MILL_SHAPE_FAULT])
{
    const char *fault = NULL;
    for (size_t k = 0, step; k < j->edges && !fault; k += step) {
        step = mill_facets_sharing(j, k);
        fault = judge_edge(is, &j->edge[k], step, text);
    }
    return fault;
}

/* ---- crossings ---- */

/* Does a side of `one` go through the inside of the other facet, by more than `least` [m]? */
static bool pierces(const vec3 one[3], const vec3 other[3], double least)
{
    const vec3 cross = vec3_cross(vec3_sub(other[1], other[0]), vec3_sub(other[2], other[0]));
    const vec3 n = vec3_scale(cross, 1.0 / vec3_norm(cross));
    double over[3];
    for (int k = 0; k < 3; k++)
        over[k] = vec3_dot(n, vec3_sub(one[k], other[0]));
    bool found = false;
    for (int k = 0; k < 3 && !found; k++) {
        const double from = over[k], to = over[(k + 1) % 3];
        if (!((from > least && to < -least) || (from < -least && to > least)))
            continue;
        const vec3 way = vec3_sub(one[(k + 1) % 3], one[k]);
        const vec3 at = vec3_axpy(one[k], from / (from - to), way);
        found = true;
        for (int i = 0; i < 3 && found; i++) {
            const vec3 side = vec3_sub(other[(i + 1) % 3], other[i]);
            const double off = vec3_dot(vec3_cross(n, side), vec3_sub(at, other[i]));
            found = off > least * vec3_norm(side);
        }
    }
    return found;
}

/* Facets that share a corner or an edge need no exception: a side that only touches does not
 * pierce. */
static bool cross(const vec3 one[3], const vec3 other[3], double least)
{
    return pierces(one, other, least) || pierces(other, one, least);
}

static bool meets(const struct mill_facets_node *n, const vec3 lo, const vec3 hi)
{
    return (double)n->lo[0] <= hi.x && (double)n->hi[0] >= lo.x && (double)n->lo[1] <= hi.y &&
           (double)n->hi[1] >= lo.y && (double)n->lo[2] <= hi.z && (double)n->hi[2] >= lo.z;
}

/* The first facet after number `one` in the tree's order that crosses it, or -1. *left: how many
 * more pairs may be compared. */
static int32_t crossed_by(const struct mill_body *is, const struct mill_facets_tree *tree,
                          int32_t one, long *left)
{
    const vec3 *p = is->facet[tree->order[one]];
    const vec3 lo = {fmin(p[0].x, fmin(p[1].x, p[2].x)), fmin(p[0].y, fmin(p[1].y, p[2].y)),
                     fmin(p[0].z, fmin(p[1].z, p[2].z))};
    const vec3 hi = {fmax(p[0].x, fmax(p[1].x, p[2].x)), fmax(p[0].y, fmax(p[1].y, p[2].y)),
                     fmax(p[0].z, fmax(p[1].z, p[2].z))};
    for (int32_t at = 0; at < tree->nodes;) {
        const struct mill_facets_node *n = &tree->node[at];
        const bool near = meets(n, lo, hi);
        const int32_t first = n->leaf >> 3, end = first + (n->leaf & 7);
        at = near ? at + 1 : n->skip;
        if (!near || n->leaf == MILL_FACETS_INNER)
            continue;
        for (int32_t k = first > one ? first : one + 1; k < end; k++)
            if (--*left < 0 || cross(p, is->facet[tree->order[k]], ROUNDED * tree->size))
                return k;
    }
    return -1;
}

static const char *find_crossing(const struct mill_body *is, const struct mill_facets_tree *tree,
                                 char text[MILL_SHAPE_FAULT])
{
    long left = MOST_PAIRS;
    for (int32_t k = 0; k < (int32_t)is->facets; k++) {
        const int32_t other = crossed_by(is, tree, k, &left);
        if (other < 0)
            continue;
        if (left < 0) {
            snprintf(text, MILL_SHAPE_FAULT,
                     "too many long facets lie side by side to check that none cross, as in a disc "
                     "of thousands of sectors: simplify the mesh");
            return text;
        }
        const int32_t a = tree->order[k] + 1, b = tree->order[other] + 1;
        snprintf(text, MILL_SHAPE_FAULT,
                 "facets %d and %d cross: unite the parts into one solid in the program that made "
                 "the mesh, or give each a file of its own",
                 a < b ? a : b, a < b ? b : a);
        return text;
    }
    return NULL;
}

static const char *find_turned(const struct mill_body *is, const struct mill_facets_joints *j,
                               char text[MILL_SHAPE_FAULT])
{
    int32_t turned = -1;
    if (!(mill_facets_solid.volume(is) > 0.0))
        snprintf(text, MILL_SHAPE_FAULT,
                 "its facets face into the solid: turn all of them over (\"flip normals\" in the "
                 "program that made the mesh)");
    else if (!mill_facets_shells(is, j, &turned))
        snprintf(text, MILL_SHAPE_FAULT, "out of memory for %zu facets", is->facets);
    else if (turned == MILL_FACETS_HOLLOW)
        snprintf(text, MILL_SHAPE_FAULT,
                 "it has more cavities than can be checked: leave out those that no ball can "
                 "reach");
    else if (turned >= 0)
        snprintf(text, MILL_SHAPE_FAULT,
                 "facet %d and all that hang together with it face into their solid: turn them "
                 "over (\"flip normals\" of that part)",
                 turned + 1);
    else
        return NULL;
    return text;
}

const char *mill_facets_fault(const struct mill_body *is, char text[MILL_SHAPE_FAULT])
{
    if (!mill_solid_is_sound(&mill_facets_solid, is)) {
        snprintf(text, MILL_SHAPE_FAULT,
                 "it has %zu facets: a closed mesh takes at least 4, of finite coordinates",
                 is->facets);
        return text;
    }
    const char *fault = find_flat(is, text);
    struct mill_facets_joints joints = {0};
    struct mill_facets_tree tree = {0};
    const bool good = fault || (mill_facets_join(is->facet, is->facets, &joints) &&
                                mill_facets_plant(is->facet, is->facets, &tree));
    if (!good) {
        snprintf(text, MILL_SHAPE_FAULT, "out of memory for %zu facets", is->facets);
        fault = text;
    }
    if (!fault)
        fault = find_open(is, &joints, text);
    if (!fault)
        fault = find_turned(is, &joints, text);
    if (!fault)
        fault = find_crossing(is, &tree, text);
    mill_facets_part(&joints);
    mill_facets_fell(&tree);
    return fault;
}
