/* Drum and shaft: circles about the axis. The centres of touching balls are at R - a in the drum
 * and at R + a at the shaft. */
#include "geometry/mesh.h"
#include "geometry/shapes.h"

struct cylinder {
    struct mill_shape base;
    double radius; /* [m] */
    double inward; /* +1: balls meet it from inside (drum), -1: from outside (shaft) */
};

static double contact_radius(const struct cylinder *c, double radius)
{
    return c->radius - c->inward * radius;
}

static struct mill_hit next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                                    double radius, double now, double horizon, bool touching)
{
    const struct cylinder *c = (const struct cylinder *)shape;
    (void)now;
    return mill_hit_at(
        mill_shape_circle(f, 0.0, 0.0, contact_radius(c, radius), c->inward, horizon, touching));
}

static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   const struct mill_pose *pose)
{
    const struct cylinder *c = (const struct cylinder *)shape;
    const double rho = sqrt(centre.y * centre.y + centre.z * centre.z);
    /* on the axis any direction will do; at a shaft, this only happens if the shaft has no
     * thickness */
    const double uy = rho > 0.0 ? centre.y / rho : 1.0, uz = rho > 0.0 ? centre.z / rho : 0.0;
    const vec3 point = {centre.x, c->radius * uy, c->radius * uz};
    return (struct mill_contact){.normal = {0.0, -c->inward * uy, -c->inward * uz},
                                 .point = point,
                                 .velocity = mill_pose_velocity(pose, point),
                                 .gap = c->inward * (contact_radius(c, radius) - rho)};
}

/* The coordinate of the interval nearest to the surface: far from the axis for the drum, near to it
 * for the shaft */
static double nearest(const struct cylinder *c, double lo, double hi)
{
    if (c->inward > 0.0)
        return fmax(fabs(lo), fabs(hi));
    return lo > 0.0 ? lo : (hi < 0.0 ? -hi : 0.0);
}

static bool reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct cylinder *c = (const struct cylinder *)shape;
    const double y = nearest(c, lo.y, hi.y), z = nearest(c, lo.z, hi.z);
    const double gap = c->inward * (contact_radius(c, radius) - sqrt(y * y + z * z));
    return gap <= 1e-6 * c->radius + 1e-3 * radius;
}

/* Draws the shaft from end wall to end wall, with its ends, so that it is closed */
static void draw_shaft(const struct mill_shape *shape, const struct mill_chamber *chamber,
                       double tolerance, struct mill_mesh *mesh)
{
    const struct mill_profile circle =
        mill_profile_make(2, ((const struct cylinder *)shape)->radius, 0.0, 0.0);
    const double end = chamber->half_length;
    mill_mesh_mantle(mesh, &circle, end, tolerance, false);
    mill_mesh_lid(mesh, &circle, -end, -1.0, tolerance);
    mill_mesh_lid(mesh, &circle, end, 1.0, tolerance);
}

/* The shaft has a form, the drum has none. */
static bool create(struct mill_shape *shape, const void *form, const struct mill_chamber *chamber)
{
    struct cylinder *c = (struct cylinder *)shape;
    c->radius = form ? ((const struct mill_shaft *)form)->radius : chamber->drum.radius;
    c->inward = form ? -1.0 : 1.0;
    shape->hollow = form ? 0.0 : c->radius;
    shape->fixed = true; /* if it turns, it turns about its own axis */
    return true;
}

static bool is_sound(const void *form)
{
    const struct mill_shaft *is = form;
    return is->radius > 0.0 && isfinite(is->radius);
}

const struct mill_shape_type mill_cylinder_drum_type = {.name = "drum",
                                                        .kind = MILL_BALL_DRUM,
                                                        .size = sizeof(struct cylinder),
                                                        .create = create,
                                                        .next_contact = next_contact,
                                                        .contact = contact,
                                                        .reachable = reachable,
                                                        .draw = mill_mesh_drum,
                                                        .chart = mill_shape_chart};

const struct mill_shape_type mill_cylinder_shaft_type = {.name = "shaft",
                                                         .kind = MILL_BALL_SHAFT,
                                                         .is_sound = is_sound,
                                                         .size = sizeof(struct cylinder),
                                                         .create = create,
                                                         .next_contact = next_contact,
                                                         .contact = contact,
                                                         .reachable = reachable,
                                                         .draw = draw_shaft,
                                                         .chart = mill_shape_chart};
