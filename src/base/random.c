/* The generator makes its words in batches of 624; each word is tempered when it is used. */
#include "base/random.h"

#include <assert.h>

enum { FAR = 397 };

void mill_random_seed(struct mill_random *random, unsigned long seed)
{
    random->word[0] = (uint32_t)(seed == 0 ? 4357 : seed);
    for (uint32_t i = 1; i < MILL_RANDOM_WORDS; i++) {
        const uint32_t last = random->word[i - 1];
        random->word[i] = 1812433253U * (last ^ last >> 30) + i;
    }
    random->drawn = MILL_RANDOM_WORDS;
}

static void draw_batch(struct mill_random *random)
{
    uint32_t *word = random->word;
    for (int i = 0; i < MILL_RANDOM_WORDS; i++) {
        const uint32_t next = word[(i + 1) % MILL_RANDOM_WORDS];
        const uint32_t y = (word[i] & 0x80000000U) | (next & 0x7fffffffU);
        word[i] = word[(i + FAR) % MILL_RANDOM_WORDS] ^ y >> 1 ^ (y & 1U ? 0x9908b0dfU : 0U);
    }
    random->drawn = 0;
}

double mill_random_uniform(struct mill_random *random)
{
    assert(random->drawn >= 0 && random->drawn <= MILL_RANDOM_WORDS);
    if (random->drawn == MILL_RANDOM_WORDS)
        draw_batch(random);
    uint32_t y = random->word[random->drawn++];
    y ^= y >> 11;
    y ^= y << 7 & 0x9d2c5680U;
    y ^= y << 15 & 0xefc60000U;
    y ^= y >> 18;
    return y / 4294967296.0;
}

vec3 mill_random_direction(struct mill_random *random)
{
    double x, y, square;
    do {
        x = -1.0 + 2.0 * mill_random_uniform(random);
        y = -1.0 + 2.0 * mill_random_uniform(random);
        square = x * x + y * y;
    } while (square > 1.0);
    const double a = 2.0 * sqrt(1.0 - square);
    return vec3_make(x * a, y * a, -1.0 + 2.0 * square);
}
