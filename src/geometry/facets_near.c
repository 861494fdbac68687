/* The nearest point of a mesh, found by its tree, and the side of the surface on which a place is:
 * the normal of the nearest facet, edge or corner decides. Normals of edges and corners are sums of
 * the normals of their facets, weighted by the angles of the facets there (Baerentzen and Aanaes,
 * IEEE Trans. Vis. Comput. Graph. 11, 2005, 243). */
#include "geometry/facets_near.h"

vec3 mill_facets_outwards(const struct mill_facets *m, const struct mill_facets_near *near)
{
    const struct mill_facets_side *s = &m->side[near->facet];
    if (near->part >= MILL_FACETS_CORNER)
        return m->at_corner[s->corner[near->part - MILL_FACETS_CORNER]];
    if (near->part < MILL_FACETS_SIDE)
        return s->normal;
    const int32_t across = s->across[near->part - MILL_FACETS_SIDE];
    return across < 0 ? m->at_corner[-across] : vec3_add(s->normal, m->side[across].normal);
}

/* Square of the distance of a place from the boxes of a node [m^2] */
static float away(const struct mill_facets_tree *tree, int32_t at, vec3 place, const float p[3])
{
    float square = mill_facets_away(&tree->node[at], p), other = 0.0F;
    const struct mill_facets_sheath *s = tree->sheath ? &tree->sheath[at] : NULL;
    for (int k = 0; s && k < 3; k++) {
        const float along = (float)mill_facets_along(s->way[k], place);
        const float beyond = fmaxf(s->lo[k] - along, along - s->hi[k]);
        other += beyond > 0.0F ? beyond * beyond : 0.0F;
    }
    return other > square ? other : square;
}

/* It visits nearer boxes first, and omits boxes that are farther than the nearest point found. */
bool mill_facets_nearest(const struct mill_facets *m, vec3 place, double within,
                         struct mill_facets_near *near)
{
    struct {
        int32_t node;
        float square;
    } waits[MILL_FACETS_DEEPEST];
    const struct mill_facets_node *node = m->tree.node;
    const float p[3] = {(float)place.x, (float)place.y, (float)place.z};
    const double blur = mill_facets_blur(&m->tree, place);
    double least = within * within;
    int waiting = 0;
    near->facet = -1;
    waits[waiting].node = 0;
    waits[waiting++].square = away(&m->tree, 0, place, p);
    while (waiting > 0) {
        int32_t at = waits[--waiting].node;
        const double bound = sqrt(least) + blur, far = bound * bound * (1.0 + 1e-5);
        if ((double)waits[waiting].square > far)
            continue;
        while (node[at].leaf == MILL_FACETS_INNER) {
            const int32_t one = at + 1, other = node[one].skip;
            const float first = away(&m->tree, one, place, p);
            const float second = away(&m->tree, other, place, p);
            const bool turned = second < first;
            waits[waiting].node = turned ? one : other;
            waits[waiting++].square = turned ? first : second;
            at = turned ? other : one;
        }
        const int32_t begin = node[at].leaf >> 3, end = begin + (node[at].leaf & 7);
        for (int32_t k = begin; k < end; k++) {
            int part;
            const vec3 way = mill_facets_look(&m->flat[k], place, &part);
            const double square = vec3_dot(way, way);
            if (square < least) {
                least = square;
                *near = (struct mill_facets_near){.facet = k, .part = part, .way = way};
            }
        }
    }
    if (near->facet < 0)
        return false;
    near->d = sqrt(least);
    near->behind = vec3_dot(near->way, mill_facets_outwards(m, near)) < 0.0;
    return true;
}
