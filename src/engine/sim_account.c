/* Where a contact goes: into the account of the run and to the observers, in order of time */
#include "engine/sim_private.h"
#include "geometry/shape.h"

void mill_sim_book_work(struct mill_account *a, const struct mill_motion *motion,
                        const struct mill_pose *poses, double now, vec3 impulse, vec3 point,
                        vec3 velocity)
{
    const double work = vec3_dot(impulse, velocity);
    double left = work; /* work of the motion and its carriers */
    a->work += work;
    a->work_gross += fabs(work);
    for (const struct mill_motion *m = motion; m; m = m->on) {
        const struct mill_pose carrier =
            m->on && poses ? poses[m->on->number] : mill_motion_pose(m->on, now);
        const double rest = m->on ? vec3_dot(impulse, mill_pose_velocity(&carrier, point)) : 0.0;
        a->motion[m->number].work += left - rest;
        left = rest;
        if (!m->axial)
            continue;
        const vec3 arm = vec3_sub(point, mill_pose_out(&carrier, m->through));
        a->motion[m->number].impulse +=
            vec3_dot(mill_pose_turn_out(&carrier, m->axis), vec3_cross(arm, impulse));
    }
}

/* Counts an impact by its speed. */
static void count(struct mill_account *a, const struct mill_sim_entry *entry)
{
    const int kind = entry->impact.kind;
    const double speed = entry->impact.normal_speed;
    a->collisions[kind]++;
    a->floored[kind] += entry->floored;
    for (int k = 0; k < MILL_WORLD_FAST; k++)
        a->fast[kind][k] += speed >= mill_world_fast[k];
}

static void book(struct mill_world *w, const struct mill_sim_entry *entry)
{
    struct mill_account *a = &w->account;
    const struct mill_impact *impact = &entry->impact;
    const int kind = impact->kind;
    const double speed = impact->normal_speed;
    w->counts.pinch_time += entry->pressed;
    a->bridge_work += entry->bridge;
    if (impact->lasting)
        w->counts.pinch_contacts++;
    else
        count(a, entry);
    a->dissipation[kind] += impact->dissipation;
    a->dissipation_normal[kind] += impact->dissipation_normal;
    a->dissipation_gross += fabs(impact->dissipation);
    a->incident += 0.5 * entry->reduced_mass * speed * speed;
    if (impact->surface < 0 || !w->shape[impact->surface]->motion)
        return;
    a->pinch_work += impact->lasting ? vec3_dot(impact->impulse, entry->velocity) : 0.0;
    mill_sim_book_work(a, w->shape[impact->surface]->motion, NULL, entry->now, impact->impulse,
                       impact->position, entry->velocity);
}

static bool tell_impact(struct mill_sim *sim, const struct mill_impact *impact)
{
    bool goes_on = true;
    for (int k = 0; goes_on && k < sim->impact_observers; k++) {
        struct mill_observer *o = sim->impact_observer[k];
        goes_on = mill_sim_heed(sim, o->type->impact(o, impact, sim->error));
    }
    return goes_on;
}

static void tell(struct mill_sim *sim, const struct mill_sim_entry *entry)
{
    const struct mill_impact *at = &entry->impact;
    bool goes_on = entry->clear || (tell_impact(sim, at) && entry->let_go);
    for (int k = 0; goes_on && k < sim->observers; k++) {
        struct mill_observer *o = sim->observer[k];
        goes_on =
            !o->type->relief ||
            mill_sim_heed(sim, o->type->relief(o, at->ball, at->time, entry->let_go, sim->error));
    }
}

void mill_sim_count(struct mill_sim *sim, const struct mill_sim_entry *entry)
{
    const double speed = entry->impact.normal_speed;
    count(&sim->world->account, entry);
    sim->world->account.incident += 0.5 * entry->reduced_mass * speed * speed;
    tell_impact(sim, &entry->impact);
}

struct mill_sim_entry *mill_sim_next_entry(struct mill_sim *sim)
{
    struct mill_sim_entry *next = sim->log ? mill_memory_add(sim->log) : &sim->entry;
    sim->status = next ? sim->status : MILL_FAILED;
    return next ? next : &sim->entry;
}

void mill_sim_record(struct mill_sim *sim, const struct mill_sim_entry *entry)
{
    if (sim->log)
        return;
    if (!entry->clear)
        book(sim->world, entry);
    if (sim->told == 0)
        tell(sim, entry);
    else if (--sim->told == 0)
        mill_sim_heed(sim, sim->told_status);
}
