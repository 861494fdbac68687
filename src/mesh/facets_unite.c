/* The surface of the union of all solids of a mesh. A line from a facet to the outside tells its
 * winding number on both sides: how often the surface goes around a place, which is how many solids
 * are there, less the cavities. A facet is on the surface of the union where there is a solid
 * behind it and none in front of it. So facets within another solid, and facets back to back, where
 * solids touch, are left out; what remains is closed, unless faces that touch have other edges.
 *
 * Of the rooms that the remaining shells part, the balls are in one: for a container in the
 * largest, be it the solid's own or a cavity in it, for other bodies around all of them. */
#include "mesh/facets_unite.h"
#include "geometry/solid.h"

#include <stdlib.h>
#include <string.h>

/* Fraction of the maximum coordinate: error of two surfaces rounded to single precision */
#define ROUNDED 2.5e-7
/* Edges of more facets than this are not looked at for twins. */
enum { MOST_SHARING = 64 };

/* ---- shells: facets that hang together by their sides ---- */

/* Sets pair[k] of each side k to the side of the same edge that the surface goes on with: it goes
 * along the edge in the opposite direction. Where solids touch along an edge, these are facets of
 * near numbers, because a file has one solid after the other. -1: there is none. gone[n]: facets
 * that do not count any more. Returns the number of sides without a partner. As with brackets,
 * sides that wait are a list, each with the one before it in pair[]. */
static size_t pair_sides(struct mill_facets_joints *j, const bool *gone)
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
            j->pair[i] = other;
            if (other < 0 || j->edge[other].forward == j->edge[i].forward) {
                waits = (int32_t)i;
            } else {
                waits = j->pair[other];
                j->pair[other] = (int32_t)i;
            }
        }
        for (int32_t before; waits >= 0; waits = before, alone++) {
            before = j->pair[waits];
            j->pair[waits] = -1;
        }
    }
    return alone;
}

/* Sets root[n] to one facet of the shell of each facet: of those that hang together by paired
 * sides. apart: not by edges of more than two facets, where the pairs are only likely */
static void find_roots(const struct mill_facets_joints *j, bool apart, int32_t *root)
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

/* [m^3] signed, summed over a closed surface that within it */
static double volume_of(const vec3 p[3])
{
    return vec3_dot(p[0], vec3_cross(p[1], p[2])) / 6.0;
}

/* ---- lines out ---- */

/* A line from the middle of a facet to the outside, and where it goes through another one */
struct way_out {
    const struct mill_facets_check *c;
    int32_t facet;
    vec3 normal;
    struct mill_facets_line line;
    int sign;      /* of the other one: 1: it is met from behind, -1: on its front */
    double height; /* [m] above the first facet */
};

static struct way_out go_out(const struct mill_facets_check *c, int32_t facet)
{
    const vec3 *p = c->facet[facet], n = mill_facets_normal(p);
    /* in no plane and along no axis that a mesh may have */
    const vec3 way = vec3_add(n, vec3_make(0.0717, 0.1193, -0.0931));
    const vec3 middle = vec3_scale(vec3_add(vec3_add(p[0], p[1]), p[2]), 1.0 / 3.0);
    const vec3 from = vec3_axpy(middle, -2.0 * c->least, way); /* facets that touch are met too */
    return (struct way_out){
        c, facet, n, {&c->tree, from, vec3_scale(way, 6.0 * c->tree.size), {-1, -1}, 0, 0, 0},
        0, 0.0};
}

/* The next facet on the way; -1: none. Two on an edge compute the same numbers: one is met. */
static int32_t go_on(struct way_out *w)
{
    const struct mill_facets_check *c = w->c;
    const vec3 from = w->line.from, way = w->line.way;
    for (int32_t k; (k = mill_facets_line_on(&w->line)) >= 0;) {
        const vec3 *p = c->facet[k];
        const int32_t *corner = c->joints.corner[k];
        int left = 0;
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3;
            const bool forward = corner[i] < corner[j];
            const vec3 a = vec3_sub(p[forward ? i : j], from),
                       b = vec3_sub(p[forward ? j : i], from);
            left += (vec3_dot(way, vec3_cross(a, b)) >= 0.0) == forward;
        }
        if (k == w->facet || c->gone[k] || left % 3 != 0)
            continue;
        const vec3 n = mill_facets_normal(p);
        const double part = vec3_dot(n, vec3_sub(p[0], from)) / vec3_dot(n, way);
        const vec3 at = vec3_axpy(from, part, way);
        w->sign = left == 3 ? 1 : -1;
        w->height = vec3_dot(w->normal, vec3_sub(at, c->facet[w->facet][0]));
        return k;
    }
    return -1;
}

/* ---- the union ---- */

/* Takes out pairs of equal facets back to back: solids touch there, or end. */
static void cancel_twins(struct mill_facets_check *c)
{
    const struct mill_facets_joints *j = &c->joints;
    for (size_t k = 0, sides; k < j->edges; k += sides) {
        sides = mill_facets_sharing(j, k);
        for (size_t i = k; i < k + sides && sides > 2 && sides <= MOST_SHARING; i++)
            for (size_t l = k; l < i; l++) {
                const struct mill_facets_edge *a = &j->edge[i], *b = &j->edge[l];
                const int32_t one = j->corner[a->facet][(a->side + 2) % 3];
                if (a->forward != b->forward && !c->gone[a->facet] && !c->gone[b->facet])
                    c->gone[a->facet] = c->gone[b->facet] =
                        one == j->corner[b->facet][(b->side + 2) % 3];
            }
    }
}

/* Finds whether a facet is on the surface of the union. Of faces that lie on each other and face
 * the same way, that of the larger solid stays, or the first. */
static void look_out(struct mill_facets_check *c, const double *volume, int32_t facet)
{
    const int32_t own = c->solid[facet];
    struct way_out w = go_out(c, facet);
    int front = 0, behind = 1;
    bool first = true;
    for (int32_t k; (k = go_on(&w)) >= 0;) {
        const int32_t its = c->solid[k];
        if (c->shell[k] != c->shell[facet] && fabs(w.height) <= c->least) {
            const bool larger = volume[own] != volume[its] ? volume[own] > volume[its] : facet < k;
            behind += w.sign;
            first = first && (w.sign < 0 || larger);
        } else if (w.height > 0.0) {
            front += w.sign;
        }
    }
    c->hidden[facet] = !(front < 1 && front + behind >= 1 && first);
    if (front < 0 && own == facet)
        mill_facets_report_fault(
            c->report, c->facet[facet][0],
            "facet %d, and all that hang together with it, face into their solid", facet + 1);
}

static bool hide(struct mill_facets_check *c)
{
    double *volume = mill_memory_take(&c->memory, c->n, sizeof *volume);
    for (size_t k = 0; volume && k < c->n; k++)
        volume[c->solid[k]] += volume_of(c->facet[k]);
    /* most meshes are one shell: nothing can hide its facets */
    size_t alone = 0;
    while (alone < c->n && c->shell[alone] == 0)
        alone++;
    const size_t looks = !volume || (volume[0] > 0.0 && alone == c->n) ? 0 : c->n;
    for (size_t k = 0; k < looks; k++) {
        mill_facets_report_progress(c->report, "uniting the solids of a mesh", k, c->n);
        if (!c->gone[k])
            look_out(c, volume, (int32_t)k);
    }
    return volume != NULL;
}

/* ---- rooms ---- */

/* A shell of the union: the element of the facet whose number it has, in a list of all facets */
struct room {
    int32_t around; /* the next shell around it; -1: none */
    int32_t sum;    /* of the signs, on the way to the outside */
    double volume;  /* [m^3] within the shell */
    double own;     /* [m^3] within it and without the shells in it */
};

static bool is_shell(const struct mill_facets_check *c, size_t k)
{
    return !c->gone[k] && c->shell[k] == (int32_t)k;
}

/* The line goes through the shells around it once more often outwards than inwards, or, for
 * cavities, once less often. The smallest one is the next. */
static void look_around(const struct mill_facets_check *c, struct room *room, int32_t own)
{
    struct way_out w = go_out(c, own), again = w;
    int32_t best = -1;
    for (int32_t k; (k = go_on(&w)) >= 0;)
        room[c->shell[k]].sum += w.height > 0.0 && c->shell[k] != own ? w.sign : 0;
    for (int32_t k; (k = go_on(&again)) >= 0;) {
        struct room *other = &room[c->shell[k]];
        if (other->sum != 0 && (best < 0 || other->volume < room[best].volume))
            best = c->shell[k];
        other->sum = 0;
    }
    room[own].around = best;
}

/* Is the room within a shell a cavity of the solid? */
static bool is_cavity(const struct room *room, int32_t shell)
{
    bool cavity = false;
    while ((shell = room[shell].around) >= 0)
        cavity = !cavity;
    return cavity;
}

/* Leaves the shells of the room that the balls are in: for a container the largest. */
static bool part_rooms(struct mill_facets_check *c, bool container)
{
    struct room *room = mill_memory_take(&c->memory, c->n, sizeof *room);
    int32_t balls = -1;
    find_roots(&c->joints, false, c->shell);
    for (size_t k = 0; room && k < c->n; k++)
        room[c->shell[k]].volume += c->gone[k] ? 0.0 : volume_of(c->facet[k]);
    for (size_t k = 0; room && k < c->n; k++)
        room[k].volume = fabs(room[k].volume);
    for (size_t k = 0; room && k < c->n; k++)
        if (is_shell(c, k))
            look_around(c, room, (int32_t)k);
    for (size_t k = 0; room && k < c->n; k++) {
        room[k].own += room[k].volume;
        if (is_shell(c, k) && room[k].around >= 0)
            room[room[k].around].own -= room[k].volume;
    }
    for (size_t k = 0; room && container && k < c->n; k++)
        if (is_shell(c, k) && (balls < 0 || room[k].own > room[balls].own))
            balls = (int32_t)k;
    c->report->hollow = room && balls >= 0 && is_cavity(room, balls);
    for (size_t k = 0; room && k < c->n; k++) {
        const int32_t shell = c->shell[k];
        if (is_shell(c, k) && shell != balls &&
            is_cavity(room, shell) == (balls < 0 || c->report->hollow))
            c->report->closed += room[k].own;
        c->hidden[k] = shell != balls && room[shell].around != balls;
    }
    return room != NULL;
}

/* ---- all ---- */

static void take_out(struct mill_facets_check *c)
{
    for (size_t k = 0; k < c->n; k++)
        c->gone[k] = c->gone[k] || c->hidden[k];
}

/* Which facets hang together, and the corners that most of them share */
static bool find_shells(struct mill_facets_check *c)
{
    for (size_t k = 0; k < c->joints.edges; k++) {
        const struct mill_facets_edge *e = &c->joints.edge[k];
        const int32_t pair = c->joints.pair[k];
        c->across[e->facet][e->side] = pair < 0 ? e->facet : c->joints.edge[pair].facet;
    }
    int32_t *count = mill_memory_take(&c->memory, 3 * c->n, sizeof *count);
    find_roots(&c->joints, true, c->shell);
    for (size_t k = 0; count && k < 3 * c->n; k++)
        count[c->joints.corner[k / 3][k % 3]]++;
    for (size_t k = 0; count && k < 3 * c->n; k++) {
        const int32_t corner = c->joints.corner[k / 3][k % 3];
        if (k % 3 == 0 || count[corner] > count[c->hub[k / 3]])
            c->hub[k / 3] = corner;
    }
    return count != NULL;
}

static bool check(struct mill_facets_check *c, bool container)
{
    struct mill_facets_report *r = c->report;
    if (!mill_facets_join(c->facet, c->n, &c->joints))
        return false;
    mill_facets_check_areas(c);
    c->whole = pair_sides(&c->joints, c->gone) == 0 && r->faults == 0;
    if (!mill_facets_check_edges(c, false))
        return false;
    find_roots(&c->joints, false, c->solid);
    if (c->whole) {
        cancel_twins(c);
        pair_sides(&c->joints, c->gone);
    }
    if (!find_shells(c) || !mill_facets_plant(c->facet, c->n, &c->tree) ||
        !mill_facets_dress(&c->tree, c->facet, c->hub))
        return false;
    c->least = ROUNDED * c->tree.size;
    if ((c->whole && !hide(c)) || !mill_facets_check_crossings(c))
        return false;
    take_out(c);
    if (r->faults > 0 || pair_sides(&c->joints, c->gone) > 0)
        return r->faults > 0 || mill_facets_check_edges(c, true);
    if (!part_rooms(c, container))
        return false;
    take_out(c);
    return true;
}

bool mill_facets_unite(struct mill_body *is, vec3 (*facet)[3], struct mill_facets_report *r)
{
    const vec3 nowhere = {(double)NAN, (double)NAN, (double)NAN};
    const size_t n = is->facets;
    struct mill_facets_check c = {.facet = (const vec3(*)[3])facet, .n = n, .report = r};
    size_t left = 0;
    r->faults = 0;
    r->closed = 0.0;
    r->hollow = false;
    if (!mill_solid_is_sound(&mill_facets_solid, is)) {
        mill_facets_report_fault(
            r, nowhere, "it has %zu facets: a closed mesh takes at least 4, of finite coordinates",
            n);
        return true;
    }
    c.shell = mill_memory_take(&c.memory, n, sizeof *c.shell);
    c.solid = mill_memory_take(&c.memory, n, sizeof *c.solid);
    c.hub = mill_memory_take(&c.memory, n, sizeof *c.hub);
    c.across = mill_memory_take(&c.memory, n, sizeof *c.across);
    c.gone = mill_memory_take(&c.memory, n, sizeof *c.gone);
    c.hidden = mill_memory_take(&c.memory, n, sizeof *c.hidden);
    const bool good = !c.memory.failed && check(&c, is->inside);
    for (size_t k = 0; good && r->faults == 0 && k < n; k++) {
        const vec3 p[3] = {facet[k][0], facet[k][r->hollow ? 2 : 1], facet[k][r->hollow ? 1 : 2]};
        if (!c.gone[k])
            memcpy(facet[left++], p, sizeof p);
    }
    if (good && r->faults == 0 && left == 0)
        mill_facets_report_fault(r, nowhere, "its facets enclose no solid");
    is->facets = left > 0 ? left : n;
    mill_facets_part(&c.joints);
    mill_facets_fell(&c.tree);
    mill_memory_drop(&c.memory);
    return good;
}
