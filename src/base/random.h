/* Random numbers: MT19937 (M. Matsumoto & T. Nishimura, ACM TOMACS 8, 1998, 3), with the seeding
 * and scaling of the GNU Scientific Library, so that both give the same numbers. */
#ifndef MILLSIM_RANDOM_H
#define MILLSIM_RANDOM_H

#include "millsim/vec3.h"

#include <stdint.h>

enum { MILL_RANDOM_WORDS = 624 };

struct mill_random {
    uint32_t word[MILL_RANDOM_WORDS];
    int drawn; /* number of words already used */
};

/* seed: 0 .. 2^32 - 1; 0 is used as 4357. */
void mill_random_seed(struct mill_random *random, unsigned long seed);

/* Uniform in [0, 1), a multiple of 2^-32 */
double mill_random_uniform(struct mill_random *random);

/* A unit vector, all directions equally probable (G. Marsaglia, Ann. Math. Stat. 43, 1972, 645) */
vec3 mill_random_direction(struct mill_random *random);

#endif
