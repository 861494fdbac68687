/* Every impact, one row each, one dataset a column, under /impacts: for output.impacts = all. */
#ifndef MILL_IMPACTLOG_H
#define MILL_IMPACTLOG_H

#include "millsim/observer.h"

extern const struct mill_observer_type mill_impactlog_type;

#endif
