/* Events: the balls move to each, get new velocities and plans. A contact is written into the
 * account and told to the observers, at once or, beside other threads, later in order of time. */
#include "engine/sim_private.h"
#include "engine/slabs.h"
#include "geometry/shape.h"

#include <assert.h>

#define BURST 3.0    /* times the rebound floor */
#define STILL 100000 /* events within a nanosecond, after which contacts are without friction */

/* impulse: given to the ball at its surface point, in direction `outwards` from its centre */
static void kick(struct mill_world *w, int32_t i, vec3 outwards, vec3 impulse, bool smooth)
{
    struct mill_ball *b = &w->ball[i];
    const struct mill_species *s = &w->species[b->species];
    b->v = vec3_axpy(b->v, 1.0 / s->mass, impulse);
    if (!smooth) /* otherwise rounding alone would change the spin */
        w->spin[i] = vec3_axpy(w->spin[i], s->radius / s->inertia, vec3_cross(outwards, impulse));
    b->contacts++;
}

/* Did both balls have their last contact less than the duration of a contact ago? A jam of a few
 * balls is one lasting contact of soft spheres. Hard ones hit each other again and again in it, and
 * each hit costs as much as any other. So such hits part the balls faster. This keeps powers,
 * energies and rates of impacts above six times the floor (docs/physics.md). */
static bool in_burst(const struct mill_sim *sim, int32_t i, int32_t j)
{
    const struct mill_world *w = sim->world;
    const double now = w->base + sim->now;
    return j != MILL_NOBODY && now - sim->met[i] < sim->touch[w->ball[i].species] &&
           now - sim->met[j] < sim->touch[w->ball[j].species];
}

/* Gives ball i and ball j (MILL_NOBODY: only i) their impulses, and fills in the rest of the entry
 * that begin_entry has made. n: from i into its partner */
static void resolve(struct mill_sim *sim, int32_t i, int32_t j, double reduced_mass, vec3 n,
                    vec3 slip, struct mill_sim_entry *entry)
{
    struct mill_world *w = sim->world;
    struct mill_impact *impact = &entry->impact;
    const int kind = impact->kind;
    struct mill_law law = w->law[kind];
    if (w->fall[kind].points > 0)
        law.restitution = mill_impact_restitution(&w->fall[kind], vec3_dot(slip, n));
    impact->lasting = mill_pinches_press(&sim->pinches, w, i, sim->now) ||
                      (j != MILL_NOBODY && mill_pinches_press(&sim->pinches, w, j, sim->now));
    /* [m/s] minimum normal speed afterwards */
    double least = (in_burst(sim, i, j) ? BURST : 1.0) * w->rebound_floor;
    sim->met[i] = w->base + sim->now;
    if (j != MILL_NOBODY)
        sim->met[j] = w->base + sim->now;
    if (impact->lasting) {
        law.restitution = 0.0;
        least = sim->pinches.parting;
    }
    /* In a corner, friction and the rebound floor can cause contacts without end: the floor gives
     * back what friction takes. While time does not advance, contacts are without friction. */
    if (mill_bridges_give(&sim->bridges, w, i, sim->now) &&
        (j == MILL_NOBODY || mill_bridges_give(&sim->bridges, w, j, sim->now)))
        law.friction = 0.0;
    if (sim->watch.standing > STILL && law.friction > 0.0) {
        law.friction = 0.0;
        w->counts.smoothed++;
    }
    const struct mill_rebound rebound = mill_impact_resolve(&law, least, reduced_mass, n, slip);
    const bool smooth = law.friction == 0.0;
    impact->time = w->base + sim->now;
    impact->normal = vec3_scale(n, -1.0);
    impact->impulse = vec3_scale(rebound.impulse, -1.0);
    impact->slip = vec3_axpy(slip, -vec3_dot(slip, n), n);
    impact->normal_speed = rebound.normal_speed;
    impact->tangential_speed = rebound.tangential_speed;
    impact->dissipation = rebound.dissipation;
    impact->dissipation_normal = rebound.dissipation_normal;
    impact->slid = rebound.slid;
    kick(w, i, n, impact->impulse, smooth);
    if (j != MILL_NOBODY)
        kick(w, j, impact->normal, rebound.impulse, smooth);
    w->counts.not_closing += vec3_dot(slip, n) < 0.0;
    entry->now = sim->now;
    entry->reduced_mass = reduced_mass;
    entry->floored = rebound.floored;
}

/* The entry of a contact of ball i with `partner` at `position`, before it is resolved. Field by
 * field: an initializer would first clear the whole struct, which takes as long as a root. */
static struct mill_sim_entry *begin_entry(struct mill_sim *sim, int kind, int32_t i,
                                          int32_t partner, vec3 position)
{
    const vec3 zero = {0.0, 0.0, 0.0};
    struct mill_sim_entry *entry = mill_sim_next_entry(sim);
    struct mill_impact *impact = &entry->impact;
    impact->kind = kind;
    impact->ball = i;
    impact->partner = partner;
    impact->species = (int16_t)sim->world->ball[i].species;
    impact->partner_species = -1;
    impact->position = position;
    impact->surface = -1;
    impact->place = impact->facing = entry->velocity = zero;
    entry->pressed = entry->bridge = 0.0;
    entry->let_go = entry->clear = false;
    return entry;
}

/* Moves ball i to its event. */
static void arrive(struct mill_sim *sim, int32_t i)
{
    mill_sim_move(sim->world, i, sim->now);
    if (sim->world->counts.asleep > 0)
        mill_sim_rest_follow(sim, i);
}

static void ball_meets_ball(struct mill_sim *sim, int32_t one, int32_t other)
{
    assert(one != other);
    struct mill_world *w = sim->world;
    const int32_t i = one < other ? one : other, j = one < other ? other : one;
    arrive(sim, i);
    arrive(sim, j);
    const struct mill_ball *a = &w->ball[i], *b = &w->ball[j];
    const struct mill_species *sa = &w->species[a->species], *sb = &w->species[b->species];
    vec3 d = vec3_sub(b->r, a->r);
    d.x = mill_world_image(w, d.x);
    const double distance = vec3_norm(d);
    const vec3 n = vec3_scale(d, 1.0 / distance); /* from i to j */
    const vec3 spin = vec3_axpy(vec3_scale(w->spin[i], sa->radius), sb->radius, w->spin[j]);
    const vec3 slip = vec3_add(vec3_sub(a->v, b->v), vec3_cross(spin, n));
    const double reduced = sa->mass * sb->mass / (sa->mass + sb->mass);
    const int32_t wall = w->counts.asleep > 0 ? mill_sim_rest_meet(sim, i, j, vec3_dot(slip, n))
                                              : MILL_NOBODY; /* it is asleep and stays so */
    const double overlap = sa->radius + sb->radius - distance;
    w->counts.largest_overlap = mill_greatest(w->counts.largest_overlap, overlap);
    struct mill_sim_entry *entry =
        begin_entry(sim, MILL_BALL_BALL, i, j, vec3_axpy(a->r, sa->radius, n));
    struct mill_impact *impact = &entry->impact;
    impact->partner_species = (int16_t)b->species;
    impact->position.x = mill_world_image(w, impact->position.x);
    if (wall == MILL_NOBODY) {
        resolve(sim, i, j, reduced, n, slip, entry);
    } else if (wall == j) {
        resolve(sim, i, MILL_NOBODY, sa->mass, n, slip, entry);
    } else {
        resolve(sim, j, MILL_NOBODY, sb->mass, vec3_scale(n, -1.0), vec3_scale(slip, -1.0), entry);
        impact->normal = vec3_scale(n, -1.0); /* into ball i, as the rest */
        impact->impulse = vec3_scale(impact->impulse, -1.0);
        impact->slip = vec3_scale(impact->slip, -1.0);
    }
    bool gives;
    const double push = -vec3_dot(impact->impulse, n);
    entry->bridge = mill_bridges_push(&sim->bridges, w, i, j, n, push, sim->now, &gives);
    w->counts.bridges += gives;
    mill_sim_record(sim, entry);
    if (wall == MILL_NOBODY)
        mill_schedule_two(sim->schedule, i, j, sim->now);
    else
        mill_schedule_ball(sim->schedule, wall == i ? j : i, sim->now, MILL_NOBODY);
    mill_sim_look_clear(sim, i);
    mill_sim_look_clear(sim, j);
}

static void ball_meets_shape(struct mill_sim *sim, int32_t i, int32_t s)
{
    struct mill_world *w = sim->world;
    const struct mill_shape *shape = w->shape[s];
    arrive(sim, i);
    const struct mill_ball *b = &w->ball[i];
    const struct mill_species *sb = &w->species[b->species];
    const struct mill_pose pose = mill_shape_pose(shape, sim->now);
    const struct mill_contact c = mill_shape_meet(shape, b->r, b->v, sb->radius, &pose);
    const vec3 n = vec3_scale(c.normal, -1.0); /* from the ball into the surface */
    const vec3 slip = vec3_axpy(vec3_sub(b->v, c.velocity), sb->radius, vec3_cross(w->spin[i], n));
    if (!b->relief || !shape->pinches)
        w->counts.largest_overlap = mill_greatest(w->counts.largest_overlap, -c.gap);
    struct mill_sim_entry *entry = begin_entry(sim, shape->kind, i, shape->number, c.point);
    entry->impact.surface = s;
    entry->impact.place = mill_pose_in(&pose, c.point);
    entry->impact.facing = mill_pose_turn_in(&pose, c.normal);
    entry->velocity = c.velocity;
    const bool pinches = shape->pinches && sim->pinches.ball;
    const double friction = w->law[shape->kind].friction;
    if (pinches)
        entry->pressed = mill_pinches_meet(&sim->pinches, w, i, sim->now);
    else
        mill_pinches_lean(&sim->pinches, i, c.normal, friction);
    if (!shape->pinches)
        mill_bridges_touch(&sim->bridges, i, s, c.normal, sim->now);
    resolve(sim, i, MILL_NOBODY, sb->mass, n, slip, entry);
    if (pinches && mill_pinches_push(&sim->pinches, w, i, vec3_dot(entry->impact.impulse, c.normal),
                                     c.normal, friction)) {
        w->ball[i].relief = MILL_RELIEF_LASTS;
        w->counts.reliefs++;
        entry->let_go = true;
    }
    mill_sim_record(sim, entry);
    mill_schedule_ball(sim->schedule, i, sim->now, s);
}

void mill_sim_clear(struct mill_sim *sim, int32_t i)
{
    struct mill_ball *ball = &sim->world->ball[i];
    ball->relief = MILL_RELIEF_NONE;
    struct mill_sim_entry *entry = begin_entry(sim, MILL_BALL_BALL, i, MILL_NOBODY, ball->r);
    entry->impact.time = sim->world->base + sim->now;
    entry->clear = true;
    mill_sim_record(sim, entry);
}

void mill_sim_happen(struct mill_sim *sim, int32_t i)
{
    struct mill_world *w = sim->world;
    const struct mill_plan *plan = &sim->schedule->plan[i];
    if (plan->next == MILL_NEXT_PAIR && w->ball[plan->partner].contacts == plan->partner_contacts) {
        ball_meets_ball(sim, i, plan->partner);
    } else if (plan->next == MILL_NEXT_EXIT) {
        arrive(sim, i);
        mill_sim_need(sim, mill_schedule_cross(sim->schedule, i, sim->now));
    } else if (plan->next == MILL_NEXT_SURFACE) {
        ball_meets_shape(sim, i, plan->shape);
    } else { /* the plan is stale, or a search continues: make a new plan from here */
        w->counts.stale++;
        arrive(sim, i);
        mill_schedule_ball(sim->schedule, i, sim->now, MILL_NOBODY);
    }
    mill_sim_look_clear(sim, i);
}

/* ---- one after the other ---- */

void mill_sim_watch(struct mill_watch *w, double t)
{
    /* by a nanosecond at least: hops that shrink to the resolution of time still advance it */
    const bool advances = t > w->last + 1e-9, over = t - w->since > 1e-3;
    w->last = advances ? t : w->last;
    w->standing = advances ? 0 : w->standing + 1;
    w->since = over ? t : w->since;
    w->events = over ? 0 : w->events + 1;
}

/* Stops runs in which infinitely many contacts would happen in a finite time */
static void watch_time(struct mill_sim *sim, int32_t i, double t)
{
    const struct mill_watch *w = &sim->watch;
    const uint64_t balls = (uint64_t)sim->world->balls;
    mill_sim_watch(&sim->watch, t);
    if (w->standing > 1000000 + 100 * balls)
        sim->status = mill_error_set(
            sim->error, MILL_FAILED,
            "the simulated time does not advance after t = %.9g s: ball %ld has contacts without "
            "end; raise contact.rebound_floor (now %g m/s)",
            sim->world->base + sim->now, (long)i, sim->world->rebound_floor);
    if (w->events > 10000000 + 40000 * balls)
        sim->status = mill_error_set(
            sim->error, MILL_FAILED,
            "the simulated time hardly advances at t = %.9g s: %llu events within a millisecond, "
            "now of ball %ld; raise contact.rebound_floor (now %g m/s) or contact.restitution",
            sim->world->base + sim->now, (unsigned long long)w->events, (long)i,
            sim->world->rebound_floor);
}

void mill_sim_take_events(struct mill_sim *sim, double limit, uint64_t *budget)
{
    const bool large = sim->world->balls >= MILL_SIM_LARGE;
    const struct mill_schedule *p = sim->schedule;
    double t;
    for (; sim->status == MILL_OK && *budget > 0; --*budget) {
        const int32_t i =
            p->slabs ? mill_slabs_next(p->slabs, &t) : mill_calendar_next(p->calendar, &t);
        if (i < 0 || t >= limit)
            return;
        if (mill_sim_stops(sim))
            sim->status = MILL_STOPPED;
        else if (sim->proof)
            sim->proof->before(sim, i, t);
        if (sim->status != MILL_OK)
            return;
        /* rounding may put an event slightly before the last one, but time must not go backwards */
        sim->now = mill_greatest(t, sim->now);
        if (large)
            mill_schedule_ahead(sim->schedule);
        mill_sim_happen(sim, i);
        watch_time(sim, i, t);
        if (sim->proof && sim->status == MILL_OK)
            sim->proof->after(sim, i);
    }
}
