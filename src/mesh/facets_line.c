/* Which facets does a straight line meet? The n needles of a fan all meet at their common corner: a
 * line from there leaves out nodes of many facets with this corner. It cannot go through these;
 * lying on them, as a side of another solid, it is between two of them, and covers less than one */
#include "mesh/facets_unite.h"

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
