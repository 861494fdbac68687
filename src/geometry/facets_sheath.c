/* Boxes along long facets. In a tree of boxes along the axes, the boxes of a fan of n needles all
 * overlap, and a search visits all of them. Here each node has a box along the longest side of its
 * facets. */
#include "geometry/facets.h"

#include <stdlib.h>

/* Facets longer than this part of their node's box get a box of their own */
#define LONG 0.5
/* Meshes have long facets if the boxes of all are so many times as large as the facets. */
#define ROOMY 30.0

struct dressing {
    const vec3 (*facet)[3];
    const struct mill_facets_tree *tree;
};

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

static vec3 unit(vec3 a)
{
    const double length = vec3_norm(a);
    return vec3_scale(a, length > 0.0 ? 1.0 / length : 0.0);
}

static void set_way(float way[3], vec3 a)
{
    way[0] = (float)a.x;
    way[1] = (float)a.y;
    way[2] = (float)a.z;
}

/* Any three directions give a valid box; those of this facet give a narrow one. */
static void lay_along(const struct dressing *d, struct mill_facets_sheath *s, int32_t facet,
                      int32_t first, int32_t end)
{
    const vec3 *p = d->facet[facet];
    int side = 0;
    longest_side(p, &side);
    const vec3 x = unit(vec3_sub(p[(side + 1) % 3], p[side]));
    const vec3 z = unit(vec3_cross(x, vec3_sub(p[(side + 2) % 3], p[side])));
    set_way(s->way[0], x);
    set_way(s->way[1], vec3_cross(z, x));
    set_way(s->way[2], z);
    for (int k = 0; k < 3; k++) {
        double lo = INFINITY, hi = -INFINITY;
        for (int32_t i = 3 * first; i < 3 * end; i++) {
            const vec3 corner = d->facet[d->tree->order[i / 3]][i % 3];
            const double at = mill_facets_along(s->way[k], corner);
            lo = at < lo ? at : lo;
            hi = at > hi ? at : hi;
        }
        s->lo[k] = (float)lo;
        s->hi[k] = (float)hi;
    }
}

/* Makes the sheaths of a node and of all below it, whose facets begin at *from, and puts *from
 * behind them. Returns the facet with the longest side. */
static int32_t wrap(const struct dressing *d, int32_t at, int32_t *from)
{
    const struct mill_facets_node *n = &d->tree->node[at];
    const int32_t first = *from;
    int32_t facet[2];
    int side;
    if (n->leaf == MILL_FACETS_INNER) {
        facet[0] = wrap(d, at + 1, from);
        facet[1] = wrap(d, d->tree->node[at + 1].skip, from);
    } else {
        *from += n->leaf & 7;
        facet[0] = d->tree->order[first];
        facet[1] = d->tree->order[*from - 1];
    }
    const double one = longest_side(d->facet[facet[0]], &side);
    const double other = longest_side(d->facet[facet[1]], &side);
    const int32_t longest = facet[one >= other ? 0 : 1];
    struct mill_facets_sheath s = {
        {{1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}, {0.0F, 0.0F, 1.0F}},
        {n->lo[0], n->lo[1], n->lo[2]},
        {n->hi[0], n->hi[1], n->hi[2]},
    };
    const vec3 size = {(double)n->hi[0] - (double)n->lo[0], (double)n->hi[1] - (double)n->lo[1],
                       (double)n->hi[2] - (double)n->lo[2]};
    if (fmax(one, other) > LONG * LONG * vec3_dot(size, size))
        lay_along(d, &s, longest, first, *from);
    const float blur = (float)mill_facets_blur(d->tree, vec3_make(d->tree->size, 0.0, 0.0));
    for (int k = 0; k < 3; k++) {
        s.lo[k] -= blur;
        s.hi[k] += blur;
    }
    d->tree->sheath[at] = s;
    return longest;
}

static bool is_needed(const vec3 (*facet)[3], size_t n)
{
    double boxes = 0.0, facets = 0.0;
    for (size_t k = 0; k < n; k++) {
        const vec3 *p = facet[k];
        const vec3 lo = {fmin(p[0].x, fmin(p[1].x, p[2].x)), fmin(p[0].y, fmin(p[1].y, p[2].y)),
                         fmin(p[0].z, fmin(p[1].z, p[2].z))};
        const vec3 hi = {fmax(p[0].x, fmax(p[1].x, p[2].x)), fmax(p[0].y, fmax(p[1].y, p[2].y)),
                         fmax(p[0].z, fmax(p[1].z, p[2].z))};
        const vec3 size = vec3_sub(hi, lo);
        boxes += size.x * size.y + size.y * size.z + size.z * size.x;
        facets += 0.5 * vec3_norm(vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0])));
    }
    return boxes > ROOMY * facets;
}

bool mill_facets_dress(struct mill_facets_tree *tree, const vec3 (*facet)[3], size_t n, bool always)
{
    const struct dressing d = {facet, tree};
    int32_t from = 0;
    if (!always && !is_needed(facet, n))
        return true;
    tree->sheath = malloc((size_t)tree->nodes * sizeof *tree->sheath);
    if (tree->sheath)
        wrap(&d, 0, &from);
    return tree->sheath != NULL;
}
