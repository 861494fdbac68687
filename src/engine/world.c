/* Positions, energies and the energy balance from the state of the mill. */
#include "millsim/world.h"

#include "geometry/shapes.h"

#include <assert.h>
#include <stddef.h>
#include <stdlib.h>

const double mill_world_fast[MILL_WORLD_FAST] = {0.5, 1.0, 2.0};

void mill_world_free(struct mill_world *w)
{
    if (!w)
        return;
    mill_shapes_free(w->shape, w->shapes);
    for (int k = 0; k < w->motions; k++)
        free(w->motion[k]);
    free(w->motion);
    free(w->motion_name);
    free(w->species);
    free(w->spin);
    free(w->ball);
    free(w);
}

bool mill_world_has(const struct mill_world *w, int kind)
{
    bool has = kind == MILL_BALL_BALL;
    for (int k = 0; k < w->shapes && !has; k++)
        has = w->shape[k]->kind == kind;
    return has;
}

void mill_world_restart(struct mill_world *w)
{
    w->base += MILL_WORLD_EPOCH;
    for (int k = 0; k < w->motions; k++)
        w->motion[k]->type->restart(w->motion[k], w->base, MILL_WORLD_EPOCH);
}

vec3 mill_world_position(const struct mill_world *w, int32_t i, double t)
{
    assert(i >= 0 && i < w->balls);
    const struct mill_ball *b = &w->ball[i];
    return vec3_fly(b->r, b->v, w->g, mill_world_flown(b, t));
}

vec3 mill_world_velocity(const struct mill_world *w, int32_t i, double t)
{
    assert(i >= 0 && i < w->balls);
    const struct mill_ball *b = &w->ball[i];
    return vec3_axpy(b->v, mill_world_flown(b, t), w->g);
}

static struct mill_pose frame_on(const struct mill_world *w, const struct mill_motion *m, double t)
{
    const struct mill_container *c = &w->container;
    struct mill_pose pose = c->still || !m ? mill_pose_still : mill_motion_pose(m, t);
    if (c->still)
        return pose;
    const vec3 place = mill_pose_out(&pose, c->frame.place);
    const vec3 x = mill_pose_turn_out(&pose, c->frame.x), y = mill_pose_turn_out(&pose, c->frame.y);
    pose.velocity = mill_pose_velocity(&pose, place);
    pose.z = mill_pose_turn_out(&pose, c->frame.z);
    pose.x = x;
    pose.y = y;
    pose.place = place;
    pose.about_x = false;
    return pose;
}

struct mill_pose mill_world_frame(const struct mill_world *w, double t)
{
    return frame_on(w, w->container.motion, t);
}

struct mill_pose mill_world_steady_frame(const struct mill_world *w, double t)
{
    return frame_on(w, w->container.mapped, t);
}

struct mill_energy mill_world_energy(const struct mill_world *w, double t)
{
    struct mill_energy e = {0.0, 0.0, 0.0};
    for (int32_t i = 0; i < w->balls; i++) {
        const struct mill_species *s = &w->species[w->ball[i].species];
        const vec3 v = mill_world_velocity(w, i, t);
        e.kinetic += 0.5 * s->mass * vec3_dot(v, v);
        e.rotational += 0.5 * s->inertia * vec3_dot(w->spin[i], w->spin[i]);
        e.potential -= s->mass * vec3_dot(w->g, mill_world_position(w, i, t));
    }
    return e;
}

void mill_world_balance(const struct mill_world *w, double t, double *error, double *turnover)
{
    const struct mill_energy e = mill_world_energy(w, t);
    const double change = (e.kinetic - w->start.kinetic) + (e.rotational - w->start.rotational) +
                          (e.potential - w->start.potential);
    double dissipation = 0.0;
    for (int k = 0; k < w->kinds.count; k++)
        dissipation += w->account.dissipation[k];
    *error = fabs(w->account.work - change - dissipation - w->account.elastic);
    *turnover = w->start.kinetic + w->start.rotational + fabs(w->start.potential) +
                fabs(e.potential - w->start.potential) + w->account.work_gross +
                w->account.dissipation_gross + w->account.incident;
}

/* Adds one number after the other: none can be forgotten. */
void mill_world_add_account(struct mill_account *all, const struct mill_account *a)
{
    const size_t sums = offsetof(struct mill_account, collisions) / sizeof(double);
    for (size_t k = 0; k < sums; k++)
        ((double *)all)[k] += ((const double *)a)[k];
    for (size_t k = sums; k < sizeof *all / sizeof(uint64_t); k++)
        ((uint64_t *)all)[k] += ((const uint64_t *)a)[k];
}

void mill_world_add_counts(struct mill_counts *all, const struct mill_counts *c)
{
    for (size_t k = 0; k < offsetof(struct mill_counts, pinch_time) / sizeof(uint64_t); k++)
        ((uint64_t *)all)[k] += ((const uint64_t *)c)[k];
    all->pinch_time += c->pinch_time;
    all->sleep += c->sleep;
    all->quartics.solves += c->quartics.solves;
    all->quartics.fallbacks += c->quartics.fallbacks;
    all->largest_overlap = mill_greatest(all->largest_overlap, c->largest_overlap);
}
