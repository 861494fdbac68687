/* When does a ball fall asleep, and when does it wake up? rest.h says what that means. */
#include "engine/sim_private.h"
#include "geometry/shape.h"

#include <stdlib.h>

#define BENEATH 0.1 /* cosine to the vertical: a contact that can hold a ball alone */
/* Every plan must look for sleeping balls. That is worth while if this share of the balls rests. */
#define WORTH 0.1
#define SQUEEZED 1000 /* events within a nanosecond: a ball is squeezed against a sleeping one */

/* Is there something beneath ball i? */
static bool is_held(struct mill_sim *sim, int32_t i)
{
    struct mill_schedule *q = sim->schedule;
    const struct mill_world *w = sim->world;
    const vec3 r = mill_world_position(w, i, sim->now);
    const int32_t n = mill_schedule_near(q, i), cell = q->cells->cell[i];
    const double radius = mill_world_radius(w, i), room = 2.0 * mill_rest_room(&q->rest, radius);
    for (int32_t k = 0; k < n; k++) {
        const int32_t j = q->pairs->near[k];
        const vec3 d = vec3_sub(r, mill_world_position(w, j, sim->now));
        const double distance = vec3_norm(d), gap = distance - radius - mill_world_radius(w, j);
        if (j != i && gap < room && vec3_dot(d, q->rest.up) > BENEATH * distance)
            return true;
    }
    for (int32_t k = q->surface_start[cell]; k < q->surface_start[cell + 1]; k++) {
        const struct mill_shape *shape = w->shape[q->surface[k].shape];
        const struct mill_pose pose = mill_shape_pose(shape, sim->now);
        const struct mill_contact c = shape->type->contact(shape, r, radius, &pose);
        if (c.gap < room && vec3_dot(c.normal, q->rest.up) > BENEATH)
            return true;
    }
    return false;
}

/* Can no moving surface touch ball i, as long as it stays in its cell? */
static bool is_secluded(const struct mill_sim *sim, int32_t i)
{
    const struct mill_schedule *q = sim->schedule;
    const int32_t cell = q->cells->cell[i];
    bool secluded = !sim->world->ball[i].relief;
    for (int32_t k = q->surface_start[cell]; k < q->surface_start[cell + 1]; k++) {
        const struct mill_motion *motion = sim->world->shape[q->surface[k].shape]->motion;
        secluded = secluded && (!motion || q->lately[motion->number].drift == 0.0);
    }
    return secluded;
}

static void fall_asleep(struct mill_sim *sim, int32_t i)
{
    struct mill_world *w = sim->world;
    const struct mill_species *s = &w->species[w->ball[i].species];
    const double kinetic = 0.5 * s->mass * vec3_dot(w->ball[i].v, w->ball[i].v);
    const double all = kinetic + 0.5 * s->inertia * vec3_dot(w->spin[i], w->spin[i]);
    w->account.dissipation[MILL_BALL_BALL] += all;
    w->account.dissipation_normal[MILL_BALL_BALL] += kinetic;
    w->account.dissipation_gross += all;
    mill_sim_need(sim, mill_rest_sleep(sim->schedule, i));
}

static void wake(struct mill_sim *sim, int32_t i)
{
    mill_sim_need(sim, mill_rest_wake(sim->schedule, i, sim->now));
}

static int by_number(const void *a, const void *b)
{
    const int32_t i = *(const int32_t *)a, j = *(const int32_t *)b;
    return (i > j) - (i < j);
}

/* If ball i has moved away from its place, gives it a new one and wakes the balls that it may have
 * held up: those that touched it there, and that friction did not keep from leaning on it. Lists
 * them in ascending order and returns how many; to plan one ball does not change the list. */
static int32_t leave_place(struct mill_sim *sim, int32_t i, int32_t **list)
{
    struct mill_schedule *q = sim->schedule;
    const struct mill_ball *ball = &sim->world->ball[i];
    const vec3 place = q->rest.place[i], way = vec3_sub(ball->r, place);
    const double room = mill_rest_room(&q->rest, mill_world_radius(sim->world, i));
    int32_t *near = *list = q->pairs[1].near, woken = 0;
    if (vec3_dot(way, way) <= room * room)
        return 0;
    const int32_t n = mill_rest_near(&q->rest, ball->species, mill_cells_at(q->cells, place), near);
    for (int32_t k = 0; k < n; k++) {
        const struct mill_ball *other = &sim->world->ball[near[k]];
        if (mill_rest_holds(q, ball->species, place, other->species, other->r))
            near[woken++] = near[k];
    }
    qsort(near, (size_t)woken, sizeof *near, by_number);
    for (int32_t k = 0; k < woken; k++)
        wake(sim, near[k]);
    q->rest.place[i] = ball->r;
    q->rest.calm_epochs[i] = -1; /* the end of an epoch counts from the next one on */
    return woken;
}

void mill_sim_rest_follow(struct mill_sim *sim, int32_t i)
{
    int32_t *list;
    const int32_t woken = mill_world_asleep(sim->world, i) ? 0 : leave_place(sim, i, &list);
    for (int32_t k = 0; k < woken; k++)
        mill_schedule_ball(sim->schedule, list[k], sim->now, MILL_NOBODY);
}

int32_t mill_sim_rest_meet(struct mill_sim *sim, int32_t i, int32_t j, double speed)
{
    const struct mill_world *w = sim->world;
    const bool first = mill_world_asleep(w, i);
    if (!first && !mill_world_asleep(w, j))
        return MILL_NOBODY;
    const int32_t sleeping = first ? i : j, other = first ? j : i;
    if (speed <= sim->schedule->rest.calm && sim->watch.standing < SQUEEZED &&
        !mill_pinches_press(&sim->pinches, w, other, sim->now))
        return sleeping;
    wake(sim, sleeping);
    return MILL_NOBODY;
}

void mill_sim_rest_settle(struct mill_sim *sim)
{
    struct mill_rest *rest = &sim->schedule->rest;
    const struct mill_world *w = sim->world;
    int32_t *list;
    int64_t ready = 0;
    if (!(rest->calm > 0.0))
        return;
    for (int32_t i = 0; i < w->balls && sim->status == MILL_OK; i++) {
        if (mill_world_asleep(w, i)) {
            if (!is_held(sim, i))
                wake(sim, i);
            continue;
        }
        leave_place(sim, i, &list);
        const double most = rest->calm * rest->calm, radius = mill_world_radius(sim->world, i);
        const vec3 v = w->ball[i].v, spin = w->spin[i];
        const bool calm = vec3_dot(v, v) <= most && vec3_dot(spin, spin) * radius * radius <= most;
        rest->calm_epochs[i] = calm ? rest->calm_epochs[i] + 1 : 0;
        ready += rest->calm_epochs[i] >= rest->epochs;
    }
    if ((double)(ready + w->counts.asleep) < WORTH * (double)w->balls)
        return;
    for (int32_t i = 0; i < w->balls && sim->status == MILL_OK; i++)
        if (!mill_world_asleep(w, i) && rest->calm_epochs[i] >= rest->epochs &&
            is_secluded(sim, i) && is_held(sim, i))
            fall_asleep(sim, i);
}
