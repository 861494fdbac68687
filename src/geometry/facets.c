/* The mesh: a closed surface of triangles, met from outside or from inside. In both cases it is one
 * surface. Facets are in the motion's frame, with their fronts towards the balls. */
#include "base/elementary.h"
#include "geometry/facets_near.h"
#include "geometry/mesh.h"

#include <stdlib.h>
#include <string.h>

/* [m] SNUG: a facet nearer than this also touches. FARTHEST: bound of all coordinates. */
#define SNUG 1e-12
#define FARTHEST 1e9

/* ---- as a shape ---- */

static struct mill_contact contact_at(const struct mill_facets *m,
                                      const struct mill_facets_near *near, vec3 centre,
                                      double radius, const struct mill_pose *pose)
{
    const double d = near->behind ? -near->d : near->d;
    vec3 n = vec3_scale(near->way, 1.0 / d);
    if (!(near->d > 0.0)) {
        const vec3 out = mill_facets_outwards(m, near);
        n = vec3_scale(out, 1.0 / vec3_norm(out));
    }
    return mill_shape_touch(centre, d, mill_pose_turn_out(pose, n), radius, pose);
}

/* Most calls are for a ball that touches, so it searches nearby facets first. */
static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   const struct mill_pose *pose)
{
    const struct mill_facets *m = (const struct mill_facets *)shape;
    const vec3 place = mill_pose_in(pose, centre);
    struct mill_facets_near near;
    if (!mill_facets_nearest(m, place, 1.01 * radius, &near))
        mill_facets_nearest(m, place, INFINITY, &near);
    return contact_at(m, &near, centre, radius, pose);
}

/* In a concave edge a ball touches several facets: finds the facet that it closes on fastest. */
static bool beside(const struct mill_shape *shape, vec3 centre, vec3 v, double radius,
                   const struct mill_pose *pose, struct mill_contact *contact)
{
    const struct mill_facets *m = (const struct mill_facets *)shape;
    const vec3 place = mill_pose_in(pose, centre);
    struct mill_facets_walk walk = mill_facets_set_out(&m->tree, place, radius + SNUG);
    double slowest = MILL_CONVEX_SLOWEST;
    bool found = false;
    for (int32_t k; (k = mill_facets_walk_on(&walk)) >= 0;) {
        struct mill_facets_near near = {.facet = k};
        near.way = mill_facets_look(&m->flat[k], place, &near.part);
        near.d = vec3_norm(near.way);
        if (!(near.d <= radius + SNUG && near.d > 0.0))
            continue;
        const struct mill_contact one = contact_at(m, &near, centre, radius, pose);
        const double rate = vec3_dot(vec3_sub(v, one.velocity), one.normal);
        if (rate > slowest)
            continue;
        slowest = rate;
        *contact = one;
        found = true;
    }
    return found;
}

/* Has facet k the edge or the corner on which a facet is nearest? */
static bool shares(const struct mill_facets *m, const struct mill_facets_near *near, int32_t k)
{
    static const int end[3][2] = {{0, 1}, {1, 2}, {0, 2}}; /* corners of each side */
    const int32_t *own = m->side[near->facet].corner, *other = m->side[k].corner;
    const bool corner = near->part >= MILL_FACETS_CORNER;
    const int side = near->part - MILL_FACETS_SIDE;
    const int32_t first = own[corner ? near->part - MILL_FACETS_CORNER : end[side][0]];
    const int32_t last = corner ? first : own[end[side][1]];
    return (first == other[0] || first == other[1] || first == other[2]) &&
           (last == other[0] || last == other[1] || last == other[2]);
}

/* Is one of these the same place of the surface as the other, which has it? A place on an edge or a
 * corner counts if no facet there is nearer; then it is found at several facets, and the first of
 * them has it, or one that has it within. On a seam, rounding lets two facets have it within. */
static bool is_other(const struct mill_facets *m, const struct mill_facets_near *one,
                     const struct mill_facets_near *other)
{
    const bool within = other->part == MILL_FACETS_INSIDE;
    if (one->part == MILL_FACETS_INSIDE)
        return within && other < one && vec3_norm(vec3_sub(one->way, other->way)) < SNUG;
    return shares(m, one, other->facet) && one->d >= other->d - SNUG &&
           (one->d >= other->d + SNUG || within || other < one);
}

static int places(const struct mill_shape *shape, vec3 centre, double radius,
                  const struct mill_pose *pose, struct mill_contact *contacts, int most)
{
    enum { MOST = 64 };
    const struct mill_facets *m = (const struct mill_facets *)shape;
    const vec3 place = mill_pose_in(pose, centre);
    struct mill_facets_walk walk = mill_facets_set_out(&m->tree, place, radius);
    struct mill_facets_near near[MOST];
    int count = 0, found = 0;
    for (int32_t k; (k = mill_facets_walk_on(&walk)) >= 0 && count < MOST;) {
        struct mill_facets_near *one = &near[count];
        *one = (struct mill_facets_near){.facet = k};
        one->way = mill_facets_look(&m->flat[k], place, &one->part);
        one->d = vec3_norm(one->way);
        one->behind = vec3_dot(one->way, mill_facets_outwards(m, one)) < 0.0;
        count += one->d < radius && one->d > 0.0;
    }
    for (int a = 0; a < count && found < most; a++) {
        bool counts = !near[a].behind;
        for (int b = 0; counts && b < count; b++)
            counts = b == a || !is_other(m, &near[a], &near[b]);
        if (counts)
            contacts[found++] = contact_at(m, &near[a], centre, radius, pose);
    }
    if (found > 0)
        return found;
    contacts[0] = contact(shape, centre, radius, pose);
    return 1;
}

static struct mill_hit next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                                    double radius, double now, double horizon, bool touching)
{
    (void)touching;
    return mill_facets_search((const struct mill_facets *)shape, f, radius, now, horizon);
}

/* If the body turns about a line at rest, each box of the tree stays in a ring about this line. */
static bool reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct mill_facets *m = (const struct mill_facets *)shape;
    const struct mill_bodied *b = &m->body;
    if (shape->fixed || !b->rings || b->is.inside)
        return mill_body_reachable(shape, lo, hi, radius);
    mill_body_clip(b, &lo, &hi);
    for (int32_t at = 0; at < m->tree.nodes;) {
        const struct mill_facets_node *n = &m->tree.node[at];
        const vec3 least = {(double)n->lo[0], (double)n->lo[1], (double)n->lo[2]};
        const vec3 most = {(double)n->hi[0], (double)n->hi[1], (double)n->hi[2]};
        const vec3 half = vec3_scale(vec3_sub(most, least), 0.5);
        const vec3 q = vec3_sub(vec3_scale(vec3_add(least, most), 0.5), b->through);
        const double along = vec3_dot(q, b->axis), away = vec3_norm(vec3_axpy(q, -along, b->axis));
        const double around = vec3_norm(half);
        const double beside =
            fabs(b->axis.x) * half.x + fabs(b->axis.y) * half.y + fabs(b->axis.z) * half.z;
        const double ring[4] = {away - around, away + around, along - beside, along + beside};
        const bool meets = mill_body_ring_meets(b, ring, lo, hi, radius);
        if (meets && n->leaf != MILL_FACETS_INNER)
            return true;
        at = meets ? at + 1 : n->skip;
    }
    return false;
}

/* ---- from its numbers ---- */

static bool is_sound(const struct mill_body *is)
{
    bool good = is->facets >= 4 && is->facets <= MILL_FACETS_MOST && is->facet;
    for (size_t k = 0; good && k < 3 * is->facets; k++)
        good = vec3_norm(is->facet[k / 3][k % 3]) < FARTHEST; /* false for NaN */
    return good;
}

static struct mill_hull hull(const struct mill_body *is)
{
    struct mill_hull hull = {0.0, 0.0, 0};
    for (size_t k = 0; k < 3 * is->facets; k++) {
        const vec3 p = is->facet[k / 3][k % 3];
        hull.half = fmax(hull.half, fabs(p.z));
        hull.radius = fmax(hull.radius, sqrt(p.x * p.x + p.y * p.y));
    }
    return hull;
}

static double volume(const struct mill_body *is)
{
    double sixfold = 0.0;
    for (size_t k = 0; k < is->facets; k++) {
        const vec3 *p = is->facet[k];
        sixfold += vec3_dot(p[0], vec3_cross(p[1], p[2]));
    }
    return sixfold / 6.0;
}

static void outline(const struct mill_body *is, int wall, double tolerance, struct mill_mesh *mesh)
{
    (void)wall;
    (void)tolerance;
    for (size_t k = 0; k < is->facets; k++) {
        const vec3 *p = is->facet[k];
        mill_mesh_triangle(mesh, mill_body_out(is, p[0]), mill_body_out(is, p[is->inside ? 2 : 1]),
                           mill_body_out(is, p[is->inside ? 1 : 2]));
    }
}

static double per_square(vec3 a)
{
    const double square = vec3_dot(a, a);
    return square > 0.0 ? 1.0 / square : 0.0;
}

static struct mill_facets_flat flat_of(const vec3 p[3])
{
    const vec3 ab = vec3_sub(p[1], p[0]), ac = vec3_sub(p[2], p[0]), bc = vec3_sub(ac, ab);
    const vec3 n = vec3_cross(ab, ac);
    const double square = vec3_dot(n, n), per = square > 0.0 ? 1.0 / square : (double)NAN;
    const vec3 u = vec3_scale(vec3_cross(ac, n), per), v = vec3_scale(vec3_cross(n, ab), per);
    return (struct mill_facets_flat){p[0], ab, ac,
                                     u,    v,  {per_square(ab), per_square(bc), per_square(ac)}};
}

/* Computes the unit normal of a facet and adds it, weighted, to the normals at its corners */
static void add_normals(struct mill_facets *m, int32_t facet, const vec3 p[3])
{
    struct mill_facets_side *s = &m->side[facet];
    const vec3 n = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
    const double length = vec3_norm(n);
    s->normal = vec3_scale(n, length > 0.0 ? 1.0 / length : 0.0);
    for (int k = 0; k < 3; k++) {
        const vec3 one = vec3_sub(p[(k + 1) % 3], p[k]), other = vec3_sub(p[(k + 2) % 3], p[k]);
        const double angle =
            mill_elementary_atan2(vec3_norm(vec3_cross(one, other)), vec3_dot(one, other));
        vec3 *sum = &m->at_corner[s->corner[k]];
        *sum = vec3_axpy(*sum, angle, s->normal);
    }
}

/* Finds the neighbour at each side; for an edge that is not shared by exactly two facets, the place
 * of the sum of their normals. It takes the last elements of at_corner: of all corners and such
 * edges together there are at most as many as elements. */
static void find_across(struct mill_facets *m, const struct mill_facets_joints *j)
{
    int32_t place = (int32_t)j->edges;
    for (size_t k = 0, step; k < j->edges; k += step) {
        step = mill_facets_sharing(j, k);
        place -= step > 2;
        for (size_t i = 0; i < step; i++) {
            const struct mill_facets_edge *e = &j->edge[k + i];
            const struct mill_facets_edge *other = &j->edge[k + (step == 2 ? 1 - i : i)];
            m->side[e->facet].across[e->side] = step > 2 ? -place : other->facet;
            if (step > 2)
                m->at_corner[place] = vec3_add(m->at_corner[place], m->side[e->facet].normal);
        }
    }
}

/* Fills the tables of facets in the tree's order, with the fronts towards the balls */
static bool arrange(struct mill_facets *m)
{
    const struct mill_body *is = &m->body.is;
    const size_t n = is->facets;
    vec3(*seen)[3] = malloc(n * sizeof *seen), (*sorted)[3] = malloc(n * sizeof *sorted);
    struct mill_facets_joints joints = {0};
    bool good = seen && sorted;
    for (size_t k = 0; good && k < 3 * n; k++)
        seen[k / 3][is->inside ? 2 - k % 3 : k % 3] = mill_body_out(is, is->facet[k / 3][k % 3]);
    good = good && mill_facets_plant((const vec3(*)[3])seen, n, &m->tree) &&
           mill_facets_dress(&m->tree, (const vec3(*)[3])seen, NULL);
    for (size_t k = 0; good && k < n; k++) {
        memcpy(sorted[k], seen[m->tree.order[k]], sizeof sorted[k]);
        m->flat[k] = flat_of(sorted[k]);
    }
    good = good && mill_facets_join((const vec3(*)[3])sorted, n, &joints);
    for (size_t k = 0; good && k < n; k++) {
        memcpy(m->side[k].corner, joints.corner[k], sizeof m->side[k].corner);
        add_normals(m, (int32_t)k, sorted[k]);
    }
    if (good)
        find_across(m, &joints);
    mill_facets_part(&joints);
    free(seen);
    free(sorted);
    return good;
}

static bool create(struct mill_shape *shape)
{
    struct mill_facets *m = (struct mill_facets *)shape;
    struct mill_body *is = &m->body.is;
    m->corner = malloc(is->facets * sizeof *m->corner);
    m->flat = malloc(is->facets * sizeof *m->flat);
    m->side = malloc(is->facets * sizeof *m->side);
    m->at_corner = calloc(3 * is->facets, sizeof *m->at_corner); /* some are not used */
    if (!m->corner || !m->flat || !m->side || !m->at_corner)
        return false;
    memcpy(m->corner, is->facet, is->facets * sizeof *m->corner);
    is->facet = (const vec3(*)[3])m->corner;
    return arrange(m);
}

static void release(struct mill_shape *shape)
{
    struct mill_facets *m = (struct mill_facets *)shape;
    mill_facets_fell(&m->tree);
    free(m->corner);
    free(m->flat);
    free(m->side);
    free(m->at_corner);
}

static const struct mill_shape_type surface = {
    sizeof(struct mill_facets), create,          release, next_contact, contact, reachable,
    .beside = beside,           .places = places};

const struct mill_solid mill_facets_solid = {&surface, is_sound, volume, outline, .hull = hull};
