/* Time series at output.series: energies, rotor, losses and counts, under /observables. */
#ifndef MILL_SERIES_H
#define MILL_SERIES_H

#include "millsim/observer.h"

extern const struct mill_observer_type mill_series_type;

#endif
