/* Bodies of revolution: cylinder, cone, capsule and sphere, with or without rounded edges. All are
 * described in the same way: by a core, which is a frustum (for a capsule a line, for a sphere a
 * point), and by the distance by which it is grown. In the half plane of radius and axis, the
 * outline of the core is its side, a straight line, between two caps. */
#include "base/elementary.h"
#include "geometry/mesh.h"
#include "geometry/shapes.h"

struct round {
    struct mill_bodied body;
    double side;       /* [m] length of the core's side */
    double out, along; /* direction of the side: (radius, axis) */
};

/* The distance to the core; < 0: inside. The nearest point is on a cap, the side, or their edge. */
static double look(const struct round *c, double rho, double z, double *out, double *along)
{
    const struct mill_core *core = &c->body.core;
    const double half = core->half.z, r = rho - core->low, h = z + half;
    const double way = r * c->out + h * c->along, off = r * c->along - h * c->out;
    const double cap = fabs(z) - half;
    const bool above = z > half, below = z < -half;
    const bool inside = !above && !below && off <= 0.0; /* this only happens to a pinched ball */
    *out = 0.0;
    *along = z < 0.0 ? -1.0 : 1.0;
    if ((above && rho <= core->high) || (below && rho <= core->low) || (inside && cap > off))
        return cap;
    if (inside || (way >= 0.0 && way <= c->side && off > 0.0)) {
        *out = c->along;
        *along = -c->out;
        return off;
    }
    const double x = way > 0.0 ? rho - core->high : r, y = way > 0.0 ? z - half : h;
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
    const double d = look(c, rho, z - c->body.core.shift, &out, &along) - c->body.core.grown;
    /* on the axis any direction will do */
    const vec3 radial = rho > 0.0 ? vec3_scale(across, out / rho) : vec3_scale(is->x, out);
    return (struct mill_view){d, vec3_axpy(radial, along, is->z)};
}

/* ---- the core ---- */

static struct mill_core core_straight(const struct mill_body *is, double length)
{
    return (struct mill_core){.grown = is->radius, .half.z = 0.5 * length};
}

/* A frustum, shrunk by the rounding, which may then end in a tip */
static struct mill_core core_tapered(const struct mill_body *is, double end)
{
    const double half = 0.5 * is->length, slope = (end - is->radius) / is->length;
    const double middle = 0.5 * (is->radius + end) - is->rounding * sqrt(1.0 + slope * slope);
    double from = is->rounding - half, to = half - is->rounding;
    if (middle + slope * to < 0.0 && slope < 0.0)
        to = -middle / slope;
    if (middle + slope * from < 0.0 && slope > 0.0)
        from = -middle / slope;
    if (slope == 0.0 && middle < -1e-15)
        to = -INFINITY;
    return (struct mill_core){.grown = is->rounding,
                              .shift = 0.5 * (from + to),
                              .half.z = 0.5 * (to - from),
                              .low = fmax(middle + slope * from, 0.0),
                              .high = fmax(middle + slope * to, 0.0)};
}

/* The farthest point of either rim, in the half plane of the axis and the direction */
vec3 mill_round_support(const struct mill_core *c, vec3 way)
{
    const double across = sqrt(way.x * way.x + way.y * way.y), half = c->half.z;
    const bool up = way.z * half + c->high * across >= c->low * across - way.z * half;
    const double r = up ? c->high : c->low, z = c->shift + (up ? half : -half);
    if (!(across > 0.0) || r == 0.0)
        return vec3_make(0.0, 0.0, z);
    return vec3_make(r * way.x / across, r * way.y / across, z);
}

static bool create(struct mill_shape *shape)
{
    struct round *c = (struct round *)shape;
    const struct mill_core *core = &c->body.core;
    const double out = core->high - core->low, along = 2.0 * core->half.z;
    c->side = sqrt(out * out + along * along);
    c->out = c->side > 0.0 ? out / c->side : 0.0;
    c->along = c->side > 0.0 ? along / c->side : 1.0;
    return true;
}

/* ---- the kinds: a sphere is a capsule of length 0, a cylinder a cone with equal ends ---- */

static bool is_straight(const struct mill_body *is, double length)
{
    return mill_solid_is_length(is->radius, false) && mill_solid_is_length(length, true);
}

/* Also checks that something is left of it after it is shrunk by the rounding. */
static bool is_tapered(const struct mill_body *is, double end)
{
    return mill_solid_is_length(is->radius, true) && mill_solid_is_length(end, true) &&
           is->radius + end > 0.0 && mill_solid_is_length(is->length, false) &&
           core_tapered(is, end).half.z >= 0.0;
}

static struct mill_hull hull_straight(const struct mill_body *is, double length)
{
    return (struct mill_hull){0.5 * length, is->radius, 0};
}

static struct mill_hull hull_tapered(const struct mill_body *is, double end)
{
    return (struct mill_hull){0.5 * is->length, fmax(is->radius, end), 0};
}

static int walls_straight(const struct mill_body *is, double length, struct mill_wall *wall)
{
    wall[0] = (struct mill_wall){.radius = is->radius, .half = 0.5 * length};
    return 1;
}

static int walls_tapered(const struct mill_body *is, double end, struct mill_wall *wall)
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

/* Adds an arc about (rho, z) between angles of directions (sin, -cos); returns the points so far */
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

static void outline(const struct mill_body *is, const struct mill_core *c, double tolerance,
                    struct mill_mesh *mesh)
{
    const double from = c->shift - c->half.z, to = c->shift + c->half.z;
    double line[24][2];
    int n = 1;
    const double lean = c->low == c->high ? 0.5 * MILL_PI /* of its side */
                                          : mill_elementary_atan2(to - from, c->high - c->low);
    line[0][0] = 0.0;
    line[0][1] = from - c->grown;
    n = add_arc(line, n, c->low, from, c->grown, 0.0, lean);
    n = add_arc(line, n, c->high, to, c->grown, lean, MILL_PI);
    line[n][0] = 0.0;
    line[n++][1] = to + c->grown;
    mill_mesh_turned(mesh, is, line, n, tolerance);
}

/* clang-format off */
#define CONE_END .unit = "m", .lo = 0, .hi = 1e4
static const struct mill_key key_sphere[] = {{MILL_SOLID_RADIUS}, {MILL_SOLID_DIAMETER}, {.name = NULL}};
static const struct mill_key key_capsule[] = {
    {MILL_SOLID_RADIUS}, {MILL_SOLID_DIAMETER}, {MILL_SOLID_LENGTH}, {.name = NULL}};
static const struct mill_key key_cylinder[] = {
    {MILL_SOLID_RADIUS}, {MILL_SOLID_DIAMETER}, {MILL_SOLID_LENGTH}, {MILL_SOLID_ROUNDING}, {.name = NULL}};
static const struct mill_key key_cone[] = {
    {"radius", "radius at its own z = -length/2", CONE_END, MILL_SOLID_AT(radius)},
    {"end_radius", "radius at its own z = length/2", CONE_END, MILL_SOLID_AT(end_radius)},
    {MILL_SOLID_LENGTH}, {MILL_SOLID_ROUNDING}, {.name = NULL}};
/* clang-format on */

MILL_BODY_SURFACE(struct round, create, view, mill_body_is_far)

/* WHAT of a kind of this FORM: straight or tapered. SIZE: its length, or its radius at the end */
#define OF_KIND(TYPE, WHAT, NAME, FORM, SIZE)                                                      \
    static TYPE WHAT##_##NAME(const struct mill_body *is)                                          \
    {                                                                                              \
        return WHAT##_##FORM(is, SIZE);                                                            \
    }
#define ROUND(NAME, BALL, FORM, SIZE)                                                              \
    OF_KIND(struct mill_core, core, NAME, FORM, SIZE)                                              \
    OF_KIND(bool, is, NAME, FORM, SIZE)                                                            \
    OF_KIND(struct mill_hull, hull, NAME, FORM, SIZE)                                              \
    static int walls_##NAME(const struct mill_body *is, struct mill_wall wall[MILL_WALLS])         \
    {                                                                                              \
        return walls_##FORM(is, SIZE, wall);                                                       \
    }                                                                                              \
    static void outline_##NAME(const struct mill_body *is, int wall, double tolerance,             \
                               struct mill_mesh *mesh)                                             \
    {                                                                                              \
        const struct mill_core core = core_##NAME(is);                                             \
        if (wall <= 0)                                                                             \
            outline(is, &core, tolerance, mesh);                                                   \
    }                                                                                              \
    const struct mill_solid mill_round_##NAME##_solid = {                                          \
        &surface,     is_##NAME,   volume_##NAME, outline_##NAME, core_##NAME, mill_round_support, \
        walls_##NAME, hull_##NAME, key_##NAME,    .round = true,  .ball = BALL}

ROUND(sphere, true, straight, 0.0);
ROUND(capsule, false, straight, is->length);
ROUND(cone, false, tapered, is->end_radius);
ROUND(cylinder, false, tapered, is->radius);
