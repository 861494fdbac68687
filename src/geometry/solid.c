/* What all solids have in common. */
#include "geometry/solid.h"

bool mill_solid_is_inside(const void *body)
{
    return ((const struct mill_body *)body)->inside != 0;
}

bool mill_solid_is_length(double length, bool none)
{
    return (length >= MILL_SOLID_LEAST && isfinite(length)) || (none && length == 0.0);
}

static bool is_unit(vec3 a)
{
    return fabs(vec3_dot(a, a) - 1.0) < 1e-12;
}

bool mill_solid_is_sound(const struct mill_solid *solid, const struct mill_body *b)
{
    const bool holds = !b->inside || ((solid->walls || !solid->support) && b->rounding == 0.0);
    return isfinite(vec3_norm(b->centre)) && is_unit(b->x) && is_unit(b->y) &&
           vec3_norm(vec3_sub(vec3_cross(b->x, b->y), b->z)) < 1e-12 && holds &&
           mill_solid_is_length(b->rounding, true) && solid->is_sound(b);
}

vec3 mill_solid_extents(const struct mill_solid *solid, const struct mill_core *core)
{
    double far[3];
    for (int k = 0; k < 3; k++) {
        const vec3 way = {k == 0, k == 1, k == 2}, back = vec3_scale(way, -1.0);
        far[k] = fmax(vec3_dot(way, solid->support(core, way)),
                      vec3_dot(back, solid->support(core, back)));
    }
    return vec3_make(far[0], far[1], far[2]);
}

struct mill_hull mill_solid_hull(const struct mill_solid *solid, const struct mill_body *is)
{
    if (solid->hull)
        return solid->hull(is);
    const struct mill_core core = solid->core(is);
    const vec3 most = mill_solid_extents(solid, &core);
    const double far[3] = {core.grown + most.x, core.grown + most.y, core.grown + most.z};
    int k = 2;
    if (!is->inside && (far[2] < far[0] || far[2] < far[1]))
        k = far[0] >= far[1] ? 0 : 1;
    const double one = far[(k + 1) % 3], other = far[(k + 2) % 3];
    return (struct mill_hull){far[k], sqrt(one * one + other * other), (k + 1) % 3};
}
