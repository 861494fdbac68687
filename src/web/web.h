/* The engine as a WebAssembly module, for the studio (docs/studio.md). The page has one mill at a
 * time. It gives the module files (the deck and what the deck names) through the file functions of
 * WASI; the module needs nothing else from the page. Arrays and texts that functions return belong
 * to the module and are valid until the next call of any function. */
#ifndef MILL_WEB_H
#define MILL_WEB_H

#include "millsim/status.h"

#include <stdint.h>
#include <stdio.h>

/* Reads the deck /deck.ini, with the lines "SECTION.KEY=VALUE" of /set instead of its values, and
 * builds its mill. Then mill_web_text is a JSON object: "deck" (the full deck), "keys" (of the
 * deck, with unit, range, meaning), "warnings", "kinds", "motions", "species", the place of the
 * container. If not MILL_OK, mill_web_text has a line for each fault, and the mill before stays */
enum mill_status mill_web_load(void);

/* JSON, or the faults of the last call, a line each; UTF-8 */
const char *mill_web_text(void);

/* Goes on until the simulated time `until` [s], or for a number of events. MILL_ENDED: the
 * time of the run is over, or the results that were told last are as precise as the deck asks. */
enum mill_status mill_web_run(double until, double events);

/* [s] simulated time */
double mill_web_time(void);

/* Numbers of the present state, in this order: time [s], impacts; [J] kinetic, rotational and
 * potential energy, all of it at the start, work of all motions, error of the balance, turnover;
 * [J] lost in each kind of contact, then number of its impacts; [J] work of each motion, then its
 * pose (three rows of four: rotation and place [m]). */
const double *mill_web_state(void);

/* x y z [m] and speed [m/s] of each ball */
const float *mill_web_balls(void);

/* mill_web_text becomes JSON: "statistics" and "notes" of the summary (docs/file-format.md). */
enum mill_status mill_web_results(void);

/* Impacts in the window by their normal energy m* v_n^2 / 2: for each kind of contact
 * MILL_ENERGIES_BINS numbers of impacts, then as many losses [J]. After mill_web_results. */
const double *mill_web_spectrum(void);

/* [J] lower edges of these bins, and the upper edge of the last one */
const double *mill_web_edges(void);

/* The surfaces that motion k (-1: none) carries, in its frame */
struct mill_web_outline {
    uint32_t points, triangles;
    const float *point;     /* x y z [m] */
    const uint32_t *corner; /* three numbers of points a triangle */
    const uint8_t *kind;    /* kind of contact of each triangle */
};
const struct mill_web_outline *mill_web_outline(int k);

/* Writes the JSON object of mill_web_load (web_tell.c). warnings: a line each */
struct mill_deck;
struct mill_world;
void mill_web_tell(FILE *out, const struct mill_deck *deck, const struct mill_world *world,
                   const char *warnings);

#endif
