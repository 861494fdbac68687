/* A measured motion: rows of place and rotation vector over one period, joined by a periodic cubic
 * spline in each of the six columns. The second derivatives at the rows follow from a cyclic
 * tridiagonal system (Press et al., Numerical Recipes, sections 2.7 and 3.3). The matrix of a
 * rotation vector r is exp [r]. Its angular velocity is J r', where J is the integral of exp(s [r])
 * over 0 <= s <= 1. |J| <= 1, and J changes by at most half of the change of r. */
#include "base/elementary.h"
#include "millsim/motion.h"

#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 6, LOOKS = 1000 /* rows used to find how far a point moves */ };

/* Row k and the piece of the spline after it: x + s (b + s (c + s d)), s: time since the row */
struct piece {
    double t; /* [s] from the first row */
    double x[COLUMNS], b[COLUMNS], c[COLUMNS], d[COLUMNS];
};

struct table {
    struct mill_motion base;
    double length, phase; /* [s] of the table; time in the table at local time 0 */
    size_t pieces;
    struct piece *piece; /* [pieces + 1], the last one is the first one again */
    double speed, acceleration, turning, spin_up; /* most, of the place and of the rotation */
};

static bool is_sound(const void *form)
{
    const struct mill_table *is = form;
    bool good = is->rows >= 4;
    for (size_t k = 0; good && k < is->rows; k++) {
        for (int i = 0; i <= COLUMNS; i++)
            good = good && isfinite(is->row[k][i]);
        good = good && (k == 0 || is->row[k][0] > is->row[k - 1][0]);
    }
    return good;
}

/* Solves a tridiagonal system with the diagonals `below`, `on`, `above`. All arrays are [n]. */
static void solve(size_t n, const double *below, const double *on, const double *above,
                  const double *right, double *x, double *work)
{
    double pivot = on[0];
    x[0] = right[0] / pivot;
    for (size_t k = 1; k < n; k++) {
        work[k] = above[k - 1] / pivot;
        pivot = on[k] - below[k] * work[k];
        x[k] = (right[k] - below[k] * x[k - 1]) / pivot;
    }
    for (size_t k = n - 1; k-- > 0;)
        x[k] -= work[k + 1] * x[k + 1];
}

/* Sets c of one column: half of the second derivatives. The corner elements of the cyclic matrix
 * are a product of two vectors (Sherman & Morrison). room[7 n] */
static void bend(struct table *table, int column, double *room)
{
    const size_t n = table->pieces;
    struct piece *p = table->piece;
    double *below = room, *on = below + n, *above = on + n, *right = above + n, *x = right + n,
           *y = x + n, *work = y + n;
    for (size_t k = 0; k < n; k++) {
        const size_t last = k > 0 ? k - 1 : n - 1;
        const double h = p[k + 1].t - p[k].t, g = p[last + 1].t - p[last].t;
        below[k] = g;
        on[k] = 2.0 * (g + h);
        above[k] = h;
        right[k] = 3.0 * ((p[k + 1].x[column] - p[k].x[column]) / h -
                          (p[last + 1].x[column] - p[last].x[column]) / g);
    }
    const double corner = below[0], gamma = -on[0];
    on[0] -= gamma;
    on[n - 1] -= corner * corner / gamma;
    solve(n, below, on, above, right, x, work);
    memset(right, 0, n * sizeof *right);
    right[0] = gamma;
    right[n - 1] = corner;
    solve(n, below, on, above, right, y, work);
    const double share =
        (x[0] + corner * x[n - 1] / gamma) / (1.0 + y[0] + corner * y[n - 1] / gamma);
    for (size_t k = 0; k < n; k++)
        p[k].c[column] = x[k] - share * y[k];
    p[n].c[column] = p[0].c[column];
}

static double length(const double *x)
{
    return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
}

/* Bounds over a piece of `h` seconds. First derivatives are parabolas, so each is greatest at an
 * end or at its vertex. Second derivatives are linear. */
static void bound(struct table *table, const struct piece *p, double h)
{
    double rate[COLUMNS], end[COLUMNS], begin[COLUMNS];
    for (int i = 0; i < COLUMNS; i++) {
        const double last = p->b[i] + h * (2.0 * p->c[i] + 3.0 * h * p->d[i]);
        const double vertex = p->d[i] != 0.0 ? -p->c[i] / (3.0 * p->d[i]) : -1.0;
        rate[i] = fmax(fabs(p->b[i]), fabs(last));
        if (vertex > 0.0 && vertex < h)
            rate[i] = fmax(rate[i], fabs(p->b[i] + p->c[i] * vertex));
        begin[i] = 2.0 * p->c[i];
        end[i] = 2.0 * p->c[i] + 6.0 * h * p->d[i];
    }
    table->speed = fmax(table->speed, length(rate));
    table->turning = fmax(table->turning, length(rate + 3));
    table->acceleration = fmax(table->acceleration, fmax(length(begin), length(end)));
    table->spin_up = fmax(table->spin_up, fmax(length(begin + 3), length(end + 3)));
}

static struct mill_motion *create(const void *form)
{
    const struct mill_table *is = form;
    const size_t n = is->rows - 1;
    /* one block of memory, so that free() frees all */
    struct table *table = calloc(1, sizeof *table + (n + 1) * sizeof(struct piece));
    double *room = malloc(7 * n * sizeof *room);
    if (!table || !room) {
        free(table);
        free(room);
        return NULL;
    }
    table->base.type = &mill_table_type;
    table->pieces = n;
    table->piece = (struct piece *)(table + 1);
    table->length = is->row[n][0] - is->row[0][0];
    for (size_t k = 0; k <= n; k++) {
        table->piece[k].t = is->row[k][0] - is->row[0][0];
        memcpy(table->piece[k].x, is->row[k] + 1, sizeof table->piece[k].x);
    }
    for (int i = 0; i < COLUMNS; i++) /* the first row again, or whole turns further */
        if (i < 3 || fabs(is->row[n][i + 1] - is->row[0][i + 1]) < 1.0)
            table->piece[n].x[i] = is->row[0][i + 1];
    for (int i = 0; i < COLUMNS; i++)
        bend(table, i, room);
    for (size_t k = 0; k < n; k++) {
        struct piece *p = &table->piece[k];
        const double h = p[1].t - p->t;
        for (int i = 0; i < COLUMNS; i++) {
            p->d[i] = (p[1].c[i] - p->c[i]) / (3.0 * h);
            p->b[i] = (p[1].x[i] - p->x[i]) / h - h * (2.0 * p->c[i] + p[1].c[i]) / 3.0;
        }
        bound(table, p, h);
    }
    table->spin_up += 0.5 * table->turning * table->turning;
    table->base.period =
        table->speed > 0.0 || table->turning > 0.0 ? table->length : (double)INFINITY;
    free(room);
    return &table->base;
}

/* The last piece that begins at `time` or before */
static const struct piece *find(const struct table *table, double time)
{
    size_t low = 0, high = table->pieces;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (table->piece[middle].t <= time)
            low = middle;
        else
            high = middle;
    }
    return &table->piece[low];
}

/* Sum of (-z)^k (m - 1)! / (m + 2k - 1)!: the series, divided by their first terms 1, 1/2 and 1/6,
 * of sin a / a (m = 2), (1 - cos a) / a^2 (m = 3) and (a - sin a) / a^3 (m = 4); z = a^2 */
static double series(double z, int m)
{
    double sum = 1.0;
    for (int k = 12; k >= 0; k -= 2)
        sum = 1.0 - z * sum / ((m + k) * (m + k + 1.0));
    return sum;
}

/* For an angle a: sin a / a, (1 - cos a) / a^2, (a - sin a) / a^3 */
static void ratios(double a, double out[3])
{
    const double z = a * a;
    if (a < 0.5) {
        out[0] = series(z, 2);
        out[1] = series(z, 3) / 2.0;
        out[2] = series(z, 4) / 6.0;
        return;
    }
    const struct mill_heading at = mill_elementary_heading(a),
                              half = mill_elementary_heading(0.5 * a);
    out[0] = at.sin / a;
    out[1] = 2.0 * half.sin * half.sin / z;
    out[2] = (a - at.sin) / (z * a);
}

static struct mill_pose pose_at(const struct table *table, double time)
{
    const struct piece *p = find(table, time);
    const double s = time - p->t;
    double x[COLUMNS], v[COLUMNS], of[3];
    for (int i = 0; i < COLUMNS; i++) {
        x[i] = p->x[i] + s * (p->b[i] + s * (p->c[i] + s * p->d[i]));
        v[i] = p->b[i] + s * (2.0 * p->c[i] + 3.0 * s * p->d[i]);
    }
    const vec3 r = {x[3], x[4], x[5]}, rate = {v[3], v[4], v[5]};
    const vec3 direction[3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    vec3 turned[3];
    ratios(vec3_norm(r), of);
    for (int k = 0; k < 3; k++) {
        const vec3 once = vec3_cross(r, direction[k]), twice = vec3_cross(r, once);
        turned[k] = vec3_axpy(vec3_axpy(direction[k], of[0], once), of[1], twice);
    }
    const vec3 once = vec3_cross(r, rate), twice = vec3_cross(r, once);
    const vec3 turning = vec3_axpy(vec3_axpy(rate, of[1], once), of[2], twice);
    return (struct mill_pose){{x[0], x[1], x[2]}, turned[0],          turned[1],
                              turned[2],          {v[0], v[1], v[2]}, .angular_velocity = turning};
}

static struct mill_pose pose(const struct mill_motion *motion, double t)
{
    const struct table *table = (const struct table *)motion;
    const double time = fmod(table->phase + t, table->length);
    return pose_at(table, time < 0.0 ? time + table->length : time);
}

/* Home is the place of the point at the first row. */
static struct mill_motion_bounds bounds(const struct mill_motion *motion, vec3 point)
{
    const struct table *table = (const struct table *)motion;
    const double reach = vec3_norm(point);
    const struct mill_pose first = pose_at(table, 0.0);
    const vec3 home = mill_pose_out(&first, point);
    const double speed = table->speed + table->turning * reach;
    /* Every row, or some of a long table: no time is farther from one than half of an interval. */
    const size_t n = table->pieces, stride = 1 + n / LOOKS;
    double far = 0.0, between = 0.0;
    for (size_t k = 0, next; k < n; k = next) {
        next = k + stride < n ? k + stride : n;
        between = fmax(between, table->piece[next].t - table->piece[k].t);
        const struct mill_pose at = pose_at(table, table->piece[k].t);
        far = fmax(far, vec3_norm(vec3_sub(mill_pose_out(&at, point), home)));
    }
    const double turning = table->turning, centripetal = table->spin_up + turning * turning;
    return (struct mill_motion_bounds){home,    far + 0.5 * between * speed,
                                       speed,   table->acceleration + centripetal * reach,
                                       turning, .spin_up = table->spin_up};
}

static void restart(struct mill_motion *motion, double base, double by)
{
    struct table *table = (struct table *)motion;
    (void)by;
    table->phase = fmod(base, table->length);
}

const struct mill_motion_type mill_table_type = {is_sound, create, pose, bounds,
                                                 .restart = restart};
