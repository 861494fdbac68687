/* What the search for places needs to know. First, from a lattice over the container's box: the
 * room that the surfaces leave for the balls: its volume, and for each cell the surfaces that a
 * ball in it can touch. A distance changes by no more than the place does, so that at the centre of
 * a cell bounds those in the whole cell.
 *
 * Second, a lookup of balls by place, for mixtures of any sizes: one cell grid for each class of
 * sizes, with cells as wide as its largest ball. The neighbours of a ball are searched in all
 * grids, in the cells that both radii can reach: few cells of large balls, more of small ones. */
#include "start/fill.h"

#include "base/elementary.h"
#include "geometry/shape.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* Points of the lattice, about; least along an axis; more than its halvings; cells taken singly */
enum { POINTS = 200000, FEWEST = 8, HALVINGS = 64, BLOCK = 64 };
#define CLASS_RATIO 1.5 /* largest over smallest diameter of the balls in one grid */

/* ---- the room ---- */

/* Sets up the lattice over a box. Cells are cubes, except in a flat or thin drum. */
static void lay_out(struct mill_cells *l, const double extent[3])
{
    double side = mill_elementary_cbrt(extent[0] * extent[1] * extent[2] / POINTS), points;
    do {
        points = 1.0;
        for (int axis = 0; axis < 3; axis++) {
            l->n[axis] = (int32_t)fmin(fmax(ceil(extent[axis] / side), FEWEST), POINTS);
            l->side[axis] = extent[axis] / l->n[axis];
            points *= l->n[axis];
        }
        side *= 1.25;
    } while (points > FEWEST * (double)POINTS);
}

static vec3 centre_of(const struct mill_cells *l, const int32_t at[3])
{
    return vec3_make(l->lo.x + (at[0] + 0.5) * l->side[0], l->lo.y + (at[1] + 0.5) * l->side[1],
                     l->lo.z + (at[2] + 0.5) * l->side[2]);
}

/* Notes for a cell which of the first `count` surfaces of `near` are nearer than `reach` to its
 * centre. Is the centre clear of all surfaces? */
static bool look_at(struct mill_fill_room *room, const int32_t at[3], double reach, uint64_t deep,
                    const int *near, int count)
{
    const vec3 centre = centre_of(&room->lattice, at);
    uint64_t mask = deep;
    bool clear = deep == 0;
    for (int i = 0; i < count; i++) {
        const int k = near[i];
        const double gap = mill_shape_gap(room->world->shape[k], centre, 0.0, &room->pose[k]);
        mask |= (uint64_t)(gap < reach) << k % 64;
        clear = clear && gap > 0.0;
    }
    room->near[(at[0] * room->lattice.n[1] + at[1]) * room->lattice.n[2] + at[2]] = mask;
    return clear;
}

/* The same for the cells from `first` to `last`. `deep`: the surfaces that all the centres are
 * behind. Behind the first `count` of `near` there is room for those of its halves: few are in
 * reach of a box of cells, and of most boxes none. Returns the number of clear centres. */
static size_t look_around(struct mill_fill_room *room, const int32_t first[3],
                          const int32_t last[3], double reach, uint64_t deep, int *near, int count)
{
    const vec3 lo = centre_of(&room->lattice, first), hi = centre_of(&room->lattice, last);
    const vec3 middle = vec3_scale(vec3_add(lo, hi), 0.5);
    const double size = 0.501 * vec3_norm(vec3_sub(hi, lo));
    size_t cells = 1, inside = 0;
    int left = 0;
    for (int axis = 0; axis < 3; axis++)
        cells *= (size_t)(last[axis] - first[axis] + 1);
    for (int i = 0; i < count; i++) {
        const int k = near[i];
        const double gap = mill_shape_gap(room->world->shape[k], middle, 0.0, &room->pose[k]);
        if (gap <= -size)
            deep |= (uint64_t)1 << k % 64;
        else if (gap < reach + size)
            near[count + left++] = k;
    }
    if (cells <= BLOCK || left == 0) {
        int32_t at[3];
        for (at[0] = first[0]; at[0] <= last[0]; at[0]++)
            for (at[1] = first[1]; at[1] <= last[1]; at[1]++)
                for (at[2] = first[2]; at[2] <= last[2]; at[2]++)
                    inside += look_at(room, at, reach, deep, near + count, left);
        return inside;
    }
    for (int part = 0; part < 8; part++) {
        int32_t from[3], to[3];
        for (int axis = 0; axis < 3; axis++) {
            const int32_t middle_of = (first[axis] + last[axis]) / 2;
            from[axis] = part >> axis & 1 ? middle_of + 1 : first[axis];
            to[axis] = part >> axis & 1 ? last[axis] : middle_of;
        }
        if (from[0] <= to[0] && from[1] <= to[1] && from[2] <= to[2])
            inside += look_around(room, from, to, reach, deep, near + count, left);
    }
    return inside;
}

bool mill_fill_room_init(struct mill_fill_room *room, const struct mill_world *w, double reach)
{
    assert(reach > 0.0);
    const int32_t *n = room->lattice.n;
    const vec3 size = vec3_sub(w->container.hi, w->container.lo);
    const double extent[3] = {size.x, size.y, size.z};
    room->lattice = (struct mill_cells){.lo = w->container.lo};
    lay_out(&room->lattice, extent);
    const vec3 side = {room->lattice.side[0], room->lattice.side[1], room->lattice.side[2]};
    const double near = reach * (1.0 + 2.0 * MILL_FILL_SPACING) + 0.501 * vec3_norm(side);
    const size_t cells = (size_t)n[0] * (size_t)n[1] * (size_t)n[2];
    room->world = w;
    room->near = calloc(cells, sizeof *room->near);
    room->pose = calloc((size_t)w->shapes, sizeof *room->pose);
    int *all = calloc((size_t)w->shapes * HALVINGS, sizeof *all);
    const bool good = room->near && room->pose && all;
    for (int k = 0; good && k < w->shapes; k++) {
        room->pose[k] = mill_shape_pose(w->shape[k], 0.0);
        all[k] = k;
    }
    const int32_t first[3] = {0, 0, 0}, last[3] = {n[0] - 1, n[1] - 1, n[2] - 1};
    const size_t inside = good ? look_around(room, first, last, near, 0, all, w->shapes) : 0;
    free(all);
    room->volume = extent[0] * extent[1] * extent[2] * (double)inside / (double)cells;
    return good;
}

void mill_fill_room_free(struct mill_fill_room *room)
{
    free(room->near);
    free(room->pose);
}

/* [m] To a wall at the nearer periodic end: only the start has it: no balls overlap across. */
static double gap_to_end(const struct mill_world *w, vec3 r, double radius)
{
    return w->container.period > 0.0 ? 0.5 * w->container.period - fabs(r.x) - radius
                                     : (double)INFINITY;
}

bool mill_fill_room_clear(const struct mill_fill_room *room, vec3 r, double radius)
{
    const struct mill_world *w = room->world;
    const uint64_t mask = room->near[mill_cells_at(&room->lattice, r)];
    if (!(gap_to_end(w, r, radius) > 0.0))
        return false;
    for (int k = 0; mask && k < w->shapes; k++)
        if (mask >> k % 64 & 1 && !(mill_shape_gap(w->shape[k], r, radius, &room->pose[k]) > 0.0))
            return false;
    return true;
}

bool mill_fill_room_push(const struct mill_fill_room *room, vec3 *r, double radius)
{
    const struct mill_world *w = room->world;
    const uint64_t mask = room->near[mill_cells_at(&room->lattice, *r)];
    const double end = gap_to_end(w, *r, radius);
    bool moved = end < MILL_FILL_CLOSE * radius;
    if (moved)
        r->x -= copysign(MILL_FILL_SPACING * radius - end, r->x);
    for (int k = 0; mask && k < w->shapes; k++) {
        if (!(mask >> k % 64 & 1))
            continue;
        const struct mill_contact c =
            w->shape[k]->type->contact(w->shape[k], *r, radius, &room->pose[k]);
        if (c.gap < MILL_FILL_CLOSE * radius) {
            *r = vec3_axpy(*r, MILL_FILL_SPACING * radius - c.gap, c.normal);
            moved = true;
        }
    }
    return moved;
}

/* ---- balls by place ---- */

static bool make_grid(struct mill_fill_grid *g, const struct mill_world *w)
{
    const vec3 size = vec3_sub(w->container.hi, w->container.lo);
    const double extent[3] = {size.x, size.y, size.z};
    int32_t inner[3];
    const double most = 16.0 * (double)g->balls + 4096.0;
    const double wide = 2.0 * g->widest * (1.0 + MILL_FILL_SPACING);
    const double side = fmax(wide, mill_elementary_cbrt(extent[0] * extent[1] * extent[2] / most));
    for (int axis = 0; axis < 3; axis++)
        inner[axis] = (int32_t)fmin(fmax(floor(extent[axis] / side), 1.0), 1024.0);
    /* rows for balls as wide as the cells: others are few, or the rows grow */
    return mill_cells_init(
        &g->cells, w->container.lo, w->container.hi, inner, 1, 1,
        fmax(extent[0] / inner[0], fmax(extent[1] / inner[1], extent[2] / inner[2])), w->balls);
}

bool mill_fill_grids_init(struct mill_fill_grids *s, const struct mill_world *w, double widest)
{
    memset(s, 0, sizeof *s);
    s->balls = w->balls;
    s->place = calloc((size_t)w->balls, sizeof *s->place);
    if (!s->place)
        return false;
    for (int32_t i = 0; i < w->balls; i++) {
        struct mill_fill_place *p = &s->place[i];
        p->radius = mill_world_radius(w, i);
        const double k = floor(log(widest / p->radius) / log(CLASS_RATIO) + 1e-9);
        p->class = (int16_t)fmin(k, MILL_FILL_CLASSES - 1);
        struct mill_fill_grid *g = &s->grid[p->class];
        g->widest = fmax(g->widest, p->radius);
        g->balls++;
    }
    bool good = true;
    for (int k = 0; good && k < MILL_FILL_CLASSES; k++)
        good = s->grid[k].balls == 0 || make_grid(&s->grid[k], w);
    return good;
}

void mill_fill_grids_free(struct mill_fill_grids *s)
{
    for (int k = 0; k < MILL_FILL_CLASSES; k++)
        mill_cells_release(&s->grid[k].cells);
    free(s->place);
    memset(s, 0, sizeof *s);
}

void mill_fill_grids_clear(struct mill_fill_grids *s)
{
    for (int k = 0; k < MILL_FILL_CLASSES; k++) {
        if (s->grid[k].placed > 0)
            mill_cells_clear(&s->grid[k].cells);
        s->grid[k].placed = 0;
    }
}

void mill_fill_grids_place(struct mill_fill_grids *s, int32_t i)
{
    assert(i >= 0 && i < s->balls);
    const struct mill_fill_place *p = &s->place[i];
    struct mill_fill_grid *g = &s->grid[p->class];
    s->failed = s->failed || !mill_cells_insert(&g->cells, i, mill_cells_at(&g->cells, p->r));
    g->placed++;
}

void mill_fill_grids_replace(struct mill_fill_grids *s, int32_t i)
{
    const struct mill_fill_place *p = &s->place[i];
    struct mill_fill_grid *g = &s->grid[p->class];
    if (s->failed || mill_cells_at(&g->cells, p->r) == g->cells.cell[i])
        return;
    mill_cells_remove(&g->cells, i);
    g->placed--;
    mill_fill_grids_place(s, i);
}

int32_t mill_fill_grids_near(const struct mill_fill_grids *s, vec3 r, double radius, int32_t *out)
{
    const int64_t here = 0;
    int32_t n = 0;
    for (int k = MILL_FILL_CLASSES - 1; k >= 0; k--) {
        const struct mill_fill_grid *g = &s->grid[k];
        const struct mill_cells *c = &g->cells;
        if (g->placed == 0)
            continue;
        const double reach = (radius + g->widest) * (1.0 + MILL_FILL_SPACING);
        const double at[3] = {r.x - c->lo.x, r.y - c->lo.y, r.z - c->lo.z};
        int32_t from[3], to[3];
        for (int axis = 0; axis < 3; axis++) {
            from[axis] = mill_cells_along(c, axis, at[axis] - reach);
            to[axis] = mill_cells_along(c, axis, at[axis] + reach);
        }
        for (int32_t x = to[0]; x >= from[0]; x--)
            for (int32_t y = to[1]; y >= from[1]; y--)
                for (int32_t z = to[2]; z >= from[2]; z--)
                    n += mill_cells_gather(c, (x * c->n[1] + y) * c->n[2] + z, &here, 1, false, 1,
                                           out + n);
    }
    return n;
}
