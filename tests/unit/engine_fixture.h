/* What the tests of the engine's parts share: seeded random numbers, and worlds made from a deck
 * that is written into the test. */
#ifndef ENGINE_FIXTURE_H
#define ENGINE_FIXTURE_H

#include "millsim/vec3.h"
#include "millsim/world.h"

#include <check.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PI 3.14159265358979323846

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

/* Writes `text` to a new file, whose name goes to path. */
static inline void write_file(char path[64], const char *text, size_t length)
{
    strcpy(path, "/tmp/millsim-test-XXXXXX");
    const int file = mkstemp(path);
    ck_assert_int_ge(file, 0);
    ck_assert_int_eq(write(file, text, length), (ssize_t)length);
    close(file);
}

static inline struct mill_deck *read_deck(const char *text)
{
    char path[64];
    struct mill_error error = {""};
    struct mill_deck *deck = NULL;
    write_file(path, text, strlen(text));
    const enum mill_status status = mill_deck_read(path, 0, NULL, NULL, &deck, &error);
    unlink(path);
    ck_assert_msg(status == MILL_OK, "%s", error.text);
    return deck;
}

/* The world of a deck that is known to be right. */
static inline struct mill_world *make_world(const struct mill_deck *deck)
{
    struct mill_error error = {""};
    struct mill_world *world = NULL;
    const enum mill_status status = mill_world_create(deck, &world, &error);
    ck_assert_msg(status == MILL_OK, "%s", error.text);
    return world;
}

#endif
