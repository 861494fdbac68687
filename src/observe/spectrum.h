/* Histogram of speeds on truly logarithmic bins, cheap enough to be filled at every impact. */
#ifndef MILL_SPECTRUM_H
#define MILL_SPECTRUM_H

#include <stdint.h>
#include <string.h>

enum {
    MILL_SPECTRUM_DECADE = 152,  /* bins from a speed to 20 times that speed: 1.99 % each */
    MILL_SPECTRUM_LOWEST = -760, /* the lowest edge is 20^(-760/152) = 3.1e-7 m/s */
    MILL_SPECTRUM_HIGHEST = 380, /* the highest edge is 20^(380/152) = 1789 m/s */
    MILL_SPECTRUM_BINS = MILL_SPECTRUM_HIGHEST - MILL_SPECTRUM_LOWEST,
    MILL_SPECTRUM_SLOTS = MILL_SPECTRUM_BINS + 2, /* slot 0: underflow, the last one: overflow */
    MILL_SPECTRUM_FAST = 1 + (-152 - MILL_SPECTRUM_LOWEST), /* slot that starts at 0.05 m/s */
    /* The table of first guesses: speeds from 2^-22 to 2^11 m/s, 64 cells an octave. */
    MILL_SPECTRUM_SHIFT = 52 - 6,
    MILL_SPECTRUM_CELLS = (11 + 22) * 64
};

/* ln of the ratio of an edge to the one before: ln(20)/152 */
#define MILL_SPECTRUM_LOG_BIN 0x1.42e88d3bfe80fp-6

/* The bins, the same for all spectra. Bin k (slot k + 1) is edge[k] <= v < edge[k + 1]. */
struct mill_spectrum_grid {
    double edge[MILL_SPECTRUM_SLOTS];    /* [m/s]; the last: INFINITY */
    uint16_t first[MILL_SPECTRUM_CELLS]; /* slot of the lowest speed of a cell */
};

struct mill_spectrum_slot {
    uint64_t count;
    double dissipation; /* [J] */
};

struct mill_spectrum {
    double sum; /* [m/s] of the speeds counted, exact where bins are not */
    struct mill_spectrum_slot slot[MILL_SPECTRUM_SLOTS];
};

void mill_spectrum_grid_init(struct mill_spectrum_grid *grid);

/* The slot of speed v [m/s]: 0 below the lowest edge (zero, negative and NaN too),
 * MILL_SPECTRUM_BINS + 1 from the highest edge on. A cell of the table is at most 1/64 wide,
 * narrower than a bin, so it holds one edge at most and one comparison settles the guess. */
static inline int mill_spectrum_find(const struct mill_spectrum_grid *grid, double v)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    const uint64_t cell = (bits >> MILL_SPECTRUM_SHIFT) - ((uint64_t)(1023 - 22) << 6);
    if (cell >= MILL_SPECTRUM_CELLS)
        return v > 1 ? MILL_SPECTRUM_BINS + 1 : 0;
    const int slot = grid->first[cell];
    return slot + (v >= grid->edge[slot]); /* edge[slot] is where the next slot begins */
}

/* Counts a speed v [m/s] that belongs into `slot` so many times (0 or 1), and the dissipation [J]
 * that came with it. */
static inline void mill_spectrum_add(struct mill_spectrum *spectrum, int slot, uint64_t times,
                                     double v, double dissipation)
{
    spectrum->sum += (double)times * v;
    spectrum->slot[slot].count += times;
    spectrum->slot[slot].dissipation += dissipation;
}

/* into += from */
void mill_spectrum_merge(struct mill_spectrum *into, const struct mill_spectrum *from);

/* Speeds counted, and dissipation gathered, in the slots from `slot` up (0: all of them). */
struct mill_spectrum_slot mill_spectrum_total(const struct mill_spectrum *spectrum, int slot);

/* Mean of all speeds [m/s]; NaN when there is none. */
double mill_spectrum_mean(const struct mill_spectrum *spectrum);

/* The speed [m/s] that lies `share` (0..1) of the way through the bin of `slot` (1 to
 * MILL_SPECTRUM_BINS) on the logarithmic scale. */
double mill_spectrum_within(const struct mill_spectrum_grid *grid, int slot, double share);

/* The speed [m/s] below which the share `level` (0..1) of those speeds lies that fell into the
 * slots from `slot` up; log-linear within a bin, 0 within the underflow, the highest edge within
 * the overflow. NaN when there is none. */
double mill_spectrum_quantile(const struct mill_spectrum_grid *grid,
                              const struct mill_spectrum *spectrum, int slot, double level);

#endif
