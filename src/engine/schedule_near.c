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
    const double radius = p->radius[w->ball[i].species];
    const int32_t *near = p->pairs->near;
    double deepest = -INFINITY;
    if (!(fabs(r.x) + fabs(r.y) + fabs(r.z) < (double)INFINITY))
        return INFINITY;
    struct mill_grids_look look[MILL_GRIDS_LOOKS];
    const int looks = mill_grids_look(&p->grids, w->ball[i].species, p->cells->cell[i], -1, look);
    for (int l = 0; l < looks; l++) {
        const vec3 at = {r.x + look[l].shift, r.y, r.z};
        const int32_t n = mill_cells_gather(look[l].cells, look[l].cell, look[l].offset,
                                            look[l].count, 1, p->pairs->near);
        for (int32_t k = 0; k < n; k++) {
            const double sum = radius + p->radius[w->ball[near[k]].species];
            if (near[k] != i)
                deepest = fmax(deepest,
                               sum - vec3_norm(vec3_sub(mill_world_position(w, near[k], t), at)));
        }
    }
    const int32_t resting =
        mill_rest_near(&p->rest, w->ball[i].species, p->cells->cell[i], p->pairs->near);
    for (int32_t k = 0; k < resting; k++) {
        const double sum = radius + p->radius[w->ball[near[k]].species];
        if (near[k] != i)
            deepest = fmax(deepest, sum - vec3_norm(vec3_sub(w->ball[near[k]].r, r)));
    }
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_shape *s = w->shape[k];
        const struct mill_pose pose = mill_shape_pose(s, t);
        if (!p->plan[i].let_go || !s->pinches)
            deepest = fmax(deepest, -mill_shape_gap(s, r, radius, &pose));
    }
    return deepest;
}
