/* The classic parts of a mill as bodies, and the faults of a setup in words. */
#include "millsim/setup.h"
#include "base/elementary.h"

#include <assert.h>

struct mill_body mill_setup_shaft(double radius, double length)
{
    return (struct mill_body){.x = {0.0, 1.0, 0.0},
                              .y = {0.0, 0.0, 1.0},
                              .z = {1.0, 0.0, 0.0},
                              .radius = radius,
                              .length = length};
}

struct mill_body mill_setup_drum_body(const struct mill_setup_drum *drum)
{
    struct mill_body body = mill_setup_shaft(drum->radius, drum->length);
    body.inside = 1;
    body.open = drum->periodic;
    body.corners = drum->corners;
    body.corner = drum->corner;
    return body;
}

struct mill_body mill_setup_blade(const struct mill_blade *blade)
{
    const struct mill_heading angle = mill_elementary_heading(blade->angle);
    const struct mill_heading pitch = mill_elementary_heading(blade->pitch);
    const vec3 radial = {0.0, angle.cos, angle.sin}, around = {0.0, -angle.sin, angle.cos};
    const vec3 along = {1.0, 0.0, 0.0};
    return (struct mill_body){.centre = {blade->position, 0.5 * blade->tip_radius * angle.cos,
                                         0.5 * blade->tip_radius * angle.sin},
                              .x = vec3_axpy(vec3_scale(along, pitch.cos), pitch.sin, around),
                              .y = radial,
                              .z = vec3_axpy(vec3_scale(along, -pitch.sin), pitch.cos, around),
                              .size = {blade->width, blade->tip_radius, blade->thickness}};
}

const char *mill_setup_fault_text(enum mill_fault_code code)
{
    static const char *const text[] = {
        [MILL_FAULT_NONE] = "no fault",
        [MILL_FAULT_MEMORY] = "out of memory for the mill and its balls",
        [MILL_FAULT_NUMBER] = "a number of the mill is out of range",
        [MILL_FAULT_SPEED] = "a ball starts faster than light",
        [MILL_FAULT_BALL_IN_SHAPE] = "a ball starts within a surface",
        [MILL_FAULT_BALL_IN_BALL] = "two balls overlap at the start",
        [MILL_FAULT_NO_ROOM] = "the balls do not fit",
        [MILL_FAULT_CONTAINER] = "there is no container, or more than one",
        [MILL_FAULT_OUTSIDE] = "a body leaves the container",
        [MILL_FAULT_CLASH] = "two bodies run into each other",
        [MILL_FAULT_SHORT] = "a periodic drum is shorter than three balls",
        [MILL_FAULT_TILT] = "gravity has a component along a periodic drum",
        [MILL_FAULT_MOVES] = "a motion moves something along a periodic drum",
        [MILL_FAULT_END] = "a body is too near to an end of a periodic drum",
        [MILL_FAULT_BALL_OUTSIDE] = "a ball starts beyond an end of a periodic drum",
    };
    assert((unsigned)code < sizeof text / sizeof *text);
    return text[code];
}
