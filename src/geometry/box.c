/* The box, with or without rounded edges: the distance to its core, less the rounding. */
#include "geometry/body.h"
#include "geometry/mesh.h"

struct box {
    struct mill_bodied body;
    vec3 half; /* [m] of the core */
};

static double beyond(double q, double half)
{
    return q > half ? q - half : (q < -half ? q + half : 0.0);
}

static double sign(double x)
{
    return x < 0.0 ? -1.0 : 1.0;
}

MILL_CONVEX_INLINE struct mill_view view(const struct mill_convex *convex, vec3 place)
{
    const struct box *b = (const struct box *)convex;
    const struct mill_body *is = &b->body.is;
    const vec3 q = mill_body_in(is, place);
    const vec3 out = {beyond(q.x, b->half.x), beyond(q.y, b->half.y), beyond(q.z, b->half.z)};
    const double square = vec3_dot(out, out);
    if (square > 0.0) {
        const double d = sqrt(square);
        return (struct mill_view){d - is->rounding,
                                  mill_body_turn_out(is, vec3_scale(out, 1.0 / d))};
    }
    /* The ball's centre is inside the box, which only happens to a pinched ball. The way out is
     * through the nearest face. */
    const vec3 deep = {fabs(q.x) - b->half.x, fabs(q.y) - b->half.y, fabs(q.z) - b->half.z};
    const double d = fmax(deep.x, fmax(deep.y, deep.z));
    vec3 n = {0.0, 0.0, sign(q.z)};
    if (d == deep.x)
        n = vec3_make(sign(q.x), 0.0, 0.0);
    else if (d == deep.y)
        n = vec3_make(0.0, sign(q.y), 0.0);
    return (struct mill_view){d - is->rounding, mill_body_turn_out(is, n)};
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

/* About the z axis */
static struct mill_hull hull(const struct mill_body *is)
{
    const vec3 half = vec3_scale(is->size, 0.5);
    return (struct mill_hull){half.z, sqrt(half.x * half.x + half.y * half.y)};
}

static bool is_sound(const void *form)
{
    const struct mill_body *is = form;
    const double least = fmin(is->size.x, fmin(is->size.y, is->size.z));
    return mill_body_is_placed(is) && least > 0.0 && isfinite(vec3_norm(is->size)) &&
           is->rounding >= 0.0 && 2.0 * is->rounding <= least &&
           !(is->inside && is->rounding > 0.0);
}

static bool create(struct mill_shape *shape, const void *form, const struct mill_chamber *chamber)
{
    struct box *b = (struct box *)shape;
    const vec3 none = {0.0, 0.0, 0.0};
    b->body.is = *(const struct mill_body *)form;
    const vec3 size = b->body.is.size;
    const double less = b->body.is.rounding;
    b->half = vec3_make(0.5 * size.x - less, 0.5 * size.y - less, 0.5 * size.z - less);
    mill_body_create(&b->body, chamber, hull(&b->body.is), none, false);
    return true;
}

static int walls(const struct mill_body *is, struct mill_wall wall[MILL_WALLS])
{
    const vec3 half = vec3_scale(is->size, 0.5);
    for (int k = 0; k < 6; k++) {
        const double s = k % 2 ? 1.0 : -1.0;
        const vec3 out = {k / 2 == 0 ? s : 0.0, k / 2 == 1 ? s : 0.0, k / 2 == 2 ? s : 0.0};
        wall[k] = (struct mill_wall){.flat = true,
                                     .point = {out.x * half.x, out.y * half.y, out.z * half.z},
                                     .normal = vec3_scale(out, -1.0)};
    }
    return 6;
}

static double volume(const struct mill_body *is)
{
    return is->size.x * is->size.y * is->size.z; /* a container has no rounding */
}

static void outline(const struct mill_body *is, double tolerance, struct mill_mesh *mesh)
{
    const vec3 half = vec3_scale(is->size, 0.5);
    const int other = is->inside ? 1 : 0; /* mirrored, to be seen from inside */
    vec3 corner[8];
    (void)tolerance;
    for (int i = 0; i < 8; i++) {
        const int k = i ^ other;
        corner[i] = mill_body_out(is, vec3_make(k & 1 ? half.x : -half.x, k & 2 ? half.y : -half.y,
                                                k & 4 ? half.z : -half.z));
    }
    mill_mesh_box(mesh, corner);
}

static void draw(const struct mill_shape *shape, const struct mill_chamber *chamber,
                 double tolerance, struct mill_mesh *mesh)
{
    (void)chamber;
    outline(&((const struct mill_bodied *)shape)->is, tolerance, mesh);
}

const struct mill_shape_type mill_box_type = {.name = "box",
                                              .is_sound = is_sound,
                                              .size = sizeof(struct box),
                                              .create = create,
                                              .next_contact = next_contact,
                                              .contact = contact,
                                              .reachable = mill_body_reachable,
                                              .sector = mill_body_sector,
                                              .draw = draw,
                                              .walls = walls,
                                              .hull = hull,
                                              .volume = volume,
                                              .outline = outline,
                                              .chart = mill_body_chart_flat};
