/* What the tests of the shapes share: seeded random numbers, a mill of one shape of every kind, and
 * an independent search for contacts that uses nothing but the gap. */
#ifndef SHAPE_FIXTURE_H
#define SHAPE_FIXTURE_H

#include "geometry/blade.h"
#include "geometry/cylinder.h"
#include "geometry/plate.h"

#include <check.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { DRUM, WALL_0, WALL_1, SHAFT, BLADE, SHAPES };

static const double drum_radius = 0.075, drum_length = 0.12, shaft_radius = 0.015;

/* splitmix64 (Steele, Lea & Flood 2014), uniform in [lo, hi) */
static inline double uniform(uint64_t *seed, double lo, double hi)
{
    uint64_t z = *seed += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    z ^= z >> 31;
    return lo + (hi - lo) * ((double)(z >> 11) * 0x1p-53);
}

static inline double log_uniform(uint64_t *seed, double lo, double hi)
{
    return exp(uniform(seed, log(lo), log(hi)));
}

static inline vec3 direction(uint64_t *seed)
{
    const double z = uniform(seed, -1.0, 1.0), a = uniform(seed, 0.0, 2.0 * PI);
    return vec3_make(z, sqrt(1.0 - z * z) * cos(a), sqrt(1.0 - z * z) * sin(a));
}

struct mill {
    struct mill_deck_blade spec;
    double omega; /* [rad/s] */
    struct mill_shape *shape[SHAPES];
};

static inline struct mill_deck_blade blade_spec(double tip, double width, double thickness,
                                                double pitch)
{
    struct mill_deck_blade spec;
    memset(&spec, 0, sizeof spec);
    spec.tip_radius = tip;
    spec.width = width;
    spec.thickness = thickness;
    spec.pitch = pitch;
    return spec;
}

static inline void mill_build(struct mill *m, const struct mill_deck_blade *spec, double omega)
{
    m->spec = *spec;
    m->omega = omega;
    m->shape[DRUM] = mill_cylinder_drum(drum_radius);
    m->shape[WALL_0] = mill_plate_create(0, drum_length);
    m->shape[WALL_1] = mill_plate_create(1, drum_length);
    m->shape[SHAFT] = mill_cylinder_shaft(shaft_radius, omega);
    m->shape[BLADE] = mill_blade_create(spec, 0, omega, drum_radius);
    for (int k = 0; k < SHAPES; k++)
        ck_assert_ptr_nonnull(m->shape[k]);
}

static inline void mill_demolish(struct mill *m)
{
    for (int k = 0; k < SHAPES; k++)
        m->shape[k]->ops->free(m->shape[k]);
}

/* One ball in flight in that mill */
struct flight {
    struct mill_flight path; /* its heading is made when it is asked for: ask */
    double radius;           /* [m] */
    double turn;             /* [rad] of the rotor at its start */
};

static inline double gap_at(const struct mill *m, int k, const struct flight *f, double t)
{
    const vec3 r = vec3_fly(f->path.r, f->path.v, f->path.g, t);
    return m->shape[k]->ops->gap(m->shape[k], r, f->radius, f->turn + m->omega * t);
}

static inline double least_gap(const struct mill *m, vec3 r, double radius, double turn)
{
    double least = INFINITY;
    for (int k = 0; k < SHAPES; k++)
        least = fmin(least, m->shape[k]->ops->gap(m->shape[k], r, radius, turn));
    return least;
}

/* No gap changes faster than this during the flight [m/s] */
static inline double fastest(const struct mill *m, const struct flight *f, double until)
{
    const double g = vec3_norm(f->path.g), v = vec3_norm(f->path.v) + g * until;
    const double far = vec3_norm(f->path.r) + v * until;
    return v + fabs(m->omega) * far + 1e-12;
}

/* The first time in [0, until) at which the gap is below -tolerance, INFINITY if it never is. Steps
 * of gap/(greatest speed) cannot pass the surface; where the gap is nearly closed they go on by
 * what sinks in by `tolerance` at most. */
static inline double first_below(const struct mill *m, int k, const struct flight *f, double until,
                                 double tolerance)
{
    const double v = fastest(m, f, until);
    double t = 0.0;
    for (long step = 0; t < until; step++) {
        const double d = gap_at(m, k, f, t);
        if (d < -tolerance)
            return t;
        if (step == 100000000)
            ck_abort_msg("the march along shape %d does not end", k);
        t += fmax(fabs(d), tolerance) / v;
    }
    return INFINITY;
}

/* d(gap)/dt by central difference: good to 1e-6 m/s where the gap is smooth */
static inline double gap_rate(const struct mill *m, int k, const struct flight *f, double t)
{
    const double h = 1e-8;
    return (gap_at(m, k, f, t + h) - gap_at(m, k, f, t - h)) / (2.0 * h);
}

/* What shape k says of the flight */
static inline double ask(const struct mill *m, int k, const struct flight *f, double horizon,
                         bool touching)
{
    const struct mill_flight path = mill_shape_flight(f->path.r, f->path.v, f->path.g, f->turn);
    return m->shape[k]->ops->next_contact(m->shape[k], &path, f->radius, f->turn, horizon,
                                          touching);
}

/* The first contact as the loop finds it: a search that gives up early is asked again from there.
 * give_ups may be NULL. */
static inline double first_contact(const struct mill *m, int k, const struct flight *f,
                                   double horizon, bool touching, int *give_ups)
{
    double t = 0.0;
    for (int asked = 0; asked < 1000; asked++) {
        struct flight from = *f;
        from.path.r = vec3_fly(f->path.r, f->path.v, f->path.g, t);
        from.path.v = vec3_axpy(f->path.v, t, f->path.g);
        from.turn = f->turn + m->omega * t;
        const double dt = ask(m, k, &from, horizon - t, touching && asked == 0);
        if (isinf(dt))
            return INFINITY;
        ck_assert(dt == dt);
        ck_assert_double_le(fabs(dt), horizon - t);
        t += fabs(dt);
        if (dt >= 0.0)
            return t;
        if (give_ups)
            ++*give_ups;
    }
    ck_abort_msg("a search of shape %d does not end", k);
    return INFINITY;
}

#endif
