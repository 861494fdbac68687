/* The statistics of a run: an observer that gathers from run.sample_from on; and the results,
 * worked out from what it has gathered. */
#ifndef MILL_TALLY_H
#define MILL_TALLY_H

#include "millsim/observer.h"
#include "observe/maps.h"
#include "observe/observe.h"
#include "observe/precision.h"
#include "observe/rotorstat.h"
#include "observe/spectrum.h"
#include "observe/strikes.h"

/* Rows of the results: the kinds, then all of them together */
enum { MILL_TALLY_ALL = MILL_KINDS, MILL_TALLY_ROWS };

enum { MILL_TALLY_LEVELS = 10 };

struct mill_sink;

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
    double next;         /* [s] as observer.next */
    bool open;           /* the window has begun */
    bool closed;         /* and it is over: nothing is gathered any more */
    bool late;           /* its last tenth has begun */
    uint64_t snapshots;  /* taken for the maps */
    double over;         /* [s] when it was closed */
    uint64_t collisions; /* of all kinds, from t = 0 */
    uint64_t length;     /* batches of a stretch */
    uint64_t stretches;  /* complete ones */
    int32_t stretch;     /* number of the one being gathered */
    enum mill_tally_end ended;
    bool settled; /* the start-up is over, as far as known */
    struct mill_precision_known known;
    struct mill_account at_begin, at_late, at_close; /* the world's books at these times */
};

struct mill_tally {
    struct mill_observer observer; /* first: the loop sees only this */
    double begin, end;             /* [s] the window as planned; begin 0 where it is to be found */
    double watch;                  /* [s] pairs are remembered from here on */
    double interval;               /* [s] between the maps' snapshots; INFINITY: none */
    struct mill_tally_progress at;
    struct mill_spectrum_grid grid;
    struct mill_speeds impacts[MILL_KINDS], strikes[MILL_KINDS]; /* since the last stretch */
    struct mill_strikes pairs;
    struct mill_rotorstat rotor;
    struct mill_maps *maps;
    /* ---- what may end the run before its time; all 0 where nothing may ---- */
    double tick;      /* [s] between two times at which it is asked how much is known; 0: never */
    double precision; /* run.precision */
    uint64_t collisions; /* run.max_collisions; UINT64_MAX: no number ends the run */
    bool search;         /* the begin of the window is to be found */
    struct mill_precision batches;
    uint64_t before[MILL_PRECISION_SLOTS]; /* impacts by speed when the last batch ended */
    struct mill_tally_stretch *stretch;    /* [MILL_TALLY_STRETCHES], or NULL */
};

extern const struct mill_observer_type mill_tally_type;

/* ---- results ---- */

/* What the window comes to, as if the run ended now. A run that has not reached its window has
 * duration 0 and empty statistics. */
struct mill_tally_results {
    const struct mill_tally *tally; /* they are taken from; must outlive them, unchanged */
    double begin, duration;         /* [s] of the window */
    bool late;                      /* its last tenth has begun */
    bool settled;                   /* the start-up is over, as far as known */
    struct mill_precision_known known;
    struct mill_account at_begin, at_late, at_end; /* the world's books at these times */
    struct mill_speeds impacts[MILL_TALLY_ROWS], strikes[MILL_TALLY_ROWS];
    const struct mill_maps *maps; /* the tally's own, or `sum` */
    struct mill_rotorstat rotor;  /* its blocks: the tally's own, or these */
    double power[MILL_PRECISION_BATCHES], torque[MILL_PRECISION_BATCHES];
    struct mill_maps *sum; /* NULL: there was nothing to be added up */
};

/* World at local time t. Owner: the caller. MILL_FAILED: out of memory. */
enum mill_status mill_tally_results_make(const struct mill_tally *tally,
                                         const struct mill_world *world, double t,
                                         struct mill_tally_results **results,
                                         struct mill_error *error);
void mill_tally_results_free(struct mill_tally_results *results);

/* Levels of the quantiles: 0.01 ... 0.999 */
extern const double mill_tally_level[MILL_TALLY_LEVELS];

/* "ball_ball", ..., "all" */
const char *mill_tally_name(int row);

/* sum / duration; 0 when the duration is. */
double mill_tally_per_second(const struct mill_tally_results *results, double sum);

/* The tangential speeds with both halves together. */
void mill_tally_tangential(const struct mill_speeds *speeds, struct mill_spectrum *both);

/* Share of the row's impacts in the window at which the rebound floor acted; NaN when there were
 * none. */
double mill_tally_floor_share(const struct mill_tally_results *results, int row);

/* Mean over the window: power the rotor gives to the balls [W], torque about +x [N m]. NaN at
 * duration 0. */
double mill_tally_power(const struct mill_tally_results *results);
double mill_tally_torque(const struct mill_tally_results *results);

/* run.precision was asked for, the start-up is over, and both quantities are known as well. */
bool mill_tally_reached(const struct mill_tally_results *results);

/* Tells them as the group "statistics". MILL_FAILED: out of memory. */
enum mill_status mill_tally_tell(const struct mill_tally_results *results, struct mill_sink *sink,
                                 struct mill_error *error);

/* ---- the end of the run and the begin of the window (tally_window.c), for tally.c ---- */

/* After the window's begin, end and interval are set. false: out of memory. */
bool mill_tally_window_init(struct mill_tally *tally, const struct mill_observe *asked,
                            const struct mill_world *world);
void mill_tally_window_free(struct mill_tally *tally);

/* [s] simulated time of the next sample for it; INFINITY: none. And that sample, at `now`. */
double mill_tally_window_next(const struct mill_tally *tally);
void mill_tally_window_sample(struct mill_tally *tally, const struct mill_account *account,
                              double now);

/* Where the strikes of an earlier stretch are kept. */
struct mill_speeds *mill_tally_window_strikes(struct mill_tally *tally, int32_t stretch);

/* The window as it is by now: where it begins, what was gathered since, and how well the results
 * are known. For a tally that may end the run, in its window; `results` holds what was gathered
 * since the last stretch. false: out of memory. */
bool mill_tally_window_results(const struct mill_tally *tally, struct mill_tally_results *results);

/* into += from, kind by kind */
void mill_tally_add(struct mill_speeds into[MILL_KINDS], const struct mill_speeds from[MILL_KINDS]);

/* The observer's state (tally_state.c) */
void mill_tally_state(struct mill_observer *observer, struct mill_state *state);

#endif
