/* What a run will cost, from a short trial of it: contacts, processor time, memory, file; and where
 * it will leave the model's reach. */
#ifndef MILL_FORECAST_H
#define MILL_FORECAST_H

#include "deck/deck.h"
#include "observe/notes.h"

struct mill_forecast {
    double trial;        /* [s] simulated by the trial */
    double contacts;     /* of the whole run */
    double cpu;          /* [s] */
    double memory, file; /* [byte] */
    struct mill_notes notes;
};

/* How the rate of contacts grows at the begin of a run: by exp(power), until `swept` [s] */
struct mill_forecast_growth {
    double swept, power; /* swept 0: it does not grow */
};
struct mill_forecast_growth mill_forecast_growth(const struct mill_world *world);

/* [s] Time in which a mill that is steady has as many contacts as this one, up to a constant. */
double mill_forecast_work(const struct mill_forecast_growth *growth, double time);

/* Runs the world of the deck for a second or two of processor time, or to the end, and works out
 * the rest. The world is then used up. A trial that fails still leaves the notes. */
enum mill_status mill_forecast_make(const struct mill_deck *deck, struct mill_world *world,
                                    struct mill_forecast *forecast, struct mill_error *error);

#endif
