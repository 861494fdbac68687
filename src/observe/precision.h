/* How well are the results known by now, and from when on is the mill steady? The time is cut into
 * batches, whose accounts and impacts by speed are kept. This is the only place where errors of the
 * results are made. */
#ifndef MILL_PRECISION_H
#define MILL_PRECISION_H

#include "millsim/world.h"
#include "observe/spectrum.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    MILL_PRECISION_BATCHES = 1152,            /* there is room for; then they are joined */
    MILL_PRECISION_PERIODS = 3,               /* that tell an error of what motions do */
    MILL_PRECISION_FEWEST = 36,               /* batches that tell anything: of so many periods */
    MILL_PRECISION_ROWS = MILL_KINDS_MOST + 1 /* the mill's kinds, then all */
};

/* What changes as it goes; plain numbers, saved as they are. */
struct mill_precision_progress {
    double batch;     /* [s] length of a batch */
    uint64_t period;  /* batches of a period; 1 also where a batch is several; 0: nothing moves */
    uint64_t batches; /* complete by now */
};

struct mill_precision {
    double origin; /* [s] simulated time at which batch 0 begins */
    int kinds, motions;
    int rotor; /* the motion of this name, or -1 */
    struct mill_precision_progress at;
    const struct mill_spectrum_grid *grid;
    struct mill_account
        *accounts; /* [batches + 1] at the begin of each batch, and at the last end */
    uint32_t (*counts)[MILL_SPECTRUM_SLOTS]; /* [batches] impacts by normal speed */
};

/* A number with its standard error, in its own unit. The error is widened by Student's t: value +-
 * 1.96 error is its 95 % interval, however few batches there are. NaN: not known. */
struct mill_precision_mean {
    double value, error;
    double freedom; /* degrees of freedom of the error; 0 where there is none */
};

struct mill_precision_known {
    struct mill_precision_mean drive;         /* [W] power of all motions */
    struct mill_precision_mean power, torque; /* [W], [N m] of the rotor */
    struct mill_precision_mean motion_power[MILL_MOTIONS_MOST], motion_torque[MILL_MOTIONS_MOST];
    struct mill_precision_mean median, median_fast; /* [m/s] normal speed, of all; above 0.05 m/s */
    struct mill_precision_mean rate[MILL_PRECISION_ROWS];                  /* [1/s] of impacts */
    struct mill_precision_mean fast[MILL_PRECISION_ROWS][MILL_WORLD_FAST]; /* at mill_world_fast */
    uint64_t batches;                                                      /* they are taken from */
    bool idle;   /* no motion has ever done any work: nothing to be known of their power */
    bool enough; /* batches, and three periods of motions that work, to believe the errors */
};

/* Batches for the motions of this world, from `origin` [s] on; the grid must outlive it. false: out
 * of memory; then, too, free it. */
bool mill_precision_init(struct mill_precision *precision, double origin,
                         const struct mill_world *world, const struct mill_spectrum_grid *grid);
void mill_precision_free(struct mill_precision *precision);

/* [s] simulated time at which the batch now open ends. */
static inline double mill_precision_next(const struct mill_precision *precision)
{
    return precision->origin + (double)(precision->at.batches + 1) * precision->at.batch;
}

/* A batch ends: count[MILL_SPECTRUM_SLOTS] are its impacts by speed. There must be room for it;
 * the accounts of the first batch's begin are accounts[0]. */
void mill_precision_close(struct mill_precision *precision, const uint64_t *count,
                          const struct mill_account *account);

/* Joins batches when there is no room for another: 2 by 2, or 3 by 3 where 3 make a period.
 * Returns how many became one; 1: there is room still. */
uint64_t mill_precision_join(struct mill_precision *precision);

/* Batches of the start-up by MSER-5, those of the first half; *settled: it is over, for the rule
 * finds no better cut in the second half. */
uint64_t mill_precision_cut(const struct mill_precision *precision, bool *settled);

/* What the batches from `from` on tell. */
struct mill_precision_known mill_precision_tell(const struct mill_precision *precision,
                                                uint64_t from);

/* There is enough to tell, and both errors, where there is something to know, are at most `wanted`
 * times their values. */
bool mill_precision_reached(const struct mill_precision_known *known, double wanted);

/* ---- series ---- */

/* The d that minimises the sum of (x_i - mean)^2 over i >= d, divided by (n - d)^2; the last five
 * are no candidates. 0 for n <= 5. */
size_t mill_precision_mser(const double *x, size_t n);

/* Mean of x[n], a stationary series that remembers what came before. Where n holds two `period`s or
 * more, what repeats after a period has a part in the error only as far as the last one is not
 * whole. No error for n < MILL_PRECISION_FEWEST; n <= MILL_PRECISION_BATCHES. */
struct mill_precision_mean mill_precision_mean(const double *x, size_t n, size_t period);

#endif
