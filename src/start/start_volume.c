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

/* The boxes after a number of halvings: their sizes do not depend on where they are. */
struct level {
    vec3 half;           /* [m] half the sides */
    vec3 step;           /* [m] from the centre of a box to those of its halves */
    double size, volume; /* [m] half the diagonal, [m^3] */
};

struct measuring {
    const struct mill_world *world;
    struct mill_pose *pose; /* of each shape */
    int last;               /* level of the smallest boxes */
    struct level level[DEEPEST + 1];
};

/* Sets the levels, for smallest boxes with these half sides. */
static void set_levels(struct measuring *m, vec3 half, vec3 least)
{
    for (m->last = 0; m->last <= DEEPEST; m->last++) {
        const vec3 by = {half.x / least.x, half.y / least.y, half.z / least.z};
        struct level *l = &m->level[m->last];
        *l = (struct level){half, {0.0, 0.0, 0.0}, vec3_norm(half), 8.0 * half.x * half.y * half.z};
        if (m->last == DEEPEST || fmax(by.x, fmax(by.y, by.z)) <= 1.0)
            return;
        if (by.x >= by.y && by.x >= by.z)
            l->step.x = half.x *= 0.5;
        else if (by.y >= by.z)
            l->step.y = half.y *= 0.5;
        else
            l->step.z = half.z *= 0.5;
    }
}

/* The free volume in the box of this level with this centre. near: the `count` surfaces that can
 * pass through it; behind them there is room for those of its halves. */
static double volume_in(const struct measuring *m, int level, vec3 centre, int *near, int count)
{
    const struct level *l = &m->level[level];
    double part = 1.0;
    int left = 0;
    for (int i = 0; i < count; i++) {
        const int k = near[i];
        const struct mill_shape *shape = m->world->shape[k];
        const struct mill_contact c = shape->type->contact(shape, centre, 0.0, &m->pose[k]);
        if (c.gap <= -l->size)
            return 0.0;
        if (c.gap >= l->size)
            continue;
        near[count + left++] = k;
        if (level < m->last)
            continue;
        const vec3 n = c.normal;
        const double thick = l->half.x * fabs(n.x) + l->half.y * fabs(n.y) + l->half.z * fabs(n.z);
        part = fmin(part, fmax(0.5 + 0.5 * c.gap / thick, 0.0));
    }
    if (left == 0 || level == m->last)
        return part * l->volume;
    return volume_in(m, level + 1, vec3_sub(centre, l->step), near + count, left) +
           volume_in(m, level + 1, vec3_add(centre, l->step), near + count, left);
}

double mill_start_free_volume(const struct mill_world *w)
{
    const struct mill_container *c = &w->container;
    const vec3 half = vec3_scale(vec3_sub(c->hi, c->lo), 0.5);
    const double side = mill_elementary_cbrt(half.x * half.y * half.z) / BOXES;
    struct measuring m = {.world = w};
    set_levels(&m, half,
               vec3_make(fmin(side, half.x / FEWEST), fmin(side, half.y / FEWEST),
                         fmin(side, half.z / FEWEST)));
    int *near = calloc((size_t)w->shapes * DEEPEST, sizeof *near);
    m.pose = calloc((size_t)w->shapes, sizeof *m.pose);
    double volume = -1.0;
    if (near && m.pose) {
        for (int k = 0; k < w->shapes; k++) {
            near[k] = k;
            m.pose[k] = mill_shape_pose(w->shape[k], -w->base); /* lo and hi are of t = 0 */
        }
        volume = volume_in(&m, 0, vec3_add(c->lo, half), near, w->shapes);
    }
    free(near);
    free(m.pose);
    return volume;
}
