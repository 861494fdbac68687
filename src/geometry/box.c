/* The box, with or without rounded edges: the distance to its core, less the rounding. */
#include "geometry/body.h"
#include "geometry/mesh.h"

static double beyond(double q, double half)
{
    return q > half ? q - half : (q < -half ? q + half : 0.0);
}

static double sign(double x)
{
    return x < 0.0 ? -1.0 : 1.0;
}

/* From the core to a place, both in the box's own axes */
MILL_CONVEX_INLINE vec3 out_of(const struct mill_bodied *b, vec3 q)
{
    const vec3 half = b->core.half;
    return vec3_make(beyond(q.x, half.x), beyond(q.y, half.y), beyond(q.z, half.z));
}

MILL_CONVEX_INLINE struct mill_view view(const struct mill_convex *convex, vec3 place)
{
    const struct mill_bodied *b = (const struct mill_bodied *)convex;
    const struct mill_body *is = &b->is;
    const vec3 half = b->core.half, q = mill_body_in(is, place), out = out_of(b, q);
    const double square = vec3_dot(out, out);
    if (square > 0.0) {
        const double d = sqrt(square);
        return (struct mill_view){d - is->rounding,
                                  mill_body_turn_out(is, vec3_scale(out, 1.0 / d))};
    }
    /* The centre of a pinched ball is inside the box. The way out is through the nearest face. */
    const vec3 deep = {fabs(q.x) - half.x, fabs(q.y) - half.y, fabs(q.z) - half.z};
    const double d = fmax(deep.x, fmax(deep.y, deep.z));
    vec3 n = {0.0, 0.0, sign(q.z)};
    if (d == deep.x)
        n = vec3_make(sign(q.x), 0.0, 0.0);
    else if (d == deep.y)
        n = vec3_make(0.0, sign(q.y), 0.0);
    return (struct mill_view){d - is->rounding, mill_body_turn_out(is, n)};
}

/* The box is beyond the ball's travel; or the plane through its nearest point, across the way to
 * the ball, keeps them apart. The distance from this plane is out . (place + course t) / |out|;
 * here it is compared without a root. */
MILL_CONVEX_INLINE bool is_far(const struct mill_bodied *b, const struct mill_flight *f,
                               double radius)
{
    const vec3 out = out_of(b, mill_body_in(&b->is, f->place));
    const double square = vec3_dot(out, out), far = b->is.rounding + radius + f->slack;
    const double beyond = b->is.rounding + radius + f->travel;
    if (square > beyond * beyond)
        return true;
    if (!(f->slack < (double)INFINITY))
        return false;
    const vec3 course = mill_body_turn_in(&b->is, mill_pose_turn_in(f->pose, f->course));
    const double closing = f->window * vec3_dot(out, course);
    const double left = square + (closing < 0.0 ? closing : 0.0);
    return left > 0.0 && left * left > square * far * far;
}

static struct mill_core core(const struct mill_body *is)
{
    const double less = is->rounding;
    return (struct mill_core){
        .grown = less,
        .half = {0.5 * is->size.x - less, 0.5 * is->size.y - less, 0.5 * is->size.z - less}};
}

static vec3 support(const struct mill_core *c, vec3 way)
{
    return vec3_make(way.x < 0.0 ? -c->half.x : c->half.x, way.y < 0.0 ? -c->half.y : c->half.y,
                     way.z < 0.0 ? -c->half.z : c->half.z);
}

static bool is_sound(const struct mill_body *is)
{
    const double least = fmin(is->size.x, fmin(is->size.y, is->size.z));
    return mill_solid_is_length(least, false) && isfinite(vec3_norm(is->size)) &&
           2.0 * is->rounding <= least;
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

static void outline(const struct mill_body *is, int wall, double tolerance, struct mill_mesh *mesh)
{
    (void)tolerance;
    if (wall <= 0)
        mill_mesh_box(mesh, is);
}

static const struct mill_key key[] = {{"size", "lengths along its own x, y and z",
                                       .type = MILL_KEY_VECTOR, MILL_SOLID_SIZE,
                                       MILL_SOLID_AT(size)},
                                      {MILL_SOLID_ROUNDING},
                                      {.name = NULL}};

MILL_BODY_SURFACE(struct mill_bodied, NULL, view, is_far)

const struct mill_solid mill_box_solid = {&surface, is_sound, volume, outline,
                                          core,     support,  walls,  .key = key};
