/* The volume that the surfaces of a mill leave free. The box around the container is halved again
 * and again. A distance changes by no more than the place does. So the distances at the centre of a
 * box show whether a surface can pass through the box. If none does, all of the box counts, or
 * nothing of it. A box of the smallest size is cut by the nearest surface as by a plane. */
#include "millsim/start.h"

#include "base/elementary.h"
#include "geometry/shape.h"

#include <stdlib.h>

enum {
    BOXES = 96,  /* of the smallest size, along a cube of the container's volume */
    FEWEST = 32, /* along each axis */
    DEEPEST = 96 /* halvings, more than two extents of any ratio need */
};

struct measuring {
    const struct mill_world *world;
    struct mill_pose *pose; /* of each shape */
    vec3 least;             /* [m] half the sides of the smallest boxes */
};

static double clamped(double x)
{
    return fmin(fmax(x, 0.0), 1.0);
}

/* The free volume in the box with this centre and these half sides. near: the `count` surfaces that
 * can pass through it; behind them there is room for those of its halves. */
static double volume_in(const struct measuring *m, vec3 centre, vec3 half, int *near, int count)
{
    const double all = 8.0 * half.x * half.y * half.z, size = vec3_norm(half);
    double part = 1.0;
    int left = 0;
    for (int i = 0; i < count; i++) {
        const int k = near[i];
        const struct mill_shape *shape = m->world->shape[k];
        const struct mill_contact c = shape->type->contact(shape, centre, 0.0, &m->pose[k]);
        if (c.gap <= -size)
            return 0.0;
        if (c.gap >= size)
            continue;
        const vec3 n = c.normal;
        const double thick = half.x * fabs(n.x) + half.y * fabs(n.y) + half.z * fabs(n.z);
        part = fmin(part, clamped(0.5 + 0.5 * c.gap / thick));
        near[count + left++] = k;
    }
    const vec3 by = {half.x / m->least.x, half.y / m->least.y, half.z / m->least.z};
    if (left == 0 || fmax(by.x, fmax(by.y, by.z)) <= 1.0)
        return part * all;
    vec3 step = {0.0, 0.0, 0.0};
    if (by.x >= by.y && by.x >= by.z)
        step.x = half.x *= 0.5;
    else if (by.y >= by.z)
        step.y = half.y *= 0.5;
    else
        step.z = half.z *= 0.5;
    return volume_in(m, vec3_sub(centre, step), half, near + count, left) +
           volume_in(m, vec3_add(centre, step), half, near + count, left);
}

double mill_start_free_volume(const struct mill_world *w)
{
    const struct mill_container *c = &w->container;
    const vec3 half = vec3_scale(vec3_sub(c->hi, c->lo), 0.5);
    const double side = mill_elementary_cbrt(half.x * half.y * half.z) / BOXES;
    struct measuring m = {.world = w};
    m.least = vec3_make(fmin(side, half.x / FEWEST), fmin(side, half.y / FEWEST),
                        fmin(side, half.z / FEWEST));
    int *near = calloc((size_t)w->shapes * DEEPEST, sizeof *near);
    m.pose = calloc((size_t)w->shapes, sizeof *m.pose);
    double volume = -1.0;
    if (near && m.pose) {
        for (int k = 0; k < w->shapes; k++) {
            near[k] = k;
            m.pose[k] = mill_shape_pose(w->shape[k], 0.0);
        }
        volume = volume_in(&m, vec3_add(c->lo, half), half, near, w->shapes);
    }
    free(near);
    free(m.pose);
    return volume;
}
