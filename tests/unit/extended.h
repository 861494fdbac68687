/* Motions and bodies once more, in extended precision and by other formulas: inverse chains of
 * rotations, splines by elimination, distances to polygons. */
#ifndef EXTENDED_H
#define EXTENDED_H

#include "millsim/setup.h"
#include "motion_fixture.h"

typedef long double real;
struct wide {
    real x, y, z;
};

#define TWO_PI 6.283185307179586476925286766559006L

static inline struct wide wide_of(vec3 a)
{
    return (struct wide){a.x, a.y, a.z};
}

static inline struct wide wide_axpy(struct wide a, real s, struct wide b)
{
    return (struct wide){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static inline real wide_dot(struct wide a, struct wide b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline struct wide wide_turned(struct wide a, struct wide axis, real angle)
{
    const real length = sqrtl(wide_dot(axis, axis));
    if (length <= 0.0L)
        return a;
    const struct wide e = {axis.x / length, axis.y / length, axis.z / length};
    const struct wide over = {e.y * a.z - e.z * a.y, e.z * a.x - e.x * a.z, e.x * a.y - e.y * a.x};
    const real along = wide_dot(e, a), c = cosl(angle), s = sinl(angle);
    struct wide out = {c * a.x, c * a.y, c * a.z};
    out = wide_axpy(out, s, over);
    return wide_axpy(out, (1.0L - c) * along, e);
}

/* Column i of a table at time t from its first row: the system of a periodic spline's second
 * derivatives, solved by elimination */
static inline real table_at(const struct link *is, int i, real t)
{
    enum { N = ROWS - 1 };
    real m[N][N + 1] = {{0}}, h[N];
    for (int k = 0; k < N; k++)
        h[k] = (real)is->row[k + 1][0] - is->row[k][0];
    for (int k = 0; k < N; k++) {
        const int b = (k + N - 1) % N, a = (k + 1) % N;
        m[k][b] += h[b];
        m[k][k] += 2.0L * (h[b] + h[k]);
        m[k][a] += h[k];
        m[k][N] = 6.0L * (((real)is->row[a][i] - is->row[k][i]) / h[k] -
                          ((real)is->row[k][i] - is->row[b][i]) / h[b]);
    }
    for (int c = 0; c < N; c++)
        for (int r = 0; r < N; r++)
            for (int j = N; r != c && j >= c; j--)
                m[r][j] -= m[r][c] / m[c][c] * m[c][j];
    const real period = (real)is->row[N][0] - is->row[0][0];
    t = fmodl(t, period) + is->row[0][0];
    int k = 0;
    while (k < N - 1 && t >= is->row[k + 1][0])
        k++;
    const real s = t - is->row[k][0], rest = h[k] - s;
    const real a = m[k][N] / m[k][k], b = m[(k + 1) % N][N] / m[(k + 1) % N][(k + 1) % N];
    return (a * rest * rest * rest + b * s * s * s) / (6.0L * h[k]) +
           (is->row[k][i] / h[k] - a * h[k] / 6.0L) * rest +
           (is->row[(k + 1) % N][i] / h[k] - b * h[k] / 6.0L) * s;
}

/* Where a place of the laboratory is in the frame of the chain at time t */
static inline struct wide wide_in(const struct chain *c, struct wide p, real t)
{
    for (int k = 0; k < c->count; k++) {
        const struct link *is = &c->is[k];
        const bool turn = is->kind == TURN;
        const struct wide centre = wide_of(turn ? is->turn.centre : is->swing.centre);
        const struct wide axis = wide_of(turn ? is->turn.axis : is->swing.axis);
        const real wave = TWO_PI * is->swing.frequency * t + is->swing.phase;
        const real w = TWO_PI * is->shift.frequency * t;
        if (is->kind == TURN || is->kind == SWING) {
            const real angle =
                turn ? is->turn.angle + (real)is->turn.speed * t : is->swing.amplitude * sinl(wave);
            p = wide_axpy(wide_turned(wide_axpy(p, -1.0L, centre), axis, -angle), 1.0L, centre);
        } else if (is->kind == SHIFT) {
            p.x -= is->shift.amplitude.x * sinl(w + is->shift.phase.x);
            p.y -= is->shift.amplitude.y * sinl(w + is->shift.phase.y);
            p.z -= is->shift.amplitude.z * sinl(w + is->shift.phase.z);
        } else {
            const struct wide r = {table_at(is, 4, t), table_at(is, 5, t), table_at(is, 6, t)};
            p = wide_axpy(
                p, -1.0L,
                (struct wide){table_at(is, 1, t), table_at(is, 2, t), table_at(is, 3, t)});
            p = wide_turned(p, r, -sqrtl(wide_dot(r, r)));
        }
    }
    return p;
}

/* From a polygon in the plane, counter-clockwise: > 0 outside */
static inline real polygon_distance(const real corner[][2], int n, real x, real y)
{
    real best = INFINITY;
    bool inside = true;
    for (int k = 0; k < n; k++) {
        const real *a = corner[k], *b = corner[(k + 1) % n];
        const real ex = b[0] - a[0], ey = b[1] - a[1], length = ex * ex + ey * ey;
        real s = length > 0.0L ? ((x - a[0]) * ex + (y - a[1]) * ey) / length : 0.0L;
        s = fminl(fmaxl(s, 0.0L), 1.0L);
        best = fminl(best, hypotl(x - a[0] - s * ex, y - a[1] - s * ey));
        inside = inside && ex * (y - a[1]) - ey * (x - a[0]) >= 0.0L;
    }
    return inside ? -best : best;
}

static inline real beyond(real q, real half)
{
    return fmaxl(fabsl(q) - half, 0.0L);
}

/* Of a body of revolution: its half plane mirrored, so that it is a polygon around the axis */
static inline real turned_distance(real low, real high, real from, real to, real rho, real z)
{
    const real corner[4][2] = {{-low, from}, {low, from}, {high, to}, {-high, to}};
    return polygon_distance(corner, 4, rho, z);
}

/* Distance of a place from the body's surface, > 0 where balls may be; in the motion's frame */
static inline real wide_gap(const struct mill_solid *solid, const struct mill_body *is,
                            struct wide p)
{
    const struct wide q = wide_axpy(p, -1.0L, wide_of(is->centre));
    const real x = wide_dot(q, wide_of(is->x)), y = wide_dot(q, wide_of(is->y));
    const real z = wide_dot(q, wide_of(is->z)), rho = hypotl(x, y), w = is->rounding;
    real d;
    if (solid == &mill_box_solid) {
        const real a = 0.5L * is->size.x - w, b = 0.5L * is->size.y - w, c = 0.5L * is->size.z - w;
        const real out = sqrtl(beyond(x, a) * beyond(x, a) + beyond(y, b) * beyond(y, b) +
                               beyond(z, c) * beyond(z, c));
        d = out > 0.0L ? out : fmaxl(fabsl(x) - a, fmaxl(fabsl(y) - b, fabsl(z) - c));
        d -= w;
    } else if (solid == &mill_round_sphere_solid || solid == &mill_round_capsule_solid) {
        const real half = solid == &mill_round_capsule_solid ? 0.5L * is->length : 0.0L;
        d = hypotl(rho, beyond(z, half)) - is->radius;
    } else {
        const real end = solid == &mill_round_cone_solid ? is->end_radius : is->radius;
        const real slope = (end - is->radius) / is->length, less = w * sqrtl(1.0L + slope * slope);
        const real middle = 0.5L * ((real)is->radius + end) - less;
        real from = w - 0.5L * is->length, to = 0.5L * is->length - w;
        if (slope < 0.0L) /* the shrunk one may end in a tip */
            to = fminl(to, -middle / slope);
        if (slope > 0.0L)
            from = fmaxl(from, -middle / slope);
        d = turned_distance(fmaxl(middle + slope * from, 0.0L), fmaxl(middle + slope * to, 0.0L),
                            from, to, rho, z) -
            w;
    }
    return is->inside ? -d : d;
}

#endif
