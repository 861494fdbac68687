/* From a deck to a world: the deck as plain numbers, and what is wrong with these told in the
 * deck's terms. */
#ifndef MILL_DECK_SETUP_H
#define MILL_DECK_SETUP_H

#include "deck/deck.h"
#include "millsim/start.h"

/* The balls of a start file, and the line [1..] of each */
struct mill_deck_start {
    struct mill_setup_ball *ball;
    long *line;
};

/* Reads deck->start: x y z [vx vy vz [wx wy wz]] in SI a line, # comments. Every fault of the text
 * (too few or too many rows, not a number) is named with file and line. watch may be NULL. Owner:
 * the caller, also after a failure. */
enum mill_status mill_deck_start_read(const struct mill_deck *deck, int32_t balls,
                                      const struct mill_start_watch *watch,
                                      struct mill_deck_start *start, struct mill_error *error);

/* The deck's world. watch may be NULL. MILL_BAD_DECK when balls do not fit or overlap. Owner: the
 * caller. */
enum mill_status mill_deck_setup_world(const struct mill_deck *deck,
                                       const struct mill_start_watch *watch,
                                       struct mill_world **world, struct mill_error *error);

#endif
