/* Soft spheres, step by step. A step is one of velocity Verlet: half of the change of velocity, the
 * change of place, the forces, the other half. Forces need velocities at the end of the step; these
 * are predicted with the accelerations of its beginning, so that the error of the dashpots, too, is
 * of second order.
 *
 * The parts of the mill do each phase of a step on any number of threads. A part sends the forces
 * on balls of other parts, which add what they got in the order of the parts. */
#include "engine/soft.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- phases ---- */

/* Half of the change of velocity, then the change of place */
static void drift(struct mill_soft *s, struct mill_soft_part *p)
{
    const struct mill_world *w = s->world;
    const double half = 0.5 * s->dt, period = w->container.period;
    const struct mill_soft_load none = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    double fastest = 0.0;
    for (int32_t i = p->first; i < p->last; i++) {
        struct mill_soft_ball *b = &s->ball[i];
        struct mill_soft_place *at = &s->place[i];
        b->v = vec3_axpy(b->v, half, b->gain);
        b->w = vec3_axpy(b->w, half, b->turn);
        at->r = vec3_axpy(at->r, s->dt, b->v);
        const double x = period > 0.0 ? mill_world_image(w, at->r.x) : at->r.x;
        if (x != at->r.x) { /* it is at the other end now: all surfaces can be near */
            at->r.x = x;
            s->look[i] = 0.0;
            memset(s->due + (size_t)i * (size_t)w->shapes, 0, (size_t)w->shapes * sizeof *s->due);
        }
        s->load[i] = none;
        fastest = mill_greatest(fastest, vec3_dot(b->v, b->v));
        s->course[i].v = vec3_axpy(b->v, half, b->gain);
        s->course[i].w = vec3_axpy(b->w, half, b->turn);
        s->course[i].touched = b->touched;
    }
    p->fastest = fastest;
}

/* The other half of the change of velocity, by the new forces */
static void kick(struct mill_soft *s, struct mill_soft_part *p)
{
    const struct mill_world *w = s->world;
    const double half = 0.5 * s->dt;
    for (int from = 0; from <= p->number; from++) {
        struct mill_memory_list *sent = &s->part[from].sent[p->number];
        const struct mill_soft_sent *each = sent->item;
        for (; sent->count > 0; sent->count--, each++) {
            struct mill_soft_load *to = &s->load[each->slot];
            to->force = vec3_add(to->force, each->load.force);
            to->torque = vec3_add(to->torque, each->load.torque);
        }
        sent = &s->part[from].kick[p->number];
        for (each = sent->item; sent->count > 0; sent->count--, each++) {
            struct mill_soft_ball *b = &s->ball[each->slot];
            b->v = vec3_axpy(b->v, b->per_mass, each->load.force);
            b->w = vec3_axpy(b->w, b->per_inertia, each->load.torque);
        }
    }
    for (int32_t i = p->first; i < p->last; i++) {
        struct mill_soft_ball *b = &s->ball[i];
        const struct mill_soft_load *load = &s->load[i];
        b->touched = vec3_dot(load->force, load->force) > 0.0;
        b->gain = vec3_axpy(w->g, b->per_mass, load->force);
        b->turn = vec3_scale(load->torque, b->per_inertia);
        b->v = vec3_axpy(b->v, half, b->gain);
        b->w = vec3_axpy(b->w, half, b->turn);
    }
}

static void kick_and_drift(struct mill_soft *s, struct mill_soft_part *p)
{
    kick(s, p);
    drift(s, p);
}

/* ---- one step ---- */

/* [s] local time of a step in this epoch; the last one ends exactly with the epoch */
static double time_of(const struct mill_soft *s, int64_t step)
{
    return step == s->steps ? MILL_WORLD_EPOCH : (double)step * s->dt;
}

/* The balls have moved: poses and lists of now. false: out of memory */
static bool arrive(struct mill_soft *s)
{
    const struct mill_world *w = s->world;
    s->step++;
    s->path += s->dt * sqrt(s->fastest);
    s->passed += s->dt;
    for (int k = 0; k < w->motions; k++)
        s->pose[k] = mill_motion_pose(w->motion[k], time_of(s, s->step));
    return s->path - s->listed < 0.5 * s->skin || mill_soft_list(s);
}

/* ---- the world at a step ---- */

/* [J] in the springs of a part, in an order that does not depend on its pool */
static double stored_in(const struct mill_soft *s, const struct mill_soft_part *p)
{
    const struct mill_soft_near *near = p->near.item;
    double energy = 0.0;
    for (size_t n = 0; n < p->near.count; n++)
        energy += near[n].touch < 0 ? 0.0 : mill_soft_touch(p, near[n].touch)->energy;
    for (int32_t i = p->first; i < p->last; i++)
        for (int32_t k = s->ball[i].walls; k >= 0; k = mill_soft_touch(p, k)->next)
            energy += mill_soft_touch(p, k)->energy;
    return energy;
}

/* Balls and account of the world, for all that look at it between two steps */
static void publish(struct mill_soft *s)
{
    struct mill_world *w = s->world;
    struct mill_account *a = &w->account;
    a->work = a->work_gross = a->dissipation_gross = a->elastic = 0.0;
    memset(a->motion, 0, sizeof a->motion);
    memset(a->dissipation, 0, sizeof a->dissipation);
    memset(a->dissipation_normal, 0, sizeof a->dissipation_normal);
    w->soft_facts.contacts = w->soft_facts.crowded = 0;
    for (int k = 0; k < s->parts; k++) {
        const struct mill_soft_part *p = &s->part[k];
        mill_world_add_account(a, &p->tally.account);
        w->soft_facts.contacts += p->tally.contacts;
        w->soft_facts.crowded += p->tally.crowded;
        w->soft_facts.force = mill_greatest(w->soft_facts.force, p->tally.force);
        w->counts.largest_overlap = mill_greatest(w->counts.largest_overlap, p->tally.deepest);
        a->elastic += stored_in(s, p);
    }
    for (int32_t i = 0; i < w->balls; i++) {
        const struct mill_soft_ball *b = &s->ball[i];
        const int32_t number = s->course[i].number;
        struct mill_ball *to = &w->ball[number];
        to->r = s->place[i].r;
        to->v = b->v;
        to->t = time_of(s, s->step);
        w->spin[number] = b->w;
    }
}

void mill_soft_run(struct mill_sim *sim, double limit, uint64_t *budget)
{
    struct mill_soft *s = sim->soft;
    bool good = true;
    mill_soft_share(s);
    bool goes_on = *budget > 0 && time_of(s, s->step + 1) <= limit;
    if (goes_on)
        mill_soft_do(s, drift);
    while (goes_on) {
        good = arrive(s) && mill_soft_do(s, mill_soft_press);
        sim->now = time_of(s, s->step);
        s->world->soft_facts.steps++;
        --*budget;
        if (mill_sim_stops(sim) && sim->status == MILL_OK)
            sim->status = MILL_STOPPED;
        goes_on = good && sim->status == MILL_OK && *budget > 0 && time_of(s, s->step + 1) <= limit;
        s->teller = sim; /* what this tells an observer can end the run after the next step */
        mill_soft_do(s, goes_on ? kick_and_drift : kick);
        s->teller = NULL;
    }
    publish(s);
    if (!good)
        sim->status = mill_error_set(sim->error, MILL_FAILED, "out of memory for the soft spheres");
    else if (s->world->counts.largest_overlap > s->thinnest)
        sim->status = mill_error_set(
            sim->error, MILL_FAILED,
            "balls are pressed in by %.2g m, more than a radius: they need a larger soft.modulus",
            s->world->counts.largest_overlap);
}

/* ---- from the start to the end ---- */

/* Sets the balls of the slots, from the world and the balls' accelerations [by ball] */
static void seat(struct mill_soft *s, const struct mill_soft_ball *from)
{
    const struct mill_world *w = s->world;
    memset(s->look, 0, (size_t)w->balls * sizeof *s->look); /* slots have other balls now */
    memset(s->due, 0, (size_t)w->balls * (size_t)w->shapes * sizeof *s->due);
    for (int32_t i = 0; i < w->balls; i++) {
        const struct mill_species *kind = &w->species[w->ball[i].species];
        const int32_t k = s->slot[i];
        s->ball[k] = from[i];
        s->ball[k].v = w->ball[i].v;
        s->ball[k].w = w->spin[i];
        s->ball[k].per_mass = 1.0 / kind->mass;
        s->ball[k].per_inertia = 1.0 / kind->inertia;
        s->course[k].number = i;
        s->course[k].species = w->ball[i].species;
        s->place[k] = (struct mill_soft_place){w->ball[i].r, kind->radius};
    }
}

/* Puts contacts into the pools of the balls that now have them, and makes the lists. */
static bool pool(struct mill_soft *s, const struct mill_soft_touch *touch, size_t count)
{
    mill_soft_forget(s);
    for (size_t n = 0; n < count; n++) {
        const int32_t slot = mill_soft_owner(s, &touch[n]);
        struct mill_soft_part *p = s->part;
        while (slot >= p->last)
            p++;
        const int32_t at = mill_soft_touch_get(p);
        if (at < 0)
            return false;
        *mill_soft_touch(p, at) = touch[n];
        if (touch[n].b < 0)
            mill_soft_touch_link(p, &s->ball[slot], at);
    }
    return mill_soft_list(s);
}

/* All contacts, in the order of the pools, into an array. NULL: out of memory */
static struct mill_soft_touch *collect(const struct mill_soft *s, size_t *count)
{
    size_t most = 0;
    for (int k = 0; k < s->parts; k++)
        most += s->part[k].touch.count;
    struct mill_soft_touch *all = malloc((most + 1) * sizeof *all);
    *count = 0;
    for (int k = 0; k < s->parts && all; k++)
        for (size_t n = 0; n < s->part[k].touch.count; n++) {
            const struct mill_soft_touch *t = mill_soft_touch(&s->part[k], (int32_t)n);
            if (t->a >= 0)
                all[(*count)++] = *t;
        }
    return all;
}

/* New slots for all balls, and the contacts to where they belong */
static bool resettle(struct mill_soft *s, const struct mill_soft_touch *touch, size_t count)
{
    for (int32_t i = 0; i < s->world->balls; i++)
        s->spare[s->course[i].number] = s->ball[i];
    mill_soft_sort(s);
    seat(s, s->spare);
    return pool(s, touch, count);
}

bool mill_soft_restart(struct mill_soft *s)
{
    size_t count;
    struct mill_soft_touch *touch = collect(s, &count);
    for (size_t n = 0; touch && n < count; n++)
        touch[n].begin -= MILL_WORLD_EPOCH;
    s->step = 0;
    for (int32_t i = 0; i < s->world->balls; i++)
        s->world->ball[i].t = 0.0;
    const bool good = touch && resettle(s, touch, count);
    free(touch);
    return good;
}

/* Bounds of the speeds of surfaces, where balls can be */
static void find_speeds(struct mill_soft *s)
{
    const struct mill_world *w = s->world;
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_motion *m = w->shape[k]->motion;
        if (m && !w->shape[k]->fixed)
            s->speed[k] = mill_motion_fastest(m, &w->container.places);
        s->swiftest = mill_greatest(s->swiftest, s->speed[k]);
    }
}

struct mill_soft *mill_soft_create(struct mill_world *w)
{
    const size_t n = (size_t)w->balls, shapes = (size_t)w->shapes;
    const size_t all = (size_t)w->species_count * (size_t)w->species_count * (size_t)w->kinds.count;
    struct mill_soft *s = calloc(1, sizeof *s);
    if (!s)
        return NULL;
    s->world = w;
    s->spring = w->soft.on ? mill_soft_springs(w, &s->memory)
                           : mill_memory_take(&s->memory, all, sizeof *s->spring);
    s->place = mill_memory_take(&s->memory, n, sizeof *s->place);
    s->load = mill_memory_take(&s->memory, n, sizeof *s->load);
    s->course = mill_memory_take(&s->memory, n, sizeof *s->course);
    s->ball = mill_memory_take(&s->memory, n, sizeof *s->ball);
    s->spare = mill_memory_take(&s->memory, n, sizeof *s->spare);
    s->due = mill_memory_take(&s->memory, n * shapes, sizeof *s->due);
    s->look = mill_memory_take(&s->memory, n, sizeof *s->look);
    s->speed = mill_memory_take(&s->memory, shapes, sizeof *s->speed);
    s->pose = mill_memory_take(&s->memory, (size_t)w->motions, sizeof *s->pose);
    bool good = s->spring && mill_soft_lists_create(s);
    s->threads = 1;
    if (good) {
        if (w->soft.on) {
            s->steps =
                (int64_t)ceil(MILL_WORLD_EPOCH * (double)w->soft.steps / w->soft_facts.duration);
            s->dt = w->soft_facts.step = MILL_WORLD_EPOCH / (double)s->steps;
        }
        for (int32_t i = 0; i < w->balls; i++) {
            s->course[i].number = i;
            s->ball[i].gain = w->g;
        }
        find_speeds(s);
        good = resettle(s, NULL, 0);
    }
    if (good)
        return s;
    mill_soft_free(s);
    return NULL;
}

void mill_soft_free(struct mill_soft *s)
{
    if (!s)
        return;
    mill_soft_use_threads(s, 1);
    mill_soft_lists_free(s);
    mill_memory_drop(&s->memory);
    free(s);
}

/* ---- the state ---- */

static bool is_ball(const struct mill_soft *s, int32_t i)
{
    return i >= 0 && i < s->world->balls;
}

/* Contacts are in the lists of neighbours, which hold no balls that are far apart. */
static bool are_near(const struct mill_soft *s, const struct mill_soft_touch *t)
{
    const struct mill_ball *a = &s->world->ball[t->a], *b = &s->world->ball[t->b];
    const double sum = s->world->species[a->species].radius + s->world->species[b->species].radius;
    vec3 d = vec3_sub(b->r, a->r);
    d.x = mill_world_image(s->world, d.x);
    return vec3_dot(d, d) < sum * sum;
}

static bool is_finite(const void *numbers, size_t count)
{
    bool good = true;
    for (size_t k = 0; k < count; k++)
        good = good && isfinite(((const double *)numbers)[k]);
    return good;
}

/* Can the loaded numbers be right? */
static bool is_sane(const struct mill_soft *s, const struct mill_soft_touch *touch, size_t count)
{
    bool good = s->step >= 0 && s->step < s->steps;
    for (int32_t i = 0; i < s->world->balls; i++)
        s->order[i].ball = 0;
    for (int32_t i = 0; i < s->world->balls && good; i++)
        good = is_ball(s, s->slot[i]) && s->order[s->slot[i]].ball++ == 0 &&
               is_finite(&s->world->ball[i].r, 3) && is_finite(&s->world->ball[i].v, 3) &&
               is_finite(&s->world->spin[i], 3) && is_finite(&s->spare[i].gain, 6);
    for (size_t n = 0; n < count && good; n++) {
        const struct mill_soft_touch *t = &touch[n];
        good =
            is_finite(&t->begin, offsetof(struct mill_soft_touch, flags) / sizeof t->begin - 2) &&
            is_ball(s, t->a) &&
            (is_ball(s, t->b) ? t->a < t->b && are_near(s, t) : t->b == MILL_NOBODY) &&
            (t->b >= 0 || (t->shape >= 0 && t->shape < s->world->shapes));
    }
    return good;
}

void mill_soft_state(struct mill_soft *s, struct mill_state *state)
{
    struct mill_world *w = s->world;
    const size_t n = (size_t)w->balls;
    size_t count = 0;
    struct mill_soft_touch *touch = collect(s, &count);
    uint64_t told = count;
    mill_state_structs(state, "contacts", sizeof told, 1, &told);
    if (state->loads && state->status == MILL_OK) {
        free(touch);
        count = told < SIZE_MAX / sizeof *touch / 2 ? (size_t)told : 0;
        touch = malloc((count + 1) * sizeof *touch);
    }
    if (!touch)
        mill_state_refuse(state, "out of memory for the contacts");
    else
        mill_state_structs(state, "touch", sizeof *touch, count, touch);
    mill_state_field(state, "slot", MILL_FIELD_I32, n, s->slot);
    mill_state_structs(state, "step", sizeof s->step, 1, &s->step);
    mill_state_structs(state, "facts", sizeof w->soft_facts, 1, &w->soft_facts);
    for (int32_t i = 0; i < w->balls && !state->loads; i++)
        s->spare[s->course[i].number] = s->ball[i];
    mill_state_structs(state, "soft_ball", sizeof *s->spare, n, s->spare);
    for (int k = 0; k < s->parts; k++) {
        char name[32];
        snprintf(name, sizeof name, "part%d", k);
        mill_state_structs(state, name, sizeof s->part[k].tally, 1, &s->part[k].tally);
    }
    if (state->loads && state->status == MILL_OK && !is_sane(s, touch, count))
        mill_state_refuse(state, "the saved contacts are damaged");
    if (state->loads && state->status == MILL_OK) {
        seat(s, s->spare);
        if (!pool(s, touch, count))
            mill_state_refuse(state, "out of memory for the contacts");
    }
    free(touch);
}
