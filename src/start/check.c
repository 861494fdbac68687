/* Start positions that were given: speeds, surfaces, pairs, in this order. */
#include "start/check.h"

#include "engine/cells.h"
#include "geometry/shape.h"

#include <stdlib.h>

/* [m] rounding of a decimal position may make touching balls overlap by this much */
#define SLACK 1e-12
/* [m/s] a speed beyond it is a slip of units, and its square may overflow */
#define LIGHT 299792458.0

static double radius_of(const struct mill_world *w, int32_t i)
{
    return w->species[w->ball[i].species].radius;
}

static enum mill_fault_code check_speeds(const struct mill_world *w, struct mill_fault *fault)
{
    for (int32_t i = 0; i < w->balls; i++) {
        if (vec3_norm(w->ball[i].v) <= LIGHT && vec3_norm(w->spin[i]) * radius_of(w, i) <= LIGHT)
            continue;
        fault->ball = i;
        return fault->code = MILL_FAULT_SPEED;
    }
    return MILL_FAULT_NONE;
}

static enum mill_fault_code check_shapes(const struct mill_world *w, struct mill_fault *fault)
{
    for (int32_t i = 0; i < w->balls; i++) {
        for (int k = 0; k < w->shapes; k++) {
            const struct mill_shape *s = w->shape[k];
            const struct mill_pose pose = mill_shape_pose(s, 0.0);
            const double gap = mill_shape_gap(s, w->ball[i].r, radius_of(w, i), &pose);
            if (gap >= -SLACK)
                continue;
            fault->ball = i;
            fault->kind = s->type->kind;
            fault->amount = -gap;
            return fault->code = MILL_FAULT_BALL_IN_SHAPE;
        }
    }
    return MILL_FAULT_NONE;
}

static enum mill_fault_code check_pair(const struct mill_world *w, int32_t i, int32_t j,
                                       struct mill_fault *fault)
{
    const double distance = vec3_norm(vec3_sub(w->ball[i].r, w->ball[j].r));
    const double gap = distance - (radius_of(w, i) + radius_of(w, j));
    if (gap >= -SLACK)
        return MILL_FAULT_NONE;
    fault->ball = i;
    fault->other = j;
    fault->amount = -gap;
    return fault->code = MILL_FAULT_BALL_IN_BALL;
}

static enum mill_fault_code check_pairs(const struct mill_world *w, struct mill_fault *fault)
{
    double widest = 0.0, least = INFINITY;
    for (int k = 0; k < w->species_count; k++) {
        widest = fmax(widest, 2.0 * w->species[k].radius);
        least = fmin(least, 2.0 * w->species[k].radius);
    }
    const double r = w->drum_radius, l = 0.5 * w->drum_length;
    struct mill_cells cells;
    int32_t *near = malloc(sizeof *near * ((size_t)w->balls + MILL_CELL_ROW));
    if (!near || !mill_cells_init(&cells, vec3_make(-l, -r, -r), vec3_make(l, r, r), widest, least,
                                  w->balls)) {
        free(near);
        return fault->code = MILL_FAULT_MEMORY;
    }
    enum mill_fault_code code = MILL_FAULT_NONE;
    for (int32_t i = 0; i < w->balls && code == MILL_FAULT_NONE; i++) {
        const int32_t cell = mill_cells_at(&cells, w->ball[i].r);
        const int32_t n = mill_cells_gather(&cells, cell, cells.around, 27, 1, near);
        for (int32_t k = 0; k < n && code == MILL_FAULT_NONE; k++)
            code = check_pair(w, i, near[k], fault);
        if (code == MILL_FAULT_NONE && !mill_cells_insert(&cells, i, cell))
            code = fault->code = MILL_FAULT_MEMORY;
    }
    mill_cells_release(&cells);
    free(near);
    return code;
}

enum mill_fault_code mill_check_start(const struct mill_world *world, struct mill_fault *fault)
{
    enum mill_fault_code code = check_speeds(world, fault);
    if (code == MILL_FAULT_NONE)
        code = check_shapes(world, fault);
    return code == MILL_FAULT_NONE ? check_pairs(world, fault) : code;
}
