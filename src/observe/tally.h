/* The statistics of a run: an observer that gathers from run.sample_from on, and its results. */
#ifndef MILL_TALLY_H
#define MILL_TALLY_H

#include "base/parts.h"
#include "millsim/deck.h"
#include "millsim/observer.h"
#include "observe/maps.h"
#include "observe/precision.h"
#include "observe/rotorstat.h"
#include "observe/spectrum.h"
#include "observe/strikes.h"

/* Rows of the results: the kinds, then all of them together */
enum { MILL_TALLY_ALL = MILL_KINDS, MILL_TALLY_ROWS };

enum { MILL_TALLY_LEVELS = 10 };

struct mill_h5;

/* Impacts (or strikes) of one kind: how fast they come, by both speeds. */
struct mill_speeds {
    struct mill_spectrum normal;
    struct mill_spectrum tangential[2]; /* of those with v_n < 0.05 m/s; of the others */
};

/* What ended the window */
enum mill_tally_end { MILL_TALLY_TIME, MILL_TALLY_PRECISION, MILL_TALLY_COLLISIONS };

/* Where the begin of the window is yet to be found, what is gathered is kept apart by stretches of
 * so many batches, and those after the start-up are added up at the end. */
enum { MILL_TALLY_STRETCHES = 24 };

struct mill_tally_stretch {
    struct mill_speeds impacts[MILL_KINDS], strikes[MILL_KINDS];
    int32_t last; /* number of the last of the stretches as gathered that it is made of */
    struct mill_maps *maps;
};

/* How far the gathering has come; all of it is plain numbers, saved as they are. */
struct mill_tally_progress {
    double next;        /* [s] as observer.next */
    bool open;          /* the window has begun */
    bool closed;        /* and it is over: nothing is gathered any more */
    bool late;          /* its last tenth has begun */
    uint64_t snapshots; /* taken for the maps */
    double begin;       /* [s] of the window, once closed */
    double duration;    /* [s] of the window, once closed */
    uint64_t ticks;     /* so often it was asked whether the run is to end */
    uint64_t length;    /* batches of a stretch */
    uint64_t stretches; /* complete ones */
    int32_t stretch;    /* number of the one being gathered */
    enum mill_tally_end ended;
    bool settled; /* the start-up is over, as far as known */
    struct mill_precision_known known;
    struct mill_account at_begin, at_late, at_close; /* the world's books at these times */
};

/* In front of a saved state: lengths that must agree, and the one that sets the table's. */
struct mill_tally_header {
    uint64_t tally, cross, axial, planned, bits, batches, stretches;
};

struct mill_tally {
    struct mill_observer observer; /* first: the loop sees only this */
    double begin, end;             /* [s] the window as planned; begin 0 where it is to be found */
    double watch;                  /* [s] pairs are remembered from here on */
    double interval;               /* [s] between the maps' snapshots; INFINITY: none */
    struct mill_tally_progress at;
    struct mill_spectrum_grid grid;
    struct mill_speeds impacts[MILL_TALLY_ROWS], strikes[MILL_TALLY_ROWS];
    struct mill_strikes pairs;
    struct mill_rotorstat rotor;
    struct mill_maps *maps;
    /* ---- what may end the run before its time; all 0 where nothing may ---- */
    double tick;       /* [s] it is asked so often whether the run is to end; 0: never */
    double precision;  /* run.precision */
    double collisions; /* run.max_collisions */
    bool search;       /* the begin of the window is to be found */
    struct mill_precision batches;
    uint64_t before[MILL_PRECISION_SLOTS]; /* impacts by speed when the last batch ended */
    struct mill_tally_stretch *stretch;    /* [MILL_TALLY_STRETCHES], or NULL */
    struct mill_tally_header header;       /* as last listed by mill_tally_parts */
};

/* For a world at t = 0. Neither deck nor world is kept. Owner: the caller. */
enum mill_status mill_tally_create(const struct mill_deck *deck, const struct mill_world *world,
                                   struct mill_tally **tally, struct mill_error *error);
void mill_tally_free(struct mill_tally *tally);

struct mill_observer *mill_tally_observer(struct mill_tally *tally);

/* [s] simulated time up to which the run may go before this is asked again: it may end there, apart
 * from its planned end, or what may end it begins there; INFINITY: nothing else will. *over: it has
 * ended, at its last sample. */
double mill_tally_next_end(const struct mill_tally *tally, bool *over);

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

/* run.precision was asked for, the start-up is over, and both quantities are known as well. */
bool mill_tally_reached(const struct mill_tally *tally);

/* "time", "precision", "max_collisions"; NULL where only its time may end the run. */
const char *mill_tally_ended_by(const struct mill_tally *tally);

/* Replaces the group /statistics of the file. What each dataset means: docs/file-format.md. */
void mill_tally_write(const struct mill_tally *tally, struct mill_h5 *file);

/* ---- the end of the run and the begin of the window (tally_window.c), for tally.c ---- */

/* After the window's begin, end and interval are set. false: out of memory. */
bool mill_tally_window_init(struct mill_tally *tally, const struct mill_deck *deck,
                            const struct mill_world *world);
void mill_tally_window_free(struct mill_tally *tally);

/* [s] simulated time of the next sample for it; INFINITY: none. And that sample, at `now`. */
double mill_tally_window_next(const struct mill_tally *tally);
void mill_tally_window_sample(struct mill_tally *tally, const struct mill_account *account,
                              double now);

/* Where the strikes of an earlier stretch are kept. */
struct mill_speeds *mill_tally_window_strikes(struct mill_tally *tally, int32_t stretch);

/* The window is over: finds its begin, adds up what was gathered since, and tells what is known. */
void mill_tally_window_close(struct mill_tally *tally);

/* ---- the state, for a run that is interrupted and goes on ---- */

/* The state as a list of places that make one run of bytes, good for the same program only; before
 * mill_tally_finish. That one changes nothing but the first *values of them. Returns how many. */
enum { MILL_TALLY_PARTS = 24 + 8 * MILL_TALLY_STRETCHES }; /* room for so many */
size_t mill_tally_parts(struct mill_tally *tally, struct mill_part *part, size_t *values);

/* Undoes mill_tally_finish; values: the bytes of those first parts as they were. */
void mill_tally_rewind(struct mill_tally *tally, const unsigned char *values);

/* Loads a state into a tally made from the same deck and world. `source` has no other bytes left.
 */
enum mill_status mill_tally_load(struct mill_tally *tally, struct mill_source *source,
                                 struct mill_error *error);

#endif
