/* The pair search. All balls have the same acceleration, so the relative path of two balls is a
 * straight line and their contact the root of a quadratic. Several candidates are examined at once:
 * their records, one cache line each, are loaded and transposed in registers, so that one vector
 * holds one coordinate of several balls (pairs_lanes.h). No branch depends on a result. Only the
 * few balls that close and touch soon enough need a square root. The variants differ in the width
 * of the vectors. The compiler must not contract operations, so that all give the same bits. */
#include "engine/pairs.h"

#include <math.h>
#include <string.h>
#ifdef __x86_64__
#include <immintrin.h>
#endif

#define RECORD 8 /* doubles in a ball's record */
enum { LANES2 = 2, LANES4 = 4 };
#define INLINE static inline __attribute__((always_inline))

#if defined(__clang__) || __GNUC__ >= 12
#define PICK(type, a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define PICK(type, a, b, ...) __builtin_shuffle(a, b, (type){__VA_ARGS__})
#endif
#define LOAD(v, from) memcpy(&(v), (from), sizeof(v))
#define STORE(to, v) memcpy((to), &(v), sizeof(v))
/* Of the last words of records */
#define SPECIES_OF(flags, rest)                                                                    \
    (((flags)(rest) >> (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__ ? 16 : 32)) & 0xffff)
_Static_assert(offsetof(struct mill_ball, species) == 8 * RECORD - 4, "SPECIES_OF reads it");

/* ---- two at a time: for every processor with vectors ---- */

typedef double lanes2 __attribute__((vector_size(16)));
typedef int64_t flags2 __attribute__((vector_size(16)));

/* Columns of the two quarter records that begin `from` doubles into each record */
#define COLUMNS2(from, a, b)                                                                       \
    do {                                                                                           \
        lanes2 p, q;                                                                               \
        LOAD(p, base + near[k] + (from));                                                          \
        LOAD(q, base + near[k + 1] + (from));                                                      \
        a = PICK(flags2, p, q, 0, 2);                                                              \
        b = PICK(flags2, p, q, 1, 3);                                                              \
    } while (0)
#define SPLAT2(x) ((lanes2){x, x})
#define RADII2(radius, species) ((lanes2){(radius)[(species)[0]], (radius)[(species)[1]]})
#define TRANSPOSE2()                                                                               \
    do {                                                                                           \
        COLUMNS2(0, x, y);                                                                         \
        COLUMNS2(2, z, vx);                                                                        \
        COLUMNS2(4, vy, vz);                                                                       \
        COLUMNS2(6, t, rest);                                                                      \
    } while (0)

/* Writes the numbers from k on whose flag is set (all bits) and returns how many */
INLINE int32_t keep2(const flags2 *flag, int32_t k, int32_t *kept)
{
    const int32_t first = -(int32_t)(*flag)[0];
    kept[0] = k;
    kept[first] = k + 1;
    return first - (int32_t)(*flag)[1];
}

/* Lists a look's candidates from k on, as offsets of their records in doubles; returns how many. */
INLINE int32_t list(const struct mill_pairs *pairs, const struct mill_pairs_search *search,
                    const struct mill_grids_look *l, int32_t k)
{
    int32_t *restrict near = pairs->near + k;
    const int n =
        mill_cells_gather(l->cells, l->cell, l->offset, l->count, l->threes, RECORD, near);
    for (int32_t m = n; m < n + LANES4 - 1; m++)
        near[m] = search->ball * RECORD; /* fills the last group; a ball never closes on itself */
    return n;
}

/* Finds the earliest kept contact, if earlier than *found; of equal times, of the smaller ball. */
INLINE void choose(const struct mill_pairs *pairs, int32_t lanes, int64_t survivors,
                   struct mill_pair *found)
{
    double best = found->dt;
    int32_t partner = MILL_NOBODY;
    for (int64_t m = 0; m < survivors; m++) {
        const int32_t k = pairs->kept[m], other = pairs->near[k] / RECORD;
        const double *of = pairs->terms + 3 * k - 2 * (k & (lanes - 1));
        const double gap = of[lanes] > 0.0 ? of[lanes] : 0.0;
        const double dt = gap / (sqrt(of[2 * lanes]) - of[0]);
        /* Masks: compilers make branches of choices, half of which would be mispredicted. */
        const int32_t take = -(int32_t)((dt < best) | ((dt == best) & (partner > other)));
        best = dt < best ? dt : best;
        partner ^= (partner ^ other) & take;
    }
    if (partner != MILL_NOBODY) {
        found->dt = best;
        found->partner = partner;
    }
}

#define TARGET2 /* any */
#define OF(name) name##2
#include "engine/pairs_lanes.h"

#ifdef __x86_64__

/* ---- four at a time ---- */

typedef double lanes4 __attribute__((vector_size(32)));
typedef int64_t flags4 __attribute__((vector_size(32)));

/* Columns of the four half records that begin `from` doubles into each record */
#define COLUMNS4(from, a, b, c, d)                                                                 \
    do {                                                                                           \
        lanes4 p0, p1, p2, p3;                                                                     \
        LOAD(p0, base + near[k] + (from));                                                         \
        LOAD(p1, base + near[k + 1] + (from));                                                     \
        LOAD(p2, base + near[k + 2] + (from));                                                     \
        LOAD(p3, base + near[k + 3] + (from));                                                     \
        const lanes4 pq0 = PICK(flags4, p0, p1, 0, 4, 2, 6),                                       \
                     pq1 = PICK(flags4, p0, p1, 1, 5, 3, 7);                                       \
        const lanes4 rs0 = PICK(flags4, p2, p3, 0, 4, 2, 6),                                       \
                     rs1 = PICK(flags4, p2, p3, 1, 5, 3, 7);                                       \
        a = PICK(flags4, pq0, rs0, 0, 1, 4, 5);                                                    \
        b = PICK(flags4, pq1, rs1, 0, 1, 4, 5);                                                    \
        c = PICK(flags4, pq0, rs0, 2, 3, 6, 7);                                                    \
        d = PICK(flags4, pq1, rs1, 2, 3, 6, 7);                                                    \
    } while (0)
#define SPLAT4(x) ((lanes4){x, x, x, x})
#define RADII4(radius, species) (lanes4) _mm256_i64gather_pd(radius, (__m256i)(species), 8)
#define TRANSPOSE4()                                                                               \
    do {                                                                                           \
        COLUMNS4(0, x, y, z, vx);                                                                  \
        COLUMNS4(4, vy, vz, t, rest);                                                              \
    } while (0)

/* The positions of the bits that are set in a number below 16, lowest first */
static const int32_t places[16][4] = {
    {0, 0, 0, 0}, {0, 0, 0, 0}, {1, 0, 0, 0}, {0, 1, 0, 0}, {2, 0, 0, 0}, {0, 2, 0, 0},
    {1, 2, 0, 0}, {0, 1, 2, 0}, {3, 0, 0, 0}, {0, 3, 0, 0}, {1, 3, 0, 0}, {0, 1, 3, 0},
    {2, 3, 0, 0}, {0, 2, 3, 0}, {1, 2, 3, 0}, {0, 1, 2, 3},
};

#define TARGET4 __attribute__((target("avx2,popcnt")))

/* keep2() for four */
TARGET4 INLINE int32_t keep4(const flags4 *flag, int32_t k, int32_t *kept)
{
    const int mask = _mm256_movemask_pd((__m256d)*flag);
    const __m128i place = _mm_loadu_si128((const __m128i *)places[mask]);
    _mm_storeu_si128((__m128i *)kept, _mm_add_epi32(place, _mm_set1_epi32(k)));
    return _mm_popcnt_u32((unsigned)mask);
}

#define OF(name) name##4
#include "engine/pairs_lanes.h"

#endif

mill_pairs_fn *mill_pairs_variant(int k, const char **name)
{
    *name = k == 0 ? "plain" : "avx2";
    if (k == 0)
        return search2;
#ifdef __x86_64__
    if (k == 1 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("popcnt"))
        return search4;
#endif
    return NULL;
}

mill_pairs_fn *mill_pairs_choose(void)
{
    const char *name;
    mill_pairs_fn *wide = mill_pairs_variant(1, &name);
    return wide ? wide : mill_pairs_variant(0, &name);
}
