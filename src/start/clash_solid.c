/* Bodies as unions of convex parts: a convex body is one part, any other has one for each facet. */
#include "start/clash_solid.h"

#include "geometry/facets.h"

#include <stdlib.h>

/* ---- the tree ---- */

struct item {
    double key; /* [m] coordinate along the longest side */
    int32_t part;
};

static int by_key(const void *a, const void *b)
{
    const struct item *p = a, *q = b;
    return p->key != q->key ? (p->key > q->key) - (p->key < q->key)
                            : (p->part > q->part) - (p->part < q->part);
}

static double along(vec3 a, int axis)
{
    return axis == 0 ? a.x : (axis == 1 ? a.y : a.z);
}

/* Fills in the node around the items and all nodes below it. Returns the first unused node. */
static int32_t grow(struct mill_clash_solid *s, int32_t node, struct item *item, int32_t count)
{
    struct mill_clash_node *n = &s->node[node];
    vec3 lo = s->part[item[0].part].centre, hi = lo;
    for (int32_t k = 1; k < count; k++) {
        const vec3 c = s->part[item[k].part].centre;
        lo = vec3_make(fmin(lo.x, c.x), fmin(lo.y, c.y), fmin(lo.z, c.z));
        hi = vec3_make(fmax(hi.x, c.x), fmax(hi.y, c.y), fmax(hi.z, c.z));
    }
    const vec3 side = vec3_sub(hi, lo);
    const int axis = side.x >= side.y && side.x >= side.z ? 0 : (side.y >= side.z ? 1 : 2);
    *n = (struct mill_clash_node){.centre = vec3_axpy(lo, 0.5, side), .part = -1};
    for (int32_t k = 0; k < count; k++) {
        const struct mill_part *p = &s->part[item[k].part];
        n->radius = fmax(n->radius, vec3_norm(vec3_sub(p->centre, n->centre)) + p->around);
        item[k].key = along(p->centre, axis);
    }
    if (count == 1) {
        n->part = item[0].part;
        return node + 1;
    }
    qsort(item, (size_t)count, sizeof *item, by_key);
    n->left = node + 1;
    n->right = grow(s, node + 1, item, count / 2);
    return grow(s, n->right, item + count / 2, count - count / 2);
}

static bool plant(struct mill_clash_solid *s)
{
    struct item *item = malloc(sizeof *item * (size_t)s->parts);
    s->node = malloc(sizeof *s->node * 2 * (size_t)s->parts);
    for (int32_t k = 0; item && k < s->parts; k++)
        item[k].part = k;
    if (item && s->node)
        grow(s, 0, item, s->parts);
    free(item);
    return item && s->node;
}

/* ---- solids ---- */

bool mill_clash_solid_init(struct mill_clash_solid *s, const struct mill_setup *setup, int k,
                           struct mill_motion *const *motion)
{
    const struct mill_setup_surface *surface = &setup->surface[k];
    const struct mill_solid *solid = surface->solid;
    *s = (struct mill_clash_solid){
        .surface = k,
        .kind = surface->kind,
        .motion = surface->motion == MILL_STILL ? NULL : motion[surface->motion],
        .body = surface->body,
        .convex = solid->support,
        .turned = solid->round,
        .ball = solid->ball,
        .axis = surface->body->z};
    return mill_part_list(solid, surface->body, &s->part, &s->parts) && plant(s);
}

void mill_clash_solid_free(struct mill_clash_solid *s)
{
    free(s->part);
    free(s->node);
}

/* The solid angles of all facets add up to 4 pi for a point inside the solid, to 0 for one
 * outside. */
bool mill_clash_solid_holds(const struct mill_clash_solid *solid, vec3 place)
{
    double angle = 0.0;
    if (vec3_norm(vec3_sub(place, solid->node->centre)) > solid->node->radius)
        return false;
    for (int32_t k = 0; k < solid->parts; k++) {
        const struct mill_part *p = &solid->part[k];
        const vec3 from = vec3_sub(p->centre, place), *c = p->core.corner;
        angle +=
            mill_facets_angle(vec3_add(from, c[0]), vec3_add(from, c[1]), vec3_add(from, c[2]));
    }
    return fabs(angle) > MILL_PI;
}
