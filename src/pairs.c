/* The pair scan. All balls fall alike, so the relative motion of two is a straight line and their
 * contact a quadratic. Candidates are taken four at a time: their records, a cache line each, are
 * loaded whole and transposed in registers, so that one vector holds one coordinate of four balls.
 * Nothing branches on the outcome. The vectors are the compiler's own, lowered to whatever the
 * target has; on x86-64 a second copy uses AVX2 where the processor has it. Multiplications and
 * additions are never contracted, so both copies give the same bits. */
#include "pairs.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define LANES 4
#define RECORD 8 /* doubles of a ball */

typedef double lanes __attribute__((vector_size(32)));
typedef int64_t flags __attribute__((vector_size(32)));

#if defined(__clang__) || __GNUC__ >= 12
#define PICK(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
#else
#define PICK(a, b, i, j, k, l) __builtin_shuffle(a, b, (flags){i, j, k, l})
#endif

#define SPLAT(x) ((lanes){x, x, x, x})

/* Columns of four rows */
#define TRANSPOSE(p, q, r, s, a, b, c, d)                                                          \
    do {                                                                                           \
        const lanes low_pq = PICK(p, q, 0, 4, 2, 6), high_pq = PICK(p, q, 1, 5, 3, 7);             \
        const lanes low_rs = PICK(r, s, 0, 4, 2, 6), high_rs = PICK(r, s, 1, 5, 3, 7);             \
        a = PICK(low_pq, low_rs, 0, 1, 4, 5);                                                      \
        b = PICK(high_pq, high_rs, 0, 1, 4, 5);                                                    \
        c = PICK(low_pq, low_rs, 2, 3, 6, 7);                                                      \
        d = PICK(high_pq, high_rs, 2, 3, 6, 7);                                                    \
    } while (0)

/* The same without the last column */
#define TRANSPOSE3(p, q, r, s, a, b, c)                                                            \
    do {                                                                                           \
        const lanes low_pq = PICK(p, q, 0, 4, 2, 6), low_rs = PICK(r, s, 0, 4, 2, 6);              \
        const lanes high_pq = PICK(p, q, 1, 5, 3, 7), high_rs = PICK(r, s, 1, 5, 3, 7);            \
        a = PICK(low_pq, low_rs, 0, 1, 4, 5);                                                      \
        b = PICK(high_pq, high_rs, 0, 1, 4, 5);                                                    \
        c = PICK(low_pq, low_rs, 2, 3, 6, 7);                                                      \
    } while (0)

#define LOAD(v, from) memcpy(&(v), (from), sizeof(v))
#define STORE(to, v) memcpy((to), &(v), sizeof(v))

/* Copies the balls of the cells to `near`, each as the place of its record, counted in doubles;
 * returns how many. Eight words at a time whatever the count: no branch to mispredict. */
#define GATHER(word)                                                                               \
    do {                                                                                           \
        const word *base = (const word *)cells->bucket + (int64_t)cells->cell[i] * row;            \
        for (int32_t k = 0; k < count; k++) {                                                      \
            const word *b = base + offset[k];                                                      \
            const int32_t held = b[row - 1];                                                       \
            for (int32_t m = 0; m < MILL_CELL_ROW; m++)                                            \
                near[n + m] = (int32_t)b[m] * RECORD;                                              \
            for (int32_t m = MILL_CELL_ROW; m < held; m++)                                         \
                near[n + m] = (int32_t)b[m] * RECORD;                                              \
            n += held;                                                                             \
        }                                                                                          \
    } while (0)

static inline __attribute__((always_inline)) int32_t gather(const struct mill_cells *cells,
                                                            int32_t i,
                                                            const int64_t *restrict offset,
                                                            int32_t count, int32_t *restrict near)
{
    const int32_t row = cells->row;
    int32_t n = 0;
    if (cells->narrow && row == MILL_CELL_ROW) {
        const uint16_t *base = (const uint16_t *)cells->bucket + (int64_t)cells->cell[i] * row;
        for (int32_t k = 0; k < count; k++) {
            const uint16_t *b = base + offset[k];
            for (int32_t m = 0; m < MILL_CELL_ROW; m++)
                near[n + m] = (int32_t)b[m] * RECORD;
            n += b[MILL_CELL_ROW - 1];
        }
    } else if (cells->narrow) {
        GATHER(uint16_t);
    } else {
        GATHER(int32_t);
    }
    return n;
}

/* Sets b, c and square of n candidates: with d and u the relative position and velocity at `now`
 * and s the sum of the radii, b = d.u (< 0: closing), c = d.d - s^2 (< 0: overlapping) and square =
 * b^2 - (u.u) c (> 0: they meet). Returns how many are closing, will meet, and may do so within the
 * window; their numbers are in `kept`. */
static inline __attribute__((always_inline)) int32_t
relate(const struct mill_pairs *pairs, int32_t i, double now, double window, int32_t n)
{
    const struct mill_ball *me = &pairs->ball[i];
    const double *base = (const double *)pairs->ball;
    const int32_t *restrict near = pairs->near;
    double *restrict b = pairs->b, *restrict c = pairs->c, *restrict square = pairs->square;
    int32_t *restrict kept = pairs->kept;
    const double *radius = pairs->radius;
    const lanes mx = SPLAT(me->r.x), my = SPLAT(me->r.y), mz = SPLAT(me->r.z);
    const lanes mvx = SPLAT(me->v.x), mvy = SPLAT(me->v.y), mvz = SPLAT(me->v.z);
    const lanes gx = SPLAT(pairs->g.x), gy = SPLAT(pairs->g.y), gz = SPLAT(pairs->g.z);
    const lanes t_now = SPLAT(now), horizon = SPLAT(-2.0 * window);
    const double equal = pairs->sum, mine = radius[me->species];
    lanes s = SPLAT(equal);
    int32_t count = 0;
    for (int32_t k = 0; k < n; k += LANES) {
        const double *o0 = base + near[k], *o1 = base + near[k + 1];
        const double *o2 = base + near[k + 2], *o3 = base + near[k + 3];
        lanes p0, p1, p2, p3, q0, q1, q2, q3, x, y, z, vx, vy, vz, t;
        LOAD(p0, o0);
        LOAD(p1, o1);
        LOAD(p2, o2);
        LOAD(p3, o3);
        LOAD(q0, o0 + 4);
        LOAD(q1, o1 + 4);
        LOAD(q2, o2 + 4);
        LOAD(q3, o3 + 4);
        TRANSPOSE(p0, p1, p2, p3, x, y, z, vx);
        TRANSPOSE3(q0, q1, q2, q3, vy, vz, t);
        if (equal == 0.0) {
            const lanes theirs = {radius[((const struct mill_ball *)o0)->species],
                                  radius[((const struct mill_ball *)o1)->species],
                                  radius[((const struct mill_ball *)o2)->species],
                                  radius[((const struct mill_ball *)o3)->species]};
            s = SPLAT(mine) + theirs;
        }
        const lanes dt = t_now - t;
        const lanes half = SPLAT(0.5) * dt * dt;
        const lanes dx = x + vx * dt + gx * half - mx;
        const lanes dy = y + vy * dt + gy * half - my;
        const lanes dz = z + vz * dt + gz * half - mz;
        const lanes ux = vx + gx * dt - mvx;
        const lanes uy = vy + gy * dt - mvy;
        const lanes uz = vz + gz * dt - mvz;
        const lanes vb = dx * ux + dy * uy + dz * uz;
        const lanes vc = dx * dx + dy * dy + dz * dz - s * s;
        const lanes vs = vb * vb - (ux * ux + uy * uy + uz * uz) * vc;
        STORE(&b[k], vb);
        STORE(&c[k], vc);
        STORE(&square[k], vs);
        /* the contact is not earlier than c / -2b: keeps those that may beat the best */
        const flags keep = (vb < SPLAT(0.0)) & (vs > SPLAT(0.0)) & ~(vc >= vb * horizon);
        kept[count] = k;
        count -= (int32_t)keep[0];
        kept[count] = k + 1;
        count -= (int32_t)keep[1];
        kept[count] = k + 2;
        count -= (int32_t)keep[2];
        kept[count] = k + 3;
        count -= (int32_t)keep[3];
    }
    return count;
}

static inline __attribute__((always_inline)) int32_t search(const struct mill_pairs *pairs,
                                                            int32_t i, double now,
                                                            const int64_t *offset, int32_t count,
                                                            struct mill_pair *found)
{
    int32_t *near = pairs->near;
    const int32_t n = gather(pairs->cells, i, offset, count, near);
    for (int32_t k = n; k < n + LANES - 1; k++)
        near[k] = i * RECORD; /* fills the last group; no ball is closing on itself: d = u = 0 */
    const int32_t kept = relate(pairs, i, now, found->dt, n);
    const double *b = pairs->b, *c = pairs->c, *square = pairs->square;
    double best = found->dt;
    int32_t partner = MILL_NOBODY;
    for (int32_t m = 0; m < kept; m++) {
        const int32_t k = pairs->kept[m], other = near[k] / RECORD;
        const double gap = c[k] > 0.0 ? c[k] : 0.0, dt = gap / (sqrt(square[k]) - b[k]);
        /* masks: a compiler makes a branch of a choice, and half of them are mispredicted */
        const int32_t take = -(int32_t)((dt < best) | ((dt == best) & (partner > other)));
        best = dt < best ? dt : best;
        partner ^= (partner ^ other) & take;
    }
    if (partner != MILL_NOBODY) {
        found->dt = best;
        found->partner = partner;
    }
    return n;
}

static int32_t search_plain(const struct mill_pairs *pairs, int32_t i, double now,
                            const int64_t *offset, int32_t count, struct mill_pair *best)
{
    return search(pairs, i, now, offset, count, best);
}

#ifdef __x86_64__
__attribute__((target("avx2"))) static int32_t search_avx2(const struct mill_pairs *pairs,
                                                           int32_t i, double now,
                                                           const int64_t *offset, int32_t count,
                                                           struct mill_pair *best)
{
    return search(pairs, i, now, offset, count, best);
}
#endif

mill_pairs_fn *mill_pairs_variant(int k, const char **name)
{
    if (k == 0) {
        *name = "plain";
        return search_plain;
    }
#ifdef __x86_64__
    if (k == 1 && __builtin_cpu_supports("avx2")) {
        *name = "avx2";
        return search_avx2;
    }
#endif
    return NULL;
}

mill_pairs_fn *mill_pairs_choose(void)
{
    const char *name;
    mill_pairs_fn *best = mill_pairs_variant(0, &name), *more;
    for (int k = 1; (more = mill_pairs_variant(k, &name)) != NULL; k++)
        best = more;
    return best;
}
