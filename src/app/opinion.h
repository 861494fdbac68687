/* A second opinion on the quartics of a paranoid run, by GSL; true also if GSL finds no roots */
#ifndef MILL_APP_OPINION_H
#define MILL_APP_OPINION_H

#include "millsim/poly.h"

mill_poly_opinion_fn mill_opinion_agrees;

#endif
