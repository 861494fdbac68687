/* The flat end walls: the gap is a parabola of time, a straight line where gravity is parallel to
 * it. */
#include "plate.h"

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
    const double p[5] = {-gap(shape, f->r, radius, turn), -w->inward * f->v.x,
                         -0.5 * w->inward * f->g.x, 0.0, 0.0};
    if (!touching && p[0] + horizon * (fmax(p[1], 0.0) + horizon * fmax(p[2], 0.0)) < 0.0)
        return INFINITY;
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

static const struct mill_shape_ops ops = {MILL_BALL_WALL, next_contact, gap,
                                          contact,        reachable,    release};

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
