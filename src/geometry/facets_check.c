/* Is a mesh the surface of solids? Three conditions:
 *
 * Each facet has an area.
 *
 * It is closed: each edge belongs to pairs of facets, which go along it in opposite directions.
 *
 * It does not cross itself: no side of a facet goes through the inside of another one, by more than
 * the rounding to single precision of an STL file can cause. Solids may touch, but where a face of
 * one ends within a face of another one, there is no edge that could become one of the union. */
#include "geometry/facets.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

/* Fraction of its longest side: a facet with less height has no area */
#define NO_AREA 1e-9

void mill_facets_report_fault(struct mill_facets_report *r, const char *format, ...)
{
    char text[MILL_SHAPE_FAULT];
    va_list list;
    if (r->faults++ >= MILL_FACETS_TOLD)
        return;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    r->fault(r->self, text);
}

/* A place in the file's own unit */
static vec3 told(const struct mill_facets_check *c, vec3 place)
{
    return vec3_scale(place, 1.0 / c->report->unit);
}

/* ---- areas ---- */

static bool has_area(const vec3 p[3])
{
    const vec3 ab = vec3_sub(p[1], p[0]), ac = vec3_sub(p[2], p[0]), bc = vec3_sub(p[2], p[1]);
    const double longest = fmax(vec3_dot(ab, ab), fmax(vec3_dot(ac, ac), vec3_dot(bc, bc)));
    return vec3_norm(vec3_cross(ab, ac)) > NO_AREA * longest;
}

void mill_facets_check_areas(struct mill_facets_check *c)
{
    for (size_t k = 0; k < c->n; k++) {
        const vec3 at = told(c, c->facet[k][0]);
        if (!has_area(c->facet[k]))
            mill_facets_report_fault(c->report, "facet %zu has no area, at (%.6g, %.6g, %.6g)",
                                     k + 1, at.x, at.y, at.z);
    }
}

/* ---- edges ---- */

enum trouble { NONE, HOLE, TURNED, KNOT, SEAM };

/* What is wrong with an edge, of which side k is the first and without a partner */
static enum trouble trouble_of(const struct mill_facets_check *c, size_t k, size_t sides,
                               bool united)
{
    bool alone = false;
    for (size_t i = k; i < k + sides; i++)
        alone = alone || (c->joints.pair[i] < 0 && !c->gone[c->joints.edge[i].facet]);
    if (!alone || c->joints.edge[k].low == c->joints.edge[k].high)
        return NONE;
    return united ? SEAM : sides == 1 ? HOLE : sides == 2 ? TURNED : KNOT;
}

static void tell_edge(struct mill_facets_check *c, enum trouble what, size_t k, int edges)
{
    const struct mill_facets_edge *e = &c->joints.edge[k];
    const vec3 from = c->facet[e->facet][e->side], to = c->facet[e->facet][(e->side + 1) % 3];
    const vec3 at = told(c, vec3_scale(vec3_add(from, to), 0.5));
    const int facet = e->facet + 1;
    const int other = what == TURNED || what == KNOT ? e[1].facet + 1 : 0;
    if (what == HOLE)
        mill_facets_report_fault(c->report,
                                 "not closed: a hole of %d edge%s, beside facet %d at (%.6g, %.6g, "
                                 "%.6g)",
                                 edges, edges > 1 ? "s" : "", facet, at.x, at.y, at.z);
    else if (what == TURNED)
        mill_facets_report_fault(c->report,
                                 "facets %d and %d, at (%.6g, %.6g, %.6g), share an edge, but one "
                                 "is turned over; so are %d edges in all there",
                                 facet, other, at.x, at.y, at.z, edges);
    else if (what == KNOT)
        mill_facets_report_fault(
            c->report,
            "an odd number of facets, %d and %d among them, share an edge at "
            "(%.6g, %.6g, %.6g), or some are turned over; so do %d edges there",
            facet, other, at.x, at.y, at.z, edges);
    else
        mill_facets_report_fault(c->report,
                                 "solids touch at (%.6g, %.6g, %.6g), beside facet %d, without "
                                 "common edges",
                                 at.x, at.y, at.z, facet);
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
            sides = mill_facets_sharing(j, k);
            if (trouble_of(c, k, sides, what == SEAM) != what)
                continue;
            int32_t *edges = &count[mill_facets_root(root, e->low)];
            if (pass == 0)
                mill_facets_merge(root, e->low, e->high);
            else if (pass == 1)
                ++*edges;
            else if (*edges > 0)
                tell_edge(c, what, k, *edges);
            *edges = pass == 2 ? 0 : *edges;
        }
}

bool mill_facets_check_edges(struct mill_facets_check *c, bool united)
{
    int32_t *count = malloc(c->joints.edges * sizeof *count);
    int32_t *root = malloc(c->joints.edges * sizeof *root);
    if (count && root && united)
        tell_edges(c, SEAM, count, root);
    for (enum trouble what = HOLE; count && root && !united && what <= KNOT; what++)
        tell_edges(c, what, count, root);
    free(count);
    free(root);
    return count && root;
}

/* ---- crossings ---- */

/* One side, the two facets that it belongs to, and one that it comes near to */
struct meeting {
    int32_t side;
    int32_t facet[2]; /* equal if the side has no partner */
    vec3 end[2], apex[2];
    const vec3 *other; /* its corners */
    int32_t other_facet;
    vec3 normal; /* of the other one */
};

static double above(const struct meeting *m, vec3 place)
{
    return vec3_dot(m->normal, vec3_sub(place, m->other[0]));
}

/* The part of the side that runs within the sides of the other facet, by more than `least` [m] */
static bool runs_within(const struct meeting *m, double least, double *enter, double *leave)
{
    const double length = vec3_norm(vec3_sub(m->end[1], m->end[0]));
    for (int k = 0; k < 3; k++) {
        const vec3 side = vec3_sub(m->other[(k + 1) % 3], m->other[k]);
        const vec3 in = vec3_cross(m->normal, vec3_scale(side, 1.0 / vec3_norm(side)));
        const double from = vec3_dot(in, vec3_sub(m->end[0], m->other[k])) - least;
        const double to = vec3_dot(in, vec3_sub(m->end[1], m->other[k])) - least;
        if (from <= 0.0 && to <= 0.0)
            return false;
        if (from < 0.0)
            *enter = fmax(*enter, from / (from - to));
        else if (to < 0.0)
            *leave = fmin(*leave, from / (from - to));
    }
    return (*leave - *enter) * length > least;
}

/* Where does the side go through the other facet? */
static bool pierces(const struct meeting *m, double least, vec3 *at)
{
    const double from = above(m, m->end[0]), to = above(m, m->end[1]);
    if (!((from > least && to < -least) || (from < -least && to > least)))
        return false;
    *at = vec3_axpy(m->end[0], from / (from - to), vec3_sub(m->end[1], m->end[0]));
    for (int k = 0; k < 3; k++) {
        const vec3 side = vec3_sub(m->other[(k + 1) % 3], m->other[k]);
        const double in = vec3_dot(vec3_cross(m->normal, side), vec3_sub(*at, m->other[k]));
        if (!(in > least * vec3_norm(side)))
            return false;
    }
    return true;
}

/* A side in the plane of a facet of another shell: the surface goes through the facet there, or
 * touches it; or a face that lies on the facet ends there. That is no fault if both are parts of
 * one face and the smaller is left out. */
static const char *judge_touch(const struct mill_facets_check *c, const struct meeting *m, vec3 *at)
{
    double enter = 0.0, leave = 1.0;
    if (c->lines.shell[m->facet[0]] == c->lines.shell[m->other_facet] ||
        !(fabs(above(m, m->end[0])) <= c->least && fabs(above(m, m->end[1])) <= c->least) ||
        !runs_within(m, 4.0 * c->least, &enter, &leave))
        return NULL;
    const double over[2] = {above(m, m->apex[0]), above(m, m->apex[1])};
    const bool flat[2] = {fabs(over[0]) <= c->least, fabs(over[1]) <= c->least};
    *at = vec3_axpy(m->end[0], 0.5 * (enter + leave), vec3_sub(m->end[1], m->end[0]));
    if (!flat[0] && !flat[1])
        return over[0] * over[1] < 0.0 ? "cross" : NULL;
    if (flat[0] == flat[1] || !c->hidden)
        return NULL;
    const int32_t lies = m->facet[flat[1]];
    const vec3 *p = c->facet[lies];
    const vec3 normal = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
    const bool same = vec3_dot(normal, m->normal) > 0.0;
    return same && c->hidden[lies] ? NULL : "lie on each other in part";
}

/* Tells one fault for all meetings that share corners. */
static void judge(struct mill_facets_check *c, const struct meeting *m, bool *told_of)
{
    vec3 at = {0.0, 0.0, 0.0};
    const char *what = pierces(m, c->least, &at) ? "cross" : judge_touch(c, m, &at);
    bool known = false;
    if (!what)
        return;
    const int32_t facets[3] = {m->facet[0], m->facet[1], m->other_facet};
    for (int k = 0; k < 9; k++)
        known = known || told_of[c->joints.corner[facets[k / 3]][k % 3]];
    for (int k = 0; k < 9; k++)
        told_of[c->joints.corner[facets[k / 3]][k % 3]] = true;
    at = told(c, at);
    if (!known)
        mill_facets_report_fault(c->report, "facets %d and %d %s at (%.6g, %.6g, %.6g)",
                                 (facets[0] < facets[2] ? facets[0] : facets[2]) + 1,
                                 (facets[0] < facets[2] ? facets[2] : facets[0]) + 1, what, at.x,
                                 at.y, at.z);
}

/* The side, unless it is gone or its partner stands for both */
static bool begin(const struct mill_facets_check *c, size_t k, struct meeting *m)
{
    const struct mill_facets_edge *e = &c->joints.edge[k];
    const int32_t pair = c->joints.pair[k];
    if (c->gone[e->facet] || (pair >= 0 && pair < (int32_t)k) || e->low == e->high)
        return false;
    const struct mill_facets_edge *both[2] = {e, pair < 0 ? e : &c->joints.edge[pair]};
    for (int i = 0; i < 2; i++) {
        m->facet[i] = both[i]->facet;
        m->end[i] = c->facet[e->facet][(e->side + i) % 3];
        m->apex[i] = c->facet[both[i]->facet][(both[i]->side + 2) % 3];
    }
    return true;
}

bool mill_facets_check_crossings(struct mill_facets_check *c)
{
    struct mill_facets_report *r = c->report;
    bool *told_of = calloc(3 * c->n, sizeof *told_of);
    struct meeting m;
    for (size_t k = 0; told_of && k < c->joints.edges; k++) {
        const struct mill_facets_edge *e = &c->joints.edge[k];
        if (r->tell && k % (3 * MILL_FACETS_PROGRESS) == 0)
            r->tell(r->self, "checking a mesh for crossings", (int32_t)(k / 3), (int32_t)c->n);
        if (!begin(c, k, &m))
            continue;
        struct mill_facets_line line = {.in = &c->lines,
                                        .from = m.end[0],
                                        .way = vec3_sub(m.end[1], m.end[0]),
                                        .skip = {e->low, e->high},
                                        .of = c->lines.shell[e->facet]};
        for (int32_t other; (other = mill_facets_line_on(&line)) >= 0;) {
            if (other == m.facet[0] || other == m.facet[1] || c->gone[other])
                continue;
            m.other_facet = other;
            m.other = c->facet[other];
            const vec3 n =
                vec3_cross(vec3_sub(m.other[1], m.other[0]), vec3_sub(m.other[2], m.other[0]));
            m.normal = vec3_scale(n, 1.0 / vec3_norm(n));
            judge(c, &m, told_of);
        }
    }
    free(told_of);
    return told_of != NULL;
}
