/* What is near a ball: for audits and for balls at rest, not for plans */
#include "engine/schedule.h"
#include "geometry/shape.h"

int32_t mill_schedule_near(struct mill_schedule *p, int32_t i)
{
    const int32_t species = p->world->ball[i].species, cell = p->cells->cell[i];
    int32_t n = mill_grids_gather(&p->grids, species, cell, p->pairs->near);
    return n + mill_rest_near(&p->rest, species, cell, p->pairs->near + n);
}

double mill_schedule_overlap(struct mill_schedule *p, int32_t i, double t)
{
    const struct mill_world *w = p->world;
    const vec3 r = mill_world_position(w, i, t);
    const double radius = p->radius[w->ball[i].species], period = w->container.period;
    double deepest = -INFINITY;
    if (!(fabs(r.x) + fabs(r.y) + fabs(r.z) < (double)INFINITY))
        return INFINITY;
    const int32_t n = mill_schedule_near(p, i);
    for (int32_t k = 0; k < n; k++) {
        const int32_t j = p->pairs->near[k];
        const vec3 other = mill_world_position(w, j, t);
        vec3 at = r; /* or the image that is nearer to the other ball */
        if (fabs(other.x - r.x) > 0.5 * period && period > 0.0)
            at.x += copysign(period, other.x - r.x);
        if (j != i)
            deepest = fmax(deepest,
                           radius + p->radius[w->ball[j].species] - vec3_norm(vec3_sub(other, at)));
    }
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_shape *s = w->shape[k];
        const struct mill_pose pose = mill_shape_pose(s, t);
        if (!w->ball[i].relief || !s->pinches)
            deepest = fmax(deepest, -mill_shape_gap(s, r, radius, &pose));
    }
    return deepest;
}
