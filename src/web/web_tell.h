/* What the page is told of a new mill */
#ifndef MILL_WEB_TELL_H
#define MILL_WEB_TELL_H

#include "deck/deck.h"
#include "millsim/world.h"

#include <stdio.h>

/* Writes the JSON object of mill_web_load. warnings: a line each */
void mill_web_tell(FILE *out, const struct mill_deck *deck, const struct mill_world *world,
                   const char *warnings);

#endif
