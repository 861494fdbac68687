/* Can the drum be a slice of a long mill, whose ends are periodic? Balls meet only the images of
 * balls, not those of surfaces. So no ball at one end may touch what is at the other end: a surface
 * either keeps a ball's radius away from the ends, or has the same cross-section from end to end.
 * Nothing may move along the axis. */
#include "start/ends.h"

#include "start/clash_solid.h"

#include <math.h>

#define FEWEST 3.0 /* balls along the drum: as many cells as the pair search needs */
/* Relative to the length: rounding errors of places and directions */
#define SNUG 1e-12

/* The largest x of a part, or the largest -x (way -1) */
static double farthest(const struct mill_clash_part *p, double way)
{
    const vec3 at = mill_clash_solid_support(p, vec3_make(way, 0.0, 0.0));
    return way * at.x + p->grown;
}

/* Does this part reach from -half to half [m] with one cross-section? */
static bool goes_through(const struct mill_clash_part *p, double half)
{
    const double side[3] = {p->half.x, p->half.y, p->half.z};
    const vec3 axis[3] = {p->x, p->y, p->z};
    const double least = half * (1.0 - SNUG) + fabs(p->centre.x);
    if (p->form == MILL_CLASH_FACET || (p->form == MILL_CLASH_ROUND && p->low != p->high))
        return false;
    for (int k = p->form == MILL_CLASH_ROUND ? 2 : 0; k < 3; k++)
        if (hypot(axis[k].y, axis[k].z) <= SNUG && side[k] >= least)
            return true;
    return false;
}

/* Is the surface clear of both ends, by `room` [m]? */
static bool is_clear(const struct mill_clash_solid *solid, double half, double room)
{
    bool clear = true;
    for (int32_t k = 0; clear && k < solid->parts; k++)
        clear =
            goes_through(&solid->part[k], half) ||
            fmax(farthest(&solid->part[k], 1.0), farthest(&solid->part[k], -1.0)) <= half - room;
    return clear;
}

static bool fail(struct mill_fault *fault, enum mill_fault_code code, int surface, double amount)
{
    *fault = (struct mill_fault){.code = code, .other = surface, .amount = amount};
    return false;
}

/* The places of a surface along the axis do not change if its motion only turns about the axis. */
static bool does_surface_fit(const struct mill_setup *s, int k, struct mill_motion *const *motion,
                             double room, struct mill_fault *fault)
{
    const vec3 x = {1.0, 0.0, 0.0};
    struct mill_clash_solid solid;
    const int on = s->surface[k].motion;
    if (on != MILL_STILL && !mill_motion_keeps(motion[on], x))
        return fail(fault, MILL_FAULT_MOVES, k, 0.0);
    if (!mill_clash_solid_is(&s->surface[k]) || s->surface[k].type == &mill_cylinder_shaft_type)
        return true;
    const bool made = mill_clash_solid_init(&solid, s, k, motion);
    const bool fits = made && is_clear(&solid, 0.5 * s->drum.length, room);
    mill_clash_solid_free(&solid);
    return fits || fail(fault, made ? MILL_FAULT_END : MILL_FAULT_MEMORY, k, room);
}

bool mill_ends_fit(const struct mill_setup *s, struct mill_motion *const *motion,
                   struct mill_fault *fault)
{
    double widest = 0.0;
    if (!s->drum.periodic)
        return true;
    for (int k = 0; k < s->species; k++)
        widest = fmax(widest, s->balls[k].diameter);
    if (s->drum.length < FEWEST * widest * (1.0 + 1e-6))
        return fail(fault, MILL_FAULT_SHORT, -1, widest);
    if (s->gravity.x != 0.0)
        return fail(fault, MILL_FAULT_TILT, -1, 0.0);
    if (s->drum.rides > 0 && !mill_motion_pose(motion[s->drum.rides - 1], 0.0).about_x)
        return fail(fault, MILL_FAULT_MOVES, -1, 0.0);
    for (int k = 0; k < s->surfaces; k++)
        if (!does_surface_fit(s, k, motion, 0.5 * widest, fault))
            return false;
    return true;
}
