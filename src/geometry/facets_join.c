/* Finds which facets of a mesh share corners and edges. Corners are sorted by their coordinates,
 * and equal ones get one number. Sides are sorted by the numbers of their ends. */
#include "geometry/facets.h"

#include <stdlib.h>

struct corner {
    vec3 at;
    int32_t place; /* 3 * facet + corner */
};

static int by_coordinates(const void *a, const void *b)
{
    const struct corner *p = a, *q = b;
    if (p->at.x != q->at.x)
        return p->at.x < q->at.x ? -1 : 1;
    if (p->at.y != q->at.y)
        return p->at.y < q->at.y ? -1 : 1;
    if (p->at.z != q->at.z)
        return p->at.z < q->at.z ? -1 : 1;
    return p->place < q->place ? -1 : 1;
}

static int by_ends(const void *a, const void *b)
{
    const struct mill_facets_edge *p = a, *q = b;
    if (p->low != q->low)
        return p->low < q->low ? -1 : 1;
    if (p->high != q->high)
        return p->high < q->high ? -1 : 1;
    return p->facet < q->facet || (p->facet == q->facet && p->side < q->side) ? -1 : 1;
}

static bool number_corners(const vec3 (*facet)[3], size_t n, int32_t (*number)[3])
{
    struct corner *corner = malloc(3 * n * sizeof *corner);
    if (!corner)
        return false;
    for (size_t k = 0; k < 3 * n; k++)
        corner[k] = (struct corner){facet[k / 3][k % 3], (int32_t)k};
    qsort(corner, 3 * n, sizeof *corner, by_coordinates);
    int32_t last = 0;
    for (size_t k = 0; k < 3 * n; k++) {
        const vec3 a = corner[k].at, b = corner[k > 0 ? k - 1 : 0].at;
        last += a.x != b.x || a.y != b.y || a.z != b.z;
        number[corner[k].place / 3][corner[k].place % 3] = last;
    }
    free(corner);
    return true;
}

bool mill_facets_join(const vec3 (*facet)[3], size_t n, struct mill_facets_joints *j)
{
    *j = (struct mill_facets_joints){.edges = 3 * n};
    j->corner = malloc(n * sizeof *j->corner);
    j->edge = malloc(3 * n * sizeof *j->edge);
    j->pair = malloc(3 * n * sizeof *j->pair);
    if (!j->corner || !j->edge || !j->pair || !number_corners(facet, n, j->corner))
        return false;
    for (size_t k = 0; k < 3 * n; k++) {
        const int32_t from = j->corner[k / 3][k % 3], to = j->corner[k / 3][(k + 1) % 3];
        const bool forward = from < to;
        j->edge[k] =
            (struct mill_facets_edge){forward ? from : to, forward ? to : from, (int32_t)(k / 3),
                                      (int16_t)(k % 3), (int16_t)forward};
    }
    qsort(j->edge, 3 * n, sizeof *j->edge, by_ends);
    return true;
}

void mill_facets_part(struct mill_facets_joints *j)
{
    free(j->corner);
    free(j->edge);
    free(j->pair);
}
