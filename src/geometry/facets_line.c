/* Which facets does a straight line meet? Of n needles around one corner, each side meets all the
 * others there, and no box parts them. So a walk can leave out the nodes whose facets all have one
 * of the line's ends as a corner. */
#include "geometry/facets.h"

#include <stdlib.h>

/* Finds what the facets of a node and of all below it have in common. hub[n]: a corner of each */
static void compare(struct mill_facets_lines *l, const int32_t *hub, int32_t at)
{
    const struct mill_facets_node *n = &l->tree.node[at];
    int32_t pair[2][2];
    for (int i = 0; i < 2; i++) {
        if (n->leaf == MILL_FACETS_INNER) {
            const int32_t child = i ? l->tree.node[at + 1].skip : at + 1;
            compare(l, hub, child);
            pair[i][0] = l->common[child][0];
            pair[i][1] = l->common[child][1];
        } else {
            const int32_t facet = l->tree.order[(n->leaf >> 3) + i * ((n->leaf & 7) - 1)];
            pair[i][0] = hub[facet];
            pair[i][1] = l->shell[facet];
        }
    }
    for (int i = 0; i < 2; i++)
        l->common[at][i] = pair[0][i] == pair[1][i] ? pair[0][i] : -1;
}

/* Sets hub[n]: the corner of each facet that most facets have. count: [3 n] */
static void find_hubs(const struct mill_facets_joints *j, int32_t *count, int32_t *hub)
{
    for (size_t k = 0; k < j->edges; k++)
        count[j->corner[k / 3][k % 3]]++;
    for (size_t k = 0; k < j->edges; k++) {
        const int32_t c = j->corner[k / 3][k % 3];
        if (k % 3 == 0 || count[c] > count[hub[k / 3]])
            hub[k / 3] = c;
    }
}

bool mill_facets_draw(struct mill_facets_lines *l, const vec3 (*facet)[3], size_t n,
                      const struct mill_facets_joints *joints)
{
    int32_t *hub = malloc(n * sizeof *hub), *count = calloc(3 * n, sizeof *count);
    l->shell = malloc(n * sizeof *l->shell);
    l->common = malloc(2 * n * sizeof *l->common);
    const bool good = hub && count && l->shell && l->common &&
                      mill_facets_plant(facet, n, &l->tree) &&
                      mill_facets_dress(&l->tree, facet, n, true);
    if (good) {
        mill_facets_shells(joints, l->shell);
        find_hubs(joints, count, hub);
        compare(l, hub, 0);
    }
    free(hub);
    free(count);
    return good;
}

void mill_facets_wipe(struct mill_facets_lines *l)
{
    mill_facets_fell(&l->tree);
    free(l->shell);
    free(l->common);
}

static bool meets(const struct mill_facets_line *line, int32_t at)
{
    const int32_t hub = line->in->common[at][0], shell = line->in->common[at][1];
    const struct mill_facets_sheath *s = &line->in->tree.sheath[at];
    double enter = 0.0, leave = 1.0; /* as parts of the line */
    if (hub >= 0 && (hub == line->skip[0] || hub == line->skip[1]) && shell == line->of)
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
    const struct mill_facets_tree *tree = &line->in->tree;
    while (line->next >= line->last) {
        if (line->at >= tree->nodes)
            return -1;
        const struct mill_facets_node *n = &tree->node[line->at];
        const bool near = meets(line, line->at);
        line->at = near ? line->at + 1 : n->skip;
        if (near && n->leaf != MILL_FACETS_INNER) {
            line->next = n->leaf >> 3;
            line->last = line->next + (n->leaf & 7);
        }
    }
    return tree->order[line->next++];
}
