/* The places of the arcs of the wavy profile. The formulas avoid cancellation for all heights from
 * zero to overhangs and for any number of buckles. */
#include "base/profile.h"

#include "base/elementary.h"

#include "millsim/vec3.h"

#include <assert.h>

struct mill_profile mill_profile_make(int buckles, double radius, double height, double angle)
{
    assert(buckles >= 2 && radius > 0.0 && height >= 0.0);
    const double half_pitch = MILL_PI / buckles, s = mill_elementary_heading(0.5 * half_pitch).sin;
    const double q = 2.0 * s * s, h = height;
    const double rest = q * radius * radius - 2.0 * h * h;
    const double u = rest / (2.0 * h + sqrt(4.0 * h * h + q * rest));
    /* R - u would cancel if h is small; this form follows from the equation of u */
    const double outer = u > 0.0 ? (4.0 * h * u + 2.0 * h * h) / (q * (radius + u)) : radius - u;
    const double inner = radius + u;
    /* angle at an inner centre, between the axis and the next outer centre */
    const struct mill_heading half = mill_elementary_heading(half_pitch);
    const double half_inner = mill_elementary_atan2(outer * half.sin, inner - outer * half.cos);
    return (struct mill_profile){.buckles = buckles,
                                 .radius = radius,
                                 .height = height,
                                 .angle = angle,
                                 .arc = u + h,
                                 .outer = outer,
                                 .inner = inner,
                                 .half_outer = half_inner + half_pitch,
                                 .half_inner = half_inner};
}

/* An arc meets its mirror image in the neighbouring half pitch if it covers the direction normal to
 * the ray between them and its radius reaches this ray. */
bool mill_profile_is_sound(const struct mill_profile *p)
{
    const double s = mill_elementary_heading(MILL_PI / p->buckles).sin;
    if (p->half_outer >= 0.5 * MILL_PI && p->inner * s <= p->arc)
        return false;
    return p->height < p->radius && !(p->half_inner >= 0.5 * MILL_PI && p->outer * s <= p->arc);
}
