/* A tree of boxes around facets. Boxes are split by the surface area heuristic: among a few planes
 * normal to each axis, it takes the plane with the minimum sum of (number of facets) x (area of
 * their box) (Wald, IEEE Symposium on Interactive Ray Tracing 2007, 33). */
#include "geometry/facets.h"

#include <stdlib.h>

enum {
    BINS = 12,
    LEAF = 2,    /* maximum number of facets in one leaf; below 8 */
    HALVING = 32 /* from this level on, halves of boxes limit the number of levels */
};

struct box {
    float lo[3], hi[3];
};

struct item {
    struct box box;
    float middle[3];
    int32_t facet;
};

struct growth {
    struct item *item;
    struct mill_facets_node *node;
    int32_t nodes;
};

static const struct box nothing = {{INFINITY, INFINITY, INFINITY},
                                   {-INFINITY, -INFINITY, -INFINITY}};

static void include(struct box *box, const struct box *other)
{
    for (int k = 0; k < 3; k++) {
        box->lo[k] = other->lo[k] < box->lo[k] ? other->lo[k] : box->lo[k];
        box->hi[k] = other->hi[k] > box->hi[k] ? other->hi[k] : box->hi[k];
    }
}

static double area(const struct box *b)
{
    const double x = (double)b->hi[0] - (double)b->lo[0], y = (double)b->hi[1] - (double)b->lo[1];
    const double z = (double)b->hi[2] - (double)b->lo[2];
    return x >= 0.0 ? x * y + y * z + z * x : 0.0;
}

/* The nearest float, not below (side 1) or above (side -1) */
static float rounded(double x, float side)
{
    const float f = (float)x;
    return (double)side * ((double)f - x) < 0.0 ? nextafterf(f, side * (float)INFINITY) : f;
}

static struct item item_of(const vec3 corner[3], int32_t facet)
{
    struct item item = {.facet = facet};
    for (int k = 0; k < 3; k++) {
        double c[3];
        for (int i = 0; i < 3; i++)
            c[i] = k == 0 ? corner[i].x : k == 1 ? corner[i].y : corner[i].z;
        item.box.lo[k] = rounded(fmin(c[0], fmin(c[1], c[2])), -1.0F);
        item.box.hi[k] = rounded(fmax(c[0], fmax(c[1], c[2])), 1.0F);
        item.middle[k] = 0.5F * (item.box.lo[k] + item.box.hi[k]);
    }
    return item;
}

/* A plane between two bins, normal to an axis */
struct split {
    int axis, bin;
    float from, per; /* bin of a middle m: (m - from) * per */
    double cost;
};

static int bin_of(const struct split *s, const struct item *item)
{
    const int bin = (int)((item->middle[s->axis] - s->from) * s->per);
    return bin < BINS - 1 ? bin : BINS - 1;
}

/* The best plane normal to one axis; its cost is INFINITY if all centres are in one bin. */
static struct split split_across(const struct item *item, int32_t n, int axis)
{
    struct split s = {axis, 0, item[0].middle[axis], 0.0F, INFINITY};
    struct box box[BINS], left = nothing, right[BINS + 1];
    int32_t count[BINS] = {0}, before = 0;
    float to = s.from;
    for (int32_t k = 1; k < n; k++) {
        s.from = item[k].middle[axis] < s.from ? item[k].middle[axis] : s.from;
        to = item[k].middle[axis] > to ? item[k].middle[axis] : to;
    }
    s.per = (float)BINS / (to - s.from);
    if (!(s.per < (float)INFINITY))
        return s;
    for (int b = 0; b < BINS; b++)
        box[b] = nothing;
    for (int32_t k = 0; k < n; k++) {
        const int b = bin_of(&s, &item[k]);
        count[b]++;
        include(&box[b], &item[k].box);
    }
    right[BINS] = nothing;
    for (int b = BINS - 1; b >= 0; b--) {
        right[b] = right[b + 1];
        include(&right[b], &box[b]);
    }
    for (int b = 1; b < BINS; b++) {
        include(&left, &box[b - 1]);
        before += count[b - 1];
        const double cost = area(&left) * before + area(&right[b]) * (n - before);
        if (before > 0 && before < n && cost < s.cost) {
            s.cost = cost;
            s.bin = b;
        }
    }
    return s;
}

/* Puts the facets on the near side of the best plane first and returns their number */
static int32_t part(struct item *item, int32_t n, int level)
{
    struct split best = {.cost = INFINITY};
    for (int axis = 0; axis < 3 && level < HALVING; axis++) {
        const struct split s = split_across(item, n, axis);
        best = s.cost < best.cost ? s : best;
    }
    if (!(best.cost < (double)INFINITY))
        return n / 2;
    int32_t near = 0;
    for (int32_t k = 0; k < n; k++) {
        if (bin_of(&best, &item[k]) >= best.bin)
            continue;
        const struct item other = item[near];
        item[near++] = item[k];
        item[k] = other;
    }
    return near;
}

static void grow(struct growth *g, int32_t from, int32_t to, int level)
{
    struct mill_facets_node *node = &g->node[g->nodes++];
    struct box box = nothing;
    for (int32_t k = from; k < to; k++)
        include(&box, &g->item[k].box);
    for (int k = 0; k < 3; k++) {
        node->lo[k] = box.lo[k];
        node->hi[k] = box.hi[k];
    }
    node->leaf = MILL_FACETS_INNER;
    if (to - from <= LEAF) {
        node->leaf = 8 * from + (to - from);
    } else {
        const int32_t near = from + part(g->item + from, to - from, level);
        grow(g, from, near, level + 1);
        grow(g, near, to, level + 1);
    }
    node->skip = g->nodes;
}

bool mill_facets_plant(const vec3 (*facet)[3], size_t n, struct mill_facets_tree *tree)
{
    *tree = (struct mill_facets_tree){.nodes = 0};
    struct growth g = {.item = malloc(n * sizeof *g.item)};
    g.node = tree->node = malloc(2 * n * sizeof *g.node);
    tree->order = malloc(n * sizeof *tree->order);
    const bool good = g.item && g.node && tree->order && n > 0;
    for (size_t k = 0; good && k < n; k++)
        g.item[k] = item_of(facet[k], (int32_t)k);
    if (good)
        grow(&g, 0, (int32_t)n, 0);
    for (size_t k = 0; good && k < n; k++)
        tree->order[k] = g.item[k].facet;
    for (int k = 0; good && k < 3; k++)
        tree->size =
            fmax(tree->size, fmax(fabs((double)g.node->lo[k]), fabs((double)g.node->hi[k])));
    tree->nodes = g.nodes;
    free(g.item);
    return good;
}

void mill_facets_fell(struct mill_facets_tree *tree)
{
    free(tree->node);
    free(tree->sheath);
    free(tree->order);
}
