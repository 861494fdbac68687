/* The pair scan. All balls fall alike, so the relative motion of two is a straight line and their
 * contact a quadratic. Candidates are taken four at a time: their records, a cache line each, are
 * loaded whole and transposed in registers, so that one vector holds one coordinate of four balls.
 * Nothing branches on the outcome. The vectors are the compiler's own, lowered to whatever the
 * target has; on x86-64 a second copy uses AVX2 where the processor has it. Multiplications and
 * additions are never contracted, so both copies give the same bits. */
#include "relate.h"

#include <stddef.h>
#include <string.h>

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
        const lanes low_pq = PICK(p, q, 0, 4, 2, 6), low_rs = PICK(r, s, 0, 4, 2, 6);               \
        const lanes high_pq = PICK(p, q, 1, 5, 3, 7), high_rs = PICK(r, s, 1, 5, 3, 7);            \
        a = PICK(low_pq, low_rs, 0, 1, 4, 5);                                                      \
        b = PICK(high_pq, high_rs, 0, 1, 4, 5);                                                    \
        c = PICK(low_pq, low_rs, 2, 3, 6, 7);                                                      \
    } while (0)

#define LOAD(v, from) memcpy(&(v), (from), sizeof(v))
#define STORE(to, v) memcpy((to), &(v), sizeof(v))

static inline __attribute__((always_inline)) int32_t
scan(const struct mill_relate *relate, int32_t i, double now, double best, const int32_t *near,
     int32_t n, double *restrict b, double *restrict c, double *restrict square,
     int32_t *restrict kept)
{
    const struct mill_ball *ball = relate->ball;
    const struct mill_ball *me = &ball[i];
    const lanes mx = SPLAT(me->r.x), my = SPLAT(me->r.y), mz = SPLAT(me->r.z);
    const lanes mvx = SPLAT(me->v.x), mvy = SPLAT(me->v.y), mvz = SPLAT(me->v.z);
    const lanes gx = SPLAT(relate->g.x), gy = SPLAT(relate->g.y), gz = SPLAT(relate->g.z);
    const lanes t_now = SPLAT(now), window = SPLAT(best);
    const double equal = relate->sum, mine = relate->radius[me->species];
    lanes s = SPLAT(equal);
    int32_t count = 0;
    for (int32_t k = 0; k < n; k += MILL_RELATE_LANES) {
        const struct mill_ball *o0 = &ball[near[k]], *o1 = &ball[near[k + 1]];
        const struct mill_ball *o2 = &ball[near[k + 2]], *o3 = &ball[near[k + 3]];
        lanes p0, p1, p2, p3, q0, q1, q2, q3, x, y, z, vx, vy, vz, t;
        LOAD(p0, &o0->r.x);
        LOAD(p1, &o1->r.x);
        LOAD(p2, &o2->r.x);
        LOAD(p3, &o3->r.x);
        LOAD(q0, &o0->v.y);
        LOAD(q1, &o1->v.y);
        LOAD(q2, &o2->v.y);
        LOAD(q3, &o3->v.y);
        TRANSPOSE(p0, p1, p2, p3, x, y, z, vx);
        TRANSPOSE3(q0, q1, q2, q3, vy, vz, t);
        if (equal == 0.0) {
            const lanes theirs = {relate->radius[o0->species], relate->radius[o1->species],
                                  relate->radius[o2->species], relate->radius[o3->species]};
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
        const flags keep =
            (vb < SPLAT(0.0)) & (vs > SPLAT(0.0)) & ~(vc >= SPLAT(-2.0) * vb * window);
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

static int32_t scan_plain(const struct mill_relate *relate, int32_t i, double now, double best,
                          const int32_t *near, int32_t n, double *b, double *c, double *square,
                          int32_t *kept)
{
    return scan(relate, i, now, best, near, n, b, c, square, kept);
}

#ifdef __x86_64__
__attribute__((target("avx2"))) static int32_t
scan_avx2(const struct mill_relate *relate, int32_t i, double now, double best, const int32_t *near,
          int32_t n, double *b, double *c, double *square, int32_t *kept)
{
    return scan(relate, i, now, best, near, n, b, c, square, kept);
}
#endif

mill_relate_fn *mill_relate_variant(int k, const char **name)
{
    if (k == 0) {
        *name = "plain";
        return scan_plain;
    }
#ifdef __x86_64__
    if (k == 1 && __builtin_cpu_supports("avx2")) {
        *name = "avx2";
        return scan_avx2;
    }
#endif
    return NULL;
}

mill_relate_fn *mill_relate_choose(void)
{
    const char *name;
    mill_relate_fn *best = mill_relate_variant(0, &name), *more;
    for (int k = 1; (more = mill_relate_variant(k, &name)) != NULL; k++)
        best = more;
    return best;
}
