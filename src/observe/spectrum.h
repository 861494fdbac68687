/* Histogram of speeds with logarithmic bins, fast enough to be filled at every impact */
#ifndef MILL_SPECTRUM_H
#define MILL_SPECTRUM_H

#include "millsim/world.h"
#include "observe/sums.h"

#include <string.h>

enum {
    MILL_SPECTRUM_DECADE = 152,  /* bins of a factor of 20, each 1.99 % wide */
    MILL_SPECTRUM_LOWEST = -760, /* the lowest edge is 20^(-760/152) = 3.1e-7 m/s */
    MILL_SPECTRUM_HIGHEST = 380, /* the highest edge is 20^(380/152) = 1789 m/s */
    MILL_SPECTRUM_BINS = MILL_SPECTRUM_HIGHEST - MILL_SPECTRUM_LOWEST,
    MILL_SPECTRUM_SLOTS = MILL_SPECTRUM_BINS + 2, /* slot 0: underflow, the last one: overflow */
    MILL_SPECTRUM_FAST = 1 + (-152 - MILL_SPECTRUM_LOWEST), /* slot that starts at 0.05 m/s: fast */
    /* Table of first guesses: speeds from 2^-22 to 2^11 m/s, 64 cells an octave (a factor of 2) */
    MILL_SPECTRUM_SHIFT = 52 - 6,
    MILL_SPECTRUM_CELLS = (11 + 22) * 64
};

/* ln of the ratio of an edge to the one before: ln(20)/152 */
#define MILL_SPECTRUM_LOG_BIN 0x1.42e88d3bfe80fp-6

/* The bins, equal for all spectra. Bin k (slot k + 1) holds edge[k] <= v < edge[k + 1]. */
struct mill_spectrum_grid {
    double edge[MILL_SPECTRUM_SLOTS];    /* [m/s] the last one is INFINITY */
    uint16_t first[MILL_SPECTRUM_CELLS]; /* slot of the lowest speed in a cell */
};

struct mill_spectrum_slot {
    uint64_t count;
    double dissipation; /* [J] */
};

struct mill_spectrum {
    double sum; /* [m/s] of all counted speeds; exact, unlike the bins */
    struct mill_spectrum_slot slot[MILL_SPECTRUM_SLOTS];
};

void mill_spectrum_grid_init(struct mill_spectrum_grid *grid);

/* The slot from which on impacts are fast: at 0.05 m/s or more, and at least six rebound floors, so
 * that nothing that is said of them depends on the floor */
int mill_spectrum_from(const struct mill_spectrum_grid *grid, const struct mill_world *world);

/* The slot of a speed v [m/s]; 0: below the lowest edge (also zero, negative and NaN); the last:
 * from the highest edge on. A cell of the table has a relative width of at most 1/64, less than a
 * bin. So it contains at most one edge, and one comparison after the guess is enough. */
static inline int mill_spectrum_find(const struct mill_spectrum_grid *grid, double v)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    const uint64_t cell = (bits >> MILL_SPECTRUM_SHIFT) - ((uint64_t)(1023 - 22) << 6);
    if (cell >= MILL_SPECTRUM_CELLS)
        return v > 1 ? MILL_SPECTRUM_BINS + 1 : 0;
    const int slot = grid->first[cell];
    return slot + (v >= grid->edge[slot]); /* edge[slot] is the start of the next slot */
}

/* Counts a speed v [m/s] in `slot`, 0 or 1 `times`, and adds the impact's dissipation [J]. */
static inline void mill_spectrum_add(struct mill_spectrum *spectrum, int slot, uint64_t times,
                                     double v, double dissipation)
{
    spectrum->sum += (double)times * v;
    spectrum->slot[slot].count += times;
    spectrum->slot[slot].dissipation += dissipation;
}

/* The numbers of a struct mill_spectrum: the sum of speeds, then these */
enum { MILL_SPECTRUM_COUNT = 1, MILL_SPECTRUM_DISSIPATION };
extern const struct mill_sums_list mill_spectrum_sums;

/* Number of speeds and their dissipation in `slot` and all slots above it (0: in all). */
struct mill_spectrum_slot mill_spectrum_total(const struct mill_spectrum *spectrum, int slot);

/* Mean of all speeds [m/s]; NaN if there are none. */
double mill_spectrum_mean(const struct mill_spectrum *spectrum);

/* A quantile of the speeds in `slot` and all slots above it: at the fraction `within` of slot
 * `bin`. count, below: of all these speeds; of those in slots before `bin` */
struct mill_spectrum_place {
    int slot, bin;
    double within, count, below;
};
struct mill_spectrum_place mill_spectrum_place(const struct mill_spectrum *s, int slot, double at);

/* Moves the place to a higher level. */
void mill_spectrum_raise(const struct mill_spectrum *spectrum, double level,
                         struct mill_spectrum_place *place);

/* [m/s] log-linear in a bin; 0 in the underflow; the highest edge in the overflow; NaN: none */
double mill_spectrum_speed(const struct mill_spectrum_grid *g, const struct mill_spectrum_place *p);

#endif
