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
    struct mill_notes notes;
};

/* How the rate of contacts grows at the start of a run: by the factor exp(power), until the time
 * `swept` [s] */
struct mill_forecast_growth {
    double swept, power; /* swept 0: no growth */
};
struct mill_forecast_growth mill_forecast_growth(const struct mill_world *world);

/* [s] Time in which a steady mill has as many contacts as this one has in `time`, up
 * to a constant. */
double mill_forecast_work(const struct mill_forecast_growth *growth, double time);

/* Runs the deck's world for 1.5 million contacts, or 20 seconds of processor time, or to its end,
 * and computes the forecast. The world must not be used afterwards. If the trial fails, the
 * notes are still valid. */
enum mill_status mill_forecast_make(const struct mill_deck *deck, struct mill_world *world,
                                    struct mill_forecast *forecast, struct mill_error *error);

#endif
