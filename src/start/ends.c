/* Can the drum be a slice of a long mill, whose ends are periodic? Balls meet only images of balls,
 * not of surfaces. So no ball at one end may touch what is at the other: a surface keeps a ball's
 * radius away from the ends, or has one cross-section all along. Nothing moves along the axis. */
#include "base/elementary.h"
#include "geometry/shapes.h"
#include "start/clash.h"
#include "start/clash_solid.h"

#include <math.h>

enum { WAYS = 64 };
#define LEAN 1e-9
#define FEWEST 3.0 /* balls along the drum: as many cells as the pair search needs */
/* Relative to the length: rounding errors of places and directions */
#define SNUG 1e-12

/* Does this part reach from -half to half [m] with one cross-section? Then it is equally far at
 * both ends in every direction across: leaning towards either end finds a point beyond it. */
static bool goes_through(const struct mill_part *p, double half)
{
    for (int k = 0; k < WAYS; k++) {
        const struct mill_heading to = mill_elementary_heading(2.0 * MILL_PI * k / WAYS);
        const vec3 way = {0.0, to.cos, to.sin};
        double far[2];
        for (int end = 0; end < 2; end++) {
            const double side = end ? 1.0 : -1.0;
            const vec3 at = mill_part_support(p, vec3_axpy(way, side * LEAN, vec3_make(1, 0, 0)));
            far[end] = vec3_dot(at, way);
            if (side * at.x < half * (1.0 - SNUG))
                return false;
        }
        if (fabs(far[0] - far[1]) > SNUG * half)
            return false;
    }
    return true;
}

/* Is the surface clear of both ends, by `room` [m]? */
static bool is_clear(const struct mill_clash_solid *solid, double half, double room)
{
    const vec3 x = {1.0, 0.0, 0.0}, back = {-1.0, 0.0, 0.0};
    for (int32_t k = 0; k < solid->parts; k++) {
        const struct mill_part *p = &solid->part[k];
        if (fmax(mill_part_extent(p, x), mill_part_extent(p, back)) > half - room &&
            !(solid->solid->support && goes_through(p, half)))
            return false;
    }
    return true;
}

static bool fail(struct mill_fault *fault, enum mill_fault_code code, int surface, double amount)
{
    *fault = (struct mill_fault){.code = code, .other = surface, .amount = amount};
    return false;
}

/* The places of a surface along the axis do not change if its motion only turns about the axis. */
static bool does_surface_fit(const struct mill_setup *s, int k, struct mill_motion *const *motion,
                             double half, double room, struct mill_fault *fault)
{
    const vec3 x = {1.0, 0.0, 0.0};
    struct mill_clash_solid solid;
    const int on = s->surface[k].motion, number = mill_clash_number(s, k);
    if (on != MILL_STILL && !mill_motion_keeps(motion[on], x))
        return fail(fault, MILL_FAULT_MOVES, number, 0.0);
    if (s->surface[k].body->inside)
        return on == MILL_STILL || mill_motion_pose(motion[on], 0.0).about_x ||
               fail(fault, MILL_FAULT_MOVES, number, 0.0);
    const bool made = mill_clash_solid_init(&solid, s, k, motion);
    const bool fits = made && is_clear(&solid, half, room);
    mill_clash_solid_free(&solid);
    return fits || fail(fault, made ? MILL_FAULT_END : MILL_FAULT_MEMORY, number, room);
}

bool mill_ends_fit(const struct mill_setup *s, struct mill_motion *const *m, struct mill_fault *f)
{
    const struct mill_body *slice = mill_shapes_container(s)->body;
    double widest = 0.0;
    if (!slice->open)
        return true;
    for (int k = 0; k < s->species; k++)
        widest = fmax(widest, s->balls[k].diameter);
    if (slice->length < FEWEST * widest * (1.0 + 1e-6))
        return fail(f, MILL_FAULT_SHORT, -1, widest);
    if (s->gravity.x != 0.0)
        return fail(f, MILL_FAULT_TILT, -1, 0.0);
    for (int k = 0; k < s->surfaces; k++)
        if (!does_surface_fit(s, k, m, 0.5 * slice->length, 0.5 * widest, f))
            return false;
    return true;
}
