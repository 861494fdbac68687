/* The pieces of a contour that balls meet, and the plan of squares that tells which of them are
 * near. contour_meet.c has the contacts.
 *
 * Long arcs are cut into parts. A corner that points towards the balls is a piece of its own; then
 * the places at which a ball's centre touches are a curve of lines and arcs without corners that
 * point inwards, and each belongs to the piece that it is beside. */
#include "geometry/contour.h"
#include "base/elementary.h"
#include "base/memory.h"
#include "millsim/lining.h"

#include <stdlib.h>

/* Sine of the angle between neighbours that are tangent: their normals differ by rounding only */
#define TANGENT 1e-12
/* Bulge of the longest arcs: 90 degrees, away from the balls, and 168 degrees, around them */
#define MOST_BULGE (0.41421356237309515 * (1.0 + 1e-12))
#define MOST_HOLLOW 0.9
#define MOST_PARTS 4 /* of one side */
#define FLAT 1e-9    /* bend times length: its farthest point is an end */
#define SQRT2 1.4142135623730951
#define FINEST 1e-12 /* relative to the size: more than rounding of a place */
/* Half diagonals of a square: the pieces listed are farther from it by no more */
#define NEAR 8.0

/* ---- pieces ---- */

struct making {
    struct mill_contour_piece *piece;
    int count;
};

static void set_line(double line[3], double x, double y, const double at[2])
{
    line[0] = x;
    line[1] = y;
    line[2] = x * at[0] + y * at[1];
}

/* Begins a piece at the line at which the last one ends, or puts a corner between them. */
static void join(struct making *m, struct mill_contour_piece *next)
{
    const struct mill_contour_piece *last = &m->piece[m->count - 1];
    const double *t = last->to;
    double *f = next->from;
    const double turn = f[0] * t[1] - f[1] * t[0]; /* to the left: > 0 */
    if (fabs(turn) < TANGENT && f[0] * t[0] + f[1] * t[1] < 0.0) {
        for (int k = 0; k < 3; k++)
            f[k] = -t[k];
    } else if (turn <= 0.0) {
        const double x = last->end[1][0], y = last->end[1][1];
        m->piece[m->count++] = (struct mill_contour_piece){.x = x,
                                                           .y = y,
                                                           .bend = -1.0,
                                                           .end = {{x, y}, {x, y}},
                                                           .from = {-t[0], -t[1], -t[2]},
                                                           .to = {-f[0], -f[1], -f[2]}};
    }
}

/* A line, or an arc of at most half a turn */
static void add_side(struct making *m, const struct mill_corner *a, const struct mill_corner *b)
{
    const double dx = b->x - a->x, dy = b->y - a->y, c = sqrt(dx * dx + dy * dy);
    const double ex = dx / c, ey = dy / c, u = a->bulge, per = 1.0 / (1.0 + u * u);
    const double cosine = (1.0 - u * u) * per, sine = 2.0 * u * per; /* of half the angle */
    struct mill_contour_piece p = {.x = 0.5 * (a->x + b->x) + 0.5 * u * dy,
                                   .y = 0.5 * (a->y + b->y) - 0.5 * u * dx,
                                   .nx = -ey,
                                   .ny = ex,
                                   .bend = 2.0 * u * per / c,
                                   .end = {{a->x, a->y}, {b->x, b->y}},
                                   .half = 0.5 * c * sqrt(1.0 + u * u)};
    set_line(p.from, ex * cosine + ey * sine, ey * cosine - ex * sine, p.end[0]);
    set_line(p.to, -(ex * cosine - ey * sine), -(ey * cosine + ex * sine), p.end[1]);
    if (m->count > 0)
        join(m, &p);
    m->piece[m->count++] = p;
}

static void add_sides(struct making *m, struct mill_corner a, struct mill_corner b)
{
    const bool good = a.bulge <= MOST_HOLLOW && a.bulge >= -MOST_BULGE;
    const struct mill_corner middle = good ? b : mill_lining_halve(&a, &b);
    if (good) {
        add_side(m, &a, &b);
    } else {
        add_sides(m, a, middle);
        add_sides(m, middle, b);
    }
}

/* All pieces of a body, in their order. Owner: the caller. NULL: out of memory */
static struct mill_contour_piece *make_pieces(const struct mill_body *is, int *count)
{
    const size_t n = is->corners;
    struct making m = {calloc(2 * MOST_PARTS * n, sizeof *m.piece), 0};
    for (size_t k = 0; m.piece && k < n; k++) {
        struct mill_corner a = is->corner[k], b = is->corner[(k + 1) % n];
        if (!is->inside) { /* the other way round: balls are on the left */
            a = is->corner[(n - k) % n];
            b = is->corner[n - k - 1];
            a.bulge = -b.bulge;
        }
        add_sides(&m, a, b);
    }
    if (m.piece)
        join(&m, m.piece);
    *count = m.count;
    return m.piece;
}

/* ---- distances from the axis ---- */

/* [m] Of the nearest and the farthest point of a piece. The farthest one of an arc is its end, or
 * beyond the centre of its circle. */
static void measure(const struct mill_contour_piece *p, double *low, double *high)
{
    const struct mill_contour_view v = mill_contour_look(p, 0.0, 0.0);
    *low = fmin(*low, fabs(v.d));
    for (int k = 0; k < 2; k++)
        *high = fmax(*high, sqrt(p->end[k][0] * p->end[k][0] + p->end[k][1] * p->end[k][1]));
    if (p->half == 0.0 || fabs(p->bend) * p->half < FLAT)
        return; /* an end, but for rounding */
    const double r = 0.5 / p->bend, cx = p->x + r * p->nx, cy = p->y + r * p->ny;
    const double away = sqrt(cx * cx + cy * cy), by = 1.0 + fabs(r) / away;
    const bool beyond = away > 0.0 && mill_contour_is_beside(p, cx * by, cy * by);
    *high = fmax(*high, beyond ? away * by : sqrt(p->x * p->x + p->y * p->y));
}

void mill_contour_reach(const struct mill_body *is, double *low, double *high)
{
    int count;
    struct mill_contour_piece *piece = make_pieces(is, &count);
    *low = INFINITY;
    *high = 0.0;
    for (int k = 0; piece && k < count; k++)
        measure(&piece[k], low, high);
    free(piece);
}

/* ---- the plan of squares ---- */

struct mill_contour_nook mill_contour_nook_at(const struct mill_contour *c, double x, double y)
{
    const double i = (x - c->corner[0]) / c->size, k = (y - c->corner[1]) / c->size;
    if (!(i >= 0.0 && k >= 0.0 && i < c->squares && k < c->squares))
        return (struct mill_contour_nook){0.0f, INFINITY, -1, (int16_t)c->pieces,
                                          (int16_t)c->pieces};
    return c->nook[(int)k * c->squares + (int)i];
}

/* The greatest float that is not above x */
static float round_down(double x)
{
    const float f = (float)x;
    return (double)f > x ? nextafterf(f, -INFINITY) : f;
}

struct planting {
    struct mill_contour *c;
    struct mill_memory_list list; /* int16_t */
    bool good;
};

/* Lists the pieces near to each square of a block of `side` squares, from those near to a block
 * around it. Within eight half diagonals of a block's nearest piece is all that is within eight of
 * those of its quarter. */
static void plant(struct planting *p, int i, int k, int side, const int16_t *list, int count)
{
    struct mill_contour *c = p->c;
    const double half = 0.5 * side * c->size, around = half * SQRT2 * (1.0 + 1e-9);
    const double x = c->corner[0] + i * c->size + half, y = c->corner[1] + k * c->size + half;
    const double blur = FINEST * c->far;
    int16_t *near = malloc(((size_t)count + 1) * sizeof *near);
    double *d = malloc(((size_t)count + 1) * sizeof *d), least = INFINITY;
    int kept = 0, close = 0;
    p->good = p->good && near && d;
    for (int n = 0; p->good && n < count; n++)
        least = fmin(least, d[n] = fabs(mill_contour_look(&c->piece[list[n]], x, y).d));
    for (int far = 0; far < 2 && p->good; far++) {
        for (int n = 0; n < count; n++)
            if (d[n] <= least + NEAR * around && (d[n] > least + 2.0 * around + blur) == far)
                near[kept++] = list[n];
        close = far ? close : kept;
    }
    free(d);
    for (int n = 0; n < 4 && p->good && side > 1; n++)
        plant(p, i + n % 2 * side / 2, k + n / 2 * side / 2, side / 2, near, kept);
    for (int n = 0; n < kept && p->good && side == 1; n++) {
        int16_t *one = mill_memory_add(&p->list);
        if ((p->good = one))
            *one = near[n];
    }
    if (p->good && side == 1)
        c->nook[k * c->squares + i] = (struct mill_contour_nook){
            round_down(least - around - blur),
            kept == c->pieces ? INFINITY : round_down(least + (NEAR - 1.0) * around - blur),
            (int32_t)p->list.count - kept, (int16_t)kept, (int16_t)close};
    free(near);
}

static bool make_plan(struct mill_contour *c)
{
    struct planting p = {c, {.size = sizeof(int16_t)}, true};
    const double wide = c->far * (1.0 + (c->half < (double)INFINITY ? 0.5 : 1e-3));
    int16_t *all = malloc((size_t)c->pieces * sizeof *all);
    /* A contour at rest is asked for its nearest point only. Its small table stays in the cache. */
    c->squares = c->body.convex.base.motion ? 128 : 64;
    c->nook = calloc((size_t)c->squares * (size_t)c->squares, sizeof *c->nook);
    c->corner[0] = c->corner[1] = -wide;
    c->size = 2.0 * wide / c->squares;
    for (int k = 0; all && k < c->pieces; k++)
        all[k] = (int16_t)k;
    p.good = all && c->nook;
    plant(&p, 0, 0, c->squares, all, c->pieces);
    c->list = p.list.item;
    free(all);
    return p.good;
}

/* ---- as a shape ---- */

void mill_contour_free(struct mill_shape *shape)
{
    struct mill_contour *c = (struct mill_contour *)shape;
    free(c->piece);
    free(c->nook);
    free(c->list);
}

bool mill_contour_create(struct mill_shape *shape)
{
    struct mill_contour *c = (struct mill_contour *)shape;
    const struct mill_body *is = &c->body.is;
    shape->fixed = !shape->motion; /* it has no axis of symmetry */
    c->body.convex.bounds = mill_motion_bounds(shape->motion, is->centre);
    c->plain = is->inside && vec3_norm(is->centre) == 0.0 && is->x.y == 1.0 && is->y.z == 1.0;
    c->half = is->inside ? (double)INFINITY : 0.5 * is->length;
    c->piece = make_pieces(is, &c->pieces);
    c->low = INFINITY;
    double most = 0.0; /* bend */
    for (int k = 0; c->piece && k < c->pieces; k++) {
        const struct mill_contour_piece *p = &c->piece[k];
        measure(p, &c->low, &c->high);
        c->far = fmax(c->far, sqrt(p->x * p->x + p->y * p->y) + p->half);
        most = fmax(most, p->bend);
    }
    shape->hollow = most > 0.0 ? 0.5 / most : 0.0;
    return c->piece && make_plan(c);
}

/* ---- which pieces can a ball in a cell touch? ---- */

/* Is some of the box around this place, with half sides w and h, past a line or near to it? */
static bool is_some_past(const double line[3], double x, double y, double w, double h)
{
    const double margin = 1e-9 * (fabs(x) + fabs(y) + w + h);
    return mill_contour_past(line, x, y) + fabs(line[0]) * w + fabs(line[1]) * h >= -margin;
}

/* Can a ball in this box touch the piece? The box is divided into quarters. */
static bool comes_near(const struct mill_contour_piece *p, double x, double y, double w, double h,
                       double reach, int depth)
{
    if (fabs(mill_contour_look(p, x, y).d) > reach + sqrt(w * w + h * h) ||
        !is_some_past(p->from, x, y, w, h) || !is_some_past(p->to, x, y, w, h))
        return false;
    bool near = depth == 0;
    for (int k = 0; k < 4 && !near; k++)
        near = comes_near(p, x + (k % 2 - 0.5) * w, y + (k / 2 - 0.5) * h, 0.5 * w, 0.5 * h, reach,
                          depth - 1);
    return near;
}

/* A body that turns about the contour's own axis: the contour stays in a ring. */
static bool does_ring_meet(const struct mill_contour *c, vec3 lo, vec3 hi, double radius)
{
    const struct mill_bodied *b = &c->body;
    const double ring[4] = {c->low, c->high, -INFINITY, INFINITY};
    const vec3 off = vec3_sub(b->is.centre, b->through);
    const bool about = b->rings && vec3_norm(vec3_cross(b->is.z, b->axis)) < 1e-12 &&
                       vec3_norm(vec3_cross(off, b->axis)) < 1e-12 * c->far;
    return !about || mill_body_ring_meets(b, ring, lo, hi, radius);
}

struct mill_span mill_contour_parts(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    enum { DEPTH = 3 };
    const struct mill_contour *c = (const struct mill_contour *)shape;
    const struct mill_span none = {0, 0};
    mill_body_clip(&c->body, &lo, &hi);
    if (shape->wall < 0)
        return none; /* that is: all */
    if (!shape->fixed)
        return does_ring_meet(c, lo, hi, radius) ? (struct mill_span){0, (int16_t)c->pieces} : none;
    const vec3 half = vec3_scale(vec3_sub(hi, lo), 0.5);
    const struct mill_contour_spot s = mill_contour_spot_of(c, vec3_add(lo, half));
    const double around = vec3_norm(half) * (1.0 + 1e-9);
    const double w = c->plain ? half.y : around, h = c->plain ? half.z : around;
    const double reach = radius * (1.0 + 1e-3) + 1e-6 * c->far;
    if ((double)mill_contour_nook_at(c, s.x, s.y).near > reach + sqrt(w * w + h * h))
        return none;
    /* the longest row of pieces out of reach, after piece `to`, is left out */
    int first = -1, last = -1, widest = -1, from = 0, to = 0;
    for (int k = 0; k < c->pieces; k++) {
        if (!comes_near(&c->piece[k], s.x, s.y, w, h, reach, DEPTH))
            continue;
        if (first >= 0 && k - last > widest) {
            widest = k - last;
            from = k;
            to = last;
        }
        first = first < 0 ? k : first;
        last = k;
    }
    if (first < 0)
        return none;
    if (first + c->pieces - last >= widest) {
        from = first;
        to = last;
    }
    return (struct mill_span){(int16_t)from, (int16_t)((to - from + c->pieces) % c->pieces + 1)};
}

bool mill_contour_reachable(const struct mill_shape *shape, vec3 lo, vec3 hi, double radius)
{
    return shape->wall < 0 ? mill_body_reachable(shape, lo, hi, radius)
                           : mill_contour_parts(shape, lo, hi, radius).count > 0;
}
