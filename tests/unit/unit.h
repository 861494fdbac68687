/* What the unit tests share: seeded random numbers, and how the tests of a program are run. */
#ifndef UNIT_H
#define UNIT_H

#include "millsim/vec3.h"

#include <check.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

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

/* A test, run so many times with _i = 0, 1, ... */
struct unit_test {
    const TTest *test;
    int rounds;
};

/* Returns what main does. set_up and tear_down: around each test; may be NULL. */
static inline int unit_run_in(const char *name, void (*set_up)(void), void (*tear_down)(void),
                              const struct unit_test *test, size_t tests)
{
    Suite *suite = suite_create(name);
    TCase *all = tcase_create(name);
    tcase_set_timeout(all, 120.0);
    tcase_add_checked_fixture(all, set_up, tear_down);
    for (size_t k = 0; k < tests; k++)
        tcase_add_loop_test(all, test[k].test, 0, test[k].rounds);
    suite_add_tcase(suite, all);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_ENV);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}

static inline int unit_run(const char *name, const struct unit_test *test, size_t tests)
{
    return unit_run_in(name, NULL, NULL, test, tests);
}

#endif
