/* The run of another program that computes soft spheres. It gives the state of all balls several
 * times in each contact; the contacts are found as our own, with the same lists and shapes.
 *
 * At the first sample of a contact the equation of the damped spring gives, from overlap and
 * closing speed, speed and time of the impact. Sums over samples give the losses. */
#include "engine/soft.h"

#include <math.h>
#include <string.h>

enum { ROUNDS = 400 }; /* of moving balls apart */
enum { ROW = 10 };     /* numbers of a ball in a sample */
#define CLOSED 1e-7    /* of the largest radius: smaller overlaps count as none */
#define MOST 1e12      /* upper limit of places, speeds and spins */

void mill_soft_watch_springs(struct mill_soft *s, double interval, const double shear[2],
                             const double (*spring)[2])
{
    const struct mill_world *w = s->world;
    const size_t species = (size_t)w->species_count, pairs = species * species;
    for (size_t k = 0; k < pairs * (size_t)w->kinds.count; k++) {
        const double a = w->species[k % pairs / species].mass, b = w->species[k % species].mass;
        const double mass = k < pairs ? a * b / (a + b) : b;
        const double root = sqrt(mass * spring[k][0]), dashpot = spring[k][1] / root;
        const struct mill_soft_damping damping = {dashpot, shear[0], shear[1] * dashpot, 0.0};
        const double friction = w->law[k / pairs].friction;
        s->spring[k] =
            (struct mill_soft_spring){mass, spring[k][0], root, friction, damping, NULL, NULL};
    }
    mill_soft_forget(s);
    s->watch->deepest = 0.0;
    s->watch->interval = interval;
    s->watch->now = NAN;
}

/* ---- a contact ---- */

/* The slip [m/s] just before the contact: by the velocities of the sample before, no overlap */
static vec3 slip_before(const struct mill_soft *s, const struct mill_soft_touch *t, vec3 n)
{
    const int32_t a = s->slot[t->a];
    const vec3 *own = s->watch->before[a], arm = vec3_scale(n, s->place[a].radius);
    vec3 rate = vec3_add(own[0], vec3_cross(own[1], arm));
    if (t->b >= 0) {
        const int32_t b = s->slot[t->b];
        const vec3 *its = s->watch->before[b];
        const vec3 back = vec3_scale(n, s->place[b].radius);
        rate = vec3_sub(rate, vec3_sub(its[0], vec3_cross(its[1], back)));
    } else if (s->world->shape[t->shape]->motion) {
        const struct mill_pose *pose = &s->pose[s->world->shape[t->shape]->motion->number];
        rate = vec3_sub(rate, mill_pose_velocity(pose, vec3_add(s->place[a].r, arm)));
    }
    return vec3_axpy(rate, -vec3_dot(rate, n), n);
}

/* The contact has begun since the last sample. Returns its age [s]. */
static double begin(struct mill_soft *s, struct mill_soft_part *p, struct mill_soft_touch *t,
                    const struct mill_soft_meeting *m, double closing, int kind)
{
    const struct mill_world *w = s->world;
    struct mill_soft_watch *watch = s->watch;
    const struct mill_soft_spring *spring = m->spring;
    /* [1/s] the damped oscillation: overlap = speed / frequency exp(-decay age) sin(phase) */
    const double decay = 0.5 * spring->damping.normal * spring->root / spring->mass;
    const double frequency = sqrt(spring->stiff / spring->mass - decay * decay);
    const double phase = atan2(1.0, (closing / m->depth + decay) / frequency);
    const double age = phase / frequency;
    const double speed = m->depth * frequency * exp(decay * age) / sin(phase);
    const double e = w->law[kind].restitution;
    const double lost = 0.5 * (1.0 - e * e) * spring->mass * speed * speed;
    /* it began after the last sample; rounding and third bodies can give an earlier time */
    const double time = mill_greatest(watch->now - age, watch->last);
    const struct mill_shape *shape = t->b < 0 ? w->shape[t->shape] : NULL;
    struct mill_sim_entry *entry = mill_memory_add(&p->told);
    watch->isolated[kind] += lost;
    t->begin = time;
    if (!entry) {
        p->failed = true;
        return age;
    }
    *entry = (struct mill_sim_entry){
        .reduced_mass = spring->mass,
        .impact = {.time = time,
                   .kind = kind,
                   .ball = t->a,
                   .partner = shape ? shape->number : t->b,
                   .position = vec3_axpy(m->point, time - watch->now, watch->velocity),
                   .normal = vec3_scale(m->normal, -1.0),
                   .normal_speed = speed,
                   .tangential_speed = vec3_norm(slip_before(s, t, m->normal)),
                   .dissipation_normal = lost}};
    return age;
}

/* [W] into friction: the tangential spring, whose force is limited by Coulomb's law, and the
 * dashpot, which acts while the contact sticks, as in LIGGGHTS */
static double rub(const struct mill_soft_watch *watch, const struct mill_soft_meeting *m,
                  struct mill_soft_touch *t, double pressing, vec3 along, double age)
{
    const struct mill_soft_spring *spring = m->spring;
    const double limit = spring->friction * fabs(pressing);
    const double rigid = spring->damping.spring * spring->stiff;
    vec3 shift = m->begins ? vec3_scale(along, mill_least(age, watch->interval))
                           : vec3_axpy(t->spring, 0.5 * watch->interval, vec3_add(t->creep, along));
    shift = vec3_axpy(shift, -vec3_dot(shift, m->normal), m->normal);
    const double size = rigid * vec3_norm(shift);
    const bool slides = size > limit;
    if (slides)
        shift = vec3_scale(shift, limit / size);
    t->spring = shift;
    t->creep = along;
    vec3 drag = vec3_scale(shift, rigid);
    if (!slides)
        drag = vec3_axpy(drag, spring->damping.tangential * spring->root, along);
    return vec3_dot(drag, along);
}

static void touch(struct mill_soft *s, struct mill_soft_part *p, const struct mill_soft_meeting *m,
                  struct mill_soft_touch *t)
{
    struct mill_soft_watch *watch = s->watch;
    const struct mill_soft_spring *spring = m->spring;
    const int kind = t->b < 0 ? s->world->shape[t->shape]->kind : MILL_BALL_BALL;
    const double closing = vec3_dot(m->rate, m->normal);
    const double dashpot = spring->damping.normal * spring->root;
    watch->normal[kind] += watch->interval * dashpot * closing * closing;
    watch->elastic += 0.5 * spring->stiff * m->depth * m->depth;
    watch->deepest = mill_greatest(watch->deepest, m->depth);
    const double age = m->begins ? begin(s, p, t, m, closing, kind) : 0.0;
    t->normal = m->normal;
    if (t->b < 0 && spring->friction > 0.0)
        watch->rubbed[kind] +=
            watch->interval * rub(watch, m, t, spring->stiff * m->depth + dashpot * closing,
                                  vec3_axpy(m->rate, -closing, m->normal), age);
}

/* ---- the work on a container that moves ---- */

/* [W] of a force, and of its torque about the origin, on what has this pose */
static double power_of(const struct mill_motion *m, double t, vec3 force, vec3 torque)
{
    const struct mill_pose pose = mill_motion_pose(m, t);
    return vec3_dot(force, mill_pose_velocity(&pose, vec3_make(0.0, 0.0, 0.0))) +
           vec3_dot(torque, pose.angular_velocity);
}

/* The walls and gravity alone change momentum and angular momentum of the balls. So the force of
 * all walls is known without the contacts; its power is the work of what moves all walls. */
static void balance(struct mill_soft *s)
{
    const struct mill_world *w = s->world;
    struct mill_soft_watch *watch = s->watch;
    const vec3 momentum = watch->momentum, middle = watch->middle, whirl = watch->whirl;
    const double span = watch->now - watch->last, half = watch->now - 0.5 * span - w->base;
    double mass = 0.0;
    if (!w->container.motion)
        return;
    watch->momentum = watch->middle = watch->whirl = vec3_make(0.0, 0.0, 0.0);
    for (int32_t i = 0; i < w->balls; i++) {
        const struct mill_soft_ball *b = &s->ball[i];
        const vec3 at = vec3_scale(s->place[i].r, 1.0 / b->per_mass);
        watch->momentum = vec3_axpy(watch->momentum, 1.0 / b->per_mass, b->v);
        watch->middle = vec3_add(watch->middle, at);
        const vec3 whirls = vec3_axpy(vec3_cross(at, b->v), 1.0 / b->per_inertia, b->w);
        watch->whirl = vec3_add(watch->whirl, whirls);
        mass += 1.0 / b->per_mass;
    }
    if (!(span > 0.0)) /* the first sample with these springs */
        return;
    const vec3 force = vec3_axpy(vec3_sub(watch->momentum, momentum), -mass * span, w->g);
    const vec3 moment = vec3_cross(vec3_scale(vec3_add(middle, watch->middle), 0.5 * span), w->g);
    const vec3 torque = vec3_sub(vec3_sub(watch->whirl, whirl), moment);
    double left = power_of(w->container.motion, half, force, torque);
    for (const struct mill_motion *m = w->container.motion; m; m = m->on) {
        const double rest = m->on ? power_of(m->on, half, force, torque) : 0.0;
        watch->work[m->number] += left - rest;
        left = rest;
    }
}

/* ---- a sample ---- */

static vec3 outside(const struct mill_soft_frame *f, const double p[3])
{
    return vec3_axpy(vec3_axpy(vec3_scale(f->x, p[0]), p[1], f->y), p[2], f->z);
}

/* Sets the balls; returns the longest way since the last sample [m], or -1 with `error` */
static double seat(struct mill_soft *s, const struct mill_soft_frame *f, const double (*row)[ROW],
                   struct mill_error *error)
{
    const struct mill_world *w = s->world;
    struct mill_soft_watch *watch = s->watch;
    double farthest = 0.0;
    for (int32_t n = 0; n < w->balls; n++) {
        const double *is = row[n];
        bool good = is[0] >= 1.0 && is[0] <= w->balls;
        for (int k = 1; k < ROW; k++)
            good = good && fabs(is[k]) <= MOST;
        const int32_t k = good ? s->slot[(int32_t)is[0] - 1] : -1;
        if (k < 0 || watch->seen[k] == watch->samples) {
            mill_error_set(error, MILL_FAILED,
                           "row %ld: expected finite numbers, and each ball from 1 to %ld once",
                           (long)n, (long)w->balls);
            return -1.0;
        }
        struct mill_soft_ball *ball = &s->ball[k];
        const vec3 r = vec3_add(f->origin, outside(f, is + 1));
        vec3 gone = vec3_sub(r, s->place[k].r);
        gone.x = mill_world_image(w, gone.x);
        farthest = mill_greatest(farthest, vec3_dot(gone, gone));
        watch->seen[k] = watch->samples;
        watch->before[k][0] = ball->v;
        watch->before[k][1] = ball->w;
        s->place[k].r = r;
        ball->v = vec3_add(f->velocity, outside(f, is + 4));
        ball->w = outside(f, is + 7);
        s->course[k].v = ball->v;
        s->course[k].w = ball->w;
    }
    return sqrt(farthest);
}

enum mill_status mill_soft_watch_sample(struct mill_soft *s, double time,
                                        const struct mill_soft_frame *frame,
                                        const double (*row)[ROW], struct mill_error *error)
{
    const struct mill_world *w = s->world;
    struct mill_soft_watch *watch = s->watch;
    bool good = true;
    if (!(watch->interval > 0.0))
        return mill_error_set(error, MILL_FAILED, "expected the record 'springs' before");
    if (!(fabs(time) <= MOST) || time < watch->now)
        return mill_error_set(error, MILL_FAILED, "its time is %.9g s, that of the last one %.9g",
                              time, watch->now);
    watch->samples++;
    const double gone = seat(s, frame, row, error);
    if (gone < 0.0)
        return MILL_FAILED;
    const bool first = isnan(watch->now);
    watch->last = first ? time : watch->now;
    watch->now = time;
    watch->velocity = frame->velocity;
    for (int32_t i = 0; first && i < w->balls; i++) {
        watch->before[i][0] = s->ball[i].v;
        watch->before[i][1] = s->ball[i].w;
    }
    balance(s);
    s->path += gone;
    s->passed += time - watch->last;
    for (int k = 0; k < w->motions; k++)
        s->pose[k] = mill_motion_pose(w->motion[k], time - w->base);
    if (s->path - s->listed >= 0.5 * s->skin)
        good = mill_soft_list(s);
    watch->elastic = 0.0;
    good = mill_soft_do(s, mill_soft_press) && good;
    return good ? MILL_OK : mill_error_set(error, MILL_FAILED, "out of memory for the contacts");
}

/* ---- balls moved apart ---- */

/* Collects how far two move apart, and a bit more: half an overlap each, or all at a surface */
static void part(struct mill_soft *s, struct mill_soft_part *p, const struct mill_soft_meeting *m,
                 struct mill_soft_touch *t)
{
    const double far = m->depth + 0.5 * CLOSED * s->thickest, share = t->b < 0 ? 1.0 : 0.5;
    (void)p;
    for (int k = 0; k < (t->b < 0 ? 1 : 2); k++) {
        vec3 *shift = &s->load[s->slot[k ? t->b : t->a]].force;
        *shift = vec3_axpy(*shift, (k ? share : -share) * far, m->normal);
    }
    s->watch->deepest = mill_greatest(s->watch->deepest, m->depth);
}

double mill_soft_watch_part(struct mill_soft *s)
{
    const size_t n = (size_t)s->world->balls;
    const double closed = CLOSED * s->thickest;
    double left = INFINITY;
    bool good = true;
    s->watch->touch = part;
    for (int round = 0; round < ROUNDS && good && left > closed; round++) {
        memset(s->load, 0, n * sizeof *s->load);
        memset(s->look, 0, n * sizeof *s->look); /* they may be anywhere */
        memset(s->due, 0, n * (size_t)s->world->shapes * sizeof *s->due);
        s->watch->deepest = 0.0;
        good = mill_soft_list(s) && mill_soft_do(s, mill_soft_press);
        left = s->watch->deepest;
        for (int32_t i = 0; i < s->world->balls && left > closed; i++)
            s->place[i].r = vec3_add(s->place[i].r, s->load[i].force);
    }
    s->watch->touch = touch;
    s->watch->deepest = 0.0;
    mill_soft_forget(s);
    return !good ? (double)NAN : left > closed ? left : 0.0;
}

void mill_soft_watch_state(const struct mill_soft *s, double *state)
{
    const size_t n = 3 * (size_t)s->world->balls;
    for (int32_t i = 0; i < s->world->balls; i++) {
        const struct mill_soft_ball *b = &s->ball[i];
        const vec3 is[3] = {s->place[i].r, b->v, b->w};
        for (size_t k = 0; k < 3; k++)
            memcpy(state + k * n + 3 * (size_t)s->course[i].number, &is[k], sizeof is[k]);
    }
}

/* ---- from the start ---- */

struct mill_soft *mill_soft_watch_create(struct mill_world *w)
{
    const size_t n = (size_t)w->balls;
    struct mill_soft *s = mill_soft_create(w);
    if (!s)
        return NULL;
    s->watch = mill_memory_take(&s->memory, 1, sizeof *s->watch);
    if (s->watch) {
        s->watch->touch = touch;
        s->watch->last = s->watch->now = NAN;
        s->watch->before = mill_memory_take(&s->memory, n, sizeof *s->watch->before);
        s->watch->seen = mill_memory_take(&s->memory, n, sizeof *s->watch->seen);
    }
    if (!s->memory.failed)
        return s;
    mill_soft_free(s);
    return NULL;
}
