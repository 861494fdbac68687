/* How well are the median normal speed above 0.05 m/s and the rotor's power known by now, and from
 * when on is the mill steady? The time is cut into batches, whose accounts and speeds are kept. */
#ifndef MILL_PRECISION_H
#define MILL_PRECISION_H

#include "millsim/world.h"
#include "observe/spectrum.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    MILL_PRECISION_BATCHES = 1152, /* there is room for; then they are joined */
    MILL_PRECISION_SLOTS = MILL_SPECTRUM_SLOTS - MILL_SPECTRUM_FAST, /* from 0.05 m/s up */
    MILL_PRECISION_FEWEST = 36 /* batches that tell anything: three revolutions */
};

/* What changes as it goes; plain numbers, saved as they are. */
struct mill_precision_progress {
    double batch;     /* [s] length of a batch */
    uint64_t period;  /* batches of a revolution; 1 also where a batch is several; 0: no rotor */
    uint64_t batches; /* complete by now */
};

struct mill_precision {
    double origin; /* [s] simulated time at which batch 0 begins */
    struct mill_precision_progress at;
    const struct mill_spectrum_grid *grid;
    struct mill_account
        *accounts; /* [batches + 1] at the begin of each batch, and at the last end */
    uint32_t (*counts)[MILL_PRECISION_SLOTS]; /* [batches] impacts by normal speed */
};

/* A mean with its standard error, in its own unit; NaN: not known. */
struct mill_precision_mean {
    double value, error;
};

struct mill_precision_known {
    struct mill_precision_mean median; /* [m/s] normal speed of the impacts above 0.05 m/s */
    struct mill_precision_mean power;  /* [W] of the rotor */
    uint64_t batches;                  /* they are taken from */
    bool idle;   /* the rotor has never done any work: nothing to be known of its power */
    bool enough; /* batches, and three revolutions of a rotor that works, to believe the errors */
};

/* Batches for a rotor of `rotor_speed` [rad/s] (0: none), from `origin` [s] on; the grid must
 * outlive it. false: out of memory; then, too, free it. */
bool mill_precision_init(struct mill_precision *precision, double origin, double rotor_speed,
                         const struct mill_spectrum_grid *grid);
void mill_precision_free(struct mill_precision *precision);

/* [s] simulated time at which the batch now open ends. */
static inline double mill_precision_next(const struct mill_precision *precision)
{
    return precision->origin + (double)(precision->at.batches + 1) * precision->at.batch;
}

/* A batch ends: count[MILL_PRECISION_SLOTS] are its impacts by speed. There must be room for it;
 * the accounts of the first batch's begin are accounts[0]. */
void mill_precision_close(struct mill_precision *precision, const uint64_t *count,
                          const struct mill_account *account);

/* Joins batches when there is no room for another: 2 by 2, or 3 by 3 where 3 make a revolution.
 * Returns how many became one; 1: there is room still. */
uint64_t mill_precision_join(struct mill_precision *precision);

/* Batches of the start-up by MSER-5, those of the first half; *settled: it is over, for the rule
 * finds no better cut in the second half. */
uint64_t mill_precision_cut(const struct mill_precision *precision, bool *settled);

/* What the batches from `from` on tell. whole: they are whole revolutions, two or more. */
struct mill_precision_known mill_precision_tell(const struct mill_precision *precision,
                                                uint64_t from, bool whole);

/* There is enough to tell, and both errors, where there is something to know, are at most `wanted`
 * times their values. */
bool mill_precision_reached(const struct mill_precision_known *known, double wanted);

/* ---- series ---- */

/* The d that minimises the sum of (x_i - mean)^2 over i >= d, divided by (n - d)^2; the last five
 * are no candidates. 0 for n <= 5. */
size_t mill_precision_mser(const double *x, size_t n);

/* Standard error of the mean of x[n], a stationary series that remembers what came before; period >
 * 0: n is two or more times that, and what repeats after it has no part in the error. NaN for n <
 * MILL_PRECISION_FEWEST; n <= MILL_PRECISION_BATCHES. */
double mill_precision_error(const double *x, size_t n, size_t period);

#endif
