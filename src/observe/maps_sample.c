/* Where are the balls on average? A ball is as large as a map's cell, so its volume is spread over
 * points of a cubic lattice within it, with their spacing chosen so that the second moment of the
 * ball, a^2/5 along each axis, is kept. In the axial map the lattice is turned so that one of its
 * axes is radial; then the points fall onto few distinct (x, r), which is what makes this cheap.
 * Balls are taken by the block: first the places of all, in loops that the compiler turns into
 * vector instructions, then they are poured into the cells one ball after the other. */
#include "observe/maps.h"

#include <math.h>
#include <stdbool.h>

enum {
    BLOCK = 32, /* balls */
    LANES = 8,  /* balls whose places are found at a time: their number is rounded up to this */
    POINTS = 32 /* (+-1, +-1, +-1) and the permutations of (+-3, +-1, +-1), in half spacings */
};

/* Half the spacing over the ball's radius. The mean square of one coordinate over the lattice is
 * (8 * 1 + 24 * 11 / 3) / 32 = 3 half spacings squared, that of a ball a^2 / 5. */
#define HALF_SPACING sqrt(1.0 / 15)

/* Places (j, k) of the lattice in the plane of radius and azimuth, in half spacings. Points on
 * either side of the radius (k and -k) share their r and are taken together, so that their
 * velocities' cross terms cancel. */
enum { SPOTS = 6 };
static const double spot[SPOTS][2] = {{-3, 1}, {-1, 1}, {1, 1}, {3, 1}, {-1, 3}, {1, 3}};

struct block {
    int count, padded;                   /* balls; rounded up */
    double x[BLOCK], y[BLOCK], z[BLOCK]; /* [m] centres */
    double u[BLOCK], v[BLOCK], w[BLOCK]; /* [m/s] */
    double h[BLOCK];                     /* [m] half the spacing */
    double two[BLOCK];                   /* [m^3] of two points */
    double radius[BLOCK];                /* [m] distance from the axis */
    double out[BLOCK], around[BLOCK];    /* [m/s] radial and azimuthal velocity */
    double share[SPOTS][BLOCK];          /* of these at the spots: cosine of the angle between */
    /* [B] where in the map: of the planes -3, -1, 1, 3 in y, z and x, and of the spots */
    unsigned row[4][BLOCK], column[4][BLOCK], slice[4][BLOCK], ring[SPOTS][BLOCK];
};

/* (volume, flow) of a cell, or to be poured into one; at once, or in two halves where the processor
 * has no instruction for four numbers (made in one piece it would go through memory there) */
typedef double jug __attribute__((vector_size(32), aligned(32), may_alias));
typedef double half __attribute__((vector_size(16), may_alias));

/* Everything below is compiled for each width of vectors: see mill_maps_sample_as. */
#define INLINE static inline __attribute__((always_inline))

/* Up to BLOCK balls from `first` on; the last one again to round them up */
INLINE void take(struct block *b, const struct mill_world *world, int32_t first, double t)
{
    const struct mill_ball *ball = world->ball + first;
    b->count = world->balls - first < BLOCK ? (int)(world->balls - first) : BLOCK;
    b->padded = (b->count + LANES - 1) / LANES * LANES;
    const int n = b->padded;
    for (int i = 0; i < n; i++) {
        const vec3 r = vec3_fly(ball->r, ball->v, world->g, t - ball->t);
        const vec3 v = vec3_axpy(ball->v, t - ball->t, world->g);
        b->x[i] = r.x;
        b->y[i] = r.y;
        b->z[i] = r.z;
        b->u[i] = v.x;
        b->v[i] = v.y;
        b->w[i] = v.z;
        b->h[i] = world->species[ball->species].radius;
        ball += i + 1 < b->count;
    }
    for (int i = 0; i < n; i++) {
        const double a = b->h[i];
        b->h[i] = a * HALF_SPACING;
        b->two[i] = 2 * (4 * MILL_PI / 3 * a * a * a / POINTS);
    }
}

/* Cells of the four planes across one axis. No ball reaches so far beyond the wall that its outer
 * plane does; one that did would be moved inside. */
INLINE void place_planes(const struct mill_map *map, int n, int axis, int stride,
                         const double centre[BLOCK], const double h[BLOCK],
                         unsigned offset[4][BLOCK])
{
    const double per = map->per[axis], zero = -map->from[axis] * per;
    const double end = map->n[axis] - 1e-9;
    for (int i = 0; i < n; i++) {
        const double size = h[i] * per, one = size < end / 6 ? size : end / 6, three = 3 * one;
        double at = centre[i] * per + zero;
        at = at < end - three ? at : end - three;
        at = at > three ? at : three;
        offset[0][i] = (unsigned)((int)(at - three) * stride);
        offset[1][i] = (unsigned)((int)(at - one) * stride);
        offset[2][i] = (unsigned)((int)(at + one) * stride);
        offset[3][i] = (unsigned)((int)(at + three) * stride);
    }
}

INLINE void place_spots(const struct mill_map *map, struct block *b)
{
    const double per = map->per[1], last = map->n[1] - 1;
    const int n = b->padded;
    for (int i = 0; i < n; i++) {
        const double radius = sqrt(b->y[i] * b->y[i] + b->z[i] * b->z[i]);
        const double c = radius > 0 ? b->y[i] / radius : 1, s = radius > 0 ? b->z[i] / radius : 0;
        b->radius[i] = radius;
        b->out[i] = b->v[i] * c + b->w[i] * s;
        b->around[i] = b->w[i] * c - b->v[i] * s;
    }
    for (int k = 0; k < SPOTS; k++) {
        for (int i = 0; i < n; i++) {
            const double h = b->h[i], along = b->radius[i] + spot[k][0] * h;
            const double there = sqrt(along * along + spot[k][1] * h * spot[k][1] * h);
            const double at = there * per;
            b->share[k][i] = along / there;
            b->ring[k][i] = (unsigned)((int)(at < last ? at : last) * (int)sizeof *map->flow);
        }
    }
}

INLINE void pour(char *row, unsigned offset, const jug *what)
{
    *(jug *)(void *)(row + offset) += *what;
}

/* Seen along x the lattice is 12 places: four hold 4 points each, eight hold 2. */
INLINE void pour_square(char *flow, const struct block *b, int i, const jug *two, const jug *four)
{
    const unsigned left = b->column[0][i], right = b->column[3][i];
    const unsigned inner[2] = {b->column[1][i], b->column[2][i]};
    char *row = flow + b->row[0][i];
    pour(row, inner[0], two);
    pour(row, inner[1], two);
    row = flow + b->row[1][i];
    pour(row, left, two);
    pour(row, inner[0], four);
    pour(row, inner[1], four);
    pour(row, right, two);
    row = flow + b->row[2][i];
    pour(row, left, two);
    pour(row, inner[0], four);
    pour(row, inner[1], four);
    pour(row, right, two);
    row = flow + b->row[3][i];
    pour(row, inner[0], two);
    pour(row, inner[1], two);
}

INLINE void pour_cross(const struct mill_map *map, const struct block *b, int i, bool wide)
{
    const double n = b->two[i];
    if (wide) {
        const jug two = {n, n * b->u[i], n * b->v[i], n * b->w[i]}, four = two + two;
        pour_square((char *)map->flow, b, i, &two, &four);
    } else {
        const half two[2]
            __attribute__((aligned(32))) = {{n, n * b->u[i]}, {n * b->v[i], n * b->w[i]}};
        const half four[2] __attribute__((aligned(32))) = {two[0] + two[0], two[1] + two[1]};
        pour_square((char *)map->flow, b, i, (const jug *)two, (const jug *)four);
    }
}

/* The inner two of the four planes, or all */
INLINE void pour_line(char *const slice[4], unsigned ring, bool all, const jug *two)
{
    if (all)
        pour(slice[0], ring, two);
    pour(slice[1], ring, two);
    pour(slice[2], ring, two);
    if (all)
        pour(slice[3], ring, two);
}

INLINE void pour_spot(char *const slice[4], const struct block *b, int i, int k, bool wide)
{
    const bool all = k == 1 || k == 2;
    const double n = b->two[i], out = b->out[i] * b->share[k][i];
    const double around = b->around[i] * b->share[k][i];
    if (wide) {
        const jug two = {n, n * b->u[i], n * out, n * around};
        pour_line(slice, b->ring[k][i], all, &two);
    } else {
        const half two[2] __attribute__((aligned(32))) = {{n, n * b->u[i]}, {n * out, n * around}};
        pour_line(slice, b->ring[k][i], all, (const jug *)two);
    }
}

INLINE void pour_axial(const struct mill_map *map, const struct block *b, int i, bool wide)
{
    char *const flow = (char *)map->flow;
    char *const slice[4] = {flow + b->slice[0][i], flow + b->slice[1][i], flow + b->slice[2][i],
                            flow + b->slice[3][i]};
    pour_spot(slice, b, i, 0, wide);
    pour_spot(slice, b, i, 1, wide);
    pour_spot(slice, b, i, 2, wide);
    pour_spot(slice, b, i, 3, wide);
    pour_spot(slice, b, i, 4, wide);
    pour_spot(slice, b, i, 5, wide);
}

INLINE void sample(struct mill_maps *maps, const struct mill_world *world, double t, bool wide)
{
    const int cell = (int)sizeof *maps->cross.flow;
    struct block b __attribute__((aligned(64)));
    for (int32_t first = 0; first < world->balls; first += BLOCK) {
        take(&b, world, first, t);
        place_planes(&maps->cross, b.padded, 0, cell * maps->cross.n[1], b.y, b.h, b.row);
        place_planes(&maps->cross, b.padded, 1, cell, b.z, b.h, b.column);
        place_planes(&maps->axial, b.padded, 0, cell * maps->axial.n[1], b.x, b.h, b.slice);
        place_spots(&maps->axial, &b);
        for (int i = 0; i < b.count; i++) {
            pour_cross(&maps->cross, &b, i, wide);
            pour_axial(&maps->axial, &b, i, wide);
        }
    }
    maps->samples++;
}

/* The same source for any processor and, on x86-64, for those with AVX2 and with AVX-512: the same
 * operations on more numbers at a time, to the same bits, as none is contracted. */
static void sample_any(struct mill_maps *maps, const struct mill_world *world, double t)
{
    sample(maps, world, t, false);
}

#if defined __x86_64__ && defined __GNUC__
__attribute__((target("avx2"))) static void sample_avx2(struct mill_maps *maps,
                                                        const struct mill_world *world, double t)
{
    sample(maps, world, t, true);
}

__attribute__((target("avx512f,avx512vl"))) static void
sample_avx512(struct mill_maps *maps, const struct mill_world *world, double t)
{
    sample(maps, world, t, true);
}

int mill_maps_widest(void)
{
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl"))
        return 512;
    return __builtin_cpu_supports("avx2") ? 256 : 128;
}

void mill_maps_sample_as(struct mill_maps *maps, const struct mill_world *world, double t,
                         int width)
{
    if (width == 512)
        sample_avx512(maps, world, t);
    else if (width == 256)
        sample_avx2(maps, world, t);
    else
        sample_any(maps, world, t);
}
#else
int mill_maps_widest(void)
{
    return 128;
}

void mill_maps_sample_as(struct mill_maps *maps, const struct mill_world *world, double t,
                         int width)
{
    (void)width;
    sample_any(maps, world, t);
}
#endif

void mill_maps_sample(struct mill_maps *maps, const struct mill_world *world, double t)
{
    mill_maps_sample_as(maps, world, t, mill_maps_widest());
}
