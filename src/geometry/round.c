/* Bodies of revolution: cylinder, cone, capsule and sphere, with or without rounded edges. All are
 * described in the same way: by a core, which is a frustum (for a capsule a line, for a sphere a
 * point), and by the distance by which it is grown. In the half plane of radius and axis, the
 * outline of the core is its side, a straight line, between two caps. */
#include "base/elementary.h"
#include "geometry/body.h"
#include "geometry/mesh.h"

struct round {
    struct mill_bodied body;
    double grown;      /* [m] by which the core is grown */
    double shift;      /* [m] place of the core's centre along the axis */
    double half;       /* [m] half of the core's length */
    double low, high;  /* [m] its radii at -half, +half */
    double side;       /* [m] length of the core's side */
    double out, along; /* direction of the side: (radius, axis) */
};

/* The distance to the core; < 0: inside. The nearest point is on a cap, on the side, or where they
 * meet. */
static double look(const struct round *c, double rho, double z, double *out, double *along)
{
    const double r = rho - c->low, h = z + c->half;
    const double way = r * c->out + h * c->along, off = r * c->along - h * c->out;
    const bool above = z > c->half, below = z < -c->half;
    *out = 0.0;
    *along = z < 0.0 ? -1.0 : 1.0;
    if ((above && rho <= c->high) || (below && rho <= c->low))
        return fabs(z) - c->half;
    if (!above && !below && off <= 0.0) { /* inside: this only happens to a pinched ball */
        const double cap = fabs(z) - c->half;
        if (cap > off)
            return cap;
        *out = c->along;
        *along = -c->out;
        return off;
    }
    if (way >= 0.0 && way <= c->side && off > 0.0) {
        *out = c->along;
        *along = -c->out;
        return off;
    }
    const double x = way > 0.0 ? rho - c->high : r, y = way > 0.0 ? z - c->half : h;
    const double d = sqrt(x * x + y * y);
    *out = d > 0.0 ? x / d : c->along;
    *along = d > 0.0 ? y / d : -c->out;
    return d;
}

MILL_CONVEX_INLINE struct mill_view view(const struct mill_convex *convex, vec3 place)
{
    const struct round *c = (const struct round *)convex;
    const struct mill_body *is = &c->body.is;
    const vec3 q = vec3_sub(place, is->centre);
    const double z = vec3_dot(q, is->z);
    const vec3 across = vec3_axpy(q, -z, is->z);
    const double rho = vec3_norm(across);
    double out, along;
    const double d = look(c, rho, z - c->shift, &out, &along) - c->grown;
    /* on the axis any direction will do */
    const vec3 radial = rho > 0.0 ? vec3_scale(across, out / rho) : vec3_scale(is->x, out);
    return (struct mill_view){d, vec3_axpy(radial, along, is->z)};
}

static struct mill_hit next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                                    double radius, double now, double horizon, bool touching)
{
    const struct mill_bodied *b = (const struct mill_bodied *)shape;
    (void)touching;
    if (mill_body_is_far(b, f, radius))
        return mill_hit_at(INFINITY);
    return mill_convex_search(&b->convex, view, f, radius, now, horizon);
}

static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   const struct mill_pose *pose)
{
    return mill_convex_contact((const struct mill_convex *)shape, view, centre, radius, pose);
}

struct mill_round_core mill_round_core(const struct mill_shape_type *type,
                                       const struct mill_body *is)
{
    const bool point = type == &mill_round_sphere_type, line = type == &mill_round_capsule_type;
    const double half = point ? 0.0 : 0.5 * is->length;
    struct mill_round_core c = {.from = -half, .to = half, .grown = is->radius};
    if (point || line)
        return c;
    const double end = type == &mill_round_cone_type ? is->end_radius : is->radius;
    const double slope = (end - is->radius) / is->length;
    const double middle = 0.5 * (is->radius + end) - is->rounding * sqrt(1.0 + slope * slope);
    c = (struct mill_round_core){
        .from = is->rounding - half, .to = half - is->rounding, .grown = is->rounding};
    if (middle + slope * c.to < 0.0 && slope < 0.0)
        c.to = -middle / slope;
    if (middle + slope * c.from < 0.0 && slope > 0.0)
        c.from = -middle / slope;
    if (slope == 0.0 && middle < -1e-15)
        c.to = -INFINITY;
    c.low = fmax(middle + slope * c.from, 0.0);
    c.high = fmax(middle + slope * c.to, 0.0);
    return c;
}

static bool create(struct mill_shape *shape, const void *form, const struct mill_chamber *chamber)
{
    struct round *c = (struct round *)shape;
    const struct mill_body *is = form;
    const struct mill_shape_type *type = shape->type;
    const vec3 axis = {0.0, 0.0, 1.0};
    const bool point = type == &mill_round_sphere_type;
    const struct mill_round_core core = mill_round_core(type, is);
    c->body.is = *is;
    c->grown = core.grown;
    c->shift = 0.5 * (core.from + core.to);
    c->half = 0.5 * (core.to - core.from);
    c->low = core.low;
    c->high = core.high;
    const double out = c->high - c->low, along = 2.0 * c->half;
    c->side = sqrt(out * out + along * along);
    c->out = c->side > 0.0 ? out / c->side : 0.0;
    c->along = c->side > 0.0 ? along / c->side : 1.0;
    mill_body_create(&c->body, chamber, type->hull(is), axis, point);
    return true;
}

/* ---- the kinds ---- */

static bool is_turned(const struct mill_body *is)
{
    return mill_body_is_placed(is) && is->radius >= 0.0 && isfinite(is->radius);
}

static bool is_sphere(const void *form)
{
    const struct mill_body *is = form;
    return is_turned(is) && is->radius > 0.0;
}

static bool is_capsule(const void *form)
{
    const struct mill_body *is = form;
    return is_sphere(form) && is->length >= 0.0 && isfinite(is->length);
}

/* Also checks that something is left of the cone after it is shrunk by the rounding. */
static bool is_cone(const void *form)
{
    const struct mill_body *is = form;
    if (!is_turned(is) || !(is->length > 0.0 && is->end_radius >= 0.0 && is->rounding >= 0.0) ||
        !isfinite(is->length + is->end_radius + is->rounding) ||
        !(is->radius + is->end_radius > 0.0) || (is->inside && is->rounding > 0.0))
        return false;
    const struct mill_round_core core = mill_round_core(&mill_round_cone_type, is);
    return core.from <= core.to;
}

static bool is_cylinder(const void *form)
{
    struct mill_body is = *(const struct mill_body *)form;
    is.end_radius = is.radius;
    return is_cone(&is);
}

static struct mill_hull hull_sphere(const struct mill_body *is)
{
    return (struct mill_hull){0.0, is->radius};
}

static struct mill_hull hull_capsule(const struct mill_body *is)
{
    return (struct mill_hull){0.5 * is->length, is->radius};
}

static struct mill_hull hull_cylinder(const struct mill_body *is)
{
    return (struct mill_hull){0.5 * is->length, is->radius};
}

static struct mill_hull hull_cone(const struct mill_body *is)
{
    return (struct mill_hull){0.5 * is->length, fmax(is->radius, is->end_radius)};
}

static int walls_sphere(const struct mill_body *is, struct mill_wall wall[MILL_WALLS])
{
    wall[0] = (struct mill_wall){.radius = is->radius};
    return 1;
}

static int walls_capsule(const struct mill_body *is, struct mill_wall wall[MILL_WALLS])
{
    wall[0] = (struct mill_wall){.radius = is->radius, .half = 0.5 * is->length};
    return 1;
}

static int walls_between(const struct mill_body *is, double end, struct mill_wall wall[MILL_WALLS])
{
    const double half = 0.5 * is->length;
    wall[0] = (struct mill_wall){.radius = 0.5 * (is->radius + end),
                                 .slope = (end - is->radius) / is->length,
                                 .half = INFINITY};
    for (int k = 1; k < 3; k++)
        wall[k] = (struct mill_wall){.flat = true,
                                     .point = {0.0, 0.0, k == 1 ? -half : half},
                                     .normal = {0.0, 0.0, k == 1 ? 1.0 : -1.0}};
    return 3;
}

static int walls_cylinder(const struct mill_body *is, struct mill_wall wall[MILL_WALLS])
{
    return walls_between(is, is->radius, wall);
}

static int walls_cone(const struct mill_body *is, struct mill_wall wall[MILL_WALLS])
{
    return walls_between(is, is->end_radius, wall);
}

static double volume_sphere(const struct mill_body *is)
{
    return 4.0 / 3.0 * MILL_PI * is->radius * is->radius * is->radius;
}

static double volume_capsule(const struct mill_body *is)
{
    return volume_sphere(is) + MILL_PI * is->radius * is->radius * is->length;
}

static double volume_cone(const struct mill_body *is)
{
    const double a = is->radius, b = is->end_radius;
    return MILL_PI / 3.0 * (a * a + a * b + b * b) * is->length;
}

static double volume_cylinder(const struct mill_body *is)
{
    return MILL_PI * is->radius * is->radius * is->length;
}

/* ---- outlines: a line in the half plane, from the lower end on the axis to the upper end ---- */

/* Adds an arc about (rho, z) from one angle to another, with directions (sin, -cos); returns the
 * number of points */
static int add_arc(double (*line)[2], int n, double rho, double z, double radius, double from,
                   double to)
{
    enum { PARTS = 5 };
    for (int k = 0; k <= PARTS; k++, n++) {
        const struct mill_heading at = mill_elementary_heading(from + (to - from) * k / PARTS);
        line[n][0] = rho + radius * at.sin;
        line[n][1] = z - radius * at.cos;
        if (radius <= 0.0) /* a sharp edge is one point */
            return n + 1;
    }
    return n;
}

static void outline(const struct mill_shape_type *type, const struct mill_body *is,
                    double tolerance, struct mill_mesh *mesh)
{
    const struct mill_round_core c = mill_round_core(type, is);
    double line[24][2];
    int n = 1;
    const double lean = c.low == c.high ? 0.5 * MILL_PI /* of its side */
                                        : mill_elementary_atan2(c.to - c.from, c.high - c.low);
    line[0][0] = 0.0;
    line[0][1] = c.from - c.grown;
    n = add_arc(line, n, c.low, c.from, c.grown, 0.0, lean);
    n = add_arc(line, n, c.high, c.to, c.grown, lean, MILL_PI);
    line[n][0] = 0.0;
    line[n++][1] = c.to + c.grown;
    mill_mesh_turned(mesh, is, line, n, tolerance);
}

static void draw(const struct mill_shape *shape, const struct mill_chamber *chamber,
                 double tolerance, struct mill_mesh *mesh)
{
    (void)chamber;
    shape->type->outline(&((const struct mill_bodied *)shape)->is, tolerance, mesh);
}

#define ROUND(NAME)                                                                                \
    static void outline_##NAME(const struct mill_body *is, double tolerance,                       \
                               struct mill_mesh *mesh)                                             \
    {                                                                                              \
        outline(&mill_round_##NAME##_type, is, tolerance, mesh);                                   \
    }                                                                                              \
    const struct mill_shape_type mill_round_##NAME##_type = {.name = #NAME,                        \
                                                             .is_sound = is_##NAME,                \
                                                             .size = sizeof(struct round),         \
                                                             .create = create,                     \
                                                             .next_contact = next_contact,         \
                                                             .contact = contact,                   \
                                                             .reachable = mill_body_reachable,     \
                                                             .sector = mill_body_sector,           \
                                                             .draw = draw,                         \
                                                             .walls = walls_##NAME,                \
                                                             .hull = hull_##NAME,                  \
                                                             .volume = volume_##NAME,              \
                                                             .outline = outline_##NAME,            \
                                                             .chart = mill_body_chart_round}

ROUND(sphere);
ROUND(capsule);
ROUND(cone);
ROUND(cylinder);
