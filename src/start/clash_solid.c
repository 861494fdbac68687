/* Surfaces as unions of convex parts. A body is one part: a box or a frustum, grown by its rounding
 * or radius. A line and a point are frustums, too. A mesh has one part for each facet. */
#include "start/clash_solid.h"

#include "geometry/body.h"
#include "geometry/facets.h"

#include <stdlib.h>

bool mill_clash_solid_is(const struct mill_setup_surface *s)
{
    return s->type->hull || s->type == &mill_blade_type || s->type == &mill_cylinder_shaft_type;
}

/* ---- parts ---- */

static struct mill_clash_part part_at(const struct mill_body *is, enum mill_clash_form form)
{
    return (struct mill_clash_part){
        .form = form, .centre = is->centre, .x = is->x, .y = is->y, .z = is->z};
}

static struct mill_clash_part box_of(const struct mill_body *is)
{
    struct mill_clash_part p = part_at(is, MILL_CLASH_BOX);
    p.grown = is->rounding;
    p.half = vec3_make(0.5 * is->size.x - p.grown, 0.5 * is->size.y - p.grown,
                       0.5 * is->size.z - p.grown);
    p.around = vec3_norm(p.half) + p.grown;
    return p;
}

static struct mill_clash_part round_of(const struct mill_body *is,
                                       const struct mill_shape_type *type)
{
    const struct mill_round_core core = mill_round_core(type, is);
    struct mill_clash_part p = part_at(is, MILL_CLASH_ROUND);
    p.centre = vec3_axpy(is->centre, 0.5 * (core.from + core.to), is->z);
    p.grown = core.grown;
    p.half.z = 0.5 * (core.to - core.from);
    p.low = core.low;
    p.high = core.high;
    const double wide = fmax(p.low, p.high);
    p.around = sqrt(p.half.z * p.half.z + wide * wide) + p.grown;
    return p;
}

static struct mill_clash_part facet_of(const struct mill_body *is, const vec3 corner[3])
{
    struct mill_clash_part p = {.form = MILL_CLASH_FACET};
    const vec3 a = mill_body_out(is, corner[0]), b = mill_body_out(is, corner[1]),
               c = mill_body_out(is, corner[2]);
    p.centre = vec3_scale(vec3_add(vec3_add(a, b), c), 1.0 / 3.0);
    p.x = vec3_sub(a, p.centre);
    p.y = vec3_sub(b, p.centre);
    p.z = vec3_sub(c, p.centre);
    p.around = fmax(vec3_norm(p.x), fmax(vec3_norm(p.y), vec3_norm(p.z)));
    return p;
}

/* As in blade.c: from the axis to the tip */
static struct mill_clash_part blade_of(const struct mill_blade *is)
{
    const struct mill_heading angle = mill_elementary_heading(is->angle);
    const struct mill_heading pitch = mill_elementary_heading(is->pitch);
    const vec3 radial = {0.0, angle.cos, angle.sin}, around = {0.0, -angle.sin, angle.cos};
    const vec3 along = {1.0, 0.0, 0.0};
    struct mill_clash_part p = {.form = MILL_CLASH_BOX};
    p.half = vec3_make(0.5 * is->width, 0.5 * is->tip_radius, 0.5 * is->thickness);
    p.centre = vec3_axpy(vec3_make(is->position, 0.0, 0.0), p.half.y, radial);
    p.x = vec3_axpy(vec3_scale(along, pitch.cos), pitch.sin, around);
    p.y = radial;
    p.z = vec3_axpy(vec3_scale(along, -pitch.sin), pitch.cos, around);
    p.around = vec3_norm(p.half);
    return p;
}

static struct mill_clash_part shaft_of(const struct mill_shaft *is, double length)
{
    const struct mill_body body = {.x = {0.0, 1.0, 0.0},
                                   .y = {0.0, 0.0, 1.0},
                                   .z = {1.0, 0.0, 0.0},
                                   .radius = is->radius,
                                   .length = length};
    return round_of(&body, &mill_round_cylinder_type);
}

struct mill_clash_part mill_clash_solid_move(const struct mill_clash_part *part,
                                             const struct mill_pose *to)
{
    struct mill_clash_part p = *part;
    p.centre = mill_pose_out(to, p.centre);
    p.x = mill_pose_turn_out(to, p.x);
    p.y = mill_pose_turn_out(to, p.y);
    p.z = mill_pose_turn_out(to, p.z);
    return p;
}

vec3 mill_clash_solid_support(const struct mill_clash_part *p, vec3 way)
{
    const double x = vec3_dot(p->x, way), y = vec3_dot(p->y, way), z = vec3_dot(p->z, way);
    vec3 at = p->centre;
    if (p->form == MILL_CLASH_FACET)
        return vec3_add(at, x >= y && x >= z ? p->x : (y >= z ? p->y : p->z));
    if (p->form == MILL_CLASH_BOX) {
        at = vec3_axpy(at, x < 0.0 ? -p->half.x : p->half.x, p->x);
        at = vec3_axpy(at, y < 0.0 ? -p->half.y : p->half.y, p->y);
        return vec3_axpy(at, z < 0.0 ? -p->half.z : p->half.z, p->z);
    }
    /* the farthest point of either rim, in the half plane of the axis and the direction */
    const double across = sqrt(x * x + y * y);
    const bool up = z * p->half.z + p->high * across >= p->low * across - z * p->half.z;
    const double r = up ? p->high : p->low;
    at = vec3_axpy(at, up ? p->half.z : -p->half.z, p->z);
    if (!(across > 0.0) || r == 0.0)
        return at;
    return vec3_axpy(vec3_axpy(at, r * x / across, p->x), r * y / across, p->y);
}

/* ---- the tree ---- */

struct item {
    double key; /* [m] coordinate along the longest side */
    int32_t part;
};

static int by_key(const void *a, const void *b)
{
    const struct item *p = a, *q = b;
    return p->key != q->key ? (p->key > q->key) - (p->key < q->key)
                            : (p->part > q->part) - (p->part < q->part);
}

static double along(vec3 a, int axis)
{
    return axis == 0 ? a.x : (axis == 1 ? a.y : a.z);
}

/* Fills in the node around the items and all nodes below it. Returns the first unused node. */
static int32_t grow(struct mill_clash_solid *s, int32_t node, struct item *item, int32_t count)
{
    struct mill_clash_node *n = &s->node[node];
    vec3 lo = s->part[item[0].part].centre, hi = lo;
    for (int32_t k = 1; k < count; k++) {
        const vec3 c = s->part[item[k].part].centre;
        lo = vec3_make(fmin(lo.x, c.x), fmin(lo.y, c.y), fmin(lo.z, c.z));
        hi = vec3_make(fmax(hi.x, c.x), fmax(hi.y, c.y), fmax(hi.z, c.z));
    }
    const vec3 side = vec3_sub(hi, lo);
    const int axis = side.x >= side.y && side.x >= side.z ? 0 : (side.y >= side.z ? 1 : 2);
    *n = (struct mill_clash_node){.centre = vec3_axpy(lo, 0.5, side), .part = -1};
    for (int32_t k = 0; k < count; k++) {
        const struct mill_clash_part *p = &s->part[item[k].part];
        n->radius = fmax(n->radius, vec3_norm(vec3_sub(p->centre, n->centre)) + p->around);
        item[k].key = along(p->centre, axis);
    }
    if (count == 1) {
        n->part = item[0].part;
        return node + 1;
    }
    qsort(item, (size_t)count, sizeof *item, by_key);
    n->left = node + 1;
    n->right = grow(s, node + 1, item, count / 2);
    return grow(s, n->right, item + count / 2, count - count / 2);
}

static bool plant(struct mill_clash_solid *s)
{
    struct item *item = malloc(sizeof *item * (size_t)s->parts);
    s->node = malloc(sizeof *s->node * 2 * (size_t)s->parts);
    for (int32_t k = 0; item && k < s->parts; k++)
        item[k].part = k;
    if (item && s->node)
        grow(s, 0, item, s->parts);
    free(item);
    return item && s->node;
}

/* ---- solids ---- */

bool mill_clash_solid_init(struct mill_clash_solid *s, const struct mill_setup *setup, int k,
                           struct mill_motion *const *motion)
{
    const struct mill_setup_surface *surface = &setup->surface[k];
    const struct mill_shape_type *type = surface->type;
    const struct mill_body *is = type->hull ? surface->form : NULL;
    *s = (struct mill_clash_solid){.surface = k, .body = is, .axis = {1.0, 0.0, 0.0}};
    s->motion = surface->motion == MILL_STILL ? NULL : motion[surface->motion];
    const size_t facets = is ? is->facets : 0;
    s->mesh = facets > 0;
    s->ball = type == &mill_round_sphere_type;
    s->turned = is ? !s->mesh && type != &mill_box_type : type == &mill_cylinder_shaft_type;
    if (is)
        s->axis = is->z;
    s->parts = s->mesh ? (int32_t)facets : 1;
    s->part = malloc(sizeof *s->part * (size_t)s->parts);
    if (!s->part)
        return false;
    if (is && s->mesh)
        for (int32_t n = 0; n < s->parts; n++)
            s->part[n] = facet_of(is, is->facet[n]);
    else if (is)
        s->part[0] = type == &mill_box_type ? box_of(is) : round_of(is, type);
    else
        s->part[0] =
            s->turned ? shaft_of(surface->form, setup->drum.length) : blade_of(surface->form);
    return plant(s);
}

void mill_clash_solid_free(struct mill_clash_solid *s)
{
    free(s->part);
    free(s->node);
}

/* The farthest point of a convex part is also the farthest one in its own direction. The search
 * goes from a farthest point to a farther one, from several first directions. */
static double reach_of(const struct mill_clash_part *p)
{
    enum { WAYS = 32, STEPS = 100 };
    double far = 0.0;
    for (int n = 0; n < WAYS; n++) {
        const struct mill_heading to = mill_elementary_heading(n * (2.0 * MILL_PI / WAYS));
        vec3 way = {0.0, to.cos, to.sin};
        double last = 0.0;
        for (int k = 0; k < STEPS; k++) {
            const vec3 at = mill_clash_solid_support(p, way);
            const double d = sqrt(at.y * at.y + at.z * at.z);
            if (!(d > last))
                break;
            way = vec3_make(0.0, at.y / d, at.z / d);
            last = d;
        }
        far = fmax(far, last);
    }
    return far + p->grown;
}

double mill_clash_solid_reach(const struct mill_setup_surface *surface)
{
    const struct mill_setup_surface still = {
        .type = surface->type, .form = surface->form, .motion = MILL_STILL};
    const struct mill_setup setup = {.surfaces = 1, .surface = &still};
    struct mill_clash_solid s;
    double far = -1.0;
    if (mill_clash_solid_init(&s, &setup, 0, NULL))
        for (int32_t k = 0; k < s.parts; k++)
            far = fmax(far, reach_of(&s.part[k]));
    mill_clash_solid_free(&s);
    return far;
}

/* The solid angles of all facets add up to 4 pi for a point inside the mesh, to 0
 * for one outside. */
bool mill_clash_solid_holds(const struct mill_clash_solid *mesh, vec3 place)
{
    double angle = 0.0;
    if (vec3_norm(vec3_sub(place, mesh->node->centre)) > mesh->node->radius)
        return false;
    for (int32_t k = 0; k < mesh->parts; k++) {
        const struct mill_clash_part *p = &mesh->part[k];
        const vec3 from = vec3_sub(p->centre, place);
        angle +=
            mill_facets_angle(vec3_add(from, p->x), vec3_add(from, p->y), vec3_add(from, p->z));
    }
    return fabs(angle) > MILL_PI;
}
