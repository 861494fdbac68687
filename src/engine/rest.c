/* Which balls rest, and when does a ball in flight meet one? Relative to it, the flight is a
 * parabola: the contact is the root of a quartic, found by the certified search of poly.h. */
#include "engine/rest.h"

#include "engine/slabs.h"
#include "geometry/shape.h"

#define CALM 4.0   /* rebound floors */
#define SWIFT 10.0 /* rebound floors: maximum speed of each body that moves at all */
#define LIFT 0.1   /* [radii] a calm ball cannot hop out of the pit between its neighbours */
/* [sqrt(radius / g)] minimum duration of rest. A ball on top of another one falls off sooner. */
#define WHILE 6.0

/* Does all that moves move fast enough? Slower shapes would push too gently to wake others. */
static bool is_swift(const struct mill_schedule *q)
{
    const struct mill_world *w = q->world;
    bool swift = true;
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_motion *motion = w->shape[k]->motion;
        const double speed = motion ? q->lately[motion->number].drift : 0.0;
        swift = swift && (speed == 0.0 ||
                          (speed > SWIFT * w->rebound_floor && motion != w->container.motion));
    }
    return swift;
}

bool mill_rest_create(struct mill_schedule *q, double widening)
{
    struct mill_rest *p = &q->rest;
    const struct mill_world *w = q->world;
    const double g = q->pull, calm = CALM * w->rebound_floor;
    p->widening = widening;
    p->hop = 0.5 * calm * calm / g;
    if (w->container.period > 0.0 || !(g > 0.0) || !(calm > 0.0) ||
        !(p->hop <= LIFT * q->thinnest) || !is_swift(q))
        return true;
    p->calm = calm;
    p->up = vec3_scale(w->g, -1.0 / g);
    p->epochs = (int32_t)fmax(2.0, ceil(WHILE * sqrt(q->widest / g) / MILL_WORLD_EPOCH));
    p->place = mill_memory_take(&q->memory, (size_t)w->balls, sizeof *p->place);
    p->calm_epochs = mill_memory_take(&q->memory, (size_t)w->balls, sizeof *p->calm_epochs);
    for (int32_t i = 0; p->place && i < w->balls; i++)
        p->place[i] = w->ball[i].r;
    return !q->memory.failed;
}

bool mill_rest_lie_down(struct mill_schedule *q, int32_t i)
{
    const int32_t species = q->world->ball[i].species;
    mill_grids_remove(&q->grids, i, species);
    return (q->rest.grids.classes > 0 ||
            mill_grids_init(&q->rest.grids, q->world, q->rest.widening)) &&
           mill_grids_insert(&q->rest.grids, i, species, q->cells->cell[i]);
}

bool mill_rest_sleep(struct mill_schedule *q, int32_t i)
{
    struct mill_ball *ball = &q->world->ball[i];
    struct mill_plan *plan = &q->plan[i];
    ball->v = q->world->spin[i] = vec3_make(0.0, 0.0, 0.0);
    ball->t = HUGE_VAL;
    ball->contacts++; /* plans with its flight are stale */
    q->world->counts.asleep++;
    plan->pair_t = plan->shape_t = plan->exit_t = INFINITY;
    plan->partner = MILL_NOBODY;
    plan->shape = MILL_NOBODY;
    plan->next = MILL_NEXT_SURFACE;
    mill_schedule_enter(q, i, INFINITY);
    return mill_rest_lie_down(q, i);
}

bool mill_rest_wake(struct mill_schedule *q, int32_t i, double now)
{
    struct mill_ball *ball = &q->world->ball[i];
    ball->t = now;
    ball->contacts++; /* plans with it at rest are stale */
    q->world->counts.asleep--;
    q->world->counts.sleep += now;
    q->rest.calm_epochs[i] = 0;
    mill_grids_remove(&q->rest.grids, i, ball->species);
    return mill_grids_insert(&q->grids, i, ball->species, q->cells->cell[i]);
}

int32_t mill_rest_near(const struct mill_rest *p, int32_t species, int32_t cell, int32_t *near)
{
    return p->grids.classes > 0 ? mill_grids_gather(&p->grids, species, cell, near) : 0;
}

/* [s] until a flight from d with velocity u, relative to a ball at rest, is `sum` [m] from it */
static double meet(vec3 d, vec3 u, vec3 g, double sum, double most, struct mill_poly_counts *counts)
{
    const double p[5] = {
        sum * sum - vec3_dot(d, d),         /* rises when the gap closes */
        -2.0 * vec3_dot(d, u),              /* */
        -(vec3_dot(u, u) + vec3_dot(d, g)), /* */
        -vec3_dot(u, g),                    /* */
        -0.25 * vec3_dot(g, g),
    };
    return mill_poly_first_rise(p, most, false, counts);
}

bool mill_rest_holds(const struct mill_schedule *q, int32_t species, vec3 lower,
                     int32_t upper_species, vec3 upper)
{
    const double friction = q->world->law[MILL_BALL_BALL].friction;
    const double sum = q->radius[species] + q->radius[upper_species];
    const vec3 d = vec3_sub(upper, lower);
    const double distance = vec3_norm(d);
    return distance - sum < 2.0 * mill_rest_room(&q->rest, 0.5 * sum) &&
           vec3_dot(d, q->rest.up) * sqrt(1.0 + friction * friction) >= -friction * distance;
}

/* [s] in which ball i can have left its place, or a little more */
static double leaving(const struct mill_schedule *q, int32_t i)
{
    const struct mill_ball *ball = &q->world->ball[i];
    const double room = mill_rest_room(&q->rest, q->radius[ball->species]);
    const double gone = vec3_norm(vec3_sub(ball->r, q->rest.place[i])), v = vec3_norm(ball->v);
    const double left = mill_greatest(1.1 * room - gone, 0.1 * room);
    return 2.0 * left / (v + sqrt(v * v + 2.0 * q->pull * left));
}

void mill_rest_plan(struct mill_schedule *q, int32_t i, double now)
{
    struct mill_world *w = q->world;
    struct mill_plan *plan = &q->plan[i];
    const struct mill_ball *ball = &w->ball[i];
    const double until = mill_least(mill_least(plan->pair_t, q->horizon), plan->exit_t);
    const double window = until - now; /* the same for all, whatever their order */
    const double far = window * (vec3_norm(ball->v) + 0.5 * window * q->pull);
    const int32_t n = mill_rest_near(&q->rest, ball->species, q->cells->cell[i], q->pairs->near);
    struct mill_pair found = {INFINITY, MILL_NOBODY};
    bool holds = false;
    for (int32_t k = 0; k < n; k++) {
        const int32_t j = q->pairs->near[k];
        holds = holds || mill_rest_holds(q, ball->species, q->rest.place[i], w->ball[j].species,
                                         w->ball[j].r);
        const double sum = q->radius[ball->species] + q->radius[w->ball[j].species];
        const vec3 d = vec3_sub(ball->r, w->ball[j].r);
        const double within = (sum + far) * (1.0 + 1e-9);
        if (vec3_dot(d, d) > within * within)
            continue;
        const double dt = meet(d, ball->v, w->g, sum, window, &w->counts.quartics);
        if (dt < found.dt || (dt == found.dt && j < found.partner))
            found = (struct mill_pair){dt, j};
    }
    w->counts.pair_tests += (uint64_t)n;
    if (found.partner != MILL_NOBODY) {
        plan->pair_t = now + found.dt;
        plan->partner = found.partner;
        plan->partner_contacts = w->ball[found.partner].contacts;
    }
    const double left = holds ? now + leaving(q, i) : (double)INFINITY;
    if (left < mill_least(plan->pair_t, plan->exit_t)) {
        plan->shape_t = left;
        plan->shape = 0; /* any: no contact is due then */
        plan->next = MILL_NEXT_SEARCH;
    }
}
