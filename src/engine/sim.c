/* The event loop. Each event has the same four steps: move the balls to it, change their
 * velocities, call the observers, make new plans. Local time restarts at fixed intervals of
 * simulated time, the epochs. At the end of an epoch every ball is moved to the same time, checked
 * for overlaps and planned again. Thus local times stay small and precise. Only the clock decides
 * when an epoch ends, so no output option can change the run. */
#include "engine/sim_private.h"
#include "geometry/shape.h"

#include <assert.h>
#include <stdlib.h>

#define STILL 100000 /* events within a nanosecond, after which contacts are without friction */
#define LARGE 20000  /* balls, from which schedule_ahead.c saves more time than it takes */

enum mill_status mill_sim_create(struct mill_world *world, struct mill_sim **sim,
                                 struct mill_error *error)
{
    struct mill_sim *s = *sim = calloc(1, sizeof *s);
    const enum mill_status status =
        s && mill_pinches_create(&s->pinches, world)
            ? mill_schedule_create(world, &s->schedule, error)
            : mill_error_set(error, MILL_FAILED, "out of memory for the event loop");
    if (status == MILL_OK) {
        s->world = world;
        mill_sim_epoch_begin(s);
    } else {
        mill_sim_free(s);
        *sim = NULL;
    }
    return status;
}

void mill_sim_free(struct mill_sim *sim)
{
    if (!sim)
        return;
    mill_schedule_free(sim->schedule);
    mill_pinches_free(&sim->pinches);
    mill_sim_thread_free(sim->thread);
    free(sim->paranoid);
    free(sim);
}

enum mill_status mill_sim_observe(struct mill_sim *sim, struct mill_observer *observer)
{
    assert(observer && observer->type);
    if (sim->observers == (int)(sizeof sim->observer / sizeof sim->observer[0]))
        return MILL_FAILED;
    observer->next = observer->type->sample ? observer->next : (double)INFINITY;
    sim->observer[sim->observers++] = observer;
    return MILL_OK;
}

void mill_sim_use_threads(struct mill_sim *sim, int threads)
{
    if (threads > 1 && !sim->thread)
        sim->thread = mill_sim_thread_create(sim->world);
    if (threads > 1)
        return;
    mill_sim_thread_free(sim->thread);
    sim->thread = NULL;
}

int mill_sim_threads(const struct mill_sim *sim)
{
    return sim->thread && mill_sim_thread_ran(sim->thread) ? 2 : 1;
}

const struct mill_world *mill_sim_world(const struct mill_sim *sim)
{
    return sim->world;
}

double mill_sim_time(const struct mill_sim *sim)
{
    return sim->world->base + sim->now;
}

double mill_sim_local_time(const struct mill_sim *sim)
{
    return sim->now;
}

/* Stores the status of the observers. true: it is no failure. */
static bool goes_on(struct mill_sim *sim, enum mill_status status)
{
    sim->status = status != MILL_OK ? status : sim->status;
    return mill_sim_goes_on(sim->status);
}

static void tell(struct mill_sim *sim, const struct mill_impact *impact)
{
    goes_on(sim, sim->thread ? mill_sim_thread_push(sim->thread, impact, sim->error)
                             : mill_sim_tell(sim->observer, sim->observers, impact, sim->error));
}

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

/* Gives their impulses to ball i and ball j; j MILL_NOBODY: only i. n: from i into its partner. The
 * caller has set kind, ball, partner and position of the impact. This function fills in the rest
 * and adds the impact to the account. */
static void resolve(struct mill_sim *sim, int32_t i, int32_t j, double reduced_mass, vec3 n,
                    vec3 slip, struct mill_impact *impact)
{
    struct mill_world *w = sim->world;
    struct mill_account *a = &w->account;
    const int kind = impact->kind;
    struct mill_law law = w->law[kind];
    if (w->fall[kind].points > 0)
        law.restitution = mill_impact_restitution(&w->fall[kind], vec3_dot(slip, n));
    impact->lasting = mill_pinches_press(&sim->pinches, w, i, sim->now) ||
                      (j != MILL_NOBODY && mill_pinches_press(&sim->pinches, w, j, sim->now));
    double least = w->rebound_floor; /* [m/s] minimum normal speed afterwards */
    if (impact->lasting) {
        law.restitution = 0.0;
        least = sim->pinches.parting;
    }
    /* In a corner, friction and the rebound floor can cause contacts without end at the same time:
     * the floor gives back the energy that friction takes. If time does not advance, contacts are
     * therefore computed without friction until it advances again. Then the floor separates the
     * bodies. */
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
    if (impact->lasting) {
        w->counts.pinch_contacts++;
    } else {
        a->collisions[kind]++;
        a->floored[kind] += rebound.floored;
        for (int k = 0; k < MILL_WORLD_FAST; k++)
            a->fast[kind][k] += rebound.normal_speed >= mill_world_fast[k];
    }
    a->dissipation[kind] += rebound.dissipation;
    a->dissipation_normal[kind] += rebound.dissipation_normal;
    a->dissipation_gross += fabs(rebound.dissipation);
    a->incident += 0.5 * reduced_mass * rebound.normal_speed * rebound.normal_speed;
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
    w->counts.largest_overlap =
        mill_greatest(w->counts.largest_overlap, sa->radius + sb->radius - distance);
    struct mill_impact impact = {.kind = MILL_BALL_BALL,
                                 .ball = i,
                                 .partner = j,
                                 .species = (int16_t)a->species,
                                 .partner_species = (int16_t)b->species,
                                 .position = vec3_axpy(a->r, sa->radius, n),
                                 .surface = -1};
    impact.position.x = mill_world_image(w, impact.position.x);
    if (wall == MILL_NOBODY) {
        resolve(sim, i, j, reduced, n, slip, &impact);
    } else if (wall == j) {
        resolve(sim, i, MILL_NOBODY, sa->mass, n, slip, &impact);
    } else {
        resolve(sim, j, MILL_NOBODY, sb->mass, vec3_scale(n, -1.0), vec3_scale(slip, -1.0),
                &impact);
        impact.normal = vec3_scale(n, -1.0); /* into ball i, as the rest */
        impact.impulse = vec3_scale(impact.impulse, -1.0);
        impact.slip = vec3_scale(impact.slip, -1.0);
    }
    tell(sim, &impact);
    if (wall != i)
        mill_schedule_ball(sim->schedule, i, sim->now, MILL_NOBODY);
    if (wall != j)
        mill_schedule_ball(sim->schedule, j, sim->now, MILL_NOBODY);
}

/* Adds the work of the surface on the ball to the account, and the part of each motion: the work of
 * the impulse at the velocity that this motion adds to the velocity of its carriers. Also adds the
 * angular impulse about the motion's axis. */
static void book_work(struct mill_sim *sim, const struct mill_shape *shape,
                      const struct mill_contact *c, const struct mill_impact *impact)
{
    struct mill_account *a = &sim->world->account;
    if (!shape->motion)
        return;
    const vec3 impulse = impact->impulse; /* on the ball */
    const double work = vec3_dot(impulse, c->velocity);
    double left = work; /* work of the motion and its carriers */
    a->work += work;
    a->pinch_work += impact->lasting ? work : 0.0;
    a->work_gross += fabs(work);
    for (const struct mill_motion *m = shape->motion; m; m = m->on) {
        const struct mill_pose carrier = mill_motion_pose(m->on, sim->now);
        const double rest = m->on ? vec3_dot(impulse, mill_pose_velocity(&carrier, c->point)) : 0.0;
        vec3 through, axis;
        a->motion[m->number].work += left - rest;
        left = rest;
        if (!m->type->axis || !m->type->axis(m, &through, &axis))
            continue;
        const vec3 arm = vec3_sub(c->point, mill_pose_out(&carrier, through));
        a->motion[m->number].impulse +=
            vec3_dot(mill_pose_turn_out(&carrier, axis), vec3_cross(arm, impulse));
    }
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
    if (!sim->schedule->plan[i].let_go || !shape->pinches)
        w->counts.largest_overlap = mill_greatest(w->counts.largest_overlap, -c.gap);
    struct mill_impact impact = {.kind = shape->kind,
                                 .ball = i,
                                 .partner = shape->number,
                                 .species = (int16_t)b->species,
                                 .partner_species = -1,
                                 .position = c.point,
                                 .surface = s,
                                 .place = mill_pose_in(&pose, c.point),
                                 .facing = mill_pose_turn_in(&pose, c.normal)};
    const bool pinches = shape->pinches && sim->pinches.ball;
    const double friction = w->law[impact.kind].friction;
    if (pinches)
        mill_pinches_meet(&sim->pinches, w, i, sim->now);
    else
        mill_pinches_lean(&sim->pinches, i, c.normal, friction);
    resolve(sim, i, MILL_NOBODY, sb->mass, n, slip, &impact);
    if (pinches && mill_pinches_push(&sim->pinches, w, i, vec3_dot(impact.impulse, c.normal),
                                     c.normal, friction)) {
        sim->schedule->plan[i].let_go = true;
        w->counts.reliefs++;
    }
    book_work(sim, shape, &c, &impact);
    tell(sim, &impact);
    mill_schedule_ball(sim->schedule, i, sim->now, s);
}

static void happen(struct mill_sim *sim, int32_t i)
{
    struct mill_world *w = sim->world;
    const struct mill_plan *plan = &sim->schedule->plan[i];
    if (plan->next == MILL_NEXT_PAIR && w->ball[plan->partner].contacts == plan->partner_contacts) {
        ball_meets_ball(sim, i, plan->partner);
    } else if (plan->next == MILL_NEXT_EXIT) {
        arrive(sim, i);
        if (!mill_schedule_cross(sim->schedule, i, sim->now))
            sim->status =
                mill_error_set(sim->error, MILL_FAILED, "out of memory for the cell grid");
    } else if (plan->next == MILL_NEXT_SURFACE) {
        ball_meets_shape(sim, i, plan->shape);
    } else { /* the plan is stale, or a search continues: make a new plan from here */
        w->counts.stale++;
        arrive(sim, i);
        mill_schedule_ball(sim->schedule, i, sim->now, MILL_NOBODY);
    }
}

/* Stops runs in which infinitely many contacts would happen in a finite time */
static void watch_time(struct mill_sim *sim, int32_t i, double t)
{
    struct mill_watch *w = &sim->watch;
    const uint64_t balls = (uint64_t)sim->world->balls;
    /* less than a nanosecond is no advance: hops that shrink to the resolution of time still
     * advance it */
    if (t > w->last + 1e-9) {
        w->last = t;
        w->standing = 0;
    } else if (++w->standing > 1000000 + 100 * balls) {
        sim->status = mill_error_set(sim->error, MILL_FAILED,
                                     "the simulated time does not advance after t = %.9g s: ball "
                                     "%ld has contacts without end; raise contact.rebound_floor "
                                     "(now %g m/s)",
                                     mill_sim_time(sim), (long)i, sim->world->rebound_floor);
    }
    if (t - w->since > 1e-3) {
        w->since = t;
        w->events = 0;
    } else if (++w->events > 10000000 + 40000 * balls) {
        sim->status = mill_error_set(
            sim->error, MILL_FAILED,
            "the simulated time hardly advances at t = %.9g s: %llu events within a millisecond, "
            "now of ball %ld; raise contact.rebound_floor (now %g m/s) or contact.restitution",
            mill_sim_time(sim), (unsigned long long)w->events, (long)i, sim->world->rebound_floor);
    }
}

static void take_samples(struct mill_sim *sim, double due)
{
    goes_on(sim, sim->thread
                     ? mill_sim_thread_sample(sim->thread, sim->world, sim->now, due, sim->error)
                     : mill_sim_sample(sim->observer, sim->observers, sim->world, sim->now, due,
                                       sim->error));
}

/* [s] simulated time of the next sample */
static double next_sample(const struct mill_sim *sim)
{
    double next = INFINITY;
    for (int k = 0; k < sim->observers; k++)
        next = mill_least(next, sim->thread ? mill_sim_thread_next(sim->thread, k)
                                            : sim->observer[k]->next);
    return next;
}

/* Carries out all events before local time `limit`, or until the budget is 0. */
static void take_events(struct mill_sim *sim, double limit, uint64_t *budget,
                        const volatile sig_atomic_t *stop)
{
    double t;
    int32_t i;
    for (; sim->status == MILL_OK && *budget > 0; --*budget) {
        i = mill_calendar_next(sim->schedule->calendar, &t);
        if (i < 0 || t >= limit)
            return;
        if (stop && *stop)
            sim->status = MILL_STOPPED;
        else if (sim->paranoid)
            mill_sim_paranoid_before(sim, i, t);
        if (sim->status != MILL_OK)
            return;
        /* rounding may put an event slightly before the last one, but time must not go backwards */
        sim->now = mill_greatest(t, sim->now);
        if (sim->world->balls >= LARGE)
            mill_schedule_ahead(sim->schedule);
        happen(sim, i);
        watch_time(sim, i, t);
        if (sim->paranoid && sim->status == MILL_OK)
            mill_sim_paranoid_after(sim, i);
    }
}

enum mill_status mill_sim_run(struct mill_sim *sim, double until, uint64_t budget,
                              const volatile sig_atomic_t *stop, struct mill_error *error)
{
    assert(until == until);
    sim->error = error;
    sim->status = MILL_OK;
    if (sim->thread)
        mill_sim_thread_begin(sim->thread, sim->observer, sim->observers);
    while (budget > 0) {
        const double sample = next_sample(sim);
        const double halt = mill_least(sample, until) - sim->world->base;
        const double limit = mill_least(mill_greatest(halt, sim->now), MILL_WORLD_EPOCH);
        take_events(sim, limit, &budget, stop);
        if (sim->status != MILL_OK || budget == 0)
            break;
        sim->now = limit;
        if (halt > MILL_WORLD_EPOCH) {
            /* the observers read the motions, which mill_sim_epoch_end() changes */
            if (sim->thread)
                sim->status = mill_sim_thread_wait(sim->thread, sim->error);
            if (sim->status != MILL_OK)
                break;
            mill_sim_epoch_end(sim);
        } else if (sample <= until) {
            take_samples(sim, sample);
        } else {
            if (sim->paranoid)
                mill_sim_paranoid_account(sim);
            break;
        }
        if (sim->status == MILL_OK && stop && *stop)
            sim->status = MILL_STOPPED;
        if (sim->status != MILL_OK)
            break;
    }
    if (sim->thread)
        goes_on(sim, mill_sim_thread_end(sim->thread, error));
    sim->error = NULL;
    return sim->status;
}
