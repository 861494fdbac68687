/* Why does the input wait for the next account? A batch of the statistics ends between two
 * accounts, and work and losses up to then are known only when the second has come. */
#include "observe/replay.h"

#include "observe/tally.h"

/* [s] rounding: a state may be farther from a sample by this than the limit */
#define ROUNDING 1e-12

#define FAR 1e6   /* in sizes of the mill: no place in it is as far away */
#define MOST 1e12 /* [m/s], [rad/s], [J] upper limit of speeds and of the loss in an impact */

enum { NUMBERS = 1 << 29 }; /* maximum number of bodies: observe/strikes.h */

void mill_replay_init(struct mill_replay *r, struct mill_world *world,
                      const struct mill_observers *observers, double apart, double end)
{
    *r = (struct mill_replay){.world = world,
                              .kinds = mill_kinds_listed(world),
                              .observers = observers,
                              .apart = apart,
                              .end = end,
                              .at = -INFINITY,
                              .impact_at = -INFINITY,
                              .state_at = -INFINITY};
    r->impacts.list.size = sizeof(struct mill_replay_impact);
    r->states.list.size = (1 + 9 * (size_t)world->balls) * sizeof(double);
    world->account.pinch_work = NAN; /* not known */
}

void mill_replay_free(struct mill_replay *r)
{
    free(r->impacts.list.item);
    free(r->states.list.item);
}

/* ---- waiting data ---- */

/* The first waiting item, or NULL */
static const void *first(const struct mill_replay_queue *q)
{
    return q->begin < q->list.count ? (char *)q->list.item + q->begin * q->list.size : NULL;
}

/* Makes room for another item at the end. NULL: out of memory. */
static void *add_item(struct mill_replay_queue *q)
{
    struct mill_memory_list *l = &q->list;
    if (q->begin > 0 && 2 * q->begin >= l->count) { /* at least half of the list is over */
        l->count -= q->begin;
        memmove(l->item, (char *)l->item + q->begin * l->size, l->count * l->size);
        q->begin = 0;
    }
    return mill_memory_add(l);
}

/* ---- the world at a given time ---- */

/* Begins epochs, as the event loop does: a sample at the end of one belongs to it, no impact. */
static void reach(struct mill_replay *r, double time, bool impact)
{
    struct mill_world *w = r->world;
    time = fmin(time, r->end); /* a wrong time, later than the run, must not take long */
    while (time - w->base > MILL_WORLD_EPOCH || (impact && time - w->base >= MILL_WORLD_EPOCH)) {
        mill_world_restart(w);
        for (int32_t i = 0; r->at > (double)-INFINITY && i < w->balls; i++)
            w->ball[i].t = r->at - w->base;
    }
}

static vec3 three(const double *from)
{
    return vec3_make(from[0], from[1], from[2]);
}

/* Moves the balls to the state that is nearest to this time. */
static void place_balls(struct mill_replay *r, double time)
{
    struct mill_world *w = r->world;
    const size_t n = 3 * (size_t)w->balls;
    const double *state;
    while ((state = first(&r->states)) && fabs(state[0] - time) <= fabs(r->at - time)) {
        r->at = *state++;
        for (int32_t i = 0; i < w->balls; i++, state += 3) {
            w->ball[i].r = three(state);
            w->ball[i].v = three(state + n);
            w->ball[i].t = r->at - w->base;
            w->spin[i] = three(state + 2 * n);
        }
        r->states.begin++;
    }
}

size_t mill_replay_length(const struct mill_world *w)
{
    return 2 * (size_t)(1 + w->motions + w->kinds.count);
}

/* Sets works and losses to their values at this time. Impacts are counted as they come. */
static void set_account(struct mill_replay *r, double time)
{
    struct mill_world *w = r->world;
    struct mill_account *a = &w->account;
    const double step = r->last[0] - r->before[0];
    const double share = step > 0 ? (time - r->before[0]) / step : 1.0;
    double now[MILL_REPLAY_ACCOUNT] = {0};
    const double *motion = now + 2, *loss = motion + 2 * w->motions;
    for (size_t i = 0; i < mill_replay_length(w); i++)
        now[i] = share == 1.0 ? r->last[i] : r->before[i] + share * (r->last[i] - r->before[i]);
    a->elastic = now[1];
    a->work = 0.0;
    for (int k = 0; k < w->motions; k++) {
        a->motion[k].work = motion[2 * k];
        a->motion[k].impulse = motion[2 * k + 1];
        a->work += a->motion[k].work;
    }
    for (int n = 0; n < r->kinds.count; n++) {
        const int k = r->kinds.kind[n];
        a->dissipation[k] = loss[2 * k];
        a->dissipation_normal[k] = loss[2 * k + 1];
    }
}

/* ---- calling the observers ---- */

static enum mill_status tell_impact(struct mill_replay *r, const struct mill_replay_impact *from,
                                    struct mill_error *error)
{
    struct mill_world *w = r->world;
    struct mill_account *a = &w->account;
    const int32_t one = w->ball[from->ball].species;
    const int32_t other = from->kind == MILL_BALL_BALL ? w->ball[from->partner].species : -1;
    const double mass = w->species[one].mass, met = other < 0 ? 0.0 : w->species[other].mass;
    const double reduced = other < 0 ? mass : mass * met / (mass + met);
    const struct mill_impact impact = {.time = from->time,
                                       .kind = from->kind,
                                       .ball = from->ball,
                                       .partner = from->partner,
                                       .species = (int16_t)one,
                                       .partner_species = (int16_t)other,
                                       .position = three(from->position),
                                       .normal = three(from->normal),
                                       .surface = -1, /* not known */
                                       .normal_speed = from->normal_speed,
                                       .tangential_speed = from->tangential_speed,
                                       .dissipation = from->dissipation,
                                       .dissipation_normal = from->dissipation};
    enum mill_status status = MILL_OK;
    reach(r, from->time, true);
    a->collisions[from->kind]++;
    for (int k = 0; k < MILL_WORLD_FAST; k++)
        a->fast[from->kind][k] += from->normal_speed >= mill_world_fast[k];
    a->incident += 0.5 * reduced * from->normal_speed * from->normal_speed;
    for (int k = 0; status == MILL_OK && k < r->observers->count; k++) {
        struct mill_observer *o = r->observers->each[k];
        status = o->type->impact ? o->type->impact(o, &impact, error) : MILL_OK;
    }
    return status;
}

/* Only maps and other observers need the balls; all else in the statistics uses the account. */
static bool wants_balls(const struct mill_observer *o, double time)
{
    const struct mill_tally *t = (const struct mill_tally *)o;
    return o->type != &mill_tally_type.type || (t->at.open && mill_tally_snapshot(t, 0) <= time);
}

/* Moves everything to this time, and takes the samples that are due then. */
static enum mill_status take_samples(struct mill_replay *r, double due, struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    reach(r, due, false);
    place_balls(r, due);
    set_account(r, due);
    for (int k = 0; status == MILL_OK && k < r->observers->count; k++) {
        struct mill_observer *o = r->observers->each[k];
        if (o->next > due || !o->type->sample)
            continue;
        if (wants_balls(o, due) && !(fabs(r->at - due) <= r->apart + ROUNDING))
            return mill_error_set(error, MILL_FAILED,
                                  "there is no state of the balls within %g s of t = %.9g s, where "
                                  "%s want one",
                                  r->apart, due, o->type->name);
        status = o->type->sample(o, r->world, due - r->world->base, error);
    }
    return status;
}

/* Processes everything up to this time, including samples at it, but only the impacts before it */
static enum mill_status go_on(struct mill_replay *r, double until, struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    double next;
    do {
        next = INFINITY;
        for (int k = 0; k < r->observers->count; k++)
            next = r->observers->each[k]->type->sample ? fmin(next, r->observers->each[k]->next)
                                                       : next;
        const double due = fmin(next, until);
        const struct mill_replay_impact *impact;
        while (status == MILL_OK && (impact = first(&r->impacts)) && impact->time < due) {
            status = tell_impact(r, impact, error);
            r->impacts.begin++;
        }
        if (status == MILL_OK)
            status = take_samples(r, due, error);
    } while (status == MILL_OK && next <= until);
    r->now = status == MILL_OK ? until : r->now;
    return status;
}

/* ---- input ---- */

/* Number of the first value that is NaN or larger than `most`; `count`: there is none */
static size_t find_wrong(size_t count, const double *values, double most)
{
    size_t i = 0;
    while (i < count && fabs(values[i]) <= most)
        i++;
    return i;
}

/* [m] upper limit of a place's coordinates */
static double farthest(const struct mill_world *world)
{
    return FAR * fmin(world->drum_radius, world->drum_length);
}

enum mill_status mill_replay_state(struct mill_replay *r, double time, const double *values,
                                   struct mill_error *error)
{
    const size_t places = 3 * (size_t)r->world->balls, count = 3 * places;
    size_t wrong = find_wrong(places, values, farthest(r->world));
    wrong += wrong < places ? 0 : find_wrong(count - places, values + places, MOST);
    if (!(time >= r->state_at) || !isfinite(time))
        return mill_error_set(error, MILL_FAILED, "its time is %.9g s, that of the one before %.9g",
                              time, r->state_at);
    if (wrong < count)
        return mill_error_set(error, MILL_FAILED, "ball %zu: its %s: got %g", wrong % places / 3,
                              wrong < places       ? "place"
                              : wrong < 2 * places ? "velocity"
                                                   : "angular velocity",
                              values[wrong]);
    char *to = add_item(&r->states);
    if (!to)
        return mill_error_set(error, MILL_FAILED, "out of memory for the states between accounts");
    memcpy(to, &time, sizeof time);
    memcpy(to + sizeof time, values, count * sizeof *values);
    r->state_at = time;
    return MILL_OK;
}

static enum mill_status check_impact(const struct mill_replay *r, double before,
                                     const struct mill_replay_impact *i, struct mill_error *why)
{
    const struct mill_world *w = r->world;
    const int kind = i->kind, ball = i->ball, partner = i->partner;
    const bool pair = kind == MILL_BALL_BALL;
    const double *at = i->position;
    if (kind < 0 || kind >= w->kinds.count)
        return mill_error_set(why, MILL_FAILED, "kind %d, expected 0 to %d", kind,
                              w->kinds.count - 1);
    if (r->kinds.number[kind] < 0)
        return mill_error_set(why, MILL_FAILED, "kind %d, and the mill has no %s", kind,
                              w->kinds.name[kind]);
    if (ball < 0 || ball >= w->balls || (pair && (partner < 0 || partner >= w->balls)))
        return mill_error_set(why, MILL_FAILED, "ball %d and partner %d, expected 0 to %d", ball,
                              partner, (int)w->balls - 1);
    if ((pair && partner == ball) || partner < -1 || partner >= NUMBERS)
        return mill_error_set(why, MILL_FAILED, "ball %d and partner %d", ball, partner);
    const double some[] = {i->normal_speed, i->tangential_speed, i->dissipation,
                           i->normal[0],    i->normal[1],        i->normal[2]};
    if (!isfinite(i->time) || find_wrong(6, some, MOST) < 6)
        return mill_error_set(why, MILL_FAILED, "expected numbers");
    if (find_wrong(3, at, farthest(w)) < 3)
        return mill_error_set(why, MILL_FAILED, "at %g %g %g m: is that in the mill?", at[0], at[1],
                              at[2]);
    if (i->time < before)
        return mill_error_set(why, MILL_FAILED, "its time is %.9g s, after %s of %.9g s", i->time,
                              "an impact or account", before);
    return MILL_OK;
}

enum mill_status mill_replay_impacts(struct mill_replay *r, size_t count,
                                     const struct mill_replay_impact *impact,
                                     struct mill_error *error)
{
    double before = fmax(r->impact_at, r->accounts > 0 ? r->now : (double)-INFINITY);
    struct mill_error why;
    for (size_t i = 0; i < count; before = impact[i++].time)
        if (check_impact(r, before, &impact[i], &why) != MILL_OK)
            return mill_error_set(error, MILL_FAILED, "impact %zu: %s", i, why.text);
    r->impact_at = before;
    for (size_t i = 0; i < count; i++) {
        struct mill_replay_impact *to = add_item(&r->impacts);
        if (!to)
            return mill_error_set(error, MILL_FAILED,
                                  "out of memory for the impacts between accounts");
        *to = impact[i];
    }
    return MILL_OK;
}

enum mill_status mill_replay_account(struct mill_replay *r, const double *account,
                                     struct mill_error *error)
{
    struct mill_world *w = r->world;
    const size_t count = mill_replay_length(w);
    for (size_t i = 0; i < count; i++)
        if (isinf(account[i]))
            return mill_error_set(error, MILL_FAILED,
                                  "expected finite numbers, or NaN for what is not known");
    if (!(account[0] >= r->now))
        return mill_error_set(error, MILL_FAILED, "its time is %.9g s, that of the one before %.9g",
                              account[0], r->now);
    memcpy(r->before, r->accounts > 0 ? r->last : account, count * sizeof *account);
    memcpy(r->last, account, count * sizeof *account);
    r->accounts++;
    for (int k = 0; k < w->motions; k++)
        w->account.work_gross += fabs(r->last[2 + 2 * k] - r->before[2 + 2 * k]);
    return go_on(r, account[0], error);
}

enum mill_status mill_replay_end(struct mill_replay *r, double time, struct mill_error *error)
{
    if (!(time >= r->now) || !isfinite(time))
        return mill_error_set(error, MILL_FAILED,
                              "its time is %.9g s, that of the last account %.9g", time, r->now);
    return r->accounts > 0 ? go_on(r, time, error) : MILL_OK;
}
