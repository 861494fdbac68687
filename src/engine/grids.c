/* One cell grid for each class of sizes. Without classes, a small ball would gather all the small
 * balls in the 27 wide cells around it: of 10 mm and 1 mm, a thousand times as many as it touches.
 *
 * In a periodic box, the cells beyond an end are those at the other end. A ball near an end looks
 * into them too, from its place beyond it. Enough cells along x let no ball see another twice. */
#include "engine/grids.h"

#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ALIKE 1.5 /* largest over smallest diameter within a class */
/* A class with fewer balls than this in a cell of the next class is not worth a grid of its own:
 * the large balls would cross the small cells in vain. */
#define CROWD 4.0
#define ROOM (1.0 + 1e-9) /* rounding must not hide a touching pair */
#define FEWEST 3          /* cells along a periodic box */

struct sizes {
    double least, widest; /* [m] diameters */
    double balls;
    bool equal; /* they all have the same diameter */
};

/* Sorts the species into classes, smallest first, and returns their number; 0: out of memory */
static int make_classes(struct mill_grids *g, const struct mill_world *w, struct sizes *of)
{
    double last = 0.0;
    int n = 0;
    double *count = calloc((size_t)w->species_count, sizeof *count);
    for (int32_t i = 0; count && i < w->balls; i++)
        count[w->ball[i].species] += 1.0;
    for (int done = 0; count && done < w->species_count;) {
        double next = INFINITY; /* the next diameter */
        for (int k = 0; k < w->species_count; k++)
            if (2.0 * w->species[k].radius > last)
                next = fmin(next, 2.0 * w->species[k].radius);
        if (n == 0 || (next > ALIKE * of[n - 1].least && n < MILL_GRIDS_MOST))
            of[n++] = (struct sizes){next, next, 0.0, true};
        of[n - 1].equal = of[n - 1].least == next;
        of[n - 1].widest = last = next;
        for (int k = 0; k < w->species_count; k++)
            if (2.0 * w->species[k].radius == next) {
                of[n - 1].balls += count[k];
                g->class_of[k] = (int8_t)(n - 1);
                done++;
            }
    }
    free(count);
    return n;
}

/* Unites each class that has fewer than `crowd` balls in a cell of the next class with this one. */
static void unite(struct mill_grids *g, const struct mill_world *w, struct sizes *of, double crowd)
{
    for (int c = 0; c + 1 < g->classes;) {
        const double wide = of[c + 1].widest;
        if (of[c].balls * wide * wide * wide >= crowd * w->container.volume) {
            c++;
            continue;
        }
        of[c + 1].least = of[c].least;
        of[c + 1].balls += of[c].balls;
        of[c + 1].equal = false;
        memmove(&of[c], &of[c + 1], sizeof *of * (size_t)(g->classes - c - 1));
        for (int k = 0; k < w->species_count; k++)
            g->class_of[k] = (int8_t)(g->class_of[k] - (g->class_of[k] > c));
        g->classes--;
    }
}

/* Is a cell this far away closer than `sum`? */
static bool is_within(const struct mill_cells *c, const int32_t d[3], double sum)
{
    double square = 0.0;
    for (int axis = 0; axis < 3; axis++) {
        const double gap = fmax(abs(d[axis]) - 1, 0) * c->side[axis];
        square += gap * gap;
    }
    return square < sum * sum;
}

/* Lists what a class sees in its own grid c, in that of a smaller class (`down`), or of a larger
 * one. A larger ball sees all cells closer than the sum of the radii. So what is newly near a
 * smaller ball after a crossing is not behind it; and what is newly near an equal ball, ahead. */
static bool make_view(struct mill_grids_view *v, const struct mill_cells *c, bool own, bool down)
{
    const int32_t m = v->reach, wide = 2 * m + 1, nearest = own ? 1 : 0;
    /* after a crossing: down, one cell of each line along the axis */
    const double most = wide * (double)wide * (wide + 6.0 * (down ? 1 : m + 1));
    if (most > INT32_MAX)
        return false;
    const int32_t all = wide * wide * wide;
    int64_t *next = mill_memory_get((size_t)most, sizeof *next);
    for (int face = -1; face < 6 && next; face++) {
        const int32_t way = face % 2 ? 1 : -1;
        v->offset[1 + face] = next;
        for (int32_t k = 0; k < all; k++) {
            int32_t d[3] = {k / (wide * wide) - m, k / wide % wide - m, k % wide - m};
            const int64_t cells = ((int64_t)d[0] * c->n[1] + d[1]) * c->n[2] + d[2];
            bool sees = !down || is_within(c, d, v->widest);
            if (face >= 0 && !down)
                sees = d[face / 2] * way >= nearest;
            if (face >= 0 && down && sees) {
                d[face / 2] += way; /* before the crossing */
                sees = !is_within(c, d, v->widest);
            }
            if (sees)
                *next++ = cells * c->row; /* in words of the rows */
        }
        v->count[1 + face] = (int32_t)(next - v->offset[1 + face]);
    }
    return next != NULL;
}

/* The numbers of cells, and how far balls look */
struct layout {
    int32_t inner[3]; /* of the finest cells in the box */
    int32_t factor[MILL_GRIDS_MOST], margin[MILL_GRIDS_MOST];
};

/* False: a periodic box is too short for these classes */
static bool lay_out(struct mill_grids *g, const struct mill_world *w, const struct sizes *of,
                    double widening, struct layout *l)
{
    const vec3 lo = w->container.places.lo, hi = w->container.places.hi;
    const double extent[3] = {hi.x - lo.x, hi.y - lo.y, hi.z - lo.z};
    const int n = g->classes;
    mill_cells_cut(lo, hi, of[0].widest * widening, w->balls, l->inner);
    if (g->period > 0.0 && l->inner[0] < FEWEST)
        l->inner[0] = FEWEST;
    double least = INFINITY; /* [m] edge of the finest cells */
    for (int axis = 0; axis < 3; axis++)
        least = fmin(least, l->inner[axis] > 1 ? extent[axis] / l->inner[axis] : (double)INFINITY);
    for (int a = 0; a < n; a++) {
        const int32_t before = a > 0 ? l->factor[a - 1] : 1;
        l->margin[a] = 1;
        l->factor[a] = a > 0 ? before * (int32_t)ceil(of[a].widest * ROOM / (least * before)) : 1;
        l->factor[a] = l->factor[a] > 1 ? l->factor[a] : 1;
    }
    bool fits = true;
    if (g->period > 0.0)
        l->inner[0] -= l->inner[0] % l->factor[n - 1];
    for (int a = 0; a < n; a++)
        for (int b = 0; b < n; b++) {
            struct mill_grids_view *v = &g->view[a][b];
            const double sum = 0.5 * (of[a].widest + of[b].widest);
            const int small = a < b ? a : b;
            v->sum = of[a].equal && of[b].equal ? sum : 0.0;
            v->widest = sum * ROOM;
            v->reach = a == b ? 1 : (int32_t)ceil(v->widest / (least * l->factor[small]));
            if (a < b)
                v->reach = (int32_t)ceil((double)v->reach * l->factor[a] / l->factor[b]);
            l->margin[b] = v->reach > l->margin[b] ? v->reach : l->margin[b];
            fits = fits && l->inner[0] / l->factor[b] > 2 * v->reach;
        }
    return fits || g->period == 0.0;
}

bool mill_grids_init(struct mill_grids *g, const struct mill_world *w, double widening)
{
    struct sizes of[MILL_GRIDS_MOST];
    struct layout l;
    const vec3 lo = w->container.places.lo, hi = w->container.places.hi;
    memset(g, 0, sizeof *g);
    g->period = w->container.period;
    g->class_of = calloc((size_t)w->species_count, sizeof *g->class_of);
    g->own = calloc(MILL_GRIDS_MOST, sizeof *g->own);
    if (!g->class_of || !g->own)
        return false;
    g->classes = make_classes(g, w, of);
    if (g->classes == 0)
        return false; /* out of memory */
    unite(g, w, of, CROWD);
    if (!lay_out(g, w, of, widening, &l)) {
        unite(g, w, of, INFINITY);
        if (!lay_out(g, w, of, widening, &l))
            return false; /* the start refuses such short boxes */
    }
    const int n = g->classes;
    g->plain = n == 1 && g->period == 0.0;
    bool made = true;
    for (int a = 0; a < n && made; a++) {
        made = mill_cells_init(&g->own[a], lo, hi, l.inner, l.factor[a], l.margin[a], of[a].least,
                               w->balls);
        g->before[a] = l.factor[a] * (l.margin[0] + l.margin[a]) - l.margin[0];
        g->per_factor[a] = 1.0 / l.factor[a];
    }
    if (made && g->period > 0.0) { /* balls leave the outermost cells */
        g->own[0].edge[0][l.margin[0]] = lo.x;
        g->own[0].edge[0][l.margin[0] + l.inner[0]] = hi.x;
    }
    for (int a = 0; a < n && made; a++)
        for (int b = 0; b < n && made; b++)
            made = make_view(&g->view[a][b], &g->own[b], a == b, b < a);
    return made;
}

void mill_grids_release(struct mill_grids *g)
{
    for (int a = 0; a < MILL_GRIDS_MOST; a++) {
        if (g->own)
            mill_cells_release(&g->own[a]);
        for (int b = 0; b < MILL_GRIDS_MOST; b++)
            free(g->view[a][b].offset[0]);
    }
    free(g->own);
    free(g->class_of);
    memset(g, 0, sizeof *g);
}

/* The cell of a class's grid around a cell of the finest one, by its indices; exact as theirs */
static int32_t cell_in(const struct mill_grids *g, int in, const int32_t fine[3])
{
    const struct mill_cells *c = &g->own[in];
    int32_t i[3];
    for (int k = 0; k < 3; k++)
        i[k] = (int32_t)((fine[k] + g->before[in] + 0.5) * g->per_factor[in]) - g->own[0].margin;
    return (i[0] * c->n[1] + i[1]) * c->n[2] + i[2];
}

/* After the rows of a grid have become longer */
static void rescale(struct mill_grids *g, int in, int32_t row)
{
    for (int a = 0; a < g->classes; a++) {
        const struct mill_grids_view *v = &g->view[a][in];
        for (int face = -1; face < 6; face++)
            for (int32_t k = 0; k < v->count[1 + face]; k++)
                v->offset[1 + face][k] = v->offset[1 + face][k] / row * g->own[in].row;
    }
}

/* The cell of a grid around a cell of the finest grid */
static int32_t cell_around(const struct mill_grids *g, int in, int32_t cell)
{
    int32_t fine[3];
    if (in == 0)
        return cell;
    mill_cells_index(&g->own[0], cell, fine);
    return cell_in(g, in, fine);
}

int32_t mill_grids_block(const struct mill_grids *g, int32_t cell)
{
    return cell_around(g, g->classes - 1, cell);
}

bool mill_grids_has_room(const struct mill_grids *g, int32_t species, int32_t cell)
{
    const int in = g->class_of[species];
    return mill_cells_has_room(&g->own[in], cell_around(g, in, cell));
}

bool mill_grids_insert(struct mill_grids *g, int32_t ball, int32_t species, int32_t cell)
{
    const int in = g->class_of[species];
    struct mill_cells *c = &g->own[in];
    const int32_t row = c->row;
    const bool made = mill_cells_insert(c, ball, cell_around(g, in, cell));
    mill_cells_set(&g->own[0], ball, cell);
    if (c->row != row)
        rescale(g, in, row);
    return made;
}

void mill_grids_remove(struct mill_grids *g, int32_t ball, int32_t species)
{
    mill_cells_remove(&g->own[g->class_of[species]], ball);
}

int32_t mill_grids_across(const struct mill_grids *g, int32_t cell, int32_t face, double *shift)
{
    const struct mill_cells *c = &g->own[0];
    const int32_t step = mill_cells_step(c, face), inner = c->n[0] - 2 * c->margin;
    int32_t i[3];
    *shift = 0.0;
    if (g->period > 0.0 && face < 2) {
        mill_cells_index(c, cell, i);
        if (i[0] == (face ? c->margin + inner - 1 : c->margin)) {
            *shift = face ? -g->period : g->period;
            return cell - (inner - 1) * step;
        }
    }
    return cell + step;
}

bool mill_grids_cross(struct mill_grids *g, int32_t ball, int32_t species, int face, double *shift)
{
    const int32_t to = mill_grids_across(g, g->own[0].cell[ball], face, shift);
    mill_grids_remove(g, ball, species);
    return mill_grids_insert(g, ball, species, to);
}

/* How many of the cells are less than `layers` cells away along x. Their offsets ascend. */
static int32_t count_below(const struct mill_grids_look *look, int32_t layers)
{
    const struct mill_cells *c = look->cells;
    const int64_t layer = (int64_t)c->n[1] * c->n[2] * c->row, end = layers * layer - layer / 2;
    int32_t low = 0, high = look->count;
    if (high == 0 || look->offset[0] >= end || look->offset[high - 1] < end)
        return high == 0 || look->offset[0] >= end ? 0 : high; /* mostly */
    while (low < high) {
        const int32_t middle = low + (high - low) / 2;
        if (look->offset[middle] < end)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Adds the looks into the cells at the other end of a periodic box. */
static int look_beyond(const struct mill_grids *g, struct mill_grids_look *look, int looks)
{
    int all = looks;
    for (int k = 0; k < looks; k++) {
        const struct mill_cells *c = look[k].cells;
        const int32_t inner = c->n[0] - 2 * c->margin, whole = inner * mill_cells_step(c, 1);
        int32_t i[3];
        mill_cells_index(c, look[k].cell, i);
        const int32_t low = count_below(&look[k], c->margin - i[0]);
        const int32_t high = count_below(&look[k], c->margin - i[0] + inner);
        const int side = low > 0 ? 1 : high < look[k].count ? -1 : 0;
        if (side == 0)
            continue;
        struct mill_grids_look *l = &look[all++];
        *l = look[k];
        l->cell += side * whole;
        l->offset += side > 0 ? 0 : high;
        l->count = side > 0 ? low : l->count - high;
        l->shift = side * g->period;
    }
    return all;
}

int mill_grids_look_all(const struct mill_grids *g, int32_t species, int32_t cell, int32_t face,
                        struct mill_grids_look *look)
{
    const int own = g->class_of[species];
    int32_t fine[3], before[3];
    int looks = 0;
    mill_cells_index(&g->own[0], cell, fine);
    memcpy(before, fine, sizeof before);
    if (face >= 0)
        before[face / 2] -= face % 2 ? 1 : -1;
    for (int in = 0; in < g->classes; in++) {
        const struct mill_grids_view *v = &g->view[own][in];
        const int small = in < own ? in : own;
        const int32_t at = cell_in(g, in, fine);
        if (face >= 0 && cell_in(g, small, fine) == cell_in(g, small, before))
            continue; /* who is near the ball is as before */
        look[looks] = (struct mill_grids_look){.cells = &g->own[in],
                                               .offset = v->offset[1 + face],
                                               .sum = v->sum,
                                               .cell = at,
                                               .count = v->count[1 + face]};
        look[looks].threes = in == own && face < 4 && mill_cells_shortest(&g->own[in]);
        looks++;
    }
    return g->period > 0.0 ? look_beyond(g, look, looks) : looks;
}

int32_t mill_grids_gather(const struct mill_grids *g, int32_t species, int32_t cell, int32_t *near)
{
    struct mill_grids_look look[MILL_GRIDS_LOOKS];
    const int looks = mill_grids_look(g, species, cell, -1, look);
    int32_t n = 0;
    for (int k = 0; k < looks; k++)
        n += mill_cells_gather(look[k].cells, look[k].cell, look[k].offset, look[k].count, false, 1,
                               near + n);
    return n;
}

bool mill_grids_near(const struct mill_grids *g, int32_t species, int32_t cell, int32_t other,
                     int32_t other_cell, int image)
{
    const int a = g->class_of[species], b = g->class_of[other], small = a < b ? a : b;
    const struct mill_cells *c = &g->own[small];
    int32_t i[3], j[3], d[3];
    mill_cells_index(c, cell_around(g, small, cell), i);
    mill_cells_index(c, cell_around(g, small, other_cell), j);
    for (int axis = 0; axis < 3; axis++)
        d[axis] = i[axis] - j[axis];
    d[0] -= image * (c->n[0] - 2 * c->margin);
    return a == b ? abs(d[0]) <= 1 && abs(d[1]) <= 1 && abs(d[2]) <= 1
                  : is_within(c, d, g->view[a][b].widest);
}
