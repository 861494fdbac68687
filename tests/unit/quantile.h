/* A quantile of the speeds of a spectrum, by itself */
#ifndef QUANTILE_H
#define QUANTILE_H

#include "observe/spectrum.h"

/* [m/s] of the speeds in `slot` and all slots above it; NaN if there are none */
static inline double quantile_of(const struct mill_spectrum_grid *grid,
                                 const struct mill_spectrum *spectrum, int slot, double level)
{
    const struct mill_spectrum_place place = mill_spectrum_place(spectrum, slot, level);
    return mill_spectrum_speed(grid, &place);
}

#endif
