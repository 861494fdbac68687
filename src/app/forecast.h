/* What a run will cost, from a short trial of it: contacts, processor time, memory, file. */
#ifndef MILL_FORECAST_H
#define MILL_FORECAST_H

#include "deck/deck.h"
#include "millsim/world.h"

struct mill_forecast {
    double trial;        /* [s] simulated by the trial */
    double contacts;     /* of the whole run */
    double rate;         /* [1/s] of contacts at its end */
    double cpu;          /* [s] */
    double memory, file; /* [byte] */
};

/* Runs the world of the deck for a second or two of processor time, or to the end, and works out
 * the rest. The world is then used up. */
enum mill_status mill_forecast_make(const struct mill_deck *deck, struct mill_world *world,
                                    struct mill_forecast *forecast, struct mill_error *error);

#endif
