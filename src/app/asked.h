/* What a deck asks of the observers */
#ifndef MILL_ASKED_H
#define MILL_ASKED_H

#include "deck/deck.h"
#include "observe/observe.h"

/* What a deck asks the observers of its mill for */
struct mill_observe mill_asked_observe(const struct mill_deck *deck,
                                       const struct mill_world *world);

#endif
