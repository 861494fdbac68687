/* Bodies: their places, their movement, and the cells that they reach. */
#include "geometry/body.h"

#include <assert.h>

/* Fraction of the size of the mill; larger than rounding errors of a place. */
#define MARGIN 1e-6

/* [m] Maximum of way . p over all points p of a convex body, seen from the line. way: unit */
static double reach_of(const struct mill_bodied *b, vec3 way)
{
    const vec3 own = mill_body_turn_in(&b->is, way);
    return vec3_dot(way, vec3_sub(b->is.centre, b->through)) +
           vec3_dot(own, b->convex.base.solid->support(&b->core, own)) + b->core.grown;
}

/* The ring and the strip of a convex body are narrower than those of its hull. */
static void narrow_ring(struct mill_bodied *b)
{
    const vec3 e = b->towards, side = vec3_cross(b->axis, e);
    b->from = -reach_of(b, vec3_scale(b->axis, -1.0));
    b->to = reach_of(b, b->axis);
    if (vec3_norm(e) == 0.0)
        return;
    const double across = fmax(reach_of(b, side), reach_of(b, vec3_scale(side, -1.0)));
    const double far = reach_of(b, e), back = reach_of(b, vec3_scale(e, -1.0));
    const double most = fmax(far, back);
    b->beyond = fmin(b->beyond, sqrt(most * most + across * across));
    if (back <= MARGIN * far) /* none of it is behind the line */
        b->across = across;
}

/* A body that turns about a line at rest stays in a ring about this line. */
static void find_ring(struct mill_bodied *b)
{
    const struct mill_motion *motion = b->convex.base.motion;
    const vec3 z = b->along, centre = b->is.centre;
    b->rings = motion && !motion->on && motion->axial;
    if (!b->rings)
        return;
    b->through = motion->through;
    b->axis = motion->axis;
    const vec3 a = vec3_sub(vec3_axpy(centre, -b->hull.half, z), b->through);
    const vec3 way = vec3_scale(z, 2.0 * b->hull.half);
    const double a_along = vec3_dot(a, b->axis), way_along = vec3_dot(way, b->axis);
    const vec3 a_out = vec3_axpy(a, -a_along, b->axis),
               way_out = vec3_axpy(way, -way_along, b->axis);
    const double square = vec3_dot(way_out, way_out);
    const double share =
        square > 0.0 ? fmin(fmax(-vec3_dot(a_out, way_out) / square, 0.0), 1.0) : 0.0;
    const vec3 b_out = vec3_add(a_out, way_out), middle = vec3_add(a_out, b_out);
    if (vec3_norm(middle) > b->hull.radius) {
        const vec3 e = vec3_scale(middle, 1.0 / vec3_norm(middle));
        if (fmin(vec3_dot(a_out, e), vec3_dot(b_out, e)) >= -MARGIN * vec3_norm(middle))
            b->towards = e;
        b->across =
            fmax(vec3_norm(vec3_cross(a_out, e)), vec3_norm(vec3_cross(b_out, e))) + b->hull.radius;
    }
    const double first = vec3_norm(a_out), last = vec3_norm(vec3_add(a_out, way_out));
    b->near = vec3_norm(vec3_axpy(a_out, share, way_out)) - b->hull.radius;
    b->beyond = fmax(first, last) + b->hull.radius;
    b->from = fmin(a_along, a_along + way_along) - b->hull.radius;
    b->to = fmax(a_along, a_along + way_along) + b->hull.radius;
    if (b->convex.base.solid->support && !b->is.inside)
        narrow_ring(b);
}

struct mill_wall mill_body_wall(const struct mill_solid *solid, const struct mill_body *is,
                                int wall)
{
    struct mill_wall all[MILL_WALLS] = {{false}};
    assert(wall < MILL_WALLS);
    if (wall >= 0)
        solid->walls(is, all);
    return all[wall < 0 ? 0 : wall];
}

/* Sets an axis, in the body's own frame, about which the surface can turn without a change; zero:
 * there is none. Returns true if any direction is such an axis. */
static bool find_symmetry(const struct mill_bodied *b, vec3 *symmetry)
{
    const struct mill_shape *base = &b->convex.base;
    const struct mill_wall wall = mill_body_wall(base->solid, &b->is, base->wall);
    const vec3 own = {0.0, 0.0, 1.0}, none = {0.0, 0.0, 0.0};
    if (base->wall >= 0) {
        *symmetry = wall.flat ? wall.normal : own;
        return !wall.flat && wall.half <= 0.0;
    }
    *symmetry = base->solid->round ? own : none;
    return base->solid->ball;
}

bool mill_body_create(struct mill_bodied *b, const struct mill_reach *places)
{
    struct mill_convex *c = &b->convex;
    struct mill_motion_bounds *bounds = &c->bounds;
    vec3 symmetry;
    const bool ball = find_symmetry(b, &symmetry);
    b->places = *places;
    b->hull = mill_solid_hull(c->base.solid, &b->is);
    b->along = b->hull.axis == 0 ? b->is.z : b->hull.axis == 1 ? b->is.x : b->is.y;
    if (c->base.solid->core)
        b->core = c->base.solid->core(&b->is);
    c->centre = b->is.centre;
    *bounds = mill_motion_bounds(c->base.motion, c->centre);
    bool in_itself = ball; /* it turns about an axis of symmetry */
    if (vec3_norm(symmetry) > 0.0 && vec3_norm(bounds->axis) > 0.0) {
        const struct mill_pose pose = mill_shape_pose(&c->base, 0.0);
        const vec3 own = mill_pose_turn_out(&pose, mill_body_turn_out(&b->is, symmetry));
        in_itself = ball || vec3_norm(vec3_cross(own, bounds->axis)) < 1e-12;
    }
    if (in_itself) {
        bounds->turning = bounds->spin_up = 0.0;
        bounds->axis = vec3_make(0.0, 0.0, 0.0);
    }
    /* except for rounding, a place on the axis does not move */
    const double size = vec3_norm(b->is.centre) + b->hull.half + b->hull.radius;
    c->base.fixed = bounds->turning == 0.0 && bounds->far <= 1e-15 * size;
    if (c->base.fixed)
        bounds->speed = bounds->acceleration = bounds->far = 0.0;
    find_ring(b);
    return !c->base.type->create || c->base.type->create(&c->base);
}

/* The maximum distance of points of a box from its centre, normal to a direction */
static double across_of(vec3 half, vec3 axis)
{
    double across = 0.0;
    for (int k = 0; k < 4; k++) {
        const vec3 corner = {half.x, k & 1 ? -half.y : half.y, k & 2 ? -half.z : half.z};
        across = fmax(across, vec3_norm(vec3_axpy(corner, -vec3_dot(corner, axis), axis)));
    }
    return across;
}

bool mill_body_ring_meets(const struct mill_bodied *b, const double ring[4], vec3 lo, vec3 hi,
                          double radius)
{
    const double far = radius * (1.0 + 1e-3) + MARGIN * (b->beyond + fabs(b->from) + fabs(b->to));
    const vec3 q = vec3_sub(vec3_scale(vec3_add(lo, hi), 0.5), b->through);
    const vec3 half = vec3_scale(vec3_sub(hi, lo), 0.5), axis = b->axis;
    const double along = vec3_dot(q, axis);
    const double most = half.x * fabs(axis.x) + half.y * fabs(axis.y) + half.z * fabs(axis.z);
    if (along <= ring[2] - far - most || along >= ring[3] + far + most)
        return false; /* most boxes */
    const double half_across = across_of(half, axis), away = vec3_norm(vec3_axpy(q, -along, axis));
    return away > ring[0] - far - half_across && away < ring[1] + far + half_across;
}

/* Seen from the line, ball and body are within angles of the directions of box and body. */
struct mill_sector mill_body_sector(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct mill_bodied *b = (const struct mill_bodied *)shape;
    const struct mill_sector any = {0.0, 0.0, -2.0};
    mill_body_clip(b, &lo, &hi);
    const vec3 q = vec3_sub(vec3_scale(vec3_add(lo, hi), 0.5), b->through);
    const vec3 out = vec3_axpy(q, -vec3_dot(q, b->axis), b->axis);
    const double margin = 1e-3 * radius + MARGIN * (b->beyond + b->hull.half);
    const double half = across_of(vec3_scale(vec3_sub(hi, lo), 0.5), b->axis) + margin;
    const double rho = vec3_norm(out), across = b->across + radius + margin;
    if (!b->rings || vec3_norm(b->towards) == 0.0 || !(rho - half > across))
        return any;
    const vec3 e = b->towards;
    const double s = half / rho, t = across / (rho - half); /* the sines of both angles */
    return (struct mill_sector){vec3_dot(e, out) / rho, vec3_dot(b->axis, vec3_cross(e, out)) / rho,
                                sqrt((1.0 - s * s) * (1.0 - t * t)) - s * t - 1e-9};
}

void mill_body_clip(const struct mill_bodied *b, vec3 *lo, vec3 *hi)
{
    const vec3 least = b->places.lo, most = b->places.hi;
    *lo = vec3_make(mill_least(mill_greatest(lo->x, least.x), most.x),
                    mill_least(mill_greatest(lo->y, least.y), most.y),
                    mill_least(mill_greatest(lo->z, least.z), most.z));
    *hi = vec3_make(mill_least(mill_greatest(hi->x, least.x), most.x),
                    mill_least(mill_greatest(hi->y, least.y), most.y),
                    mill_least(mill_greatest(hi->z, least.z), most.z));
}

/* Can balls in the box touch the sphere around all places that the body reaches? */
static bool comes_near(const struct mill_bodied *b, vec3 lo, vec3 hi, double radius)
{
    const struct mill_motion_bounds *m = &b->convex.bounds;
    const vec3 h = m->home;
    const vec3 off = {h.x - mill_least(mill_greatest(h.x, lo.x), hi.x),
                      h.y - mill_least(mill_greatest(h.y, lo.y), hi.y),
                      h.z - mill_least(mill_greatest(h.z, lo.z), hi.z)};
    const double far = m->far + b->hull.half + b->hull.radius;
    return vec3_norm(off) <= far + radius * (1.0 + 1e-3) + MARGIN * (far + vec3_norm(h));
}

/* The box is in the laboratory. The gap to a fixed body depends only on the place. Between two
 * places it changes by at most their distance. */
bool mill_body_reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct mill_bodied *b = (const struct mill_bodied *)shape;
    const double ring[4] = {b->near, b->beyond, b->from, b->to};
    mill_body_clip(b, &lo, &hi);
    if (shape->fixed) {
        const struct mill_pose pose = mill_shape_pose(shape, 0.0);
        const vec3 middle = vec3_scale(vec3_add(lo, hi), 0.5);
        const double half = 0.5 * vec3_norm(vec3_sub(hi, lo));
        const double margin = 1e-3 * radius + MARGIN * (b->hull.radius + b->hull.half);
        return mill_shape_gap(shape, middle, radius, &pose) <= half + margin;
    }
    return b->is.inside || ((!b->rings || mill_body_ring_meets(b, ring, lo, hi, radius)) &&
                            comes_near(b, lo, hi, radius));
}
