/* How much energy do impacts bring, and how much do they lose? Histograms for each pair of species
 * and surfaces, with 16 equal bins for each octave (a factor of 2) of millijoules. So the leading
 * bits of a double are its bin. The edges are exact, and 1, 10 and 100 mJ are edges. The standard
 * error of any sum over impacts follows from coarser histograms of short blocks of time. */
#ifndef MILL_ENERGIES_H
#define MILL_ENERGIES_H

#include "millsim/observer.h"
#include "observe/kinds.h"
#include "observe/precision.h"

enum {
    MILL_ENERGIES_LOWEST = -44, /* bins from 2^-44 mJ = 5.7e-17 J */
    MILL_ENERGIES_HIGHEST = 20, /* to 2^20 mJ = 1049 J */
    MILL_ENERGIES_INSIDE = (MILL_ENERGIES_HIGHEST - MILL_ENERGIES_LOWEST) * 16, /* 2^10 bins */
    MILL_ENERGIES_BINS = MILL_ENERGIES_INSIDE + 2, /* first: lower, and <= 0; last: higher */
    MILL_ENERGIES_SHIFT = 52 - 4,
    MILL_ENERGIES_FIRST = (1023 + MILL_ENERGIES_LOWEST) * 16 - 1, /* leading bits of bin 0 */
    MILL_ENERGIES_SORTS = 3,  /* energies of an impact: normal, total, dissipated */
    MILL_ENERGIES_JOINED = 4, /* bins that are one in a block */
    MILL_ENERGIES_COARSE = MILL_ENERGIES_INSIDE / MILL_ENERGIES_JOINED + 2,
    MILL_ENERGIES_BLOCKS = 108, /* then 2 or 3 are joined: 36 remain, which an error needs */
    MILL_ENERGIES_CLASSES = 16  /* more species are counted in classes of about the same mass */
};

#define MILL_ENERGIES_MILLI 1e3 /* [mJ/J] */

/* Slot i counts energies E with edge(i) <= E < edge(i + 1). */
struct mill_energies_pair {
    struct {
        uint64_t count;
        double dissipation; /* [J] of these impacts */
    } normal[MILL_ENERGIES_BINS];
    uint64_t total[MILL_ENERGIES_BINS], dissipated[MILL_ENERGIES_BINS];
};
extern const struct mill_sums_list mill_energies_sums;

/* Which pairs there are: of balls, the classes of both; for each kind of surface, of the ball */
struct mill_energies {
    const struct mill_world *world;
    size_t classes, pairs;
    int32_t *class_of;             /* [species], by mass; the species itself if there are few */
    size_t first[MILL_KINDS_MOST]; /* number of the pair of class 0 */
};

/* false: out of memory. The caller frees them in both cases. */
bool mill_energies_init(struct mill_energies *energies, const struct mill_world *world);
void mill_energies_free(struct mill_energies *energies);

/* [byte] What the energies of several species take in memory, and at most in a file */
double mill_energies_cost(const struct mill_energies *energies);

/* Number of the pair of two classes of balls */
static inline size_t mill_energies_balls(size_t one, size_t other)
{
    const size_t low = one < other ? one : other, high = one < other ? other : one;
    return high * (high + 1) / 2 + low;
}

/* Writes the content of the group "energies". sums: [pairs] */
void mill_energies_tell(const struct mill_energies *energies, const struct mill_sums *sums,
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
bool mill_energies_blocks_init(struct mill_energies_blocks *blocks, size_t pairs);
void mill_energies_blocks_free(struct mill_energies_blocks *blocks);

/* Ends a block with what was counted in `pair` since the last one. period: batches of a period,
 * which blocks that are joined divide, or hold; 0: there is none */
void mill_energies_blocks_close(struct mill_energies_blocks *blocks,
                                const struct mill_energies_pair *pair, uint64_t period);

/* Forgets the counts so far, of energies that were cleared. */
void mill_energies_blocks_restart(struct mill_energies_blocks *blocks);

/* Saves or loads them. */
void mill_energies_blocks_state(struct mill_energies_blocks *blocks, struct mill_state *state);

/* First block that begins at a batch or after it */
static inline uint64_t mill_energies_blocks_first(const struct mill_energies_blocks *b, uint64_t at)
{
    return (at + b->length - 1) / b->length;
}

/* Blocks in a period of this many batches; 0: no whole number of them, more than one */
static inline uint64_t mill_energies_blocks_period(const struct mill_energies_blocks *b, uint64_t n)
{
    return n > b->length && n % b->length == 0 ? n / b->length : 0;
}

/* Impacts of all pairs in each block from `first` on, each bin with its weight */
void mill_energies_blocks_weigh(const struct mill_energies_blocks *blocks, uint64_t first, int sort,
                                const double weight[MILL_ENERGIES_COARSE],
                                double series[MILL_ENERGIES_BLOCKS]);

/* Writes the group "blocks" in "energies". from: the first batch that counts. Of
 * MILL_SPREAD_SEVERAL starts: one block each, the sum of its blocks; of fewer all, in a row */
void mill_energies_blocks_tell(const struct mill_energies_blocks *const *blocks, int starts,
                               const struct mill_energies *energies,
                               const struct mill_precision *batches, uint64_t from,
                               struct mill_sink *sink);

/* Hard impacts: of `energy` [J] or more. In a bin they are spread evenly over its logarithm. */
struct mill_energies_hard {
    double energy; /* NaN: nothing is lost, and nothing is hard */
    int sort;      /* of the energy: normal, total, dissipated */
    double count;
    /* How `count` varies, as a found energy varies, too: the sum over impacts, each with its
     * weight, plus this part [1/J] of the energy lost */
    double weight[MILL_ENERGIES_COARSE], of_loss;
};

/* asked [J]: NaN: the normal energy above which half of the lost energy falls */
struct mill_energies_hard mill_energies_find_hard(const struct mill_energies_pair *pair,
                                                  size_t pairs, double asked, int sort);

/* [J] Lower edge of bin i; for i = MILL_ENERGIES_BINS the upper edge of the last bin */
double mill_energies_edge(int i);

/* Bin of an energy [mJ] by its bits, which grow with it. > MILL_ENERGIES_INSIDE: outside bins */
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

/* Counts three energies in pair[pairs]: m* v_n^2 / 2; m* (v_n^2 + v_t^2) / 2; the one lost */
static inline void mill_energies_impact(const struct mill_energies *energies,
                                        struct mill_energies_pair *pair,
                                        const struct mill_impact *impact)
{
    const int16_t one = impact->species, other = impact->partner_species;
    const size_t class = (size_t)energies->class_of[one];
    double mass = energies->world->species[one].mass;
    pair += energies->first[impact->kind];
    if (other < 0) {
        pair += class;
    } else {
        const double met = energies->world->species[other].mass;
        mass = mass * met / (mass + met);
        pair += mill_energies_balls(class, (size_t)energies->class_of[other]);
    }
    const double half_mass = 0.5 * MILL_ENERGIES_MILLI * mass; /* [g] makes energies in mJ */
    const double v = impact->normal_speed, slip = impact->tangential_speed;
    const double normal = half_mass * (v * v), total = normal + half_mass * (slip * slip);
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
