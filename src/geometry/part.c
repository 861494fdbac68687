/* Convex parts of bodies, and how far they reach: by the support, the farthest point in a
 * direction.
 *
 * How near does a part come to a round wall, from inside? The wall is the envelope of its tangent
 * planes, so the gap is the minimum, over their directions u, of what is left between the plane and
 * the part: radius - e(u), where e is the part's extent. e is convex and e(s u) = s e(u). So for u
 * between two directions, or three, e is at most the same combination of their values. The search
 * divides the circle or sphere of directions until this bound is close to the greatest e. */
#include "geometry/mesh.h"

#include <stdlib.h>

enum { DEEPEST = 40 };
/* relative to the gap, at walls without and with round ends, and to a distance that counts as 0 */
#define CLOSE_ENOUGH 1e-4
#define CLOSE_AT_ENDS 1e-2
#define TOUCHING 0.05
/* relative to the hull: error of an outline that is not the exact surface */
#define FLAT 1e-3

/* ---- making parts ---- */

struct mill_part mill_part_of(const struct mill_solid *solid, const struct mill_body *is)
{
    struct mill_part p = {.support = solid->support, .x = is->x, .y = is->y, .z = is->z};
    p.core = solid->core(is);
    p.centre = vec3_axpy(is->centre, p.core.shift, is->z);
    p.core.shift = 0.0;
    const vec3 far = mill_solid_extents(solid, &p.core);
    p.around = vec3_norm(vec3_make(solid->round ? 0.0 : far.x, far.y, far.z)) + p.core.grown;
    return p;
}

static vec3 support_of_facet(const struct mill_core *core, vec3 way)
{
    const vec3 *c = core->corner;
    const double a = vec3_dot(c[0], way), b = vec3_dot(c[1], way), d = vec3_dot(c[2], way);
    return a >= b && a >= d ? c[0] : (b >= d ? c[1] : c[2]);
}

struct mill_part mill_part_facet(vec3 a, vec3 b, vec3 c, double grown)
{
    const struct mill_pose own = mill_pose_still;
    const vec3 corner[3] = {a, b, c}, centre = vec3_scale(vec3_add(vec3_add(a, b), c), 1.0 / 3.0);
    struct mill_part p = {support_of_facet, {.grown = grown}, centre, own.x, own.y, own.z, 0.0};
    for (int k = 0; k < 3; k++) {
        p.core.corner[k] = vec3_sub(corner[k], p.centre);
        p.around = fmax(p.around, vec3_norm(p.core.corner[k]));
    }
    p.around += grown;
    return p;
}

bool mill_part_list(const struct mill_solid *solid, const struct mill_body *is,
                    struct mill_part **part, int32_t *count)
{
    struct mill_mesh mesh = {0};
    *count = 1;
    if (!solid->support) {
        const struct mill_hull hull = mill_solid_hull(solid, is);
        const double flat = is->facets > 0 ? 0.0 : FLAT * (hull.half + hull.radius);
        solid->outline(is, MILL_SOLID_WHOLE, flat, &mesh);
        *count = (int32_t)mesh.triangles;
        *part = malloc((mesh.triangles + 1) * sizeof **part);
        for (int32_t k = 0; *part && k < *count; k++) {
            const int64_t *c = mesh.corner[k];
            (*part)[k] =
                mill_part_facet(mesh.point[c[0]], mesh.point[c[1]], mesh.point[c[2]], flat);
        }
    } else if ((*part = malloc(sizeof **part))) {
        **part = mill_part_of(solid, is);
    }
    const bool good = *part && !mesh.failed;
    mill_mesh_free(&mesh);
    return good;
}

struct mill_part mill_part_move(const struct mill_part *part, const struct mill_pose *to)
{
    struct mill_part p = *part;
    p.centre = mill_pose_out(to, p.centre);
    p.x = mill_pose_turn_out(to, p.x);
    p.y = mill_pose_turn_out(to, p.y);
    p.z = mill_pose_turn_out(to, p.z);
    return p;
}

struct mill_pose mill_part_frame(vec3 through, vec3 direction)
{
    const vec3 any = fabs(direction.x) < 0.6 ? vec3_make(1.0, 0.0, 0.0) : vec3_make(0.0, 1.0, 0.0);
    const vec3 across = vec3_cross(direction, any), y = vec3_scale(across, 1.0 / vec3_norm(across));
    return (struct mill_pose){
        .place = through, .x = vec3_cross(y, direction), .y = y, .z = direction};
}

/* ---- walls ---- */

double mill_part_wall_gap(const struct mill_wall *w, vec3 p)
{
    if (w->flat)
        return vec3_dot(w->normal, vec3_sub(p, w->point));
    const double beyond = fabs(p.z) - w->half;
    const double away = sqrt(p.x * p.x + p.y * p.y + (beyond > 0.0 ? beyond * beyond : 0.0));
    return (w->radius + w->slope * p.z - away) / sqrt(1.0 + w->slope * w->slope);
}

struct search {
    struct mill_part part; /* its core alone: what it is grown by has no direction */
    const struct mill_wall *wall;
    double radius; /* [m] of the wall, less what the part is grown by */
    double lift;   /* [m] extent along the axis, which directions between two others have more of */
    double best, bound;  /* [m] the greatest extent found; no extent is greater than the bound */
    double share, slack; /* accuracy: share of the gap, [m] */
    long looks;
};

/* A direction, and the extent in it */
struct look {
    vec3 u;
    double e;
};

static struct look look(struct search *s, vec3 sum)
{
    const struct mill_wall *w = s->wall;
    struct look l = {vec3_scale(sum, 1.0 / vec3_norm(sum)), 0.0};
    if (isinf(w->half))
        l.e = mill_part_extent(&s->part, vec3_make(l.u.x, l.u.y, -w->slope));
    else
        l.e = mill_part_extent(&s->part, l.u) - w->half * fabs(l.u.z);
    s->best = fmax(s->best, l.e);
    s->looks++;
    return l;
}

/* Bounds the extents between corners that are this much shorter in the middle. Close enough? */
static bool is_bounded(struct search *s, double e, double shortened, int depth)
{
    const double most = e + s->lift, bound = most > 0.0 ? most / shortened - s->lift : e;
    const double gap = fabs(s->radius - s->best);
    if (depth < DEEPEST && bound > s->best + fmax(s->share * gap, s->slack))
        return false;
    s->bound = fmax(s->bound, bound);
    return true;
}

static void divide_arc(struct search *s, struct look a, struct look b, int depth)
{
    const vec3 sum = vec3_add(a.u, b.u);
    if (is_bounded(s, fmax(a.e, b.e), 0.5 * vec3_norm(sum), depth))
        return;
    const struct look middle = look(s, sum);
    divide_arc(s, a, middle, depth + 1);
    divide_arc(s, middle, b, depth + 1);
}

static void divide_triangle(struct search *s, struct look a, struct look b, struct look c,
                            int depth)
{
    const vec3 n = vec3_cross(vec3_sub(b.u, a.u), vec3_sub(c.u, a.u));
    if (is_bounded(s, fmax(a.e, fmax(b.e, c.e)), fabs(vec3_dot(n, a.u)) / vec3_norm(n), 2 * depth))
        return;
    const struct look ab = look(s, vec3_add(a.u, b.u)), bc = look(s, vec3_add(b.u, c.u)),
                      ca = look(s, vec3_add(c.u, a.u));
    divide_triangle(s, a, ab, ca, depth + 1);
    divide_triangle(s, b, bc, ab, depth + 1);
    divide_triangle(s, c, ca, bc, depth + 1);
    divide_triangle(s, ab, bc, ca, depth + 1);
}

struct mill_part_gap mill_part_to_wall(const struct mill_part *p, const struct mill_wall *w,
                                       double near)
{
    const double lean = sqrt(1.0 + w->slope * w->slope);
    struct search s = {*p, w, .best = -INFINITY, .bound = -INFINITY, .slack = TOUCHING * near};
    static const vec3 way[6] = {{1, 0, 0},  {0, 1, 0}, {-1, 0, 0},
                                {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    struct look at[6];
    if (w->flat) {
        const double gap =
            -vec3_dot(w->normal, w->point) - mill_part_extent(p, vec3_scale(w->normal, -1.0));
        return (struct mill_part_gap){gap, gap, 1};
    }
    const bool ends = !isinf(w->half);
    s.radius = w->radius - p->core.grown * lean;
    s.share = ends ? CLOSE_AT_ENDS : CLOSE_ENOUGH;
    s.part.core.grown = 0.0;
    if (w->slope != 0.0)
        s.lift = mill_part_extent(&s.part, vec3_make(0.0, 0.0, w->slope));
    for (int k = 0; k < (ends ? 6 : 4); k++)
        at[k] = look(&s, way[k]);
    for (int k = 0; k < 4; k++) {
        for (int end = 4; ends && end < 6; end++)
            divide_triangle(&s, at[k], at[(k + 1) % 4], at[end], 0);
        if (!ends)
            divide_arc(&s, at[k], at[(k + 1) % 4], 0);
    }
    return (struct mill_part_gap){(s.radius - s.bound) / lean, (s.radius - s.best) / lean, s.looks};
}
