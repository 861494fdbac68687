/* Seeded random numbers for the unit tests. */
#ifndef DRAWS_H
#define DRAWS_H

#include "millsim/vec3.h"
#include "unit.h"

#define PI MILL_PI

static const vec3 nought = {0.0, 0.0, 0.0};

/* splitmix64 (Steele, Lea & Flood 2014) */
static inline uint64_t random_bits(uint64_t *seed)
{
    uint64_t z = *seed += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    return z ^ z >> 31;
}

/* uniform in [lo, hi) */
static inline double uniform(uint64_t *seed, double lo, double hi)
{
    return lo + (hi - lo) * ((double)(random_bits(seed) >> 11) * 0x1p-53);
}

static inline double log_uniform(uint64_t *seed, double lo, double hi)
{
    return exp(uniform(seed, log(lo), log(hi)));
}

static inline int32_t below(uint64_t *seed, int32_t n)
{
    return (int32_t)(random_bits(seed) % (uint64_t)n);
}

static inline vec3 direction(uint64_t *seed)
{
    const double z = uniform(seed, -1.0, 1.0), a = uniform(seed, 0.0, 2.0 * PI);
    return vec3_make(z, sqrt(1.0 - z * z) * cos(a), sqrt(1.0 - z * z) * sin(a));
}

static inline vec3 point_in(uint64_t *seed, vec3 lo, vec3 hi)
{
    const double x = uniform(seed, lo.x, hi.x), y = uniform(seed, lo.y, hi.y);
    return vec3_make(x, y, uniform(seed, lo.z, hi.z));
}

#endif
