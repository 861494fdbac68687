/* How accurate are the results so far, and when does the mill become steady? Time is divided into
 * batches with accounts and impacts by speed. All standard errors of results are computed here. */
#ifndef MILL_PRECISION_H
#define MILL_PRECISION_H

#include "millsim/world.h"
#include "observe/spectrum.h"
#include "observe/spread.h"

enum {
    MILL_PRECISION_BATCHES = MILL_SPREAD_MOST, /* maximum number */
    MILL_PRECISION_FEWER = 384, /* of each of several starts: portions of 48, 64 or 96 fit */
    MILL_PRECISION_STARTS = 64, /* maximum number of starts of a run */
    MILL_PRECISION_ROWS = MILL_KINDS_MOST + 1 /* of each kind of the mill, then of all together */
};

/* The part that changes during the run; plain numbers, which a checkpoint stores as they are. */
struct mill_precision_progress {
    double batch;     /* [s] length of a batch */
    uint64_t period;  /* its batches; 1 also if a batch is several periods; 0: nothing moves */
    uint64_t batches; /* complete so far */
};

struct mill_precision {
    double origin; /* [s] simulated time at which batch 0 begins */
    int kinds, motions;
    int fast;      /* slot of the spectra from which on impacts are fast */
    uint64_t most; /* batches; then they are joined */
    struct mill_precision_progress at;
    const struct mill_spectrum_grid *grid;
    struct mill_account *accounts; /* [batches + 1] at the start of each, and at the end */
    uint32_t (*counts)[MILL_SPECTRUM_SLOTS]; /* [batches] impacts by normal speed */
};

/* The starts of a run: their batches are of the same times. */
struct mill_precision_set {
    int count; /* at least 1 */
    const struct mill_precision *of[MILL_PRECISION_STARTS];
};

/* First all means, in a row */
struct mill_precision_known {
    struct mill_spread_mean drive;                            /* [W] power of all motions */
    struct mill_spread_mean motion_power[MILL_MOTIONS_MOST];  /* [W] */
    struct mill_spread_mean motion_torque[MILL_MOTIONS_MOST]; /* [N m] */
    struct mill_spread_mean median, median_fast; /* [m/s] normal speed: all impacts; fast ones */
    struct mill_spread_mean rate[MILL_PRECISION_ROWS]; /* [1/s] of impacts; of fast ones: */
    struct mill_spread_mean fast[MILL_PRECISION_ROWS][MILL_WORLD_FAST];
    struct mill_spread_mean loss[MILL_PRECISION_ROWS];        /* [W] lost in impacts */
    struct mill_spread_mean loss_normal[MILL_PRECISION_ROWS]; /* its normal part */
    uint64_t batches;                                         /* that the results come from */
    bool idle;   /* no motion has ever done work, so that there is no power to know */
    bool enough; /* batches and periods of the motions for a run to end */
    bool slips;  /* so few impacts are fast that their median is not known */
    bool drifts; /* the first quarter of the batches differs from the last half */
};

/* One number for the mill, for each motion, or for each kind of contact and for all together */
enum mill_precision_each { MILL_PRECISION_ONE, MILL_PRECISION_MOTION, MILL_PRECISION_KIND };

/* A result that is the change of a number of the account per second */
struct mill_precision_rate {
    const char *name, *unit, *meaning; /* in the results */
    enum mill_precision_each each;
    size_t at, step; /* offset in an account; bytes from one number to the next */
    bool counts;     /* whole numbers */
    size_t width;    /* numbers for each, one after the other */
    size_t to;       /* offset in a struct mill_precision_known */
};
enum { MILL_PRECISION_DRIVE, MILL_PRECISION_POWER, MILL_PRECISION_RATE = 3 }; /* after the torque */
enum { MILL_PRECISION_LOSS = 5, MILL_PRECISION_RATES = 7 };
extern const struct mill_precision_rate mill_precision_rates[MILL_PRECISION_RATES];

/* The mean of a rate: of this motion, or of this kind; `kinds`: of all kinds */
static inline struct mill_spread_mean *mill_precision_of(const struct mill_precision_known *known,
                                                         const struct mill_precision_rate *r,
                                                         int row)
{
    return (struct mill_spread_mean *)(void *)((char *)known + r->to) + (size_t)row * r->width;
}

/* Prepares batches for the motions of this world, starting at `origin` [s]. The grid must outlive
 * them. false: out of memory. The caller frees it in both cases. */
bool mill_precision_init(struct mill_precision *precision, double origin,
                         const struct mill_world *world, const struct mill_spectrum_grid *grid);
void mill_precision_free(struct mill_precision *precision);

/* [s] simulated time at which the present batch ends */
static inline double mill_precision_next(const struct mill_precision *precision)
{
    return precision->origin + (double)(precision->at.batches + 1) * precision->at.batch;
}

/* Ends a batch. count[MILL_SPECTRUM_SLOTS]: its impacts by speed. There must be room for the batch,
 * and accounts[0] must be the account at the start of the first batch. */
void mill_precision_close(struct mill_precision *precision, const uint64_t *count,
                          const struct mill_account *account);

/* Joins batches if there is no room for another: 2 into 1, or 3 into 1 where 3 make a period.
 * Returns how many became one; 1: nothing was joined. */
uint64_t mill_precision_join(struct mill_precision *precision);

/* Number of batches of the start-up, in the first half: by MSER-5; of several starts twice that, or
 * later, until nothing drifts. *settled: it is over, and MSER-5 finds no cut in the second half. */
uint64_t mill_precision_cut(const struct mill_precision_set *set, bool *settled);

/* Computes the results of the batches from `from` on. */
struct mill_precision_known mill_precision_tell(const struct mill_precision_set *s, uint64_t from);

/* A rate of one start alone, number k of its row, over the batches from `from` to `to` */
double mill_precision_one(const struct mill_precision *precision, uint64_t from, uint64_t to,
                          const struct mill_precision_rate *rate, int row, size_t k);

/* Sets the values of all rates to those between two accounts that are `duration` [s] apart. At
 * duration 0 powers and torques are NaN, and what belongs to impacts is 0. */
void mill_precision_whole(struct mill_precision_known *known,
                          const struct mill_precision *precision, const struct mill_account *from,
                          const struct mill_account *to, double duration);

/* Takes all errors away. */
void mill_precision_forget(struct mill_precision_known *known);

/* True if there are enough batches, and both errors are at most `wanted` times their values. A
 * power that is always 0 is not tested, nor a median that cannot be known. */
bool mill_precision_reached(const struct mill_precision_known *known, double wanted);

#endif
