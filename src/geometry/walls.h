/* The surfaces of a mill: one constructor a shape, and the list that a deck asks for. */
#ifndef MILLSIM_WALLS_H
#define MILLSIM_WALLS_H

#include "geometry/shape.h"
#include "millsim/deck.h"
#include "millsim/status.h"

/* Builds all shapes of the deck: drum, end walls, shaft, blades. Owner: the caller. */
enum mill_status mill_walls_create(const struct mill_deck *deck, struct mill_poly_counts *counts,
                                   struct mill_shape ***shapes, int *count,
                                   struct mill_error *error);
void mill_walls_free(struct mill_shape **shapes, int count);

#endif
