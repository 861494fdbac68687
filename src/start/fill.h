/* First positions: random, without overlap. */
#ifndef MILLSIM_FILL_H
#define MILLSIM_FILL_H

#include "millsim/deck.h"
#include "millsim/status.h"
#include "millsim/world.h"

/* Places all balls of the world (shapes and species are there, ball[i].species set) at random
 * without overlap with each other, or with any shape at the rotor's starting angle, by the deck's
 * seed, and gives each the deck's speed in a random direction. watch may be NULL. MILL_BAD_DECK
 * with the number that would fit when they do not. */
enum mill_status mill_fill_random(const struct mill_deck *deck,
                                  const struct mill_start_watch *watch, struct mill_world *world,
                                  struct mill_error *error);

#endif
