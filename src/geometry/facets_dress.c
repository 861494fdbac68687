/* In a tree of boxes along the axes, the boxes of a fan of n needles all overlap, and a search
 * visits all of them. So each node also has a box along the longest side of its facets. */
#include "geometry/facets.h"

#include <stdlib.h>

/* Facets longer than this part of their node's box get a box of their own. */
#define LONG 0.5
/* MANY: facets of a fan, or a node with long ones; LARGE: nodes of a tree searched for these */
enum { MANY = 64, LARGE = 10000 };

/* [m^2] square of the longest side, and which it is */
static double longest_side(const vec3 p[3], int *side)
{
    double most = -1.0;
    for (int k = 0; k < 3; k++) {
        const vec3 way = vec3_sub(p[(k + 1) % 3], p[k]);
        if (vec3_dot(way, way) > most) {
            most = vec3_dot(way, way);
            *side = k;
        }
    }
    return most;
}

/* Any direction gives a valid box; this one is a unit vector, if there is one. */
static void set_way(float way[3], vec3 a)
{
    const double length = vec3_norm(a), per = length > 0.0 ? 1.0 / length : 0.0;
    way[0] = (float)(a.x * per);
    way[1] = (float)(a.y * per);
    way[2] = (float)(a.z * per);
}

/* The box along a facet, around the facets from `first` to before `end` in the tree's order */
static void lay_along(struct mill_facets_sheath *s, const struct mill_facets_tree *tree,
                      const vec3 (*facet)[3], int32_t longest, int32_t first, int32_t end)
{
    const vec3 *p = facet[longest];
    int side = 0;
    longest_side(p, &side);
    const vec3 x = vec3_sub(p[(side + 1) % 3], p[side]);
    const vec3 z = vec3_cross(x, vec3_sub(p[(side + 2) % 3], p[side]));
    set_way(s->way[0], x);
    set_way(s->way[1], vec3_cross(z, x));
    set_way(s->way[2], z);
    for (int k = 0; k < 3; k++) {
        double lo = INFINITY, hi = -INFINITY;
        for (int32_t i = 3 * first; i < 3 * end; i++) {
            const double at = mill_facets_along(s->way[k], facet[tree->order[i / 3]][i % 3]);
            lo = at < lo ? at : lo;
            hi = at > hi ? at : hi;
        }
        s->lo[k] = (float)lo;
        s->hi[k] = (float)hi;
    }
}

/* Makes the sheath of a node. true: it has many long facets. */
static bool wrap(const struct mill_facets_tree *tree, const vec3 (*facet)[3], int32_t at,
                 const int32_t *hub)
{
    const struct mill_facets_node *n = &tree->node[at], *left = n,
                                  *right = &tree->node[n->skip - 1];
    while (left->leaf == MILL_FACETS_INNER)
        left++;
    const int32_t first = left->leaf >> 3, end = (right->leaf >> 3) + (right->leaf & 7);
    int32_t longest = tree->order[first];
    int side;
    struct mill_facets_sheath s = {
        {{1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}, {0.0F, 0.0F, 1.0F}},
        {n->lo[0], n->lo[1], n->lo[2]},
        {n->hi[0], n->hi[1], n->hi[2]},
        hub && end - first >= MANY ? hub[longest] : -1,
    };
    double most = 0.0, size = 0.0;
    for (int32_t i = first; i < end; i++) {
        const int32_t k = tree->order[i];
        const double square = longest_side(facet[k], &side);
        longest = square > most ? k : longest;
        most = fmax(most, square);
        s.hub = hub && hub[k] == s.hub ? s.hub : -1;
    }
    for (int k = 0; k < 3; k++)
        size += ((double)n->hi[k] - (double)n->lo[k]) * ((double)n->hi[k] - (double)n->lo[k]);
    const bool is_long = most > LONG * LONG * size;
    if (is_long)
        lay_along(&s, tree, facet, longest, first, end);
    const float blur = (float)mill_facets_blur(tree, vec3_make(tree->size, 0.0, 0.0));
    for (int k = 0; k < 3; k++) {
        s.lo[k] -= blur;
        s.hi[k] += blur;
    }
    tree->sheath[at] = s;
    return is_long && end - first >= MANY;
}

bool mill_facets_dress(struct mill_facets_tree *tree, const vec3 (*facet)[3], const int32_t *hub)
{
    bool many = hub != NULL;
    if (!many && tree->nodes < LARGE)
        return true;
    tree->sheath = malloc((size_t)tree->nodes * sizeof *tree->sheath);
    for (int32_t at = 0; tree->sheath && at < tree->nodes; at++)
        many = wrap(tree, facet, at, hub) || many;
    const bool good = tree->sheath != NULL;
    if (!many) {
        free(tree->sheath);
        tree->sheath = NULL;
    }
    return good;
}
