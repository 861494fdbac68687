/* How much energy do impacts bring, and lose? Histograms for each pair of species and surfaces. A
 * bin is a sixteenth of an octave between two powers of two, so the leading bits of the number are
 * its bin: no logarithm, no table, exact edges. */
#ifndef MILL_ENERGIES_H
#define MILL_ENERGIES_H

#include "millsim/observer.h"

#include <stdbool.h>
#include <string.h>

enum {
    MILL_ENERGIES_LOWEST = -54, /* bins from 2^-54 J = 5.6e-17 J */
    MILL_ENERGIES_HIGHEST = 10, /* to 2^10 J */
    MILL_ENERGIES_INSIDE = (MILL_ENERGIES_HIGHEST - MILL_ENERGIES_LOWEST) * 16, /* 2^10 bins */
    /* the first: below, zero and negative too; the last: above */
    MILL_ENERGIES_BINS = MILL_ENERGIES_INSIDE + 2,
    MILL_ENERGIES_SHIFT = 52 - 4,
    MILL_ENERGIES_FIRST = (1023 + MILL_ENERGIES_LOWEST) * 16 - 1 /* leading bits: the first's */
};

/* Slots are bins: slot i is edge(i) <= E < edge(i + 1). */
struct mill_energies_pair {
    double half_mass; /* [kg] m* / 2 */
    struct {
        uint64_t count;
        double dissipation; /* [J] by these impacts */
    } normal[MILL_ENERGIES_BINS];
    uint64_t total[MILL_ENERGIES_BINS], dissipated[MILL_ENERGIES_BINS];
};

/* Pairs are numbered: of the ball and the other ball, species by species, then of the ball at each
 * kind of surface, where the species of the partner is -1. */
struct mill_energies {
    size_t species, pairs;
    /* [kinds] pair: first + step species + partner's species */
    size_t first[MILL_KINDS_MOST], step[MILL_KINDS_MOST];
    struct mill_energies_pair *pair; /* [pairs] */
    double *room;                    /* [pairs][MILL_ENERGIES_BINS] for telling */
};

/* false: out of memory. Free them in any case. */
bool mill_energies_init(struct mill_energies *energies, const struct mill_world *world);
/* Empty ones of the same pairs */
bool mill_energies_like(struct mill_energies *energies, const struct mill_energies *as);
void mill_energies_free(struct mill_energies *energies);

/* into += from; from = 0. Of the same pairs. */
void mill_energies_add(struct mill_energies *into, const struct mill_energies *from);
void mill_energies_clear(struct mill_energies *energies);

/* Tells them as the group "energies". kinds: of their world */
void mill_energies_tell(const struct mill_energies *energies, const struct mill_kinds *kinds,
                        struct mill_sink *sink);

/* [J] Lower edge of bin i, and upper one of the last: 0..MILL_ENERGIES_BINS */
double mill_energies_edge(int i);

/* Bin of an energy [J], for doubles grow as their bits do; above MILL_ENERGIES_INSIDE: outside */
static inline uint64_t mill_energies_inside(double energy)
{
    uint64_t bits;
    memcpy(&bits, &energy, sizeof bits);
    return (bits >> MILL_ENERGIES_SHIFT) - MILL_ENERGIES_FIRST;
}

/* Bin of any energy [J] */
static inline uint64_t mill_energies_bin(double energy)
{
    const uint64_t bin = mill_energies_inside(energy);
    return bin <= MILL_ENERGIES_INSIDE ? bin : energy > 1 ? MILL_ENERGIES_BINS - 1 : 0;
}

/* Of normal approach, m* v_n^2 / 2; with the slip of the surfaces, m* (v_n^2 + v_t^2) / 2; lost */
static inline void mill_energies_impact(struct mill_energies *energies,
                                        const struct mill_impact *impact)
{
    struct mill_energies_pair *pair =
        &energies->pair[energies->first[impact->kind] +
                        energies->step[impact->kind] * (size_t)impact->species +
                        (size_t)impact->partner_species];
    const double v = impact->normal_speed, slip = impact->tangential_speed;
    const double normal = pair->half_mass * (v * v);
    const double total = normal + pair->half_mass * (slip * slip), lost = impact->dissipation;
    uint64_t by_normal = mill_energies_inside(normal), by_total = mill_energies_inside(total);
    uint64_t by_lost = mill_energies_inside(lost);
    if ((by_normal | by_total | by_lost) > MILL_ENERGIES_INSIDE) { /* one check of all: -1.5 ns */
        by_normal = mill_energies_bin(normal);
        by_total = mill_energies_bin(total);
        by_lost = mill_energies_bin(lost);
    }
    pair->normal[by_normal].dissipation += lost;
    if (impact->lasting)
        return;
    pair->normal[by_normal].count++;
    pair->total[by_total]++;
    pair->dissipated[by_lost]++;
}

#endif
