/* Signed dyadic numbers of up to WIDE_LIMBS words of 32 bits, for signs that must not be wrong.
 * value = sign * sum limb[i] 2^(32 (i + exponent)). Sums and products are exact while they fit;
 * what does not fit is cut off below and remembered in noise: the true value is within 2^(32
 * noise), so a sign is either certain or reported as zero. Exponents are ints: no overflow, no
 * underflow. */
#ifndef MILLSIM_POLY_WIDE_H
#define MILLSIM_POLY_WIDE_H

#include <math.h>
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

/* -1 or 1 if certain, otherwise 0 */
static inline int wide_sign(const struct wide *a)
{
    return a->exponent + a->size <= a->noise ? 0 : a->sign;
}

/* Takes n words that begin at exponent, without the zeros at either end. */
static inline void wide_store(struct wide *out, const uint32_t *words, int n, int exponent)
{
    while (n > 0 && words[n - 1] == 0)
        n--;
    int skip = 0;
    while (skip < n && words[skip] == 0)
        skip++;
    if (n - skip > WIDE_LIMBS) {
        skip = n - WIDE_LIMBS;
        out->noise = wide_max(out->noise, exponent + skip) + 1;
    }
    out->size = n - skip;
    out->exponent = exponent + skip;
    if (out->size == 0) {
        out->sign = 0;
        out->exponent = WIDE_EXACT;
    }
    memcpy(out->limb, words + skip, (size_t)out->size * sizeof *words);
}

static inline struct wide wide_from(double x)
{
    struct wide out = {.sign = (x > 0.0) - (x < 0.0), .noise = WIDE_EXACT};
    int e;
    uint64_t m = (uint64_t)ldexp(frexp(fabs(x), &e), 53);
    e += 6400 - 53; /* a multiple of 32 that makes it positive */
    int shift = e % 32;
    uint64_t low = (m & 0xffffffffu) << shift, high = ((m >> 32) << shift) + (low >> 32);
    uint32_t words[3] = {(uint32_t)low, (uint32_t)high, (uint32_t)(high >> 32)};
    wide_store(&out, words, 3, e / 32 - 200);
    return out;
}

static inline double wide_to_double(const struct wide *a)
{
    double x = 0.0;
    for (int i = wide_max(0, a->size - 3); i < a->size; i++)
        x += ldexp(a->limb[i], 32 * (i - a->size));
    return a->sign * ldexp(x, 32 * (a->exponent + a->size));
}

static inline struct wide wide_negative(const struct wide *a)
{
    struct wide out = *a;
    out.sign = -out.sign;
    return out;
}

static inline struct wide wide_product(const struct wide *a, const struct wide *b)
{
    struct wide out = {.sign = a->sign * b->sign, .noise = WIDE_EXACT};
    uint32_t words[2 * WIDE_LIMBS] = {0};
    int above_a = a->exponent + a->size, above_b = b->exponent + b->size;
    if (a->noise != WIDE_EXACT || b->noise != WIDE_EXACT)
        out.noise = wide_max(wide_max(above_a, a->noise) + b->noise, above_b + a->noise) + 1;
    for (int i = 0; i < a->size; i++) {
        uint64_t carry = 0;
        for (int j = 0; j < b->size; j++) {
            carry += (uint64_t)a->limb[i] * b->limb[j] + words[i + j];
            words[i + j] = (uint32_t)carry;
            carry >>= 32;
        }
        words[i + b->size] = (uint32_t)carry;
    }
    wide_store(&out, words, a->size + b->size, a->exponent + b->exponent);
    return out;
}

static inline uint32_t wide_word(const struct wide *a, int exponent)
{
    int i = exponent - a->exponent;
    return i >= 0 && i < a->size ? a->limb[i] : 0;
}

/* |a| < |b| */
static inline int wide_smaller(const struct wide *a, const struct wide *b)
{
    int top = wide_max(a->exponent + a->size, b->exponent + b->size);
    int bottom = a->exponent < b->exponent ? a->exponent : b->exponent;
    for (int e = top - 1; e >= bottom; e--) {
        uint32_t x = wide_word(a, e), y = wide_word(b, e);
        if (x != y)
            return x < y;
    }
    return 0;
}

static inline struct wide wide_sum(const struct wide *a, const struct wide *b)
{
    if (a->sign == 0 || b->sign == 0) {
        struct wide out = a->sign == 0 ? *b : *a;
        out.noise =
            wide_max(a->noise, b->noise) + (a->noise != WIDE_EXACT && b->noise != WIDE_EXACT);
        return out;
    }
    const struct wide *large = wide_smaller(a, b) ? b : a, *small = large == a ? b : a;
    struct wide out = {.sign = large->sign, .noise = wide_max(a->noise, b->noise)};
    out.noise += a->noise != WIDE_EXACT && b->noise != WIDE_EXACT;
    int bottom = large->exponent < small->exponent ? large->exponent : small->exponent;
    int top = large->exponent + large->size + 1;
    if (top - bottom > WIDE_LIMBS + 2) {
        bottom = top - WIDE_LIMBS - 2;
        out.noise = wide_max(out.noise, bottom) + 1;
    }
    uint32_t words[WIDE_LIMBS + 2];
    int64_t carry = 0, side = large->sign == small->sign ? 1 : -1;
    for (int e = bottom; e < top; e++) {
        carry += (int64_t)wide_word(large, e) + side * (int64_t)wide_word(small, e);
        words[e - bottom] = (uint32_t)(carry & 0xffffffff);
        carry >>= 32;
    }
    wide_store(&out, words, top - bottom, bottom);
    return out;
}

#endif
