/* The forces of contacts. Spring and dashpot push along the normal, but never pull. Along the
 * surface spring and dashpot act together, at most with Coulomb's share of the normal force.
 *
 * A contact begins within a step, and its force ends within one. The impulse in these steps is that
 * of the part of the step for which there was a force; so the restitution does not depend on when
 * in a step an impact begins, and elastic impacts keep their energy. */
#include "engine/soft.h"

#include "geometry/shape.h"

#include <math.h>

#define SAME 0.7 /* cosine of normals: a contact of a body with many facets goes on at the next */

/* What it pushes with */
struct push {
    double stiff, root, damped; /* [N/m], [kg/s]: spring, its root, the normal dashpot, now */
    double closing, pressing;   /* [m/s], [N] along the normal */
    vec3 along, drag;           /* [m/s], [N] across it */
    double strained;            /* [J] in the tangential spring */
    double rest;                /* [s] in which it ends after this step; the step: it goes on */
    vec3 force;                 /* [N] on the partner; the opposite on a */
    vec3 kick;                  /* [N s] more than that, in this step */
    vec3 impulse;               /* [N s] of the whole step */
    double work, work_normal;   /* [J] into the contact in this step */
};

/* A contact begins: `age` [s] ago. */
static void begin(const struct mill_soft *s, const struct mill_soft_meeting *m,
                  const struct push *u, struct mill_soft_touch *t, double age)
{
    t->spring = vec3_scale(u->along, age);
    t->damping = mill_soft_damping_at(m->spring, u->closing);
    t->speed = mill_greatest(u->closing, 0.0);
    t->slip = u->along;
    t->point = m->point;
    t->facing = vec3_scale(m->normal, -1.0);
    t->begin = (double)s->step * s->dt - age;
}

/* The force along the surface: spring and dashpot, at most Coulomb's */
static void rub(const struct mill_soft *s, const struct mill_soft_meeting *m, struct push *u,
                struct mill_soft_touch *t)
{
    const double rigid = t->damping.spring * u->stiff, damped = t->damping.tangential * u->root;
    const double limit = m->spring->friction * u->pressing;
    vec3 shift = t->spring;
    if (!m->begins)
        shift = vec3_axpy(shift, 0.5 * s->dt, vec3_add(t->creep, u->along));
    shift = vec3_axpy(shift, -vec3_dot(shift, m->normal), m->normal);
    u->drag = vec3_axpy(vec3_scale(shift, rigid), damped, u->along);
    const double size = vec3_norm(u->drag);
    t->flags &= ~(int64_t)MILL_SOFT_SLIDES;
    if (size > limit) {
        u->drag = vec3_scale(u->drag, limit / size);
        /* a spring strained the other way would take from the friction of the next steps */
        const vec3 left = vec3_axpy(u->drag, -damped, u->along);
        shift = vec3_scale(left, rigid > 0.0 && vec3_dot(left, u->drag) > 0.0 ? 1.0 / rigid : 0.0);
        t->flags |= MILL_SOFT_SLIDES;
    }
    t->spring = shift;
    u->strained = 0.5 * rigid * vec3_dot(shift, shift);
}

/* The first step of a contact: it begins with the force of the dashpots, and within the step. */
static void start(const struct mill_soft *s, const struct mill_soft_meeting *m, struct push *u,
                  const struct mill_soft_touch *t, double age)
{
    const bool damped = !s->world->soft.hertz && u->closing > 0.0;
    const double first = damped ? u->damped * u->closing : 0.0, slip = vec3_norm(u->along);
    const double drag = mill_least(damped ? t->damping.tangential * u->root * slip : 0.0,
                                   m->spring->friction * first);
    const double part = slip > 0.0 ? drag / slip : 0.0;
    const vec3 before = vec3_axpy(vec3_scale(m->normal, first), part, u->along);
    const vec3 within = vec3_scale(vec3_add(before, u->force), 0.5 * age);
    u->kick = vec3_axpy(vec3_add(u->kick, within), -0.5 * s->dt, u->force);
    u->impulse = vec3_axpy(within, 0.5 * u->rest, u->force);
    u->work_normal = 0.5 * age * (first * u->closing + t->power_normal);
    u->work = 0.5 * age * (first * u->closing + drag * slip + t->power);
}

/* Adds what dashpots and sliding took: work into the contact less the change of its energy. */
static void book(struct mill_soft_part *p, int kind, struct mill_soft_touch *t,
                 const struct push *u, double energy_normal)
{
    struct mill_account *a = &p->tally.account;
    const double lost_normal = u->work_normal - (energy_normal - t->energy_normal);
    const double lost = u->work - (energy_normal + u->strained - t->energy);
    a->dissipation[kind] += lost;
    a->dissipation_normal[kind] += lost_normal;
    a->dissipation_gross += fabs(lost);
    t->lost += lost;
    t->lost_normal += lost_normal;
    t->energy = energy_normal + u->strained;
    t->energy_normal = energy_normal;
    t->impulse = vec3_sub(t->impulse, u->impulse);
}

static struct push press(const struct mill_soft *s, const struct mill_soft_meeting *m,
                         struct mill_soft_touch *t, struct mill_soft_part *p, int kind)
{
    const bool hertz = s->world->soft.hertz != 0;
    const double dt = s->dt, mass = m->spring->mass, grown = hertz ? sqrt(m->depth) : 1.0;
    struct push u = {.stiff = m->spring->stiff * grown,
                     .root = m->spring->root * (hertz ? sqrt(grown) : 1.0),
                     .closing = vec3_dot(m->rate, m->normal)};
    /* [s] since it began, if it began in this step */
    const double age = u.closing * dt > m->depth ? m->depth / u.closing : dt;
    u.along = vec3_axpy(m->rate, -u.closing, m->normal);
    if (m->begins)
        begin(s, m, &u, t, age);
    u.damped = t->damping.normal * u.root;
    u.pressing = mill_greatest(u.stiff * m->depth + u.damped * u.closing, 0.0);
    if (m->spring->friction > 0.0)
        rub(s, m, &u, t);
    u.force = vec3_axpy(u.drag, u.pressing, m->normal);
    /* [N/s] of the force; the spring pushes back, and the dashpot follows the acceleration */
    const double slope = (hertz ? 1.5 : 1.0) * u.stiff * u.closing - u.damped * u.pressing / mass;
    u.rest = u.pressing + slope * dt < 0.0 ? u.pressing / -slope : dt;
    u.kick = vec3_scale(u.force, 0.5 * (u.rest - dt));
    u.impulse = vec3_scale(u.force, 0.5 * (dt + u.rest));
    /* the velocities were predicted without the change of the forces, which the power feels */
    const double late = 0.5 * dt / mass;
    const vec3 slower = vec3_axpy(u.along, -3.5 * late, vec3_sub(u.drag, t->drag));
    const double normal = u.pressing * (u.closing - late * (u.pressing - t->pressing));
    const double power = normal + vec3_dot(u.drag, slower);
    u.work_normal = 0.5 * (t->rest * t->power_normal + dt * normal);
    u.work = 0.5 * (t->rest * t->power + dt * power);
    t->power = power;
    t->power_normal = normal;
    if (m->begins)
        start(s, m, &u, t, age);
    book(p, kind, t, &u, (hertz ? 0.4 : 0.5) * u.stiff * m->depth * m->depth);
    t->rest = u.rest;
    t->pressing = u.pressing;
    t->drag = u.drag;
    t->creep = u.along;
    t->normal = m->normal;
    p->tally.deepest = mill_greatest(p->tally.deepest, m->depth);
    p->tally.force = mill_greatest(p->tally.force, u.pressing);
    return u;
}

/* The rest of the contact's energy is lost, and it is told as an impact. */
static void end(struct mill_soft *s, struct mill_soft_part *p, int32_t touch)
{
    const struct mill_world *w = s->world;
    struct mill_soft_touch *t = mill_soft_touch(p, touch);
    if (s->watch) {
        mill_soft_touch_put(p, touch); /* it was told when it began */
        return;
    }
    const struct mill_shape *shape = t->b < 0 ? w->shape[t->shape] : NULL;
    const int kind = shape ? shape->kind : MILL_BALL_BALL;
    const double lost = 0.5 * t->rest * t->power + t->energy;
    const double lost_normal = 0.5 * t->rest * t->power_normal + t->energy_normal;
    struct mill_sim_entry *entry = mill_memory_add(&p->told);
    p->tally.account.dissipation[kind] += lost;
    p->tally.account.dissipation_normal[kind] += lost_normal;
    p->tally.account.dissipation_gross += fabs(lost);
    if (!entry) {
        p->failed = true;
        return;
    }
    const int16_t one = w->ball[t->a].species, other = shape ? -1 : w->ball[t->b].species;
    const double mass = w->species[one].mass, met = shape ? 0.0 : w->species[other].mass;
    *entry = (struct mill_sim_entry){.reduced_mass = shape ? mass : mass * met / (mass + met),
                                     .impact = {.time = w->base + (double)s->step * s->dt,
                                                .kind = kind,
                                                .ball = t->a,
                                                .partner = shape ? shape->number : t->b,
                                                .species = one,
                                                .partner_species = other,
                                                .position = t->point,
                                                .normal = t->facing,
                                                .impulse = t->impulse,
                                                .slip = t->slip,
                                                .normal_speed = t->speed,
                                                .tangential_speed = vec3_norm(t->slip),
                                                .dissipation = t->lost + lost,
                                                .dissipation_normal = t->lost_normal + lost_normal,
                                                .surface = shape ? t->shape : -1,
                                                .place = t->place,
                                                .facing = t->inward,
                                                .slid = (t->flags & MILL_SOFT_SLIDES) != 0}};
    mill_soft_touch_put(p, touch);
}

/* The contact between these, or a new one. NULL: out of memory */
static struct mill_soft_touch *hold(struct mill_soft_part *p, int32_t *touch, int32_t a, int32_t b,
                                    bool crowded)
{
    if (*touch >= 0)
        return mill_soft_touch(p, *touch);
    *touch = mill_soft_touch_get(p);
    if (*touch < 0) {
        p->failed = true;
        return NULL;
    }
    struct mill_soft_touch *t = mill_soft_touch(p, *touch);
    *t = (struct mill_soft_touch){
        .a = a, .b = b, .shape = -1, .next = -1, .flags = crowded ? MILL_SOFT_CROWDED : 0};
    p->tally.contacts++;
    p->tally.crowded += crowded;
    return t;
}

/* ---- two balls ---- */

/* A force or an impulse at this arm, to the ball's part */
static void send(struct mill_soft *s, struct mill_soft_part *p, bool kicks, int32_t slot,
                 vec3 force, vec3 arm)
{
    int to = p->number;
    while (slot >= s->part[to].last)
        to++;
    struct mill_soft_sent *sent = mill_memory_add(kicks ? &p->kick[to] : &p->sent[to]);
    if (sent)
        *sent = (struct mill_soft_sent){slot, {force, vec3_cross(arm, force)}};
    else
        p->failed = true;
}

/* The push on a ball, `sign` times, at this arm from its centre */
static void load(struct mill_soft *s, struct mill_soft_part *p, int32_t slot,
                 const struct push *push, bool kicks, double sign, vec3 arm)
{
    const vec3 force = vec3_scale(push->force, sign);
    if (slot < p->last) {
        struct mill_soft_load *of = &s->load[slot];
        of->force = vec3_add(of->force, force);
        of->torque = vec3_add(of->torque, vec3_cross(arm, force));
    } else {
        send(s, p, false, slot, force, arm);
    }
    if (kicks)
        send(s, p, true, slot, vec3_scale(push->kick, sign), arm);
}

static void press_pair(struct mill_soft *s, struct mill_soft_part *p, int32_t i,
                       struct mill_soft_near *near, vec3 d, double distance)
{
    const struct mill_world *w = s->world;
    const int32_t j = near->slot;
    /* the contact is from a to b */
    const bool turned = s->course[i].number > s->course[j].number;
    const int32_t a = turned ? j : i, b = turned ? i : j;
    const struct mill_soft_course *ca = &s->course[a], *cb = &s->course[b];
    const vec3 n = vec3_scale(d, (turned ? -1.0 : 1.0) / distance);
    const double sum = s->place[a].radius + s->place[b].radius, half = 0.5 * (sum - distance);
    const double arm_a = s->place[a].radius - half, arm_b = s->place[b].radius - half;
    const vec3 spin = vec3_axpy(vec3_scale(ca->w, arm_a), arm_b, cb->w);
    struct mill_soft_meeting m = {.spring =
                                      &s->spring[ca->species * w->species_count + cb->species],
                                  .normal = n,
                                  .rate = vec3_add(vec3_sub(ca->v, cb->v), vec3_cross(spin, n)),
                                  .depth = sum - distance,
                                  .begins = near->touch < 0};
    if (m.begins) {
        m.point = vec3_axpy(s->place[a].r, arm_a, n);
        m.point.x = mill_world_image(w, m.point.x);
    }
    struct mill_soft_touch *t =
        hold(p, &near->touch, ca->number, cb->number, ca->touched || cb->touched);
    if (t && s->watch)
        s->watch->touch(s, p, &m, t);
    if (!t || s->watch)
        return;
    const struct push push = press(s, &m, t, p, MILL_BALL_BALL);
    const bool kicks = m.begins || (push.rest < s->dt && push.pressing > 0.0);
    load(s, p, a, &push, kicks, -1.0, vec3_scale(n, arm_a));
    load(s, p, b, &push, kicks, 1.0, vec3_scale(n, -arm_b));
}

static void press_pairs(struct mill_soft *s, struct mill_soft_part *p, int32_t i, int32_t last)
{
    const struct mill_world *w = s->world;
    const bool periodic = w->container.period > 0.0;
    const struct mill_soft_place own = s->place[i];
    struct mill_soft_near *near = p->near.item;
    for (int32_t k = s->begin[i]; k < last; k++) {
        const struct mill_soft_place *other = &s->place[near[k].slot];
        const double sum = own.radius + other->radius;
        vec3 d = vec3_sub(other->r, own.r);
        if (periodic)
            d.x = mill_world_image(w, d.x);
        const double square = vec3_dot(d, d);
        if (square < sum * sum) {
            press_pair(s, p, i, &near[k], d, sqrt(square));
        } else if (near[k].touch >= 0) {
            end(s, p, near[k].touch);
            near[k].touch = -1;
        }
    }
}

/* ---- a ball and a surface ---- */

/* The ball's contact with this shape with a similar normal, not seen in this step; or -1 */
static int32_t find(const struct mill_soft_part *p, const struct mill_soft_ball *ball,
                    int32_t shape, vec3 normal)
{
    double nearest = SAME;
    int32_t best = -1;
    for (int32_t k = ball->walls; k >= 0; k = mill_soft_touch(p, k)->next) {
        const struct mill_soft_touch *t = mill_soft_touch(p, k);
        const double cosine = vec3_dot(t->normal, normal);
        if (t->shape == shape && !(t->flags & MILL_SOFT_SEEN) && cosine > nearest) {
            nearest = cosine;
            best = k;
        }
    }
    return best;
}

static void press_place(struct mill_soft *s, struct mill_soft_part *p, int32_t i, int32_t number,
                        const struct mill_pose *pose, const struct mill_contact *c)
{
    const struct mill_world *w = s->world;
    const struct mill_shape *shape = w->shape[number];
    struct mill_soft_ball *ball = &s->ball[i];
    const vec3 n = vec3_scale(c->normal, -1.0), reach = vec3_scale(n, s->place[i].radius + c->gap);
    const struct mill_soft_course *course = &s->course[i];
    const size_t pairs = (size_t)w->species_count * (size_t)w->species_count;
    int32_t touch = find(p, ball, number, n);
    struct mill_soft_meeting m = {
        .spring = &s->spring[(size_t)shape->kind * pairs + (size_t)course->species],
        .normal = n,
        .point = c->point,
        .rate = vec3_add(vec3_sub(course->v, c->velocity), vec3_cross(course->w, reach)),
        .depth = -c->gap,
        .begins = touch < 0};
    struct mill_soft_touch *t = hold(p, &touch, course->number, MILL_NOBODY, course->touched);
    if (!t)
        return;
    if (m.begins) {
        t->shape = number;
        t->place = mill_pose_in(pose, c->point);
        t->inward = mill_pose_turn_in(pose, c->normal);
    }
    if (s->watch) {
        s->watch->touch(s, p, &m, t);
    } else {
        const struct push push = press(s, &m, t, p, shape->kind);
        load(s, p, i, &push, m.begins || push.rest < s->dt, -1.0, reach);
        if (shape->motion)
            mill_sim_book_work(&p->tally.account, shape->motion, s->pose, 0.0,
                               vec3_scale(push.impulse, -1.0), c->point, c->velocity);
    }
    t->flags |= MILL_SOFT_SEEN;
    if (m.begins)
        mill_soft_touch_link(p, ball, touch);
}

/* Ends the contacts with surfaces that are over. */
static void sweep(struct mill_soft *s, struct mill_soft_part *p, struct mill_soft_ball *ball)
{
    int32_t *link = &ball->walls;
    while (*link >= 0) {
        const int32_t touch = *link;
        struct mill_soft_touch *t = mill_soft_touch(p, touch);
        if (t->flags & MILL_SOFT_SEEN) {
            t->flags &= ~(int64_t)MILL_SOFT_SEEN;
            link = &t->next;
        } else {
            *link = t->next;
            end(s, p, touch);
        }
    }
}

static void press_walls(struct mill_soft *s, struct mill_soft_part *p, int32_t i)
{
    const struct mill_world *w = s->world;
    struct mill_soft_ball *ball = &s->ball[i];
    double *due = &s->due[(size_t)i * (size_t)w->shapes], next = INFINITY;
    for (int32_t k = 0; k < w->shapes; k++) {
        const struct mill_shape *shape = w->shape[k];
        const double clock = s->path + s->speed[k] * s->passed;
        if (clock >= due[k]) {
            struct mill_contact c[MILL_SOFT_PLACES];
            const struct mill_pose *pose =
                shape->motion ? &s->pose[shape->motion->number] : &mill_pose_still;
            const int places = mill_shape_places(shape, s->place[i].r, s->place[i].radius, pose, c,
                                                 MILL_SOFT_PLACES);
            for (int at = 0; at < places && c[at].gap < 0.0; at++)
                press_place(s, p, i, k, pose, &c[at]);
            due[k] = clock + mill_greatest(c[0].gap, 0.0);
        }
        /* on the common clock, which is never slower */
        next = mill_least(next, due[k] - clock);
    }
    s->look[i] = s->path + s->swiftest * s->passed + next;
    if (ball->walls >= 0)
        sweep(s, p, ball);
}

void mill_soft_press(struct mill_soft *s, struct mill_soft_part *p)
{
    const double clock = s->path + s->swiftest * s->passed;
    for (int32_t i = p->first; i < p->last; i++) {
        press_pairs(s, p, i, mill_soft_near_end(s, p, i));
        if (clock >= s->look[i])
            press_walls(s, p, i);
    }
}
