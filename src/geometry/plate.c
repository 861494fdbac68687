/* The flat end walls: the gap is a parabola in time, or a straight line if gravity is parallel to
 * the wall. */
#include "geometry/mesh.h"
#include "geometry/shapes.h"

struct plate {
    struct mill_shape base;
    double x;      /* [m] */
    double inward; /* +1 or -1: x component of the normal into the mill */
};

static struct mill_hit next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                                    double radius, double now, double horizon, bool touching)
{
    const struct plate *w = (const struct plate *)shape;
    (void)now;
    const double away = w->inward * (f->r.x - w->x) - radius, closing = -w->inward * f->v.x;
    const double p[5] = {-away, closing, -0.5 * w->inward * f->g.x};
    return mill_hit_at(mill_poly_first_rise(p, horizon, touching, NULL));
}

static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   const struct mill_pose *pose)
{
    const struct plate *w = (const struct plate *)shape;
    const vec3 point = {w->x, centre.y, centre.z}, none = {0.0, 0.0, 0.0};
    return (struct mill_contact){.normal = {w->inward, 0.0, 0.0},
                                 .point = point,
                                 .velocity = shape->motion ? mill_pose_velocity(pose, point) : none,
                                 .gap = w->inward * (centre.x - w->x) - radius};
}

static bool reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct plate *w = (const struct plate *)shape;
    const double nearest = w->inward > 0.0 ? lo.x - w->x : w->x - hi.x;
    return nearest <= radius * (1.0 + 1e-3) + 1e-6 * fabs(w->x);
}

static void draw(const struct mill_shape *shape, const struct mill_chamber *chamber,
                 double tolerance, struct mill_mesh *mesh)
{
    const struct plate *w = (const struct plate *)shape;
    mill_mesh_lid(mesh, &chamber->drum, w->x, w->inward, tolerance);
}

static bool create(struct mill_shape *shape, const void *form, const struct mill_chamber *chamber)
{
    struct plate *w = (struct plate *)shape;
    (void)form;
    w->inward = shape->number == 0 ? 1.0 : -1.0;
    w->x = -chamber->half_length * w->inward;
    shape->fixed = true; /* if it turns, its surface does not change */
    return true;
}

const struct mill_shape_type mill_plate_type = {.name = "end wall",
                                                .kind = MILL_BALL_WALL,
                                                .size = sizeof(struct plate),
                                                .create = create,
                                                .next_contact = next_contact,
                                                .contact = contact,
                                                .reachable = reachable,
                                                .draw = draw,
                                                .chart = mill_shape_chart};
