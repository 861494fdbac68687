/* Springs and dashpots that give single impacts the restitution and the tangential restitution of
 * the deck. An impact ends when its force does: no contact attracts (T. Schwager & T. Poeschel,
 * Granular Matter 9 (2007) 465). The damping is found by integrating single impacts, without a
 * dimension: mass, spring and speed are 1, and the tangential reduced mass is 2/7. */
#include "engine/soft.h"

#include "base/elementary.h"
#include "geometry/body.h"

#include <math.h>

#define POISSON 0.3
#define PACE 0.004      /* of the integration */
#define FALL 0.3        /* below the surfaces' speed in all mills that lift their balls well */
#define ROUGH 0.01      /* below this tangential restitution the damping is that of this one */
enum { HALVINGS = 40 }; /* of an interval in which a damping is searched */

/* Depth, its rate, and the tangential spring with its rate */
struct motion {
    double depth, rate, shift, slip;
};

/* The spring grows as the depth to the power of a half, or not at all; *root: its square root */
static double spring_of(double depth, bool hertz, double *root)
{
    const double spring = hertz ? sqrt(depth > 0.0 ? depth : 0.0) : 1.0;
    *root = hertz ? sqrt(spring) : 1.0;
    return spring;
}

static double force_of(const struct motion *m, const struct mill_soft_damping *d, bool hertz)
{
    double root;
    const double spring = spring_of(m->depth, hertz, &root);
    return spring * m->depth + d->normal * root * m->rate;
}

static struct motion change(const struct motion *m, const struct mill_soft_damping *d, bool hertz)
{
    double root;
    const double spring = spring_of(m->depth, hertz, &root);
    return (struct motion){m->rate, -spring * m->depth - d->normal * root * m->rate, m->slip,
                           -3.5 * (d->spring * spring * m->shift + d->tangential * root * m->slip)};
}

static struct motion after(const struct motion *m, double dt, const struct motion *c)
{
    return (struct motion){m->depth + dt * c->depth, m->rate + dt * c->rate,
                           m->shift + dt * c->shift, m->slip + dt * c->slip};
}

/* An impact with normal speed 1 and slip 1 (midpoint rule): its end. Sets the duration. */
static struct motion strike(struct mill_soft_damping *d, bool hertz)
{
    struct motion m = {0.0, 1.0, 0.0, 1.0};
    double force = force_of(&m, d, hertz), t = 0.0;
    for (;;) {
        const struct motion now = change(&m, d, hertz), half = after(&m, 0.5 * PACE, &now);
        const struct motion middle = change(&half, d, hertz), next = after(&m, PACE, &middle);
        const double last = force;
        force = force_of(&next, d, hertz);
        if (next.rate < 0.0 && force <= 0.0) {
            const double share = last / (last - force); /* of the step: then there is no force */
            const struct motion whole = {next.depth - m.depth, next.rate - m.rate,
                                         next.shift - m.shift, next.slip - m.slip};
            d->duration = t + share * PACE;
            return after(&m, share, &whole);
        }
        m = next;
        t += PACE;
    }
}

/* The damping that gives single impacts this restitution and this tangential restitution */
static struct mill_soft_damping damp(double restitution, double tangential, bool hertz)
{
    struct mill_soft_damping d = {0.0, 0.0, 0.0, 0.0};
    const double e = mill_greatest(restitution, MILL_SOFT_LEAST);
    double low = 0.0, high = 8.0;
    for (int k = 0; e < 1.0 && k < HALVINGS; k++) {
        d.normal = 0.5 * (low + high);
        const bool more = -strike(&d, hertz).rate > e;
        low = more ? d.normal : low;
        high = more ? high : d.normal;
    }
    strike(&d, hertz);
    /* without a dashpot this spring swings back in the duration of the impact */
    struct mill_soft_damping none = {0.0, 0.0, 0.0, 0.0};
    strike(&none, hertz);
    const double stuck = (2.0 / 7.0) * (none.duration / d.duration) * (none.duration / d.duration);
    const double beta = mill_greatest(tangential, ROUGH);
    low = 0.0;
    high = 40.0;
    d.spring = stuck;
    for (int k = 0; beta < 1.0 && k < HALVINGS; k++) {
        d.tangential = 0.5 * (low + high);
        const bool more = -strike(&d, hertz).slip > beta;
        low = more ? d.tangential : low;
        high = more ? high : d.tangential;
    }
    /* smoother than that: less of both */
    const double most = d.tangential;
    low = 0.0;
    high = 1.0;
    for (int k = 0; tangential < ROUGH && k < HALVINGS; k++) {
        const double share = 0.5 * (low + high);
        d.spring = share * stuck;
        d.tangential = share * most;
        const bool more = -strike(&d, hertz).slip > tangential;
        high = more ? share : high;
        low = more ? low : share;
    }
    strike(&d, hertz);
    return d;
}

static double mix(double a, double b, double share)
{
    return a + share * (b - a);
}

struct mill_soft_damping mill_soft_damping_at(const struct mill_soft_spring *spring, double speed)
{
    if (!spring->fall)
        return spring->damping;
    const double e = mill_impact_restitution(spring->fall, speed);
    const double at = (MILL_SOFT_ROWS - 1) * (e - MILL_SOFT_LEAST) / (1.0 - MILL_SOFT_LEAST);
    const double within = mill_least(mill_greatest(at, 0.0), MILL_SOFT_ROWS - 1.0);
    const int row = (int)mill_least(within, MILL_SOFT_ROWS - 2.0);
    const struct mill_soft_damping *a = &spring->damped[row], *b = a + 1;
    const double share = within - row;
    return (struct mill_soft_damping){
        mix(a->normal, b->normal, share), mix(a->spring, b->spring, share),
        mix(a->tangential, b->tangential, share), mix(a->duration, b->duration, share)};
}

/* [m/s] The fastest surface, or ball at the start; at least FALL of a fall through the mill */
static double find_speed(const struct mill_world *w)
{
    double speed = 0.0;
    for (int k = 0; k < w->shapes; k++) {
        const struct mill_bodied *b = (const struct mill_bodied *)w->shape[k];
        for (int end = -1; end < 2 && w->shape[k]->motion; end += 2) {
            const vec3 point = vec3_axpy(b->is.centre, end * b->hull.half, b->along);
            const struct mill_motion_bounds at = mill_motion_bounds(w->shape[k]->motion, point);
            speed = mill_greatest(speed, at.speed + at.turning * b->hull.radius);
        }
    }
    for (int32_t i = 0; i < w->balls; i++)
        speed = mill_greatest(speed, vec3_norm(w->ball[i].v));
    speed = mill_greatest(speed, FALL * sqrt(4.0 * vec3_norm(w->g) * w->drum_radius));
    return speed > 0.0 ? speed : 1.0;
}

/* A linear spring: an impact at this speed is as deep as with Hertz' law */
static double stiffness(const struct mill_world *w, double mass, double radius)
{
    const double reduced = w->soft.modulus / (2.0 * (1.0 - POISSON * POISSON)), root = sqrt(radius);
    const double speed = w->soft_facts.speed;
    if (w->soft.hertz)
        return 4.0 / 3.0 * reduced * root;
    return 16.0 / 15.0 * root * reduced *
           mill_elementary_root5(15.0 * mass * speed * speed / (16.0 * root * reduced));
}

/* [s] for which the impact lasts; of Hertz' law at the speed of the fastest surface */
static double lasts(const struct mill_world *w, const struct mill_soft_spring *s)
{
    const double inertia = s->mass / s->stiff;
    return s->damping.duration *
           (w->soft.hertz ? mill_elementary_root5(inertia * inertia / w->soft_facts.speed)
                          : sqrt(inertia));
}

/* The damping at the restitutions of the table. NULL: out of memory */
static struct mill_soft_damping *damp_all(const struct mill_law *law, bool hertz,
                                          struct mill_memory_pool *memory)
{
    struct mill_soft_damping *d = mill_memory_take(memory, MILL_SOFT_ROWS, sizeof *d);
    for (int k = 0; d && k < MILL_SOFT_ROWS; k++)
        d[k] = damp(mix(MILL_SOFT_LEAST, 1.0, k / (MILL_SOFT_ROWS - 1.0)), law->tangential, hertz);
    return d;
}

struct mill_soft_spring *mill_soft_springs(struct mill_world *w, struct mill_memory_pool *memory)
{
    const int species = w->species_count;
    const size_t pairs = (size_t)species * (size_t)species, kinds = (size_t)w->kinds.count;
    const bool hertz = w->soft.hertz;
    struct mill_soft_spring *all = mill_memory_take(memory, pairs * kinds, sizeof *all);
    struct mill_law last = {-1.0, 0.0, 0.0};
    struct mill_soft_damping damping = {0.0, 0.0, 0.0, 0.0};
    w->soft_facts.speed = find_speed(w);
    w->soft_facts.duration = INFINITY;
    for (int kind = 0; all && kind < w->kinds.count; kind++) {
        const struct mill_law *law = &w->law[kind];
        const bool falls = w->fall[kind].points > 0;
        if (!mill_world_has(w, kind))
            continue;
        const struct mill_soft_damping *damped = falls ? damp_all(law, hertz, memory) : NULL;
        if (falls && !damped)
            return NULL;
        if (!falls &&
            (law->restitution != last.restitution || law->tangential != last.tangential)) {
            damping = damp(law->restitution, law->tangential, hertz);
            last = *law;
        }
        for (size_t k = 0; k < pairs; k++) {
            const struct mill_species *a = &w->species[k / (size_t)species],
                                      *b = &w->species[k % (size_t)species];
            struct mill_soft_spring *s = &all[(size_t)kind * pairs + k];
            const bool pair = kind == MILL_BALL_BALL;
            const double mass = pair ? a->mass * b->mass / (a->mass + b->mass) : b->mass;
            const double bent = pair ? a->radius * b->radius / (a->radius + b->radius) : b->radius;
            const double stiff = stiffness(w, mass, bent);
            *s = (struct mill_soft_spring){mass,          stiff,   sqrt(mass * stiff),
                                           law->friction, damping, falls ? &w->fall[kind] : NULL,
                                           damped};
            if (falls)
                s->damping = damped[MILL_SOFT_ROWS - 1];
            w->soft_facts.duration = mill_least(w->soft_facts.duration, lasts(w, s));
        }
    }
    return all;
}
