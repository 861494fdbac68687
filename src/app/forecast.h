/* Estimates from a short trial run what a run will take: contacts, processor time, memory, size of
 * the file. It also finds out where the run will leave the range of the model. */
#ifndef MILL_FORECAST_H
#define MILL_FORECAST_H

#include "deck/deck.h"
#include "observe/notes.h"

struct mill_forecast {
    double trial;        /* [s] simulated time of the trial */
    double contacts;     /* in the whole run */
    double cpu;          /* [s] */
    double memory, file; /* [byte] */
    bool bound;          /* contacts and time are a lower bound: the rate has not settled */
    struct mill_notes notes;
};

/* [s] Until then the rate of contacts may still grow: a period of the motions; 0: nothing moves */
double mill_forecast_early(const struct mill_world *world);

/* Runs the deck's world until the rate of contacts has settled, or for a limited time, and computes
 * the forecast. The world must not be used afterwards. If the trial fails, the notes are valid. */
enum mill_status mill_forecast_make(const struct mill_deck *deck, struct mill_world *world,
                                    struct mill_forecast *forecast, struct mill_error *error);

#endif
