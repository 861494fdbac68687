/* The shells of a mesh: facets that hang together by their sides. And which facets does a straight
 * line meet? */
#include "mesh/facets_unite.h"

/* As brackets are paired: sides that wait for a partner are a list, each with the one before it in
 * pair[]. */
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

/* As n needles of a fan all meet at their common corner, a line from there leaves out the nodes of
 * many facets that all have this corner. It cannot go through these. If it lies on them, as a side
 * of another solid, it is between two of them, and covers less than one. */
static bool meets(const struct mill_facets_line *line, const struct mill_facets_sheath *s)
{
    double enter = 0.0, leave = 1.0; /* as parts of the line */
    if (s->hub >= 0 && (s->hub == line->skip[0] || s->hub == line->skip[1]))
        return false;
    for (int k = 0; k < 3 && enter <= leave; k++) {
        const double from = mill_facets_along(s->way[k], line->from);
        const double way = mill_facets_along(s->way[k], line->way);
        const double lo = (double)s->lo[k] - from, hi = (double)s->hi[k] - from;
        if (way == 0.0 && (lo > 0.0 || hi < 0.0))
            return false;
        if (way == 0.0)
            continue;
        enter = fmax(enter, (way > 0.0 ? lo : hi) / way);
        leave = fmin(leave, (way > 0.0 ? hi : lo) / way);
    }
    return enter <= leave;
}

int32_t mill_facets_line_on(struct mill_facets_line *line)
{
    while (line->next >= line->last) {
        if (line->at >= line->tree->nodes)
            return -1;
        const struct mill_facets_node *n = &line->tree->node[line->at];
        const bool near = meets(line, &line->tree->sheath[line->at]);
        line->at = near ? line->at + 1 : n->skip;
        if (near && n->leaf != MILL_FACETS_INNER) {
            line->next = n->leaf >> 3;
            line->last = line->next + (n->leaf & 7);
        }
    }
    return line->tree->order[line->next++];
}
