/* Signed binary numbers of up to WIDE_LIMBS words of 32 bits, for signs that must be right. value =
 * sign * sum limb[i] 2^(32 (i + exponent)). Sums and products are exact if they fit into the words.
 * If not, the low words are cut off, and noise gives the possible error: the true value is within
 * 2^(32 noise). So a sign is certain or reported as zero. Exponents are ints: nothing overflows. */
#ifndef MILLSIM_POLY_WIDE_H
#define MILLSIM_POLY_WIDE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define WIDE_LIMBS 40
#define WIDE_EXACT (-1000000)

struct wide {
    int sign, size, exponent, noise;
    uint32_t limb[WIDE_LIMBS];
};

static inline int wide_max(int a, int b)
{
    return a > b ? a : b;
}

/* Upper end of a number: it is below 2^(32 wide_top) */
static inline int wide_top(struct wide a)
{
    return a.exponent + a.size;
}

/* -1 or 1 if certain, otherwise 0 */
static inline int wide_sign(struct wide a)
{
    return wide_top(a) <= a.noise ? 0 : a.sign;
}

/* Stores n words that begin at exponent, without the zero words at both ends */
static inline void wide_store(struct wide *out, const uint32_t *words, int n, int exponent)
{
    int skip = 0;
    while (n > 0 && words[n - 1] == 0)
        n--;
    while (skip < n && words[skip] == 0)
        skip++;
    if (n - skip > WIDE_LIMBS) {
        skip = n - WIDE_LIMBS;
        out->noise = wide_max(out->noise, exponent + skip) + 1;
    }
    out->size = n - skip;
    out->exponent = out->size > 0 ? exponent + skip : WIDE_EXACT;
    if (out->size == 0)
        out->sign = 0;
    memcpy(out->limb, words + skip, (size_t)out->size * sizeof *words);
}

static inline struct wide wide_from(double x)
{
    struct wide out = {.sign = (x > 0.0) - (x < 0.0), .noise = WIDE_EXACT};
    int e;
    const uint64_t m = (uint64_t)ldexp(frexp(fabs(x), &e), 53);
    e += 6400 - 53; /* adds a multiple of 32 that makes it positive */
    const int shift = e % 32;
    const uint64_t low = (m & 0xffffffffu) << shift, high = ((m >> 32) << shift) + (low >> 32);
    const uint32_t words[3] = {(uint32_t)low, (uint32_t)high, (uint32_t)(high >> 32)};
    wide_store(&out, words, 3, e / 32 - 200);
    return out;
}

static inline double wide_to_double(struct wide a)
{
    double x = 0.0;
    for (int i = wide_max(0, a.size - 3); i < a.size; i++)
        x += ldexp(a.limb[i], 32 * (i - a.size));
    return a.sign * ldexp(x, 32 * wide_top(a));
}

static inline struct wide wide_product(struct wide a, struct wide b)
{
    struct wide out = {.sign = a.sign * b.sign, .noise = WIDE_EXACT};
    uint32_t words[2 * WIDE_LIMBS] = {0};
    if (a.noise != WIDE_EXACT || b.noise != WIDE_EXACT)
        out.noise = 1 + wide_max(wide_max(wide_top(a), a.noise) + b.noise, wide_top(b) + a.noise);
    for (int i = 0; i < a.size; i++) {
        uint64_t carry = 0;
        for (int j = 0; j < b.size; j++) {
            carry += (uint64_t)a.limb[i] * b.limb[j] + words[i + j];
            words[i + j] = (uint32_t)carry;
            carry >>= 32;
        }
        words[i + b.size] = (uint32_t)carry;
    }
    wide_store(&out, words, a.size + b.size, a.exponent + b.exponent);
    return out;
}

/* The word at that exponent, with the number's sign */
static inline int64_t wide_word(const struct wide *a, int exponent)
{
    const int i = exponent - a->exponent;
    return i >= 0 && i < a->size ? a->sign * (int64_t)a->limb[i] : 0;
}

static inline struct wide wide_sum(struct wide a, struct wide b)
{
    const bool doubtful = a.noise != WIDE_EXACT && b.noise != WIDE_EXACT;
    struct wide out = a.sign == 0 ? b : a;
    out.noise = wide_max(a.noise, b.noise) + doubtful;
    if (a.sign == 0 || b.sign == 0)
        return out;
    const int top = wide_max(wide_top(a), wide_top(b)) + 1, lowest = top - WIDE_LIMBS - 2;
    int bottom = a.exponent < b.exponent ? a.exponent : b.exponent;
    if (bottom < lowest) {
        bottom = lowest;
        out.noise = wide_max(out.noise, bottom) + 1;
    }
    uint32_t words[WIDE_LIMBS + 2];
    int64_t carry = 0; /* at the end 0, or -1 if the sum is negative */
    for (int e = bottom; e < top; e++) {
        carry += wide_word(&a, e) + wide_word(&b, e);
        words[e - bottom] = (uint32_t)carry;
        carry >>= 32;
    }
    out.sign = carry < 0 ? -1 : 1;
    uint64_t one = 1; /* a negative number is the complement plus one */
    for (int i = 0; carry < 0 && i < top - bottom; i++) {
        one += (uint32_t)~words[i];
        words[i] = (uint32_t)one;
        one >>= 32;
    }
    wide_store(&out, words, top - bottom, bottom);
    return out;
}

#endif
