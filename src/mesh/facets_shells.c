/* The shells of a mesh: facets that hang together by their sides. */
#include "mesh/facets_unite.h"

/* As brackets are paired: sides that wait are a list, each with the one before it in pair[]. */
size_t mill_facets_pair(struct mill_facets_joints *j, const bool *gone)
{
    size_t alone = 0;
    for (size_t k = 0, end; k < j->edges; k = end) {
        int32_t waits = -1;
        end = k + mill_facets_sharing(j, k);
        for (size_t i = k; i < end; i++) {
            const int32_t other = waits;
            j->pair[i] = -1;
            if (gone[j->edge[i].facet])
                continue;
            if (other < 0 || j->edge[other].forward == j->edge[i].forward) {
                j->pair[i] = waits;
                waits = (int32_t)i;
                continue;
            }
            waits = j->pair[other];
            j->pair[other] = (int32_t)i;
            j->pair[i] = other;
        }
        for (int32_t before; waits >= 0; waits = before, alone++) {
            before = j->pair[waits];
            j->pair[waits] = -1;
        }
    }
    return alone;
}

void mill_facets_shells(const struct mill_facets_joints *j, bool apart, int32_t *root)
{
    for (size_t k = 0; 3 * k < j->edges; k++)
        root[k] = (int32_t)k;
    for (size_t k = 0, end; k < j->edges; k = end) {
        end = k + mill_facets_sharing(j, k);
        for (size_t i = k; i < end && !(apart && end - k > 2); i++)
            if (j->pair[i] >= 0)
                mill_facets_merge(root, j->edge[i].facet, j->edge[j->pair[i]].facet);
    }
    for (size_t k = 0; 3 * k < j->edges; k++)
        root[k] = mill_facets_root(root, (int32_t)k);
}
