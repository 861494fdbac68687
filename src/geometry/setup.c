/* Faults of a setup in words. */
#include "millsim/setup.h"

#include <assert.h>

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
        [MILL_FAULT_SURFACE] = "a surface does not fit into the drum",
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
