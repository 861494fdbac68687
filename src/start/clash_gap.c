/* The distance of two convex parts equals the distance from the origin to the set of all
 * differences of their points. The search moves simplices of that set towards the origin (E. G.
 * Gilbert, D. W. Johnson & S. S. Keerthi, IEEE J. Robot. Autom. 4 (1988) 193). It uses the exact
 * extreme points of discs and boxes, no polygons. For any direction n, the extreme point of the set
 * against n gives a lower bound of the distance. The result is the best of these bounds, so that
 * neither rounding nor an early end of the search makes the distance too large.
 *
 * For solids with many parts, the spheres around the boxes of their tree skip the farther parts. */
#include "start/clash_solid.h"

/* SUPPORTS of them take about as long as a comparison of two parts */
enum { LOOKS = 100, SUPPORTS = 16 };
/* relative to the parts' size: a distance below this is 0 */
#define NOTHING 1e-14
/* relative to the distance: accuracy that the steps of a march need */
#define CLOSE_ENOUGH 0.05
/* relative to the distance: a sphere farther than this is skipped */
#define ENOUGH 0.9

/* ---- two convex parts ---- */

struct simplex {
    int n;
    vec3 p[4];
};

static vec3 keep(struct simplex *s, int n, vec3 a, vec3 b, vec3 c, vec3 nearest)
{
    *s = (struct simplex){n, {a, b, c}};
    return nearest;
}

/* Returns the point of the simplex that is nearest to the origin. Keeps only those corners of the
 * simplex that span the face, edge or corner with this point. */
static vec3 on_line(struct simplex *s, vec3 a, vec3 b)
{
    const vec3 way = vec3_sub(b, a);
    const double length = vec3_dot(way, way), t = -vec3_dot(a, way);
    if (t <= 0.0)
        return keep(s, 1, a, a, a, a);
    if (t >= length)
        return keep(s, 1, b, b, b, b);
    return keep(s, 2, a, b, b, vec3_axpy(a, t / length, way));
}

/* Regions of corners, edges and face (C. Ericson, Real-Time Collision Detection, 2005, 5.1.5) */
static vec3 on_triangle(struct simplex *s, vec3 a, vec3 b, vec3 c)
{
    const vec3 ab = vec3_sub(b, a), ac = vec3_sub(c, a), n = vec3_cross(ab, ac);
    const double a1 = -vec3_dot(ab, a), a2 = -vec3_dot(ac, a), b1 = -vec3_dot(ab, b),
                 b2 = -vec3_dot(ac, b), c1 = -vec3_dot(ab, c), c2 = -vec3_dot(ac, c);
    const double square = vec3_dot(n, n);
    if (a1 <= 0.0 && a2 <= 0.0)
        return keep(s, 1, a, a, a, a);
    if (b1 >= 0.0 && b2 <= b1)
        return keep(s, 1, b, b, b, b);
    if (c2 >= 0.0 && c1 <= c2)
        return keep(s, 1, c, c, c, c);
    if (a1 * b2 - b1 * a2 <= 0.0 && a1 >= 0.0 && b1 <= 0.0)
        return on_line(s, a, b);
    if (c1 * a2 - a1 * c2 <= 0.0 && a2 >= 0.0 && c2 <= 0.0)
        return on_line(s, a, c);
    if ((b1 * c2 - c1 * b2 <= 0.0 && b2 >= b1 && c1 >= c2) || !(square > 0.0))
        return on_line(s, b, c);
    return keep(s, 3, a, b, c, vec3_scale(n, vec3_dot(n, a) / square));
}

static vec3 on_tetrahedron(struct simplex *s)
{
    static const int face[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
    const struct simplex all = *s;
    vec3 best = {0.0, 0.0, 0.0};
    double least = INFINITY;
    for (int k = 0; k < 4; k++) {
        const vec3 a = all.p[face[k][0]], b = all.p[face[k][1]], c = all.p[face[k][2]];
        const vec3 n = vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
        if (-vec3_dot(n, a) * vec3_dot(n, vec3_sub(all.p[face[k][3]], a)) > 0.0)
            continue; /* the origin is on the inner side of this face */
        struct simplex of;
        const vec3 v = on_triangle(&of, a, b, c);
        if (vec3_dot(v, v) < least) {
            least = vec3_dot(v, v);
            best = v;
            *s = of;
        }
    }
    return best;
}

static vec3 nearest(struct simplex *s)
{
    return s->n == 1   ? s->p[0]
           : s->n == 2 ? on_line(s, s->p[0], s->p[1])
           : s->n == 3 ? on_triangle(s, s->p[0], s->p[1], s->p[2])
                       : on_tetrahedron(s);
}

struct mill_part_gap mill_clash_gap_parts(const struct mill_part *a, const struct mill_part *b,
                                          double near)
{
    const double grown = a->core.grown + b->core.grown, nothing = NOTHING * (a->around + b->around);
    struct mill_part_gap gap = {-INFINITY, INFINITY, 0}; /* of the cores */
    struct simplex s = {0};
    vec3 v = vec3_sub(a->centre, b->centre);
    for (int k = 0; k < LOOKS; k++) {
        const double length = vec3_norm(v);
        if (k > 0 && !(length < gap.most))
            break; /* no nearer than before, because of rounding */
        gap.most = k > 0 ? length : gap.most;
        if (!(length > nothing)) {
            gap.least = fmax(gap.least, 0.0);
            if (k > 0)
                break;
            v = vec3_make(1.0, 0.0, 0.0);
        }
        const vec3 n = vec3_scale(v, 1.0 / vec3_norm(v));
        const vec3 w = vec3_sub(mill_part_support(a, vec3_scale(n, -1.0)), mill_part_support(b, n));
        gap.least = fmax(gap.least, vec3_dot(n, w));
        if (gap.most - gap.least <= CLOSE_ENOUGH * fmax(gap.least - grown, 0.0) + 0.02 * near)
            break;
        s.p[s.n++] = w;
        v = nearest(&s);
    }
    return (struct mill_part_gap){fmax(gap.least, 0.0) - grown, gap.most - grown, 0};
}

/* ---- two solids ---- */

struct seek {
    const struct mill_clash_solid *a, *b;
    const struct mill_pose *a_in_b;
    double near;
    struct mill_part_gap gap;
};

static double apart_of(const struct seek *s, const struct mill_clash_ball *p,
                       const struct mill_clash_ball *q)
{
    return vec3_norm(vec3_sub(mill_pose_out(s->a_in_b, p->centre), q->centre));
}

/* [m] Lower bound of the distance between the contents of two spheres. For a single part the part
 * itself is used: the sphere around a long part is much larger. */
static double least_of(const struct seek *s, const struct mill_clash_ball *p,
                       const struct mill_clash_ball *q)
{
    const double least = apart_of(s, p, q) - p->radius - q->radius;
    if (least >= ENOUGH * s->gap.most)
        return least;
    if (q->part >= 0 && p->part < 0 && q->radius > p->radius) {
        const vec3 at = mill_pose_out(s->a_in_b, p->centre);
        const struct mill_part ball = mill_part_facet(at, at, at, p->radius);
        return fmax(least, mill_clash_gap_parts(&ball, &s->b->part[q->part], s->near).least);
    }
    if (p->part >= 0 && q->part < 0 && p->radius > q->radius) {
        const struct mill_part part = mill_part_move(&s->a->part[p->part], s->a_in_b);
        const struct mill_part ball = mill_part_facet(q->centre, q->centre, q->centre, q->radius);
        return fmax(least, mill_clash_gap_parts(&part, &ball, s->near).least);
    }
    return least;
}

/* If two parts are very far from each other, the bounds from their spheres are accurate enough:
 * their centres are in them. */
static void take_leaves(struct seek *s, const struct mill_clash_ball *p,
                        const struct mill_clash_ball *q)
{
    const double size = p->radius + q->radius, apart = apart_of(s, p, q);
    struct mill_part_gap gap = {apart - size, apart, 0};
    if (gap.least < ENOUGH * gap.most) {
        const struct mill_part a = mill_part_move(&s->a->part[p->part], s->a_in_b);
        gap = mill_clash_gap_parts(&a, &s->b->part[q->part], s->near);
    }
    s->gap.least = fmin(s->gap.least, gap.least);
    s->gap.most = fmin(s->gap.most, gap.most);
}

/* Splits the larger of two spheres and searches the nearer half first. `least`: from least_of */
static void seek(struct seek *s, const struct mill_clash_ball *p, const struct mill_clash_ball *q,
                 double least)
{
    s->gap.looks++;
    if (least >= ENOUGH * s->gap.most || s->gap.least <= s->near) {
        s->gap.least = fmin(s->gap.least, least);
        return;
    }
    if (p->part >= 0 && q->part >= 0) {
        take_leaves(s, p, q);
        return;
    }
    const bool splits = q->part >= 0 || (p->part < 0 && p->radius >= q->radius);
    struct mill_clash_ball half[2];
    double from[2];
    mill_clash_solid_halves(splits ? s->a : s->b, splits ? p : q, half);
    for (int k = 0; k < 2; k++)
        from[k] = splits ? least_of(s, &half[k], q) : least_of(s, p, &half[k]);
    const int first = from[0] > from[1];
    for (int n = 0; n < 2; n++) {
        const int k = n ^ first;
        seek(s, splits ? &half[k] : p, splits ? q : &half[k], from[k]);
    }
}

struct mill_part_gap mill_clash_gap_solids(const struct mill_clash_solid *a,
                                           const struct mill_clash_solid *b,
                                           const struct mill_pose *a_in_b, double near)
{
    struct seek s = {a, b, a_in_b, near, {INFINITY, INFINITY, 0}};
    seek(&s, &a->all, &b->all, least_of(&s, &a->all, &b->all));
    return s.gap;
}

/* ---- a wall ---- */

static void seek_wall(const struct mill_wall *w, const struct mill_clash_solid *s,
                      const struct mill_clash_ball *n, const struct mill_pose *in, double near,
                      struct mill_part_gap *gap)
{
    gap->looks++;
    if (mill_part_wall_gap(w, mill_pose_out(in, n->centre)) - n->radius >= gap->most)
        return;
    if (n->part >= 0) {
        const struct mill_part part = mill_part_move(&s->part[n->part], in);
        const struct mill_part_gap of = mill_part_to_wall(&part, w, near);
        gap->looks += of.looks / SUPPORTS;
        gap->least = fmin(gap->least, of.least);
        gap->most = fmin(gap->most, of.most);
        return;
    }
    struct mill_clash_ball half[2];
    mill_clash_solid_halves(s, n, half);
    seek_wall(w, s, &half[0], in, near, gap);
    seek_wall(w, s, &half[1], in, near, gap);
}

struct mill_part_gap mill_clash_gap_wall(const struct mill_wall *wall,
                                         const struct mill_clash_solid *solid,
                                         const struct mill_pose *in, double near)
{
    struct mill_part_gap gap = {INFINITY, INFINITY, 0};
    seek_wall(wall, solid, &solid->all, in, near, &gap);
    return gap;
}
