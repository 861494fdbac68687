/* How much energy do impacts bring, and how much do they lose? Histograms for each pair of
 * species and surfaces. Each octave (a factor of 2) of the energy in millijoules has 16 bins of
 * equal width. So the leading bits of a double are the number of its bin: this needs no logarithm
 * and no table. The edges are exact, and 1, 10 and 100 mJ are edges. The standard error of any sum
 * over impacts follows from coarser histograms of short blocks of time. */
#ifndef MILL_ENERGIES_H
#define MILL_ENERGIES_H

#include "millsim/observer.h"
#include "observe/precision.h"

#include <stdbool.h>
#include <string.h>

enum {
    MILL_ENERGIES_LOWEST = -44, /* bins from 2^-44 mJ = 5.7e-17 J */
    MILL_ENERGIES_HIGHEST = 20, /* to 2^20 mJ = 1049 J */
    MILL_ENERGIES_INSIDE = (MILL_ENERGIES_HIGHEST - MILL_ENERGIES_LOWEST) * 16, /* 2^10 bins */
    /* first bin: below the lowest edge, also zero and negative; last bin: above the highest edge */
    MILL_ENERGIES_BINS = MILL_ENERGIES_INSIDE + 2,
    MILL_ENERGIES_SHIFT = 52 - 4,
    MILL_ENERGIES_FIRST =
        (1023 + MILL_ENERGIES_LOWEST) * 16 - 1, /* leading bits of the first bin */
    MILL_ENERGIES_SORTS = 3,  /* energies of an impact: normal, total, dissipated */
    MILL_ENERGIES_JOINED = 4, /* bins that are one in a block */
    MILL_ENERGIES_COARSE = MILL_ENERGIES_INSIDE / MILL_ENERGIES_JOINED + 2,
    MILL_ENERGIES_BLOCKS = 108 /* then 2 or 3 are joined, so that 36 remain, which an error needs */
};

#define MILL_ENERGIES_MILLI 1e3 /* [mJ/J] */

/* Slot i counts energies E with edge(i) <= E < edge(i + 1). */
struct mill_energies_pair {
    double half_mass; /* [g] 1000 m* / 2, which makes energies in mJ */
    struct {
        uint64_t count;
        double dissipation; /* [J] of these impacts */
    } normal[MILL_ENERGIES_BINS];
    uint64_t total[MILL_ENERGIES_BINS], dissipated[MILL_ENERGIES_BINS];
};

/* Numbers of pairs. For contacts of balls: the species of both balls. For each kind of surface: the
 * species of the ball; the partner's species is then -1. */
struct mill_energies {
    size_t species, pairs;
    /* [kinds] number of a pair: first + step species + partner's species */
    size_t first[MILL_KINDS_MOST], step[MILL_KINDS_MOST];
    struct mill_energies_pair *pair; /* [pairs] */
    double *room;                    /* [pairs][MILL_ENERGIES_BINS] for telling */
};

/* false: out of memory. The caller frees them in both cases. */
bool mill_energies_init(struct mill_energies *energies, const struct mill_world *world);
/* Makes empty histograms for the same pairs */
bool mill_energies_like(struct mill_energies *energies, const struct mill_energies *as);
void mill_energies_free(struct mill_energies *energies);

/* into += from; then from = 0. Both must have the same pairs. */
void mill_energies_add(struct mill_energies *into, const struct mill_energies *from);
void mill_energies_clear(struct mill_energies *energies);

/* Writes the content of the group "energies". kinds: of the same world */
void mill_energies_tell(const struct mill_energies *energies, const struct mill_kinds *kinds,
                        struct mill_sink *sink);

/* The impacts of short blocks of time, of some batches each, in coarser bins */
struct mill_energies_blocks {
    size_t pairs;
    uint64_t length;  /* batches of a block */
    uint64_t blocks;  /* complete ones */
    uint64_t *before; /* [pairs][SORTS][COARSE] at the end of the last block */
    int32_t *count;   /* [BLOCKS][pairs][SORTS][COARSE] */
};

/* false: out of memory. The caller frees them in both cases. */
bool mill_energies_blocks_init(struct mill_energies_blocks *blocks, const struct mill_energies *of);
void mill_energies_blocks_free(struct mill_energies_blocks *blocks);

/* Ends a block with what was counted in `energies` since the last one. period: batches of a period,
 * which blocks that are joined divide, or hold; 0: there is none */
void mill_energies_blocks_close(struct mill_energies_blocks *blocks,
                                const struct mill_energies *energies, uint64_t period);

/* Forgets the counts so far, of energies that were cleared. */
void mill_energies_blocks_restart(struct mill_energies_blocks *blocks);

/* First block that begins at a batch or after it */
static inline uint64_t mill_energies_blocks_first(const struct mill_energies_blocks *blocks,
                                                  uint64_t batch)
{
    return (batch + blocks->length - 1) / blocks->length;
}

/* Blocks in a period of this many batches; 0: no whole number of them, more than one */
static inline uint64_t mill_energies_blocks_period(const struct mill_energies_blocks *blocks,
                                                   uint64_t period)
{
    return period > blocks->length && period % blocks->length == 0 ? period / blocks->length : 0;
}

/* Impacts of all pairs with a normal energy of 1 mJ or more in each block from `first` on.
 * Returns the number of these blocks. */
size_t mill_energies_blocks_hard(const struct mill_energies_blocks *blocks, uint64_t first,
                                 double series[MILL_ENERGIES_BLOCKS]);

/* Writes the group "blocks" within the group "energies". from: the first batch that counts. period:
 * in batches; batch: [s] its length */
void mill_energies_blocks_tell(const struct mill_energies_blocks *blocks,
                               const struct mill_energies *energies, const struct mill_kinds *kinds,
                               uint64_t from, uint64_t period, double batch,
                               struct mill_sink *sink);

/* [J] Lower edge of bin i; for i = MILL_ENERGIES_BINS the upper edge of the last bin */
double mill_energies_edge(int i);

/* Bin of an energy [mJ], from its bits, which grow with the value. > MILL_ENERGIES_INSIDE: outside
 * the bins */
static inline uint64_t mill_energies_inside(double energy)
{
    uint64_t bits;
    memcpy(&bits, &energy, sizeof bits);
    return (bits >> MILL_ENERGIES_SHIFT) - MILL_ENERGIES_FIRST;
}

/* Bin of any energy [mJ] */
static inline uint64_t mill_energies_bin(double energy)
{
    const uint64_t bin = mill_energies_inside(energy);
    return bin <= MILL_ENERGIES_INSIDE ? bin : energy > 1 ? MILL_ENERGIES_BINS - 1 : 0;
}

/* Counts three energies: of the normal approach, m* v_n^2 / 2; with the slip, m* (v_n^2 + v_t^2) /
 * 2; lost */
static inline void mill_energies_impact(struct mill_energies *energies,
                                        const struct mill_impact *impact)
{
    struct mill_energies_pair *pair =
        &energies->pair[energies->first[impact->kind] +
                        energies->step[impact->kind] * (size_t)impact->species +
                        (size_t)impact->partner_species];
    const double v = impact->normal_speed, slip = impact->tangential_speed;
    const double normal = pair->half_mass * (v * v);
    const double total = normal + pair->half_mass * (slip * slip);
    const double lost = MILL_ENERGIES_MILLI * impact->dissipation;
    uint64_t by_normal = mill_energies_inside(normal), by_total = mill_energies_inside(total);
    uint64_t by_lost = mill_energies_inside(lost);
    /* one check instead of three: -1.5 ns */
    if ((by_normal | by_total | by_lost) > MILL_ENERGIES_INSIDE) {
        by_normal = mill_energies_bin(normal);
        by_total = mill_energies_bin(total);
        by_lost = mill_energies_bin(lost);
    }
    pair->normal[by_normal].dissipation += impact->dissipation;
    if (impact->lasting)
        return;
    pair->normal[by_normal].count++;
    pair->total[by_total]++;
    pair->dissipated[by_lost]++;
}

#endif
