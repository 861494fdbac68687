/* What the files with keys of a deck share: short names for the members of a row, which have two
 * lines at most. */
#ifndef MILL_DECK_KEYS_H
#define MILL_DECK_KEYS_H

#include "deck/deck_private.h"
#include "geometry/solid.h"

enum { MILL_DECK_MOST_BLADES = 10000 };

/* In a mill of ten kilometres the resolution of a place is 2e-12 m. In a larger mill, overlaps
 * could exceed a nanometre. */
#define SIZE_OF_MILL .lo = MILL_SOLID_LEAST, .hi = 1e4
/* [kg/m^3] A thousandth of the density of air. It allows balls of almost no mass, and the energies
 * of the smallest balls are still far above the smallest double. */
#define LEAST_DENSITY 1e-3

#define ANY MILL_KEY_ANY
#define TEXT .type = MILL_KEY_NAME, .derived = true
#define POSITIVE MILL_KEY_POSITIVE
#define NOT_NEGATIVE MILL_KEY_NOT_NEGATIVE
#define IN(type, member) .offset = offsetof(struct type, member)
#define DECK(member) IN(mill_deck, given.member)

#endif
