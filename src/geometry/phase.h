/* Phases without drift: the phase after many turns is reduced to less than one turn, with exact
 * products, so that rounding errors do not add up. */
#ifndef MILL_PHASE_H
#define MILL_PHASE_H

#include "millsim/vec3.h"

/* start + rate * time without the whole turns: rate in turns per second, all others in turns; the
 * result is within half a turn. It has one rounding error only, for any time. */
static inline double mill_phase_turns(double start, double rate, double time)
{
    const double whole = rate * time, rest = fma(rate, time, -whole);
    const double phase = (whole - rint(whole)) + rest + start;
    return phase - rint(phase);
}

/* The same in radians. 2 pi has two parts; the product with the first is subtracted exactly. */
static inline double mill_phase_radians(double start, double rate, double time)
{
    const double whole = rate * time, rest = fma(rate, time, -whole);
    const double turns = rint(whole / (2.0 * MILL_PI)), left = fma(-turns, 2.0 * MILL_PI, whole);
    return fmod(fma(-turns, 2.4492935982947064e-16, left) + rest + start, 2.0 * MILL_PI);
}

#endif
