/* Phases that do not drift: what has gone through many turns is reduced to less than one, with the
 * products that are subtracted exact. */
#ifndef MILL_PHASE_H
#define MILL_PHASE_H

#include "millsim/vec3.h"

/* start + rate * time less whole turns: rate in turns per second, all in turns; within half a turn.
 * Exact but for the last rounding, whatever the time. */
static inline double mill_phase_turns(double start, double rate, double time)
{
    const double whole = rate * time, rest = fma(rate, time, -whole);
    const double phase = (whole - rint(whole)) + rest + start;
    return phase - rint(phase);
}

/* The same in radians: rate in radians per second. 2 pi has two parts, of which the product with
 * the first is subtracted exactly. */
static inline double mill_phase_radians(double start, double rate, double time)
{
    const double whole = rate * time, rest = fma(rate, time, -whole);
    const double turns = rint(whole / (2.0 * MILL_PI));
    const double left = fma(-turns, 2.0 * MILL_PI, whole);
    return fmod(fma(-turns, 2.4492935982947064e-16, left) + rest + start, 2.0 * MILL_PI);
}

#endif
