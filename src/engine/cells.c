/* Layers of empty cells surround the box, so that the 27 cells around a ball always exist. Its
 * outermost cells reach to infinity: a ball slightly outside due to rounding still has one. The
 * cell of a ball follows from the faces that it crossed, never from its rounded position. */
#include "engine/cells.h"

#include "base/elementary.h"
#include "base/memory.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_ROOM 63.0 /* [balls] maximum initial room of a cell; it can be widened */

static void *make_rows(const struct mill_cells *c)
{
    return mill_memory_get((size_t)mill_cells_count(c) * (size_t)c->row, mill_cells_word_size(c));
}

void mill_cells_cut(vec3 lo, vec3 hi, double diameter, int32_t balls, int32_t inner[3])
{
    assert(diameter > 0.0 && balls >= 0);
    const double extent[3] = {hi.x - lo.x, hi.y - lo.y, hi.z - lo.z};
    /* The smallest cells are fastest, but a large empty box must not have more than about 16 per
     * ball. They are slightly larger than a diameter: rounding must not hide a touching pair. */
    const double most = 16.0 * (double)balls + 4096.0;
    double side = diameter * (1.0 + 1e-9), total, along[3];
    for (;; side *= fmax(mill_elementary_cbrt(total / most), 1.05)) {
        total = 1.0;
        for (int axis = 0; axis < 3; axis++)
            total *= along[axis] = fmax(floor(extent[axis] / side), 1.0);
        if (total <= most)
            break;
    }
    for (int axis = 0; axis < 3; axis++)
        inner[axis] = (int32_t)along[axis];
}

bool mill_cells_init(struct mill_cells *c, vec3 lo, vec3 hi, const int32_t inner[3], int32_t factor,
                     int32_t margin, double least_diameter, int32_t balls)
{
    assert(least_diameter > 0.0 && balls >= 0 && factor >= 1 && margin >= 1);
    memset(c, 0, sizeof *c);
    c->lo = lo;
    c->margin = margin;
    const double extent[3] = {hi.x - lo.x, hi.y - lo.y, hi.z - lo.z}, low[3] = {lo.x, lo.y, lo.z};
    double cells = 1.0;
    for (int axis = 0; axis < 3; axis++)
        cells *= (double)(inner[axis] / factor + 1 + 2 * margin);
    if (cells > INT32_MAX)
        return false;
    bool made = true;
    for (int axis = 0; axis < 3; axis++) {
        const int32_t n = c->n[axis] = (inner[axis] + factor - 1) / factor + 2 * margin;
        const double length = c->side[axis] = extent[axis] / inner[axis] * factor;
        double *edge = c->edge[axis] = malloc(sizeof *edge * ((size_t)n + 1));
        made = made && edge;
        for (int32_t i = 0; edge && i <= n; i++) /* outermost cells reach to infinity */
            edge[i] = i <= margin       ? -HUGE_VAL
                      : i >= n - margin ? HUGE_VAL
                                        : low[axis] + (double)(i - margin) * length;
    }
    c->per_n[0] = 1.0 / c->n[1];
    c->per_n[1] = 1.0 / c->n[2];
    /* Equal balls: at most 8 centres per cell, seldom 3. Mixtures: as in a dense packing */
    const double widest = fmax(c->side[0], fmax(c->side[1], c->side[2])) / least_diameter;
    const double wide = widest + 1.0;
    double room = widest < 1.3 ? 7.0 : 1.35 * (wide * wide * wide) / 8.0 * 1.5 + 7.0;
    room = fmin(room, fmin((double)balls + 7.0, MOST_ROOM));
    c->row = MILL_CELL_ROW * (int32_t)ceil((room + 1.0) / MILL_CELL_ROW);
    c->form = balls <= UINT16_MAX ? MILL_CELLS_SHORT : MILL_CELLS_WIDE;
    if (c->form == MILL_CELLS_WIDE && c->row == MILL_CELL_ROW && balls <= MILL_CELLS_BALL) {
        c->form = MILL_CELLS_PACKED;
        c->row = MILL_CELLS_PACK;
    }
    c->bucket = make_rows(c);
    c->cell = mill_memory_get((size_t)balls + 1, sizeof *c->cell);
    if (made && c->bucket && c->cell)
        return true;
    mill_cells_release(c);
    return false;
}

void mill_cells_release(struct mill_cells *c)
{
    free(c->bucket);
    free(c->cell);
    for (int axis = 0; axis < 3; axis++)
        free(c->edge[axis]);
    memset(c, 0, sizeof *c);
}

bool mill_cells_is_inner(const struct mill_cells *c, int32_t cell)
{
    int32_t at[3];
    bool inner = cell >= 0 && cell < mill_cells_count(c);
    mill_cells_index(c, inner ? cell : 0, at);
    for (int axis = 0; axis < 3; axis++)
        inner = inner && at[axis] >= c->margin && at[axis] < c->n[axis] - c->margin;
    return inner;
}

void mill_cells_box(const struct mill_cells *c, int32_t cell, vec3 *lo, vec3 *hi)
{
    int32_t i[3];
    mill_cells_index(c, cell, i);
    *lo = vec3_make(c->edge[0][i[0]], c->edge[1][i[1]], c->edge[2][i[2]]);
    *hi = vec3_make(c->edge[0][i[0] + 1], c->edge[1][i[1] + 1], c->edge[2][i[2] + 1]);
}

/* Sets the bits of `mask` in a word of a row. */
static void set_word(struct mill_cells *c, int64_t at, uint32_t mask, uint32_t bits)
{
    const uint32_t word = (mill_cells_word(c, at) & ~mask) | bits;
    if (c->form == MILL_CELLS_SHORT)
        ((uint16_t *)c->bucket)[at] = (uint16_t)word;
    else
        ((uint32_t *)c->bucket)[at] = word;
}

static void set_ball(struct mill_cells *c, int32_t cell, int32_t k, int32_t ball)
{
    const uint32_t mask = c->form == MILL_CELLS_PACKED ? MILL_CELLS_BALL : UINT32_MAX;
    set_word(c, (int64_t)cell * c->row + k, mask, (uint32_t)ball);
}

static void set_held(struct mill_cells *c, int32_t cell, int32_t held)
{
    const int64_t first = (int64_t)cell * c->row;
    if (c->form == MILL_CELLS_PACKED)
        set_word(c, first, ~(uint32_t)MILL_CELLS_BALL, (uint32_t)held << MILL_CELLS_BITS);
    else
        set_word(c, first + c->row - 1, UINT32_MAX, (uint32_t)held);
}

/* Doubles the room of every cell: seldom, for very unequal balls, or five in one packed row. */
static bool widen(struct mill_cells *c)
{
    struct mill_cells wide = *c;
    wide.form = c->form == MILL_CELLS_PACKED ? MILL_CELLS_WIDE : c->form;
    wide.row = 2 * c->row;
    wide.bucket = make_rows(&wide);
    if (!wide.bucket)
        return false;
    for (int32_t cell = 0; cell < mill_cells_count(c); cell++) {
        const int32_t held = mill_cells_held(c, cell);
        for (int32_t k = 0; k < held; k++)
            set_ball(&wide, cell, k, mill_cells_ball(c, cell, k));
        set_held(&wide, cell, held);
    }
    free(c->bucket);
    *c = wide;
    return true;
}

bool mill_cells_insert(struct mill_cells *c, int32_t ball, int32_t cell)
{
    const int32_t held = mill_cells_held(c, cell);
    if (!mill_cells_has_room(c, cell) && !widen(c))
        return false;
    mill_cells_set(c, ball, cell);
    set_ball(c, cell, held, ball);
    set_held(c, cell, held + 1);
    return true;
}

void mill_cells_remove(struct mill_cells *c, int32_t ball)
{
    const int32_t cell = c->cell[ball], last = mill_cells_held(c, cell) - 1;
    int32_t k = 0;
    while (k < last && mill_cells_ball(c, cell, k) != ball)
        k++;
    assert(last >= 0 && mill_cells_ball(c, cell, k) == ball);
    for (; k < last; k++)
        set_ball(c, cell, k, mill_cells_ball(c, cell, k + 1));
    set_held(c, cell, last);
}

void mill_cells_clear(struct mill_cells *c)
{
    memset(c->bucket, 0, (size_t)mill_cells_count(c) * (size_t)c->row * mill_cells_word_size(c));
}

/* The time at which a ball leaves an axis of its cell, and the face. Without gravity along it, it
 * can only reach the face ahead. Choices are arithmetic, because half of the branches would be
 * mispredicted. NaN (the face is infinitely far away, or the ball rests on it): never. */
static inline double leave_straight(double r, double v, const double *edge, int32_t *face)
{
    static const double sign[2] = {-1.0, 1.0};
    const int32_t ahead = v > 0.0;
    const double gap = (edge[ahead] - r) * sign[ahead];
    *face = ahead;
    return mill_greatest(gap, 0.0) / fabs(v);
}

/* The same with gravity g along the axis. A ball that moves against gravity leaves through the face
 * ahead if it gets there; else through the face below. A ball beyond that face which moves inwards
 * leaves when it turns back: at the later root, or at the turning point if it never gets inside. */
static inline double leave_falling(double r, double v, double g, const double *edge, int32_t *face)
{
    static const double sign[2] = {-1.0, 1.0};
    const int32_t down = g > 0.0;
    const double sink = v * sign[down], pull = fabs(g), speed = fabs(v);
    const double below = (edge[down] - r) * sign[down], above = (r - edge[1 - down]) * sign[down];
    const double rise = v * v - 2.0 * pull * above;
    const bool up = (sink < 0.0) & (rise >= 0.0), straight = up | (sink > 0.0);
    const double square = up ? rise : v * v + 2.0 * pull * below;
    const double both = speed + sqrt(mill_greatest(square, 0.0));
    const double way = 2.0 * mill_greatest(up ? above : below, 0.0);
    *face = up ? 1 - down : down;
    return (straight ? way : both) / (straight ? both : pull);
}

static inline double leave(double r, double v, double g, const double *edge, int32_t *face)
{
    return g == 0.0 ? leave_straight(r, v, edge, face) : leave_falling(r, v, g, edge, face);
}

struct mill_cell_exit mill_cells_exit(const struct mill_cells *c, int cell, vec3 r, vec3 v, vec3 g)
{
    int32_t i[3], side[3];
    mill_cells_index(c, cell, i);
    const double x = leave(r.x, v.x, g.x, c->edge[0] + i[0], &side[0]);
    const double y = leave(r.y, v.y, g.y, c->edge[1] + i[1], &side[1]);
    const double z = leave(r.z, v.z, g.z, c->edge[2] + i[2], &side[2]);
    double dt = HUGE_VAL;
    const int32_t at_x = -(int32_t)(x < dt);
    dt = mill_least(x, dt);
    const int32_t at_y = -(int32_t)(y < dt);
    dt = mill_least(y, dt);
    const int32_t at_z = -(int32_t)(z < dt);
    dt = mill_least(z, dt);
    int32_t face = side[0] & at_x;
    face ^= (face ^ (2 + side[1])) & at_y;
    face ^= (face ^ (4 + side[2])) & at_z;
    return (struct mill_cell_exit){dt, face};
}
