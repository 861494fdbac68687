/* The statistics of a run: an observer that gathers from run.sample_from on; and the results,
 * worked out from what it has gathered. */
#ifndef MILL_TALLY_H
#define MILL_TALLY_H

#include "millsim/observer.h"
#include "observe/energies.h"
#include "observe/maps.h"
#include "observe/observe.h"
#include "observe/precision.h"
#include "observe/spectrum.h"
#include "observe/strikes.h"

/* Impacts (or strikes) of one kind: how fast they come, by both speeds. */
struct mill_speeds {
    struct mill_spectrum normal;
    struct mill_spectrum tangential[2]; /* of those with v_n < 0.05 m/s (results: all), others */
};

/* What is gathered of impacts and flow: kept apart by portions of a few batches where the begin of
 * the window is yet to be found, and those after the start-up are added up at the end. */
struct mill_gathered {
    struct mill_speeds *impacts, *strikes; /* [kinds] */
    struct mill_energies energies;
    uint64_t recontacts; /* impacts within a contact's duration of the pair's last one */
    struct mill_maps maps;
    int64_t last; /* number of the last of the portions as gathered that it is made of */
};

enum { MILL_TALLY_PORTIONS = 24 };

/* What ended the window */
enum mill_tally_end { MILL_TALLY_TIME, MILL_TALLY_PRECISION, MILL_TALLY_COLLISIONS };

/* How far the gathering has come; all of it is plain numbers, saved as they are. */
struct mill_tally_progress {
    bool open;           /* the window has begun */
    bool closed;         /* and it is over: nothing is gathered any more */
    bool settled;        /* the start-up is over, as far as known */
    uint64_t snapshots;  /* taken for the maps */
    double over;         /* [s] when it was closed */
    uint64_t collisions; /* of all kinds, from t = 0 */
    uint64_t length;     /* batches of a portion */
    uint64_t portions;   /* complete ones */
    enum mill_tally_end ended;
    struct mill_precision_known known;
    struct mill_account at_begin, at_end; /* the world's account at these times */
};

struct mill_tally {
    struct mill_observer observer; /* first: the loop sees only this */
    double begin, end;             /* [s] the window as planned; begin 0 where it is to be found */
    double watch;                  /* [s] pairs are remembered from here on */
    double contact[MILL_KINDS_MOST]; /* [s] how long soft spheres of steel would touch */
    double interval;                 /* [s] between the maps' snapshots; INFINITY: none */
    int kinds;                       /* of contact */
    const struct mill_world *world;
    struct mill_tally_progress at;
    struct mill_spectrum_grid grid;
    struct mill_gathered gathered; /* since the last portion */
    struct mill_strikes pairs;
    /* ---- how well the results are known, and what may end the run before its time ---- */
    double precision;    /* run.precision; 0: none */
    uint64_t collisions; /* run.max_collisions; UINT64_MAX: no number ends the run */
    bool search;         /* the begin of the window is to be found */
    struct mill_precision batches;
    uint64_t before[MILL_SPECTRUM_SLOTS]; /* impacts by speed when the last batch ended */
    struct mill_gathered *portion;        /* [MILL_TALLY_PORTIONS], or NULL */
};

extern const struct mill_observer_type mill_tally_type;

/* [s] When the maps want the balls next, once the window is open */
static inline double mill_tally_snapshot(const struct mill_tally *tally)
{
    return tally->begin + ((double)tally->at.snapshots + 0.5) * tally->interval;
}

/* [s] How long a contact of this kind of the mean ball lasts, were it of steel, at a normal speed
 * of MILL_TALLY_SLOW: of a dense bed, and ten times the speed shortens it by no more than 1.6. */
#define MILL_TALLY_SLOW 0.1 /* [m/s] */
double mill_tally_contact(const struct mill_world *world, int kind);

/* ---- results ---- */

/* What the window comes to, as if the run ended now. A run that has not reached its window has
 * duration 0 and empty statistics. */
struct mill_tally_results {
    /* they are taken from; must outlive them, unchanged */
    const struct mill_tally *tally;
    const struct mill_world *world;
    struct mill_tally_progress at; /* known: values of the whole window, errors of its batches */
    double begin, duration;        /* [s] of the window */
    int all;                       /* the row of all kinds together, behind those of the kinds */
    struct mill_speeds *impacts, *strikes; /* [all + 1] */
    struct mill_energies energies;
    uint64_t recontacts; /* of the impacts */
    struct mill_maps maps;
    double floor_share[MILL_PRECISION_ROWS]; /* of the impacts in the window, those at which the
                                                rebound floor acted; NaN when there were none */
    double pinch_power; /* [W] of the drive's power: on balls that are pressed; NaN at duration 0 */
    double block; /* [s] the shortest time of whole periods and whole batches; NaN: no rotor */
    double revolutions;                 /* of the rotor in it */
    size_t blocks;                      /* in the window */
    double *block_power, *block_torque; /* [W], [N m] of the rotor in each block */
    struct mill_account late;           /* when the last tenth of the window began, to a batch */
    bool reached; /* the start-up is over, and both quantities are known as well as was asked for */
};

/* World at local time t. Owner: the caller. MILL_FAILED: out of memory. */
enum mill_status mill_tally_results_make(const struct mill_tally *tally,
                                         const struct mill_world *world, double t,
                                         struct mill_tally_results **results,
                                         struct mill_error *error);
void mill_tally_results_free(struct mill_tally_results *results);

/* Tells them as the group "statistics". */
void mill_tally_results_tell(const struct mill_tally_results *results, struct mill_sink *sink);

/* "ball_ball", ..., "all" */
static inline const char *mill_tally_name(const struct mill_tally_results *results, int row)
{
    return row < results->all ? results->world->kinds.name[row] : "all";
}

/* sum / duration; 0 when the duration is. */
static inline double mill_tally_per_second(const struct mill_tally_results *results, double sum)
{
    return results->duration > 0 ? sum / results->duration : 0;
}

/* ---- the end of the run and the begin of the window (tally_window.c) ---- */

/* First batch of the window that ends with the last one: it begins behind the start-up, and where
 * that leaves two whole periods or more, as many as there are. at: is told what is known. */
uint64_t mill_tally_window_find(const struct mill_tally *tally, struct mill_tally_progress *at);

/* A batch ends. */
void mill_tally_window_batch(struct mill_tally *tally, const struct mill_account *account);

/* Where the strikes of an earlier portion are kept. */
struct mill_speeds *mill_tally_window_strikes(struct mill_tally *tally, int32_t portion);

/* Room for what is gathered of a world, or as another has it. false: out of memory. Free it in any
 * case. */
bool mill_tally_window_create(struct mill_gathered *gathered, const struct mill_world *world);
bool mill_tally_window_like(struct mill_gathered *gathered, const struct mill_gathered *as,
                            int kinds);

/* Frees what it holds, besides its struct. */
void mill_tally_window_free(struct mill_gathered *gathered);

/* into[rows] += from[rows] */
void mill_tally_window_add(struct mill_speeds *into, const struct mill_speeds *from, int rows);

#endif
