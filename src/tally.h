/* The statistics of a run: an observer that gathers from run.sample_from on, and its results. */
#ifndef MILL_TALLY_H
#define MILL_TALLY_H

#include "maps.h"
#include "millsim/deck.h"
#include "millsim/observer.h"
#include "rotorstat.h"
#include "spectrum.h"
#include "strikes.h"

/* Rows of the results: the kinds, then all of them together */
enum { MILL_TALLY_ALL = MILL_KINDS, MILL_TALLY_ROWS };

enum { MILL_TALLY_LEVELS = 10 };

struct mill_h5;

/* Impacts (or strikes) of one kind: how fast they come, by both speeds. */
struct mill_speeds {
    struct mill_spectrum normal;
    struct mill_spectrum tangential[2]; /* of those with v_n < 0.05 m/s; of the others */
};

/* How far the gathering has come; all of it is plain numbers, saved as they are. */
struct mill_tally_progress {
    double next;        /* [s] as observer.next */
    bool open;          /* the window has begun */
    bool closed;        /* and it is over: nothing is gathered any more */
    bool late;          /* its last tenth has begun */
    uint64_t snapshots; /* taken for the maps */
    double duration;    /* [s] of the window, once closed */
    struct mill_account at_begin, at_late, at_close; /* the world's books at these times */
};

struct mill_tally {
    struct mill_observer observer; /* first: the loop sees only this */
    double begin, end;             /* [s] the window as planned */
    double watch;                  /* [s] pairs are remembered from here on */
    double interval;               /* [s] between the maps' snapshots; INFINITY: none */
    struct mill_tally_progress at;
    struct mill_spectrum_grid grid;
    struct mill_speeds impacts[MILL_TALLY_ROWS], strikes[MILL_TALLY_ROWS];
    struct mill_strikes pairs;
    struct mill_rotorstat rotor;
    struct mill_maps *maps;
};

/* For a world at t = 0. Neither deck nor world is kept. Owner: the caller. */
enum mill_status mill_tally_create(const struct mill_deck *deck, const struct mill_world *world,
                                   struct mill_tally **tally, struct mill_error *error);
void mill_tally_free(struct mill_tally *tally);

struct mill_observer *mill_tally_observer(struct mill_tally *tally);

/* Closes the window at local time t, unless its end was reached before, and works out the sums over
 * the kinds. Call it once, before reading or writing results; a run stopped before the window
 * opened has duration 0 and empty statistics. */
void mill_tally_finish(struct mill_tally *tally, const struct mill_world *world, double t);

/* ---- results, after mill_tally_finish ---- */

/* Levels of the quantiles: 0.01 ... 0.999 */
extern const double mill_tally_level[MILL_TALLY_LEVELS];

/* "ball_ball", ..., "all" */
const char *mill_tally_name(int row);

/* sum / duration; 0 when the duration is. */
double mill_tally_per_second(const struct mill_tally *tally, double sum);

/* The tangential speeds with both halves together. */
void mill_tally_tangential(const struct mill_speeds *speeds, struct mill_spectrum *both);

/* Share of the row's impacts in the window at which the rebound floor acted; NaN when there were
 * none. */
double mill_tally_floor_share(const struct mill_tally *tally, int row);

/* Mean over the window: power the rotor gives to the balls [W], torque about +x [N m]. NaN at
 * duration 0. */
double mill_tally_power(const struct mill_tally *tally);
double mill_tally_torque(const struct mill_tally *tally);

/* Replaces the group /statistics of the file. What each dataset means: docs/file-format.md. */
enum mill_status mill_tally_write(const struct mill_tally *tally, struct mill_h5 *file,
                                  struct mill_error *error);

/* ---- the state, for a run that is interrupted and goes on ---- */

/* Save before mill_tally_finish; load into a tally made from the same deck and world. The bytes are
 * good for the same program only. */
size_t mill_tally_state_size(const struct mill_tally *tally);
void mill_tally_save(const struct mill_tally *tally, unsigned char *state);
enum mill_status mill_tally_load(struct mill_tally *tally, const unsigned char *state, size_t size,
                                 struct mill_error *error);

#endif
