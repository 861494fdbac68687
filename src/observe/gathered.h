/* All sums of the statistics of a stretch of time. Those of two, or of two runs, can be added. */
#ifndef MILL_GATHERED_H
#define MILL_GATHERED_H

#include "observe/energies.h"
#include "observe/maps.h"
#include "observe/spectrum.h"
#include "observe/wear.h"

/* Normal and tangential speeds of the impacts (or strikes) of one kind */
struct mill_speeds {
    struct mill_spectrum normal, tangential[2]; /* tangential: slow v_n (in results: all), fast */
};
enum { MILL_GATHERED_SPECTRA = sizeof(struct mill_speeds) / sizeof(struct mill_spectrum) };

struct mill_gathered_counts {
    uint64_t samples;           /* of the flow, for the maps */
    double kinetic, rotational; /* [J] energies at the samples, added up */
};

/* What is counted where: the same for all statistics of a mill */
struct mill_gathered_plan {
    int kinds; /* of contact */
    struct mill_energies energies;
    struct mill_maps maps;
    struct mill_wear_plan wear;
};

enum {
    MILL_GATHERED_IMPACTS,
    MILL_GATHERED_STRIKES,
    MILL_GATHERED_PAIRS,
    MILL_GATHERED_HITS,
    MILL_GATHERED_FLOW,
    MILL_GATHERED_WEAR,
    MILL_GATHERED_ALONG,
    MILL_GATHERED_COUNTS,
    MILL_GATHERED_PARTS
};

struct mill_gathered {
    struct mill_sums part[MILL_GATHERED_PARTS];
    /* ---- the records of the parts ---- */
    struct mill_speeds *impacts, *strikes; /* [kinds], in results one more */
    struct mill_energies_pair *pair;       /* [pairs] */
    struct mill_map_hits *hits;            /* [cells] */
    struct mill_map_flow *flow;            /* [cells] */
    struct mill_wear_sum *wear, *along;    /* [facets]; [bins], none without a contour */
    struct mill_gathered_counts *counts;
    int64_t last; /* number of the last original portion in it (tally.c) */
};

/* false: out of memory. The caller frees it in both cases. */
bool mill_gathered_plan(struct mill_gathered_plan *plan, const struct mill_world *world);
void mill_gathered_free_plan(struct mill_gathered_plan *plan);

/* Makes empty statistics, with `rows` rows of speeds. false: no memory. Owner: the caller */
bool mill_gathered_make(struct mill_gathered *g, const struct mill_gathered_plan *plan, int rows);

/* Frees the contents, not the struct itself. */
void mill_gathered_free(struct mill_gathered *gathered);

void mill_gathered_clear(struct mill_gathered *gathered);

/* into += from */
void mill_gathered_add(struct mill_gathered *into, const struct mill_gathered *from);

/* Saves or loads them; prefix: of the names of the fields. */
void mill_gathered_state(struct mill_gathered *g, const char *prefix, struct mill_state *state);

#endif
