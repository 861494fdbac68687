/* The wavy drum. Where is the nearest point of its wall? The lines that join neighbouring centres
 * pass through the joints of the arcs. The two lines that meet in an outer centre enclose the wedge
 * of this arc, on the far side from the axis. A ball's centre in the wedge is inside the outer arc,
 * as in a drum. On the axis' side of the lines, the nearest inner arc counts, seen from outside
 * like a shaft. (The profile is symmetric about the rays through the centres. So the nearest point
 * is in the half pitch of the ball, and the normals of the two arcs there do not cross the line.)
 * On a line both arcs have the same distance, so the gap has no step; where they join, it has no
 * kink.
 *
 * A flight is divided at the times at which it crosses one of the lines (quadratics). In each piece
 * the arc is known, and mill_poly_first_rise gives the time at which its gap, a quartic, first
 * closes. There is no time between the pieces, so no contact at a joint is missed, for any
 * rounding. Most flights cross no line, and usually one arc is in reach of a cell: one quartic. */
#include "geometry/wavy.h"

#include <stdlib.h>

#define NO_ARC (-1)
/* Fraction of the radius: a ball that fits into the outer arcs by less than this meets only the
 * inner arcs. */
#define SNUG 1e-12
#define SECTORS 8 /* per buckle: an estimate of the pitch by one division */
#define DEPTH 3   /* how often a box is divided into quarters before an arc counts as in reach */

/* ---- which arc is near? ---- */

/* Is a place in the wedge, between the lines through this outer centre, or nearer to it than
 * `margin` [m]? */
static bool in_wedge(const struct mill_wavy *w, const struct mill_wavy_arc *a, double y, double z,
                     double margin)
{
    const bool before = mill_wavy_beyond(a, 0, y, z) > -margin,
               after = mill_wavy_beyond(a, 1, y, z) > -margin;
    return w->overhangs ? before || after : before && after;
}

/* Is a place in the pitch around it? A wide wedge extends behind the next inner arc, into another
 * pitch. */
static bool in_pitch(const struct mill_wavy *w, const struct mill_wavy_arc *a, double y, double z)
{
    const double along = y * a->uy + z * a->uz, across = fabs(z * a->uy - y * a->uz);
    return across * w->pitch.cos <= along * w->pitch.sin;
}

/* ---- contacts ---- */

/* Converts a contact from the frame of the wall to the laboratory */
static struct mill_contact seen(const struct mill_pose *pose, const struct mill_contact *k)
{
    const vec3 point = mill_pose_out(pose, k->point);
    return (struct mill_contact){.normal = mill_pose_turn_out(pose, k->normal),
                                 .point = point,
                                 .velocity = mill_pose_velocity(pose, point),
                                 .gap = k->gap};
}

static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   const struct mill_pose *pose)
{
    const struct mill_wavy *w = (const struct mill_wavy *)shape;
    const vec3 r = shape->motion ? mill_pose_in(pose, centre) : centre;
    const struct mill_contact k =
        mill_wavy_arc_contact(w, mill_wavy_nearest(w, r.y, r.z).arc, r, radius);
    return shape->motion ? seen(pose, &k) : k;
}

/* A ball that is too large for an outer arc, or for its opening, may touch the inner arcs on both
 * sides. */
static bool beside(const struct mill_shape *shape, vec3 centre, vec3 v, double radius,
                   const struct mill_pose *pose, struct mill_contact *k)
{
    const struct mill_wavy *w = (const struct mill_wavy *)shape;
    const vec3 r = mill_pose_in(pose, centre);
    const struct mill_wavy_near near = mill_wavy_nearest(w, r.y, r.z);
    const double slack = SNUG * w->far;
    if (mill_wavy_inward(near.arc) > 0.0 && w->radius - radius > slack)
        return false;
    const struct mill_contact own = mill_wavy_arc_contact(w, near.beside, r, radius);
    *k = seen(pose, &own);
    return k->gap <= slack && vec3_dot(vec3_sub(v, k->velocity), k->normal) < 0.0;
}

static int places(const struct mill_shape *shape, vec3 centre, double radius,
                  const struct mill_pose *pose, struct mill_contact *k, int most)
{
    const struct mill_wavy *w = (const struct mill_wavy *)shape;
    const vec3 r = mill_pose_in(pose, centre);
    const struct mill_wavy_near near = mill_wavy_nearest(w, r.y, r.z);
    const bool fits = mill_wavy_inward(near.arc) > 0.0 && w->radius > radius;
    k[0] = contact(shape, centre, radius, pose);
    if (fits || most < 2)
        return 1;
    const struct mill_contact other = mill_wavy_arc_contact(w, near.beside, r, radius);
    k[1] = seen(pose, &other);
    return 1 + (k[1].gap < 0.0);
}

/* ---- the first contact of a flight ---- */

/* The first time after `from` at which the flight crosses an edge of one of the wedges; `to` if
 * there is none before. */
static double next_edge(const struct mill_wavy *w, const struct mill_flight *f,
                        struct mill_span parts, double from, double to)
{
    for (int i = parts.first % 2; i < parts.count; i += 2) {
        const struct mill_wavy_arc *a = &w->arc[mill_wavy_wrap(w, parts.first + i)];
        for (int edge = 0; edge < 2; edge++) {
            const double y = a->edge_y[edge], z = a->edge_z[edge];
            const double c = mill_wavy_beyond(a, edge, f->r.y, f->r.z), b = y * f->v.y + z * f->v.z;
            const double half_g = 0.5 * (y * f->g.y + z * f->g.z);
            if (fabs(c) > to * (fabs(b) + to * fabs(half_g)))
                continue;
            double t[2];
            const int roots = mill_poly_quadratic(half_g, 0.5 * b, c, t);
            for (int k = 0; k < roots; k++)
                if (t[k] > from && t[k] < to)
                    to = t[k];
        }
    }
    return to;
}

/* The outer arc in whose wedge a piece of a flight is, or NO_ARC. The piece begins at `from` and
 * passes `through`. It can leave the pitch only through the wall. */
static int wedge_of(const struct mill_wavy *w, struct mill_span parts, vec3 from, vec3 through)
{
    for (int i = parts.first % 2; i < parts.count; i += 2) {
        const int arc = mill_wavy_wrap(w, parts.first + i);
        const struct mill_wavy_arc *a = &w->arc[arc];
        if (in_wedge(w, a, through.y, through.z, 0.0) && in_pitch(w, a, from.y, from.z))
            return arc;
    }
    return NO_ARC;
}

/* The inner arc whose direction is nearest to that of the place, or NO_ARC */
static int inner_at(const struct mill_wavy *w, struct mill_span parts, double y, double z)
{
    double most = -INFINITY;
    int best = NO_ARC;
    for (int i = 1 - parts.first % 2; i < parts.count; i += 2) {
        const int arc = mill_wavy_wrap(w, parts.first + i);
        const double along = y * w->arc[arc].uy + z * w->arc[arc].uz;
        if (along > most) {
            most = along;
            best = arc;
        }
    }
    return best;
}

/* The first contact with one arc, taken as a full circle */
static double rise(const struct mill_wavy *w, int arc, const struct mill_flight *f, double radius,
                   double horizon, bool touching)
{
    const double s = mill_wavy_inward(arc), rho = w->radius - s * radius;
    return mill_shape_circle(f, w->arc[arc].y, w->arc[arc].z, rho, s, horizon, touching);
}

/* The first contact of a piece of a flight between two edges. outer: the arc of its wedge, or
 * NO_ARC. touching: the ball touches the nearest arc of the wall at the start, so the gap to this
 * arc is zero there. */
static double piece_contact(const struct mill_wavy *w, int outer, const struct mill_flight *f,
                            struct mill_span parts, double radius, double horizon, bool touching)
{
    if (outer != NO_ARC)
        return rise(w, outer, f, radius, horizon, touching);
    const int touched = touching ? inner_at(w, parts, f->r.y, f->r.z) : NO_ARC;
    double first = INFINITY;
    for (int i = 1 - parts.first % 2; i < parts.count; i += 2) {
        const int arc = mill_wavy_wrap(w, parts.first + i);
        const double t = rise(w, arc, f, radius, horizon, arc == touched);
        if (t < first)
            first = horizon = t;
    }
    return first;
}

/* True if there is certainly no contact within h: the flight is too short to reach any of the arcs,
 * taken as full circles. The margin is larger than all rounding errors. For an infinite h it is
 * false. */
static bool out_of_reach(const struct mill_wavy *w, const struct mill_flight *f,
                         struct mill_span parts, double radius, double h)
{
    const double speed = sqrt(f->v.y * f->v.y + f->v.z * f->v.z);
    const double fall = 0.5 * h * (fabs(f->g.y) + fabs(f->g.z));
    const double way = h * (speed + fall) * (1.0 + 1e-9) + 1e-9 * w->far;
    for (int i = 0; i < parts.count; i++) {
        const int arc = mill_wavy_wrap(w, parts.first + i);
        const double s = mill_wavy_inward(arc), reach = w->radius - s * (radius + way);
        const double y = f->r.y - w->arc[arc].y, z = f->r.z - w->arc[arc].z;
        if (!(reach > 0.0) || s * (y * y + z * z - reach * reach) >= 0.0)
            return false;
    }
    return true;
}

static struct mill_hit next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                                    double radius, double now, double horizon, bool touching)
{
    const struct mill_wavy *w = (const struct mill_wavy *)shape;
    if (shape->motion)
        return mill_wavy_moving_contact(w, f, radius, now, horizon);
    const struct mill_span all = {0, (int16_t)w->arcs};
    const struct mill_span parts = f->parts.count > 0 ? f->parts : all;
    if (out_of_reach(w, f, parts, radius, horizon))
        return mill_hit_at(INFINITY);
    const bool fits = w->radius - radius > SNUG * w->far;
    struct mill_flight piece = *f;
    for (double from = 0.0;;) {
        int outer = NO_ARC;
        double to = horizon;
        if (fits) {
            to = next_edge(w, f, parts, from, horizon);
            /* after the last crossing the arc does not change, so any later time will do */
            const double within = to <= 1e9 ? 0.5 * (from + to) : from + 1.0;
            const vec3 at = vec3_fly(f->r, f->v, f->g, within);
            outer = wedge_of(w, parts, piece.r, at);
        }
        const double t =
            piece_contact(w, outer, &piece, parts, radius, to - from, touching && from == 0.0);
        if (t <= to - from)
            return mill_hit_at(from + t);
        if (!(to < horizon))
            return mill_hit_at(INFINITY);
        from = to;
        piece.r = vec3_fly(f->r, f->v, f->g, from);
        piece.v = vec3_axpy(f->v, from, f->g);
    }
}

/* ---- which arcs can a ball in a cell touch? ---- */

/* The part of the y-z plane that a box covers, at most as large as the drum */
struct patch {
    double y, z, half_y, half_z; /* [m] centre and half sides */
};

static bool outer_in_reach(const struct mill_wavy *w, const struct mill_wavy_arc *a, struct patch p,
                           double rho, int depth)
{
    const double half = sqrt(p.half_y * p.half_y + p.half_z * p.half_z);
    if (!in_wedge(w, a, p.y, p.z, half) || mill_wavy_distance(a, p.y, p.z) + half < rho)
        return false;
    if (depth == 0)
        return true;
    for (int quarter = 0; quarter < 4; quarter++) {
        const double y = p.y + (quarter % 2 ? 0.5 : -0.5) * p.half_y;
        const double z = p.z + (quarter / 2 ? 0.5 : -0.5) * p.half_z;
        const struct patch part = {y, z, 0.5 * p.half_y, 0.5 * p.half_z};
        if (outer_in_reach(w, a, part, rho, depth - 1))
            return true;
    }
    return false;
}

static bool arc_in_reach(const struct mill_wavy *w, int arc, struct patch p, double radius)
{
    const struct mill_wavy_arc *a = &w->arc[arc];
    const double margin = 1e-6 * w->far + 1e-3 * radius;
    if (mill_wavy_inward(arc) > 0.0)
        return outer_in_reach(w, a, p, w->radius - radius - margin, DEPTH);
    const double y = fmax(fabs(p.y - a->y) - p.half_y, 0.0);
    const double z = fmax(fabs(p.z - a->z) - p.half_z, 0.0);
    return sqrt(y * y + z * z) <= w->radius + radius + margin;
}

/* The arcs between the directions of the box, without those at both ends that are too far away. */
static struct mill_span arcs_in_reach(const struct mill_shape *shape, vec3 lo, vec3 hi,
                                      double radius)
{
    const struct mill_wavy *w = (const struct mill_wavy *)shape;
    if (shape->motion) /* any arc may come near */
        return (struct mill_span){0, (int16_t)w->arcs};
    const double far = 1.5 * w->far;
    const double y0 = fmin(fmax(lo.y, -far), far), y1 = fmin(fmax(hi.y, -far), far);
    const double z0 = fmin(fmax(lo.z, -far), far), z1 = fmin(fmax(hi.z, -far), far);
    const struct patch p = {0.5 * (y0 + y1), 0.5 * (z0 + z1), 0.5 * (y1 - y0), 0.5 * (z1 - z0)};
    const double half = sqrt(p.half_y * p.half_y + p.half_z * p.half_z) * (1.0 + 1e-9);
    const double away = sqrt(p.y * p.y + p.z * p.z);
    int first = 0, count = w->arcs;
    if (away + half + radius < w->bore - 1e-6 * w->far - 1e-3 * radius)
        return (struct mill_span){0, 0};
    if (away > half) {
        const double at = (mill_elementary_atan2(p.z, p.y) - w->angle) / w->half_pitch;
        const double wide = mill_elementary_asin(half / away) / w->half_pitch + 1e-6;
        const double from = floor(at - wide), to = ceil(at + wide);
        if (to - from + 1.0 < w->arcs) {
            first = (int)(from - w->arcs * floor(from / w->arcs)) % w->arcs;
            count = (int)(to - from) + 1;
        }
    }
    while (count > 0 && !arc_in_reach(w, first, p, radius)) {
        first = (first + 1) % w->arcs;
        count--;
    }
    while (count > 0 && !arc_in_reach(w, (first + count - 1) % w->arcs, p, radius))
        count--;
    return (struct mill_span){(int16_t)first, (int16_t)count};
}

static bool reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    return arcs_in_reach(shape, lo, hi, radius).count > 0;
}

/* ---- making it ---- */

static void release(struct mill_shape *shape)
{
    free(((struct mill_wavy *)shape)->arc);
    free(((struct mill_wavy *)shape)->outer_at);
}

/* Sets the line from an outer centre to an inner one, with its normal towards the outer arc. */
static void set_edge(struct mill_wavy_arc *outer, int edge, const struct mill_wavy_arc *inner)
{
    const double y = inner->y - outer->y, z = inner->z - outer->z, d = sqrt(y * y + z * z);
    const double side = edge == 0 ? -1.0 : 1.0; /* the inner arc is before it, or after it */
    outer->edge_y[edge] = side * z / d;
    outer->edge_z[edge] = -side * y / d;
}

/* Finds for each sector the outer arc in whose pitch it begins. It uses a place slightly before the
 * beginning, because mill_wavy_is_after() cannot distinguish the beginning of a pitch of half a
 * turn from its end. */
static void find_pitches(struct mill_wavy *w)
{
    const int n = w->arcs / 2;
    for (int k = 0; k < w->sectors; k++) {
        const double along = 4.0 * k / w->sectors;
        const double y = along < 2.0 ? along - 1.0 : 3.0 - along;
        const double z = along < 2.0 ? fabs(y) - 1.0 : 1.0 - fabs(y);
        const double angle = mill_elementary_atan2(z, y) - 1e-9 - w->angle;
        const double pitch = floor(angle / (2.0 * w->half_pitch) + 0.5);
        w->outer_at[k] = (int16_t)(2 * ((int)(pitch - n * floor(pitch / n)) % n));
    }
}

static bool create(struct mill_shape *shape)
{
    struct mill_wavy *w = (struct mill_wavy *)shape;
    const struct mill_profile profile = mill_solid_profile(&w->body.is), *p = &profile;
    const int arcs = w->arcs = 2 * p->buckles;
    w->sectors = SECTORS * p->buckles;
    w->arc = calloc((size_t)arcs, sizeof *w->arc);
    w->outer_at = calloc((size_t)w->sectors, sizeof *w->outer_at);
    if (!w->arc || !w->outer_at)
        return false;
    shape->fixed = !shape->motion;
    shape->hollow = w->radius = p->arc;
    w->far = p->radius + p->height;
    w->bore = p->radius - p->height;
    w->angle = fmod(p->angle, 2.0 * MILL_PI);
    w->half_pitch = MILL_PI / p->buckles;
    w->pitch = mill_elementary_heading(w->half_pitch);
    w->overhangs = p->half_outer > 0.5 * MILL_PI;
    for (int j = 0; j < arcs; j++) {
        const double far = mill_wavy_inward(j) > 0.0 ? p->outer : p->inner;
        const struct mill_heading u = mill_elementary_heading(w->angle + j * w->half_pitch);
        w->arc[j] =
            (struct mill_wavy_arc){.y = far * u.cos, .z = far * u.sin, .uy = u.cos, .uz = u.sin};
    }
    for (int j = 0; j < arcs; j += 2) {
        set_edge(&w->arc[j], 0, &w->arc[(j + arcs - 1) % arcs]);
        set_edge(&w->arc[j], 1, &w->arc[(j + 1) % arcs]);
    }
    find_pitches(w);
    w->bounds = mill_motion_bounds(shape->motion, vec3_make(0.0, 0.0, 0.0));
    return true;
}

const struct mill_shape_type mill_wavy_type = {.size = sizeof(struct mill_wavy),
                                               .create = create,
                                               .free = release,
                                               .next_contact = next_contact,
                                               .contact = contact,
                                               .reachable = reachable,
                                               .parts = arcs_in_reach,
                                               .beside = beside,
                                               .places = places};
