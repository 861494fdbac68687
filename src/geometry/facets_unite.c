/* The surface of the union of all solids of a mesh. A line from a facet to the outside tells its
 * winding number on both sides: how often the surface goes around a place, which is how many solids
 * are there, less the cavities. A facet is on the surface of the union where there is a solid
 * behind it and none in front of it. So facets within another solid, and facets back to back, where
 * solids touch, are left out; what remains is closed, unless faces that touch have other edges.
 *
 * Of the rooms that the remaining shells part, the balls are in one: for a container in the
 * largest, be it the solid's own or a cavity in it, for other bodies around all of them. */
#include "geometry/facets.h"

#include <stdlib.h>
#include <string.h>

/* Fraction of the maximum coordinate: error of two surfaces rounded to single precision */
#define ROUNDED 2.5e-7
/* Edges of more facets than this are not looked at for twins. */
enum { MOST_SHARING = 64 };

static vec3 middle_of(const vec3 p[3])
{
    return vec3_scale(vec3_add(vec3_add(p[0], p[1]), p[2]), 1.0 / 3.0);
}

static vec3 normal_of(const vec3 p[3])
{
    const vec3 n = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
    return vec3_scale(n, 1.0 / vec3_norm(n));
}

static double sixfold_volume(const vec3 p[3])
{
    return vec3_dot(p[0], vec3_cross(p[1], p[2]));
}

/* ---- lines out ---- */

/* A line from the middle of a facet to the outside */
struct way_out {
    const struct mill_facets_check *c;
    int32_t facet;
    vec3 normal;
    struct mill_facets_line line;
    double begins; /* [m] height above the facet; the line begins a little below it */
};

static struct way_out go_out(const struct mill_facets_check *c, int32_t facet)
{
    const vec3 *p = c->facet[facet];
    struct way_out w = {c, facet, normal_of(p), {.in = &c->lines, .skip = {-1, -1}}, 0.0};
    w.begins = -2.0 * c->least;
    /* in no plane and along no axis that a mesh may have */
    const vec3 way = vec3_add(w.normal, vec3_make(0.0717, 0.1193, -0.0931));
    w.line.from = vec3_axpy(middle_of(p), w.begins, way);
    w.line.way = vec3_scale(way, 6.0 * c->lines.tree.size);
    return w;
}

/* The next facet on the way, seen from behind (sign 1) or from its front (-1), and its height [m]
 * above the first one. -1: there is none. Two facets on an edge compute the same numbers for it, so
 * that the line always meets one of them. */
static int32_t next_hit(struct way_out *w, int *sign, double *height)
{
    const struct mill_facets_check *c = w->c;
    for (int32_t k; (k = mill_facets_line_on(&w->line)) >= 0;) {
        const vec3 *p = c->facet[k];
        const int32_t *corner = c->joints.corner[k];
        int left = 0;
        for (int i = 0; i < 3; i++) {
            const bool forward = corner[i] < corner[(i + 1) % 3];
            const vec3 a = vec3_sub(p[forward ? i : (i + 1) % 3], w->line.from);
            const vec3 b = vec3_sub(p[forward ? (i + 1) % 3 : i], w->line.from);
            left += (vec3_dot(w->line.way, vec3_cross(a, b)) >= 0.0) == forward;
        }
        if (k == w->facet || c->gone[k] || left % 3 != 0)
            continue;
        const vec3 n = normal_of(p);
        const double per = vec3_dot(n, w->line.way);
        const double part = vec3_dot(n, vec3_sub(p[0], w->line.from)) / per;
        *sign = left == 3 ? 1 : -1;
        *height = w->begins + part * vec3_dot(w->normal, w->line.way);
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
                if (a->forward == b->forward || c->gone[a->facet] || c->gone[b->facet])
                    continue;
                c->gone[a->facet] = c->gone[b->facet] = j->corner[a->facet][(a->side + 2) % 3] ==
                                                        j->corner[b->facet][(b->side + 2) % 3];
            }
    }
}

/* Of faces that lie on each other and face the same way, that of the larger shell stays. */
static bool stays_for(const struct mill_facets_check *c, const double *volume, int32_t facet,
                      int32_t other)
{
    const int32_t own = c->lines.shell[facet], its = c->lines.shell[other];
    return volume[own] != volume[its] ? volume[own] > volume[its] : own < its;
}

/* Is the facet on the surface of the union? */
static bool is_outside(struct mill_facets_check *c, const double *volume, int32_t facet,
                       bool *turned)
{
    const int32_t *shell = c->lines.shell;
    struct way_out w = go_out(c, facet);
    int front = 0, behind = 1, sign;
    bool first = true;
    double height;
    for (int32_t k; (k = next_hit(&w, &sign, &height)) >= 0;) {
        if (shell[k] != shell[facet] && fabs(height) <= c->least) {
            behind += sign;
            first = first && (sign < 0 || stays_for(c, volume, facet, k));
        } else if (height > 0.0) {
            front += sign;
        }
    }
    *turned = front < 0;
    return front < 1 && front + behind >= 1 && first;
}

static void tell_turned(struct mill_facets_check *c, int32_t facet)
{
    const vec3 at = vec3_scale(c->facet[facet][0], 1.0 / c->report->unit);
    mill_facets_report_fault(c->report,
                             "facet %d, at (%.6g, %.6g, %.6g), and all that hang together with it "
                             "face into their solid",
                             facet + 1, at.x, at.y, at.z);
}

/* Finds which facets are hidden. volume[n]: of each shell, six times */
static void hide(struct mill_facets_check *c, const double *volume, bool *told)
{
    struct mill_facets_report *r = c->report;
    const int32_t *shell = c->lines.shell;
    size_t shells = 0;
    double all = 0.0;
    for (size_t k = 0; k < c->n; k++) {
        shells += shell[k] == (int32_t)k;
        all += volume[k];
    }
    if (shells == 1 && !(all > 0.0))
        tell_turned(c, 0);
    for (size_t k = 0; k < c->n && shells > 1; k++) {
        bool turned = false;
        if (r->tell && k % MILL_FACETS_PROGRESS == 0)
            r->tell(r->self, "uniting the solids of a mesh", (int32_t)k, (int32_t)c->n);
        c->hidden[k] = !c->gone[k] && !is_outside(c, volume, (int32_t)k, &turned);
        if (turned && !told[shell[k]])
            tell_turned(c, (int32_t)k);
        told[shell[k]] = told[shell[k]] || turned;
    }
}

/* ---- rooms ---- */

/* The shells of the union; each array has an element for each facet, used for one of each shell. */
struct rooms {
    const struct mill_facets_check *c;
    int32_t *shell;
    double *volume;  /* [m^3] six times that of the shell; < 0: a cavity */
    double *room;    /* [m^3] six times that between the shell and those in it */
    int32_t *depth;  /* how many shells are around it */
    int32_t *around; /* the next one around it; -1: none */
    int32_t *sum;
};

/* Is this facet the one that its shell is known by? */
static bool is_shell(const struct rooms *s, size_t k)
{
    return !s->c->gone[k] && s->shell[k] == (int32_t)k;
}

/* Counts the shells around a shell. after: their depths are known, and the deepest is the next one
 * around it. */
static void look_around(struct rooms *s, int32_t own, bool after)
{
    struct way_out w = go_out(s->c, own), again = w;
    int sign, deepest = -1;
    double height;
    for (int32_t k; (k = next_hit(&w, &sign, &height)) >= 0;)
        s->sum[s->shell[k]] += height > 0.0 ? sign : 0;
    s->sum[own] = 0;
    for (int32_t k; (k = next_hit(&again, &sign, &height)) >= 0;) {
        const int32_t other = s->shell[k];
        if (s->sum[other] != 0 && !after)
            s->depth[own]++;
        if (s->sum[other] != 0 && after && s->depth[other] > deepest) {
            deepest = s->depth[other];
            s->around[own] = other;
        }
        s->sum[other] = 0;
    }
}

static bool is_kept(const struct rooms *s, int32_t shell, int32_t room)
{
    return room < 0 ? s->depth[shell] == 0 : shell == room || s->around[shell] == room;
}

/* Leaves the shells that the room of the balls has: number `room`, or -1, the one around all. */
static void leave(struct rooms *s, int32_t room, bool *gone, struct mill_facets_report *report)
{
    const int32_t *depth = s->depth;
    const int parity = room < 0 ? 1 : depth[room] % 2;
    for (size_t k = 0; k < s->c->n; k++)
        if (is_shell(s, k) && (int32_t)k != room && depth[k] % 2 == parity)
            report->closed += s->room[k] / 6.0;
    report->hollow = room >= 0 && parity == 1;
    for (size_t k = 0; k < s->c->n; k++)
        gone[k] = gone[k] || !is_kept(s, s->shell[k], room);
}

static bool find_rooms(struct mill_facets_check *c, bool container)
{
    const size_t n = c->n;
    struct rooms s = {.c = c,
                      .shell = malloc(n * sizeof *s.shell),
                      .volume = calloc(n, sizeof *s.volume),
                      .room = calloc(n, sizeof *s.room),
                      .depth = calloc(n, sizeof *s.depth),
                      .around = malloc(n * sizeof *s.around),
                      .sum = calloc(n, sizeof *s.sum)};
    const bool good = s.shell && s.volume && s.room && s.depth && s.around && s.sum;
    int32_t room = -1;
    if (good)
        mill_facets_shells(&c->joints, s.shell);
    for (size_t k = 0; good && k < n; k++) {
        s.around[k] = -1;
        s.volume[s.shell[k]] += c->gone[k] ? 0.0 : sixfold_volume(c->facet[k]);
    }
    for (int after = 0; good && after < 2; after++)
        for (size_t k = 0; k < n; k++)
            if (is_shell(&s, k))
                look_around(&s, (int32_t)k, after);
    for (size_t k = 0; good && k < n; k++) {
        s.room[k] += fabs(s.volume[k]);
        if (s.around[k] >= 0)
            s.room[s.around[k]] -= fabs(s.volume[k]);
    }
    for (size_t k = 0; good && k < n; k++)
        if (is_shell(&s, k) && container && (room < 0 || s.room[k] > s.room[room]))
            room = (int32_t)k;
    if (good)
        leave(&s, room, c->gone, c->report);
    free(s.shell);
    free(s.volume);
    free(s.room);
    free(s.depth);
    free(s.around);
    free(s.sum);
    return good;
}

/* ---- all ---- */

/* After all that concerns single facets and edges is told: are the solids right, and what remains
 * of them? */
static bool unite(struct mill_facets_check *c, bool whole)
{
    double *volume = calloc(c->n, sizeof *volume);
    bool *told = calloc(c->n, sizeof *told), *hidden = calloc(c->n, sizeof *hidden);
    bool good = volume && told && hidden;
    for (size_t k = 0; good && k < c->n; k++)
        volume[c->lines.shell[k]] += sixfold_volume(c->facet[k]);
    if (good && whole) {
        c->hidden = hidden;
        hide(c, volume, told);
    }
    good = good && mill_facets_check_crossings(c);
    for (size_t k = 0; good && k < c->n; k++)
        c->gone[k] = c->gone[k] || hidden[k];
    if (good && c->report->faults == 0 && mill_facets_pair(&c->joints, c->gone) > 0)
        good = mill_facets_check_edges(c, true);
    free(volume);
    free(told);
    free(hidden);
    return good;
}

static bool check(struct mill_facets_check *c, bool container)
{
    if (!c->gone || !mill_facets_join(c->facet, c->n, &c->joints))
        return false;
    mill_facets_check_areas(c);
    const bool whole = mill_facets_pair(&c->joints, c->gone) == 0 && c->report->faults == 0;
    if (!mill_facets_check_edges(c, false))
        return false;
    if (whole) {
        cancel_twins(c);
        mill_facets_pair(&c->joints, c->gone);
    }
    if (!mill_facets_draw(&c->lines, c->facet, c->n, &c->joints))
        return false;
    c->least = ROUNDED * c->lines.tree.size;
    return unite(c, whole) && (c->report->faults > 0 || find_rooms(c, container));
}

bool mill_facets_unite(struct mill_body *is, vec3 (*facet)[3], struct mill_facets_report *r)
{
    struct mill_facets_check c = {.facet = (const vec3(*)[3])facet, .n = is->facets, .report = r};
    r->faults = 0;
    r->closed = 0.0;
    r->hollow = false;
    if (!mill_facets_type.is_sound(is)) {
        mill_facets_report_fault(
            r, "it has %zu facets: a closed mesh takes at least 4, of finite coordinates",
            is->facets);
        return true;
    }
    c.gone = calloc(c.n, sizeof *c.gone);
    const bool good = check(&c, is->inside);
    size_t left = 0;
    for (size_t k = 0; good && r->faults == 0 && k < c.n; k++) {
        if (c.gone[k])
            continue;
        const vec3 p[3] = {facet[k][0], facet[k][r->hollow ? 2 : 1], facet[k][r->hollow ? 1 : 2]};
        memcpy(facet[left++], p, sizeof p);
    }
    if (good && r->faults == 0 && left == 0)
        mill_facets_report_fault(r, "its facets enclose no solid");
    if (left > 0)
        is->facets = left;
    mill_facets_part(&c.joints);
    mill_facets_wipe(&c.lines);
    free(c.gone);
    return good;
}
