/* The prism over a circle about the x axis of its motion's frame: the drum, met from inside, and
 * the shaft, met from outside. The flat ends of a shaft are in the end walls, where no ball touches
 * them. The centres of touching balls are at R - a in a drum and at R + a at a shaft. It turns
 * about its axis or does not move at all; elsewhere a cylinder stands for it. */
#include "base/elementary.h"
#include "geometry/mesh.h"
#include "geometry/shapes.h"

/* ---- the circle ---- */

/* +1: balls meet it from inside, -1: from outside */
static double inward(const struct mill_body *is)
{
    return is->inside ? 1.0 : -1.0;
}

static double contact_radius(const struct mill_body *is, double radius)
{
    return is->radius - inward(is) * radius;
}

static struct mill_hit next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                                    double radius, double now, double horizon, bool touching)
{
    const struct mill_body *is = mill_body_is(shape);
    (void)now;
    return mill_hit_at(
        mill_shape_circle(f, 0.0, 0.0, contact_radius(is, radius), inward(is), horizon, touching));
}

static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   const struct mill_pose *pose)
{
    const struct mill_body *is = mill_body_is(shape);
    const double rho = sqrt(centre.y * centre.y + centre.z * centre.z), s = inward(is);
    /* on the axis any direction will do; only a shaft without thickness is met there */
    const double uy = rho > 0.0 ? centre.y / rho : 1.0, uz = rho > 0.0 ? centre.z / rho : 0.0;
    const vec3 point = {centre.x, is->radius * uy, is->radius * uz};
    const double gap = s * (contact_radius(is, radius) - rho);
    return (struct mill_contact){
        {0.0, -s * uy, -s * uz}, point, mill_pose_velocity(pose, point), gap};
}

/* The coordinate nearest to the surface: far from the axis of a drum, near to that of a shaft */
static double nearest(const struct mill_body *is, double lo, double hi)
{
    if (is->inside)
        return fmax(fabs(lo), fabs(hi));
    return lo > 0.0 ? lo : (hi < 0.0 ? -hi : 0.0);
}

static bool reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct mill_body *is = mill_body_is(shape);
    const double y = nearest(is, lo.y, hi.y), z = nearest(is, lo.z, hi.z);
    const double gap = inward(is) * (contact_radius(is, radius) - sqrt(y * y + z * z));
    return gap <= 1e-6 * is->radius + 1e-3 * radius;
}

static bool create(struct mill_shape *shape)
{
    const struct mill_body *is = mill_body_is(shape);
    shape->hollow = is->inside ? is->radius : 0.0;
    shape->fixed = true; /* if it turns, it turns about its own axis */
    return true;
}

static const struct mill_shape_type surface = {
    sizeof(struct mill_bodied), create, NULL, next_contact, contact, .reachable = reachable};

/* ---- the solid ---- */

/* It has a place of its own only along x of its motion's frame. */
static bool is_sound(const struct mill_body *is)
{
    return mill_solid_is_length(is->radius, false) && mill_solid_is_length(is->length, false) &&
           is->z.x == 1.0 && is->x.y == 1.0 && vec3_norm(is->centre) == 0.0 && is->corners == 0;
}

static int walls(const struct mill_body *is, struct mill_wall wall[MILL_WALLS])
{
    const int walls = mill_round_cylinder_solid.walls(is, wall);
    wall[0].own = &surface;
    return is->open ? 1 : walls;
}

static struct mill_hull hull(const struct mill_body *is)
{
    return (struct mill_hull){0.5 * is->length, is->radius, 0};
}

static struct mill_core core(const struct mill_body *is)
{
    const struct mill_hull around = hull(is);
    return (struct mill_core){.half.z = around.half, .low = around.radius, .high = around.radius};
}

static double volume(const struct mill_body *is)
{
    return MILL_PI * is->radius * is->radius * is->length;
}

/* Chords within the tolerance, and within a hundredth of the radius */
static void outline(const struct mill_body *is, int wall, double tolerance, struct mill_mesh *mesh)
{
    const double share = fmin(tolerance / is->radius, 0.01);
    const double widest = 4.0 * mill_elementary_asin(sqrt(0.5 * share));
    const int quarter = (int)fmax(ceil(0.5 * MILL_PI / widest), 1.0);
    struct mill_ring ring = {.fan = true};
    for (int k = 0; k < 4 * quarter; k++) {
        const double half_turns = (double)(k / (2 * quarter));
        const struct mill_heading at = mill_elementary_heading(
            MILL_PI * half_turns + 0.5 * MILL_PI * (k % (2 * quarter) - quarter) / quarter);
        mill_mesh_ring_add(&ring, is->radius * at.cos, is->radius * at.sin);
    }
    mill_mesh_prism(mesh, is, wall, &ring);
    mill_mesh_ring_free(&ring);
}

const struct mill_solid mill_prism_solid = {
    &surface,           is_sound, volume, outline,       core,
    mill_round_support, walls,    hull,   .round = true, .moving = &mill_round_cylinder_solid};
