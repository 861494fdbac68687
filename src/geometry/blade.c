/* A blade: a box fixed to its motion's frame that points outwards from the frame's x axis. The
 * distance to it is exact for faces, edges and corners; convex.h does the rest. */
#include "base/elementary.h"
#include "geometry/convex.h"
#include "geometry/mesh.h"
#include "geometry/shapes.h"

#include <stdio.h>

/* Fraction of the drum's length; a blade may touch the end walls without a gap. */
#define ROUNDING 1e-12

/* The dimensions of a blade turned by its pitch p: its length along the axis is w |cos p| + t |sin
 * p|, its width around it is w |sin p| + t |cos p|. Its corners reach further out than
 * tip_radius. */
struct extent {
    double along, across; /* [m] half of its length along the axis, half of its width around it */
    double reach;         /* [m] distance of its corners from the axis */
};

struct blade {
    struct mill_convex convex;
    vec3 centre;          /* [m] of the box, in the motion's frame */
    vec3 w, s, h;         /* unit, in that frame: along the width, radial, along the thickness */
    vec3 half;            /* [m] along these */
    struct extent extent; /* along and reach are INFINITY if it does not only turn about x */
};

static double clamp_out(double q, double half)
{
    return q > half ? q - half : (q < -half ? q + half : 0.0);
}

/* to_box: a place in coordinates of the box's own axes. beyond: how far outside of the box it
 * is. */
static inline vec3 to_box(const struct blade *b, vec3 place)
{
    const vec3 q = vec3_sub(place, b->centre);
    return vec3_make(vec3_dot(b->w, q), vec3_dot(b->s, q), vec3_dot(b->h, q));
}

static inline vec3 beyond(const struct blade *b, vec3 q)
{
    return vec3_make(clamp_out(q.x, b->half.x), clamp_out(q.y, b->half.y),
                     clamp_out(q.z, b->half.z));
}

/* From the box's own axes to the motion's frame */
static vec3 to_frame(const struct blade *b, double w, double s, double h)
{
    return vec3_axpy(vec3_axpy(vec3_scale(b->w, w), s, b->s), h, b->h);
}

MILL_CONVEX_INLINE struct mill_view view(const struct mill_convex *convex, vec3 place)
{
    const struct blade *b = (const struct blade *)convex;
    const vec3 q = to_box(b, place), out = beyond(b, q);
    const double square = vec3_dot(out, out);
    if (square > 0.0) {
        const double d = sqrt(square);
        return (struct mill_view){d, to_frame(b, out.x / d, out.y / d, out.z / d)};
    }
    /* The ball's centre is inside the box, which only happens to a pinched ball. The way out is
     * through the nearest face. */
    const double dw = fabs(q.x) - b->half.x, ds = fabs(q.y) - b->half.y;
    const double dh = fabs(q.z) - b->half.z, d = fmax(dw, fmax(ds, dh));
    if (d == dw)
        return (struct mill_view){d, to_frame(b, q.x < 0.0 ? -1.0 : 1.0, 0.0, 0.0)};
    if (d == dh)
        return (struct mill_view){d, to_frame(b, 0.0, 0.0, q.z < 0.0 ? -1.0 : 1.0)};
    return (struct mill_view){d, to_frame(b, 0.0, q.y < 0.0 ? -1.0 : 1.0, 0.0)};
}

static struct mill_hit next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                                    double radius, double now, double horizon, bool touching)
{
    const struct blade *b = (const struct blade *)shape;
    const vec3 out = beyond(b, to_box(b, f->place));
    const double far = radius + f->travel;
    (void)touching;
    /* the usual case: a sphere around the ball and its path does not touch the box */
    if (vec3_dot(out, out) > far * far)
        return mill_hit_at(INFINITY);
    return mill_convex_search(&b->convex, view, f, radius, now, horizon);
}

static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   const struct mill_pose *pose)
{
    return mill_convex_contact((const struct mill_convex *)shape, view, centre, radius, pose);
}

/* For a turn about the x axis, at any angle; with any other motion the blade may be anywhere. */
static bool reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct blade *b = (const struct blade *)shape;
    const double far = radius * (1.0 + 1e-3) + 1e-6 * b->convex.reach;
    if (lo.x > b->centre.x + b->extent.along + far || hi.x < b->centre.x - b->extent.along - far)
        return false;
    const double y = lo.y > 0.0 ? lo.y : (hi.y < 0.0 ? hi.y : 0.0);
    const double z = lo.z > 0.0 ? lo.z : (hi.z < 0.0 ? hi.z : 0.0);
    return sqrt(y * y + z * z) <= b->extent.reach + far;
}

/* Seen from the axis, a ball in the box is within an angle of the direction of the box's
 * centre. The blade, a strip from the axis outwards, is within an angle of its own
 * direction. */
static struct mill_sector sector(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct blade *b = (const struct blade *)shape;
    const struct mill_sector any = {0.0, 0.0, -2.0};
    const double far = b->convex.reach, margin = 1e-3 * radius + 1e-6 * far;
    const double y0 = fmax(lo.y, -far), y1 = fmin(hi.y, far);
    const double z0 = fmax(lo.z, -far), z1 = fmin(hi.z, far);
    const double y = 0.5 * (y0 + y1), z = 0.5 * (z0 + z1), rho = sqrt(y * y + z * z);
    const double half = 0.5 * sqrt((y1 - y0) * (y1 - y0) + (z1 - z0) * (z1 - z0)) + margin;
    const double across = b->extent.across + radius + margin;
    /* no sector for an infinite box, or for a blade that does not only turn about x */
    if (!(rho - half > across) || isinf(b->extent.reach))
        return any;
    return (struct mill_sector){(y * b->s.y + z * b->s.z) / rho, (z * b->s.y - y * b->s.z) / rho,
                                mill_sector_cos(half / rho, across / (rho - half)) - 1e-9};
}

/* Draws the whole box from the axis on; the shaft hides its inner part */
static void draw(const struct mill_shape *shape, const struct mill_chamber *chamber,
                 double tolerance, struct mill_mesh *mesh)
{
    const struct blade *b = (const struct blade *)shape;
    vec3 corner[8];
    (void)chamber;
    (void)tolerance;
    for (int i = 0; i < 8; i++)
        corner[i] = vec3_add(b->centre, to_frame(b, i & 1 ? b->half.x : -b->half.x,
                                                 i & 2 ? b->half.y : -b->half.y,
                                                 i & 4 ? b->half.z : -b->half.z));
    mill_mesh_box(mesh, corner);
}

static bool chart(const struct mill_shape *shape, struct mill_pose *frame)
{
    const struct blade *b = (const struct blade *)shape;
    *frame = (struct mill_pose){.place = b->centre, .x = b->w, .y = b->s, .z = b->h};
    return false;
}

static bool is_sound(const void *form)
{
    const struct mill_blade *is = form;
    return is->tip_radius > 0.0 && is->width > 0.0 && is->thickness > 0.0 &&
           isfinite(is->tip_radius + is->width + is->thickness) &&
           isfinite(is->position + is->angle + is->pitch);
}

static struct extent extent_of(const struct mill_blade *is)
{
    const struct mill_heading pitch = mill_elementary_heading(is->pitch);
    const double half_w = 0.5 * is->width, half_h = 0.5 * is->thickness;
    const double across = fabs(pitch.sin) * half_w + fabs(pitch.cos) * half_h;
    return (struct extent){.along = fabs(pitch.cos) * half_w + fabs(pitch.sin) * half_h,
                           .across = across,
                           .reach = sqrt(is->tip_radius * is->tip_radius + across * across)};
}

static const char *fault(const void *form, const struct mill_shape_fit *fit,
                         char text[MILL_SHAPE_FAULT])
{
    const struct mill_blade *is = form;
    const struct extent extent = extent_of(is);
    if (is->tip_radius <= fit->shaft_radius) {
        snprintf(text, MILL_SHAPE_FAULT, "must be greater than the shaft's radius, %g m, got %g m",
                 fit->shaft_radius, is->tip_radius);
        return "tip_radius";
    }
    if (is->tip_radius >= fit->bore) {
        snprintf(text, MILL_SHAPE_FAULT, "must be less than the drum's radius%s, %g m, got %g m",
                 fit->wavy ? " less the height of its buckles" : "", fit->bore, is->tip_radius);
        return "tip_radius";
    }
    if (extent.reach >= fit->bore) {
        snprintf(text, MILL_SHAPE_FAULT,
                 "the blade's corners reach %g m from the axis, but the drum's %s %g m from it",
                 extent.reach, fit->wavy ? "buckles come as near as" : "wall is", fit->bore);
        return "tip_radius";
    }
    if (fabs(is->position) + extent.along > (0.5 + ROUNDING) * fit->length) {
        snprintf(text, MILL_SHAPE_FAULT,
                 "the blade reaches from x = %g m to %g m%s, out of the drum's %g m to %g m",
                 is->position - extent.along, is->position + extent.along,
                 mill_elementary_sin(is->pitch) != 0.0 ? " with its pitch" : "", -0.5 * fit->length,
                 0.5 * fit->length);
        return fit->spread ? "width" : "position";
    }
    return NULL;
}

static struct mill_shape_gaps gaps(const void *form, const struct mill_shape_fit *fit)
{
    const struct mill_blade *is = form;
    const struct extent extent = extent_of(is);
    const double wall = 0.5 * fit->length - fabs(is->position) - extent.along;
    return (struct mill_shape_gaps){.drum = fit->bore - extent.reach,
                                    .drum_key = "tip_radius",
                                    .wall = wall > ROUNDING * fit->length ? wall : 0.0,
                                    .wall_key = fit->spread ? "width" : "position"};
}

static bool create(struct mill_shape *shape, const void *form, const struct mill_chamber *chamber)
{
    struct blade *b = (struct blade *)shape;
    const struct mill_motion *motion = shape->motion;
    const struct mill_blade *is = form;
    const struct mill_heading angle = mill_elementary_heading(is->angle);
    const struct mill_heading pitch = mill_elementary_heading(is->pitch);
    const vec3 radial = {0.0, angle.cos, angle.sin}, around = {0.0, -angle.sin, angle.cos};
    const vec3 along = {1.0, 0.0, 0.0};
    b->convex.bounds = mill_motion_bounds(motion, vec3_make(0.0, 0.0, 0.0));
    b->convex.reach = mill_motion_reach(motion, &chamber->places);
    b->half = vec3_make(0.5 * is->width, 0.5 * is->tip_radius, 0.5 * is->thickness);
    b->w = vec3_axpy(vec3_scale(along, pitch.cos), pitch.sin, around);
    b->s = radial;
    b->h = vec3_axpy(vec3_scale(along, -pitch.sin), pitch.cos, around);
    b->centre = vec3_make(is->position, b->half.y * angle.cos, b->half.y * angle.sin);
    b->extent = extent_of(is);
    if (motion && !mill_motion_pose(motion, 0.0).about_x)
        b->extent.along = b->extent.reach = INFINITY;
    return true;
}

/* clang-format off */
#define AT(member) .offset = offsetof(struct mill_blade, member)
const struct mill_key mill_blade_key[] = {
    {"position", "x of the blade's centre", .unit = "m", MILL_KEY_ANY, AT(position)},
    {"angle", "angle of the blade on the rotor, from +y towards +z", .unit = "rad", MILL_KEY_ANY,
     AT(angle)},
    {"tip_radius", "reach of a blade from the axis", .unit = "m", MILL_KEY_POSITIVE,
     AT(tip_radius)},
    {"width", "width of a blade along the axis, before pitching", .unit = "m", MILL_KEY_POSITIVE,
     AT(width)},
    {"thickness", "thickness of a blade around the axis, before pitching", .unit = "m",
     MILL_KEY_POSITIVE, AT(thickness)},
    {"pitch", "turn of a blade about its radial mid-line", .unit = "rad", MILL_KEY_ANY,
     .preset = "0 deg", AT(pitch)},
    {.name = NULL},
};
/* clang-format on */

const struct mill_shape_type mill_blade_type = {.name = "blade",
                                                .kind = MILL_BALL_BLADE,
                                                .pinches = true,
                                                .is_sound = is_sound,
                                                .on_rotor = true,
                                                .key = mill_blade_key,
                                                .form = sizeof(struct mill_blade),
                                                .fault = fault,
                                                .gaps = gaps,
                                                .size = sizeof(struct blade),
                                                .create = create,
                                                .next_contact = next_contact,
                                                .contact = contact,
                                                .reachable = reachable,
                                                .sector = sector,
                                                .draw = draw,
                                                .chart = chart};
