/* The statistics of a run, which an observer gathers from run.sample_from on, and their results */
#ifndef MILL_TALLY_H
#define MILL_TALLY_H

#include "observe/charge.h"
#include "observe/gathered.h"
#include "observe/observe.h"
#include "observe/strikes.h"

/* Two or three are joined, so both are multiples of six: no portion is left over. */
enum { MILL_TALLY_PORTIONS = 24, MILL_TALLY_FEWER = 12 /* of each of several starts */ };

/* Why the window ended */
enum mill_tally_end { MILL_TALLY_TIME, MILL_TALLY_PRECISION, MILL_TALLY_COLLISIONS };

/* State of the gathering; plain numbers, which a checkpoint stores as they are. */
struct mill_tally_progress {
    bool open;           /* the window has begun */
    bool closed;         /* the window is over: nothing more is gathered */
    bool settled;        /* the start-up is over, as far as is known */
    uint64_t snapshots;  /* samples taken for the maps */
    double over;         /* [s] time at which the window was closed */
    uint64_t collisions; /* of all kinds, from t = 0 */
    uint64_t length;     /* batches of a portion */
    uint64_t portions;   /* complete ones */
    enum mill_tally_end ended;
    struct mill_precision_known known;
    struct mill_account at_begin, at_end; /* the world's at the start and the end of the window */
};

struct mill_tally {
    struct mill_observer observer; /* first: the event loop only knows this member */
    double begin, end;             /* [s] the planned window; begin 0 if it is to be found */
    double watch;                  /* [s] pairs are recorded for strikes from here on */
    double interval;               /* [s] between the samples for the maps; INFINITY: none */
    struct mill_observe asked;
    const struct mill_world *world;
    struct mill_tally_progress at;
    struct mill_spectrum_grid grid;
    struct mill_gathered_plan plan;
    struct mill_gathered gathered; /* since the end of the last portion */
    struct mill_energies_blocks blocks;
    struct mill_strikes pairs;
    struct mill_charge charge;
    /* ---- accuracy of the results, and what can end the run before its time ---- */
    uint64_t collisions; /* run.max_collisions; UINT64_MAX: not used */
    bool search;         /* the start of the window is to be found */
    struct mill_precision batches;
    uint64_t before[MILL_SPECTRUM_SLOTS]; /* impacts by speed at the end of the last batch */
    struct mill_gathered portion[MILL_TALLY_PORTIONS];
    unsigned long seed; /* of this start */
    int starts; /* of the run that results are made of, at the same time; the first is this one */
    const struct mill_tally *start[MILL_PRECISION_STARTS];
};

extern const struct mill_observing mill_tally_type;

/* [s] Time of the next sample for the maps, or of the one `more` after it, in an open window */
static inline double mill_tally_snapshot(const struct mill_tally *tally, unsigned more)
{
    return tally->begin + ((double)(tally->at.snapshots + more) + 0.5) * tally->interval;
}

/* [s] Duration of a contact of two balls of the mean size and mass, as stiff as steel, at a normal
 * speed as in a dense bed, MILL_IMPACT_SLOW; at ten times the speed it is 1.6 times shorter. */
double mill_tally_contact(const struct mill_world *world);

/* ---- results ---- */

enum { MILL_TALLY_TURNS = 10 }; /* periods of a run in which a start-up is looked for */
enum { MILL_TALLY_LEVELS = 10 };
extern const double mill_tally_level[MILL_TALLY_LEVELS]; /* of the quantiles */

#define MILL_TALLY_FAST 0.05 /* [m/s] */

/* [m/s] fast: of the impacts from above_floor on */
struct mill_tally_speed {
    double mean, median, median_fast, quantile[MILL_TALLY_LEVELS], quantile_fast[MILL_TALLY_LEVELS];
};

/* The impacts (or strikes) of a kind, or of all kinds */
struct mill_tally_row {
    uint64_t count;
    double rate, power; /* [1/s], [W] lost in them */
    struct mill_tally_speed normal, tangential;
};

enum mill_tally_doubt {
    MILL_TALLY_KNOWN,
    MILL_TALLY_ONE_START,
    MILL_TALLY_FIRST_OF_ALL, /* stopped: not all starts are as far */
    MILL_TALLY_FEW_STARTS,
    MILL_TALLY_DRIFTS
};

/* Results of the windows of all starts, as if the run ended now. If the window has not begun, the
 * duration is 0 and the statistics are empty. Accounts are sums over the starts. */
struct mill_tally_results {
    const struct mill_tally *tally; /* tally and world must outlive the results, unchanged */
    const struct mill_world *world;
    struct mill_tally_progress at; /* known: values of the whole window, errors from its batches */
    double begin, duration;        /* [s] of the window; of all starts together */
    uint64_t from;                 /* its first batch */
    int all;                       /* row of all kinds together, after those of the kinds */
    struct mill_gathered sums;     /* speeds: [all + 1] */
    struct mill_listed kinds;      /* those of the mill: only their rows are filled */
    struct mill_tally_row impacts[MILL_PRECISION_ROWS], strikes[MILL_PRECISION_ROWS];
    double above_floor; /* [m/s] MILL_TALLY_FAST or more: nothing depends on the rebound floor */
    double floor_share[MILL_PRECISION_ROWS]; /* impacts at the rebound floor; NaN: there are none */
    double pinch_power; /* [W] part of the drive's power that goes to pressed balls, or NaN */
    enum mill_tally_doubt doubt; /* why there are no errors */
    struct mill_energies_hard is_hard;
    struct mill_spread_mean charge[MILL_CHARGE_NUMBERS]; /* if the mill tumbles */
    struct mill_charge_sum charge_sum;
    struct mill_spread_mean hard, hard_per_joule; /* [1/s], [1/J] of the drive's work, or NaN */
    struct mill_account late; /* at the start of the window's last tenth, rounded to a batch */
    bool reached;             /* the accuracy that was asked for, after the start-up */
};

/* Computes them at local time t of the world. Owner: the caller. MILL_FAILED: out of memory. */
enum mill_status mill_tally_results_make(const struct mill_tally *tally,
                                         const struct mill_world *world, double t,
                                         struct mill_tally_results **results,
                                         struct mill_error *error);
void mill_tally_results_free(struct mill_tally_results *results);

/* Writes the results as the group "statistics". */
void mill_tally_results_tell(const struct mill_tally_results *results, struct mill_sink *sink);

/* sum / duration; 0 if the duration is 0 */
static inline double mill_tally_per_second(const struct mill_tally_results *results, double sum)
{
    return results->duration > 0 ? sum / results->duration : 0;
}

/* Returns the first batch of the window, which begins after the start-up and ends with the last
 * batch. If at least two periods are left, it begins later, to hold whole ones. Sets at->known. */
uint64_t mill_tally_window(const struct mill_tally *tally, struct mill_tally_progress *at);

#endif
