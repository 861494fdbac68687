/* A mill whose drum is wavy. */
#ifndef WAVY_FIXTURE_H
#define WAVY_FIXTURE_H

#include "deck/deck_private.h"
#include "millsim/lining.h"
#include "shape_fixture.h"

#define R 0.075

static inline double square(double x)
{
    return x * x;
}

/* Of any height down to next to nothing and up to deep overhangs */
struct wavy_mill {
    struct mill mill;
    struct mill_profile profile;
    const struct mill_shape *drum;
};

static const struct mill_blade any_blade = {.tip_radius = 0.02, .width = 0.01, .thickness = 0.01};

static inline void build_with(struct wavy_mill *m, int n, double h, double angle,
                              const struct mill_blade *blade)
{
    const struct mill_setup_drum drum = wavy_drum(n, R, drum_length, h, angle);
    mill_build_in(&m->mill, &drum, blade, 0.0, 0.0);
    m->drum = m->mill.shape[DRUM];
    m->profile = mill_lining_profile(n, R, h, angle);
    ck_assert(m->profile.sound);
}

static inline void build(struct wavy_mill *m, int n, double h, double angle)
{
    build_with(m, n, h, angle, &any_blade);
}

static inline void build_random_with(uint64_t *seed, struct wavy_mill *m,
                                     const struct mill_blade *blade)
{
    const int n = (int)uniform(seed, 2.0, 25.0);
    const double most = 0.99 * fmin(mill_deck_lining_highest(n, R), 0.06);
    const double kind = uniform(seed, 0.0, 1.0);
    const double h = kind < 0.2   ? log_uniform(seed, 1e-13, 1e-3)
                     : kind < 0.6 ? uniform(seed, 1e-3, fmin(1e-2, most))
                                  : uniform(seed, 1e-6, most);
    build_with(m, n, h, kind < 0.3 ? 0.0 : uniform(seed, -20.0, 20.0), blade);
}

static inline void build_random(uint64_t *seed, struct wavy_mill *m)
{
    build_random_with(seed, m, &any_blade);
}

static inline double wall_gap(const struct wavy_mill *m, vec3 r, double radius)
{
    return mill_shape_gap(m->drum, r, radius, &mill_pose_still);
}

static inline vec3 random_place(uint64_t *seed, const struct wavy_mill *m)
{
    const double far = R + m->profile.height;
    return point_in(seed, vec3_make(-0.05, -far, -far), vec3_make(0.05, far, far));
}

static inline void random_course(uint64_t *seed, struct flight *f)
{
    const double speed = uniform(seed, 0.0, 1.0), pull = uniform(seed, 0.0, 1.0);
    f->path.v = vec3_scale(direction(seed), speed < 0.1   ? 0.0
                                            : speed < 0.3 ? log_uniform(seed, 1e-4, 1e-1)
                                                          : uniform(seed, 0.0, 10.0));
    f->path.g = pull < 0.2   ? nought
                : pull < 0.4 ? vec3_make(0.0, 0.0, -9.81)
                             : vec3_scale(direction(seed), uniform(seed, 0.0, 20.0));
    f->now = 0.0;
}

/* A ball in the drum, one in two of them near the wall */
static inline struct flight random_flight(uint64_t *seed, const struct wavy_mill *m)
{
    struct flight f;
    const double near = uniform(seed, 0.0, 1.0) < 0.5 ? 3e-3 : HUGE_VAL;
    double gap;
    f.radius = log_uniform(seed, 2e-4, 8e-3);
    do {
        f.path.r = random_place(seed, m);
        gap = wall_gap(m, f.path.r, f.radius);
    } while (gap < 0.0 || gap > near);
    random_course(seed, &f);
    return f;
}

#endif
