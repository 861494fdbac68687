/* The flat end walls: the gap is a parabola of time, a straight line where gravity is parallel to
 * it. On a straight line one division settles when, and whether in time. */
#include "geometry/plate.h"

#include "geometry/mesh.h"

#include <stdlib.h>

struct plate {
    struct mill_shape base;
    double x;      /* [m] */
    double inward; /* +1 or -1: x component of the normal into the mill */
};

static double gap(const struct mill_shape *shape, vec3 centre, double radius, double turn)
{
    const struct plate *w = (const struct plate *)shape;
    (void)turn;
    return w->inward * (centre.x - w->x) - radius;
}

static double next_contact(const struct mill_shape *shape, const struct mill_flight *f,
                           double radius, double turn, double horizon, bool touching)
{
    const struct plate *w = (const struct plate *)shape;
    const double away = gap(shape, f->r, radius, turn), closing = -w->inward * f->v.x;
    const double pull = -0.5 * w->inward * f->g.x;
    if (pull == 0.0 && (touching || away > 0.0)) {
        if (closing <= 0.0)
            return INFINITY;
        /* a quotient is rounded to the nearest double, so where it is not the horizon itself it
         * lies on the right side of it */
        const double t = away / closing;
        if (!touching && t != horizon)
            return t < horizon ? t : (double)INFINITY;
    }
    const double p[5] = {-away, closing, pull, 0.0, 0.0};
    return mill_poly_first_rise(p, horizon, touching, NULL);
}

static struct mill_contact contact(const struct mill_shape *shape, vec3 centre, double radius,
                                   double turn)
{
    const struct plate *w = (const struct plate *)shape;
    const struct mill_contact k = {{w->inward, 0.0, 0.0},
                                   {w->x, centre.y, centre.z},
                                   {0.0, 0.0, 0.0},
                                   gap(shape, centre, radius, turn)};
    return k;
}

static bool reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    const struct plate *w = (const struct plate *)shape;
    const double nearest = w->inward > 0.0 ? lo.x - w->x : w->x - hi.x;
    return nearest <= radius * (1.0 + 1e-3) + 1e-6 * fabs(w->x);
}

static void release(struct mill_shape *shape)
{
    free(shape);
}

static void draw(const struct mill_shape *shape, const struct mill_chamber *chamber,
                 struct mill_mesh *mesh)
{
    const struct plate *w = (const struct plate *)shape;
    mill_mesh_lid(mesh, &chamber->drum, w->x, w->inward, chamber->tolerance);
}

static const struct mill_shape_ops ops = {MILL_BALL_WALL, next_contact, gap,  contact, reachable,
                                          release,        NULL,         NULL, draw};

struct mill_shape *mill_plate_create(int number, double length)
{
    struct plate *w = calloc(1, sizeof *w);
    if (!w)
        return NULL;
    w->base.ops = &ops;
    w->base.number = number;
    w->inward = number == 0 ? 1.0 : -1.0;
    w->x = -0.5 * length * w->inward;
    return &w->base;
}
