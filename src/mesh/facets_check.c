/* Is a mesh the surface of solids? Three conditions:
 *
 * Each facet has an area.
 *
 * It is closed: each edge belongs to pairs of facets, which go along it in opposite directions.
 *
 * It does not cross itself: no side of a facet goes through the inside of another one, by more than
 * the rounding to single precision of an STL file can cause. Solids may touch, but where a face of
 * one ends within a face of another one, there is no edge that could become one of the union. */
#include "mesh/facets_unite.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>

/* Fraction of its longest side: a facet with less height has no area */
#define NO_AREA 1e-9
enum { LONGEST_FAULT = 200 };

void mill_facets_report_fault(struct mill_facets_report *r, vec3 place, const char *format, ...)
{
    char text[LONGEST_FAULT + 60];
    const vec3 at = vec3_scale(place, 1.0 / r->unit);
    va_list list;
    if (r->faults++ >= MILL_FACETS_TOLD)
        return;
    va_start(list, format);
    const size_t length = (size_t)vsnprintf(text, LONGEST_FAULT, format, list);
    va_end(list);
    assert(length < LONGEST_FAULT);
    if (!isnan(at.x))
        snprintf(text + length, sizeof text - length, " at (%.6g, %.6g, %.6g)", at.x, at.y, at.z);
    r->fault(r->self, text);
}

void mill_facets_check_areas(struct mill_facets_check *c)
{
    for (size_t k = 0; k < c->n; k++) {
        const vec3 *p = c->facet[k];
        const vec3 ab = vec3_sub(p[1], p[0]), ac = vec3_sub(p[2], p[0]), bc = vec3_sub(p[2], p[1]);
        const double longest = fmax(vec3_dot(ab, ab), fmax(vec3_dot(ac, ac), vec3_dot(bc, bc)));
        if (!(vec3_norm(vec3_cross(ab, ac)) > NO_AREA * longest))
            mill_facets_report_fault(c->report, p[0], "facet %zu has no area", k + 1);
    }
}

/* ---- edges ---- */

enum trouble { NONE, HOLE, TURNED, KNOT, SEAM };
static const char *const trouble_name[] = {"", "not closed: a hole", "facets turned over",
                                           "an odd number of facets",
                                           "solids touch without common edges"};

/* What is wrong with an edge, of which side k is the first of n */
static enum trouble trouble_of(const struct mill_facets_check *c, size_t k, size_t n, bool united)
{
    bool alone = false;
    for (size_t i = k; i < k + n; i++)
        alone = alone || (c->joints.pair[i] < 0 && !c->gone[c->joints.edge[i].facet]);
    if (!alone || c->joints.edge[k].low == c->joints.edge[k].high)
        return NONE;
    return united ? SEAM : n == 1 ? HOLE : n == 2 ? TURNED : KNOT;
}

/* Tells edges with this trouble, those that hang together as one. count, root: [3 n] */
static void tell_edges(struct mill_facets_check *c, enum trouble what, int32_t *count,
                       int32_t *root)
{
    const struct mill_facets_joints *j = &c->joints;
    for (size_t k = 0; k < j->edges; k++) {
        root[k] = (int32_t)k;
        count[k] = 0;
    }
    for (int pass = 0; pass < 3; pass++)
        for (size_t k = 0, sides; k < j->edges; k += sides) {
            const struct mill_facets_edge *e = &j->edge[k];
            const vec3 *p = c->facet[e->facet];
            sides = mill_facets_sharing(j, k);
            if (trouble_of(c, k, sides, what == SEAM) != what)
                continue;
            int32_t *edges = &count[mill_facets_root(root, e->low)];
            if (pass == 0)
                mill_facets_merge(root, e->low, e->high);
            else if (pass == 1)
                ++*edges;
            else if (*edges > 0)
                mill_facets_report_fault(
                    c->report, vec3_scale(vec3_add(p[e->side], p[(e->side + 1) % 3]), 0.5),
                    "%s along %d edge%s, beside facet %d", trouble_name[what], *edges,
                    *edges > 1 ? "s" : "", e->facet + 1);
            *edges = pass == 2 ? 0 : *edges;
        }
}

bool mill_facets_check_edges(struct mill_facets_check *c, bool united)
{
    const enum trouble last = united ? SEAM : KNOT;
    int32_t *count = mill_memory_take(&c->memory, c->joints.edges, sizeof *count);
    int32_t *root = mill_memory_take(&c->memory, c->joints.edges, sizeof *root);
    for (enum trouble what = united ? SEAM : HOLE; count && root && what <= last; what++)
        tell_edges(c, what, count, root);
    return count && root;
}

/* ---- lines ---- */

/* Which facets does a straight line meet? The n needles of a fan all meet at their common corner: a
 * line from there leaves out nodes of many facets with this corner. It cannot go through these;
 * lying on them, as a side of another solid, it is between two of them, and covers less than one */
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

/* ---- crossings ---- */

/* One side, the two facets that it belongs to, and one that it comes near to */
struct meeting {
    int32_t facet[3]; /* the third is the one that it comes near to */
    vec3 from, way;
    double over[4]; /* [m] above the third facet: both ends, the third corner of both facets */
    vec3 normal;    /* of the third */
};

/* The part of the side that is within the prism of a facet, by more than `least` [m] */
static bool is_within(const struct meeting *m, const vec3 p[3], double least, double part[2])
{
    part[0] = 0.0;
    part[1] = 1.0;
    for (int k = 0; k < 3; k++) {
        const vec3 side = vec3_sub(p[(k + 1) % 3], p[k]);
        const vec3 in = vec3_cross(m->normal, vec3_scale(side, 1.0 / vec3_norm(side)));
        const double from = vec3_dot(in, vec3_sub(m->from, p[k])) - least;
        const double way = vec3_dot(in, m->way);
        if (!(from > 0.0 || from + way > 0.0))
            return false;
        if (from < 0.0)
            part[0] = fmax(part[0], -from / way);
        else if (from + way < 0.0)
            part[1] = fmin(part[1], -from / way);
    }
    return part[0] < part[1];
}

/* Does the side go through the third facet? Where it meets an edge of it, it must also come from
 * the same side of the facet across this edge: else it only touches. A corner is only touched. */
static bool pierces(const struct mill_facets_check *c, const struct meeting *m, double at)
{
    const vec3 *p = c->facet[m->facet[2]];
    const vec3 place = vec3_axpy(m->from, at, m->way), to = vec3_add(m->from, m->way);
    int edges = 0;
    for (int k = 0; k < 3; k++) {
        const vec3 side = vec3_sub(p[(k + 1) % 3], p[k]);
        const double in =
            vec3_dot(vec3_cross(m->normal, side), vec3_sub(place, p[k])) / vec3_norm(side);
        if (!(in >= -c->least))
            return false;
        if (in > c->least)
            continue;
        const vec3 *q = c->facet[c->across[m->facet[2]][k]], n = mill_facets_normal(q);
        const double from = vec3_dot(n, vec3_sub(m->from, q[0])),
                     end = vec3_dot(n, vec3_sub(to, q[0]));
        if (++edges > 1 || !(from * m->over[0] > 0.0 && end * m->over[1] > 0.0) ||
            !(fmin(fabs(from), fabs(end)) > c->least))
            return false;
    }
    return true;
}

/* What is wrong where a side meets a facet, and at which part of the side? The side may go through
 * it. In the plane of a facet of another shell, the surface may go through or touch it there, or a
 * face on it ends there: no fault if both are parts of one face and the smaller one is hidden. */
static const char *judge(const struct mill_facets_check *c, const struct meeting *m, double *at)
{
    const vec3 *p = c->facet[m->facet[2]];
    const double *over = m->over, least = c->least;
    double part[2];
    bool flat[4];
    for (int k = 0; k < 4; k++)
        flat[k] = fabs(over[k]) <= least;
    *at = over[0] / (over[0] - over[1]);
    if (!flat[0] && !flat[1])
        return over[0] * over[1] < 0.0 && pierces(c, m, *at) ? "cross" : NULL;
    if (!flat[0] || !flat[1] || c->shell[m->facet[0]] == c->shell[m->facet[2]] ||
        !is_within(m, p, 4.0 * least, part) ||
        !((part[1] - part[0]) * vec3_norm(m->way) > 4.0 * least))
        return NULL;
    *at = 0.5 * (part[0] + part[1]);
    if (!flat[2] && !flat[3])
        return over[2] * over[3] < 0.0 ? "cross" : NULL;
    if (flat[2] == flat[3] || !c->whole)
        return NULL;
    const int32_t lies = m->facet[flat[3]];
    return vec3_dot(mill_facets_normal(c->facet[lies]), m->normal) > 0.0 && c->hidden[lies]
               ? NULL
               : "lie on each other in part";
}

/* Compares a side with a facet. told[3 n]: corners of sides' facets that were told, so that one
 * fault is told for all sides that hang together */
static void meet(const struct mill_facets_check *c, struct meeting *m, const vec3 apex[2],
                 bool *told)
{
    const int32_t *facet = m->facet;
    const vec3 *p = c->facet[facet[2]];
    const vec3 place[4] = {m->from, vec3_add(m->from, m->way), apex[0], apex[1]};
    double at;
    m->normal = mill_facets_normal(p);
    for (int k = 0; k < 4; k++)
        m->over[k] = vec3_dot(m->normal, vec3_sub(place[k], p[0]));
    const char *what = judge(c, m, &at);
    bool known = false;
    for (int k = 0; what && k < 6; k++)
        known = known || told[c->joints.corner[facet[k / 3]][k % 3]];
    for (int k = 0; what && k < 6; k++)
        told[c->joints.corner[facet[k / 3]][k % 3]] = true;
    if (what && !known)
        mill_facets_report_fault(c->report, vec3_axpy(m->from, at, m->way), "facets %d and %d %s",
                                 (facet[0] < facet[2] ? facet[0] : facet[2]) + 1,
                                 (facet[0] < facet[2] ? facet[2] : facet[0]) + 1, what);
}

bool mill_facets_check_crossings(struct mill_facets_check *c)
{
    bool *told = mill_memory_take(&c->memory, 3 * c->n, sizeof *told);
    for (size_t k = 0; told && k < c->joints.edges; k++) {
        const struct mill_facets_edge *e = &c->joints.edge[k];
        const int32_t pair = c->joints.pair[k];
        mill_facets_report_progress(c->report, "checking a mesh", k / 3, c->n);
        if (c->gone[e->facet] || (pair >= 0 && pair < (int32_t)k)) /* the pair stands for both */
            continue;
        const struct mill_facets_edge *f = pair < 0 ? e : &c->joints.edge[pair];
        const vec3 *p = c->facet[e->facet];
        const vec3 apex[2] = {p[(e->side + 2) % 3], c->facet[f->facet][(f->side + 2) % 3]};
        struct meeting m = {.facet = {e->facet, f->facet, -1},
                            .from = p[e->side],
                            .way = vec3_sub(p[(e->side + 1) % 3], p[e->side])};
        struct mill_facets_line line = {&c->tree, m.from, m.way, {e->low, e->high}, 0, 0, 0};
        while ((m.facet[2] = mill_facets_line_on(&line)) >= 0)
            if (m.facet[2] != e->facet && m.facet[2] != f->facet && !c->gone[m.facet[2]])
                meet(c, &m, apex, told);
    }
    return told != NULL;
}
