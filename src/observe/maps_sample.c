/* Where are the balls on average? A ball is about as large as a cell of a map, so its volume is
 * spread over points of a cubic lattice inside it. The spacing of the lattice keeps the second
 * moment of the ball, a^2/5 along each axis. In the axial map the lattice is turned so that one of
 * its axes is radial. Then the points have only a few different (x, r), which makes this fast.
 * Balls are processed in blocks: first the places of all balls, in loops that the compiler turns
 * into vector instructions; then the balls are added to the cells one after the other. */
#include "observe/maps.h"

enum {
    BLOCK = 32, /* balls */
    /* the places of this many balls are computed at a time; their number is rounded up to it */
    LANES = 8,
    SPOTS = 6,
    POINTS = 32 /* (+-1, +-1, +-1) and the permutations of (+-3, +-1, +-1), in half spacings */
};

/* Half the spacing relative to the ball's radius. The mean square of a coordinate is (8 * 1 + 24 *
 * 11 / 3) / 32 = 3 half spacings squared for the lattice, and a^2 / 5 for the ball. */
#define HALF_SPACING sqrt(1.0 / 15)

/* Places (j, k) of the lattice in the plane of radius and azimuth, in half spacings. The points k
 * and -k have the same r. They are processed together, so that cross terms of velocities cancel. */
static const double spot[SPOTS][2] = {{-3, 1}, {-1, 1}, {1, 1}, {3, 1}, {-1, 3}, {1, 3}};

struct block {
    int count, padded;                   /* number of balls; rounded up to LANES */
    double x[BLOCK], y[BLOCK], z[BLOCK]; /* [m] centres */
    double u[BLOCK], v[BLOCK], w[BLOCK]; /* [m/s] */
    double h[BLOCK];                     /* [m] half the spacing */
    double two[BLOCK];                   /* [m^3] volume of two points */
    double radius[BLOCK];                /* [m] distance from the axis */
    double out[BLOCK], around[BLOCK];    /* [m/s] radial and azimuthal velocity */
    /* at each spot: cosine of the angle between the spot's radial direction and the ball's */
    double share[SPOTS][BLOCK];
    /* [B] offsets in the map: of the planes -3, -1, 1, 3 in y, z and x, and of the spots */
    unsigned row[4][BLOCK], column[4][BLOCK], slice[4][BLOCK], ring[SPOTS][BLOCK];
};

/* (volume, flow) of a cell, or what is added to it */
typedef double four __attribute__((vector_size(32), aligned(32), may_alias));

/* Everything below is part of sample(), which is compiled for several processors. */
#define INLINE static inline __attribute__((always_inline))

/* Loads up to BLOCK balls from number `first` on. Repeats the last one to round up their number. */
INLINE void take(struct block *b, const struct mill_world *w, int32_t first, double t, double times)
{
    const struct mill_ball *ball = w->ball + first;
    b->count = w->balls - first < BLOCK ? (int)(w->balls - first) : BLOCK;
    b->padded = (b->count + LANES - 1) / LANES * LANES;
    const int n = b->padded;
    for (int i = 0; i < n; i++) {
        const double flown = mill_world_flown(ball, t);
        const vec3 r = vec3_fly(ball->r, ball->v, w->g, flown);
        const vec3 v = vec3_axpy(ball->v, flown, w->g);
        b->x[i] = r.x;
        b->y[i] = r.y;
        b->z[i] = r.z;
        b->u[i] = v.x;
        b->v[i] = v.y;
        b->w[i] = v.z;
        const double a = w->species[ball->species].radius;
        const bool relieved = ball->relief; /* it may be inside a body */
        ball += i + 1 < b->count;
        b->h[i] = a * HALF_SPACING;
        b->two[i] = relieved ? 0 : times * (2 * (4 * MILL_PI / 3 * a * a * a / POINTS));
    }
}

/* Transforms the balls to their container's frame. */
INLINE void ride(struct block *b, const struct mill_pose *frame)
{
    for (int i = 0; i < b->padded; i++) {
        const vec3 r = vec3_make(b->x[i], b->y[i], b->z[i]);
        const vec3 v = vec3_sub(vec3_make(b->u[i], b->v[i], b->w[i]), mill_pose_velocity(frame, r));
        const vec3 at = mill_pose_in(frame, r), moving = mill_pose_turn_in(frame, v);
        b->x[i] = at.x;
        b->y[i] = at.y;
        b->z[i] = at.z;
        b->u[i] = moving.x;
        b->v[i] = moving.y;
        b->w[i] = moving.z;
    }
}

/* Finds the cells of the four planes across one axis. The outer plane of a ball is never outside
 * the wall; if it were, it would be counted in the outermost cell. */
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
        for (int k = 0; k < 4; k++)
            offset[k][i] = (unsigned)((int)(at + (2 * k - 3) * one) * stride);
    }
}

/* The same along periodic ends: a plane beyond an end is at the other end. */
INLINE void place_around(const struct mill_map *map, int n, int stride, const double x[BLOCK],
                         const double h[BLOCK], unsigned offset[4][BLOCK])
{
    const double per = map->per[0], zero = -map->from[0] * per, end = map->n[0];
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < 4; k++) {
            double at = (x[i] + (2 * k - 3) * h[i]) * per + zero;
            at = at < 0 ? at + end : at;
            at = at >= end ? at - end : at;
            offset[k][i] = (unsigned)((int)at * stride);
        }
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
            b->ring[k][i] =
                (unsigned)((int)(at < last ? at : last) * (int)sizeof(struct mill_map_flow));
        }
    }
}

INLINE void add(char *row, unsigned offset, const four *what)
{
    *(four *)(void *)(row + offset) += *what;
}

/* Seen along x, the lattice has 12 places: four with 4 points each, eight with 2. */
INLINE void add_cross(char *flow, const struct block *b, int i)
{
    const double n = b->two[i];
    const four two = {n, n * b->u[i], n * b->v[i], n * b->w[i]}, twice = two + two;
    for (int k = 0; k < 4; k++) {
        const bool all = k == 1 || k == 2; /* points in all planes, not only in the inner two */
        char *row = flow + b->row[k][i];
        if (all)
            add(row, b->column[0][i], &two);
        add(row, b->column[1][i], all ? &twice : &two);
        add(row, b->column[2][i], all ? &twice : &two);
        if (all)
            add(row, b->column[3][i], &two);
    }
}

INLINE void add_axial(char *flow, const struct block *b, int i)
{
    for (int k = 0; k < SPOTS; k++) {
        const bool all = k == 1 || k == 2;
        const double n = b->two[i], out = b->out[i] * b->share[k][i];
        const double around = b->around[i] * b->share[k][i];
        const four two = {n, n * b->u[i], n * out, n * around};
        if (all)
            add(flow + b->slice[0][i], b->ring[k][i], &two);
        add(flow + b->slice[1][i], b->ring[k][i], &two);
        add(flow + b->slice[2][i], b->ring[k][i], &two);
        if (all)
            add(flow + b->slice[3][i], b->ring[k][i], &two);
    }
}

/* The same source is compiled for any processor and, where the loader can choose, for AVX2 and
 * AVX-512: the same operations on more numbers at a time. The results are equal to the last bit, as
 * no operations are contracted. (The loader would choose before ThreadSanitizer has started.) */
#if defined __x86_64__ && defined __gnu_linux__ && __has_attribute(target_clones) &&               \
    !defined __SANITIZE_THREAD__
__attribute__((target_clones("avx512f", "avx2", "default")))
#endif
static void
sample(const struct mill_maps *maps, struct mill_map_flow *flow, const struct mill_world *world,
       double t, double times)
{
    const int cell = (int)sizeof *flow;
    char *const cross = (char *)(flow + maps->cross.first);
    char *const axial = (char *)(flow + maps->axial.first);
    const bool still = world->container.still;
    const struct mill_pose frame = mill_world_steady_frame(world, t);
    struct block b __attribute__((aligned(64)));
    for (int32_t first = 0; first < world->balls; first += BLOCK) {
        take(&b, world, first, t, times);
        if (!still)
            ride(&b, &frame);
        place_planes(&maps->cross, b.padded, 0, cell * maps->cross.n[1], b.y, b.h, b.row);
        place_planes(&maps->cross, b.padded, 1, cell, b.z, b.h, b.column);
        if (world->container.period > 0.0)
            place_around(&maps->axial, b.padded, cell * maps->axial.n[1], b.x, b.h, b.slice);
        else
            place_planes(&maps->axial, b.padded, 0, cell * maps->axial.n[1], b.x, b.h, b.slice);
        place_spots(&maps->axial, &b);
        for (int i = 0; i < b.count; i++) {
            add_cross(cross, &b, i);
            add_axial(axial, &b, i);
        }
    }
}

/* Compilers differ in how others can call a function that is compiled several times. */
void mill_maps_sample(const struct mill_maps *maps, struct mill_map_flow *flow,
                      const struct mill_world *world, double t, double times)
{
    sample(maps, flow, world, t, times);
}
