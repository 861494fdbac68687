#include "observe/gathered.h"

#include "millsim/state.h"

#include <stdio.h>

#define AT(member) offsetof(struct mill_gathered_counts, member), 0, 0

static const struct mill_sum sum[] = {
    {"samples", "1", "samples of the flow", MILL_H5_U64, AT(samples)},
    {"kinetic", "J", "sum of the kinetic energies at the samples", MILL_H5_F64, AT(kinetic)},
    {"rotational", "J", "the same of the spins", MILL_H5_F64, AT(rotational)}};

static const struct mill_sums_list counts = {"counts", sizeof(struct mill_gathered_counts), 3, sum};

bool mill_gathered_plan(struct mill_gathered_plan *plan, const struct mill_world *world)
{
    *plan = (struct mill_gathered_plan){.kinds = world->kinds.count};
    return mill_maps_init(&plan->maps, world) && mill_energies_init(&plan->energies, world) &&
           mill_wear_facets_make(&plan->wear, world);
}

void mill_gathered_free_plan(struct mill_gathered_plan *plan)
{
    mill_energies_free(&plan->energies);
    mill_maps_free(&plan->maps);
    mill_wear_facets_free(&plan->wear);
}

bool mill_gathered_make(struct mill_gathered *g, const struct mill_gathered_plan *plan, int rows)
{
    const size_t spectra = (size_t)rows * MILL_GATHERED_SPECTRA;
    const struct {
        const struct mill_sums_list *list;
        size_t count;
    } of[] = {
        [MILL_GATHERED_IMPACTS] = {&mill_spectrum_sums, spectra},
        [MILL_GATHERED_STRIKES] = {&mill_spectrum_sums, spectra},
        [MILL_GATHERED_PAIRS] = {&mill_energies_sums, plan->energies.pairs},
        [MILL_GATHERED_HITS] = {&mill_maps_hits, plan->maps.cells},
        [MILL_GATHERED_FLOW] = {&mill_maps_flow, plan->maps.cells},
        [MILL_GATHERED_WEAR] = {&mill_wear_sums, (size_t)plan->wear.facets},
        [MILL_GATHERED_ALONG] = {&mill_wear_along_sums, plan->wear.contour ? MILL_WEAR_BINS : 0},
        [MILL_GATHERED_COUNTS] = {&counts, 1}};
    bool good = true;
    for (int i = 0; i < MILL_GATHERED_PARTS; i++)
        good = mill_sums_make(&g->part[i], of[i].list, of[i].count) && good;
    g->impacts = g->part[MILL_GATHERED_IMPACTS].record;
    g->strikes = g->part[MILL_GATHERED_STRIKES].record;
    g->pair = g->part[MILL_GATHERED_PAIRS].record;
    g->hits = g->part[MILL_GATHERED_HITS].record;
    g->flow = g->part[MILL_GATHERED_FLOW].record;
    g->wear = g->part[MILL_GATHERED_WEAR].record;
    g->along = g->part[MILL_GATHERED_ALONG].record;
    g->counts = g->part[MILL_GATHERED_COUNTS].record;
    return good;
}

void mill_gathered_free(struct mill_gathered *g)
{
    for (int i = 0; i < MILL_GATHERED_PARTS; i++)
        mill_sums_free(&g->part[i]);
}

void mill_gathered_clear(struct mill_gathered *g)
{
    for (int i = 0; i < MILL_GATHERED_PARTS; i++)
        mill_sums_clear(&g->part[i]);
}

void mill_gathered_add(struct mill_gathered *into, const struct mill_gathered *from)
{
    for (int i = 0; i < MILL_GATHERED_PARTS; i++)
        mill_sums_add(&into->part[i], &from->part[i]);
}

void mill_gathered_state(struct mill_gathered *g, const char *prefix, struct mill_state *state)
{
    char name[40];
    snprintf(name, sizeof name, "%s_last", prefix);
    mill_state_structs(state, name, sizeof g->last, 1, &g->last);
    for (int i = 0; i < MILL_GATHERED_PARTS; i++) {
        snprintf(name, sizeof name, "%s%s", prefix, i == MILL_GATHERED_STRIKES ? "_strikes" : "");
        mill_sums_state(&g->part[i], name, state);
    }
}
