/* Room for the histograms of energy, in one piece, and how they are told: all pairs of a kind as
 * one array, so that a file of a mixture has no more datasets than another. */
#include "observe/energies.h"

#include "observe/sink.h"

#include <stdlib.h>

#define PAIR "; by species of the ball, and between balls by that of the other, which is no lower"

static const struct {
    const char *name, *meaning;
} of[MILL_ENERGIES] = {
    {"normal", "impacts by m* v_n^2 / 2, with the normal speed just before" PAIR},
    {"total", "impacts by m* (v_n^2 + v_t^2) / 2, with normal and slip speed just before" PAIR},
    {"dissipated", "impacts by the energy dissipated" PAIR},
};

bool mill_energies_like(struct mill_energies *e, const struct mill_energies *as)
{
    *e = *as;
    e->pair = calloc(e->pairs, sizeof *e->pair);
    e->room = calloc(e->pairs, MILL_ENERGIES_BINS * sizeof *e->room);
    for (size_t i = 0; e->pair && as->pair && i < e->pairs; i++)
        e->pair[i].half_mass = as->pair[i].half_mass;
    return e->pair && e->room;
}

bool mill_energies_init(struct mill_energies *e, const struct mill_world *world)
{
    const size_t species = (size_t)world->species_count, balls = species * species;
    struct mill_energies as = {.species = species, .pairs = balls};
    as.step[MILL_BALL_BALL] = species;
    for (int kind = MILL_BALL_BALL + 1; kind < MILL_KINDS; kind++, as.pairs += species) {
        as.first[kind] = as.pairs + 1; /* the partner's species is -1 */
        as.step[kind] = 1;
    }
    if (!mill_energies_like(e, &as))
        return false;
    for (size_t i = 0; i < e->pairs; i++) {
        const double mass = world->species[i % species].mass;
        const double other = world->species[i / species % species].mass;
        e->pair[i].half_mass = 0.5 * (i < balls ? mass * other / (mass + other) : mass);
    }
    return true;
}

void mill_energies_free(struct mill_energies *e)
{
    free(e->pair);
    free(e->room);
}

void mill_energies_add(struct mill_energies *into, const struct mill_energies *from)
{
    for (size_t i = 0; i < into->pairs; i++)
        for (int bin = 0; bin < MILL_ENERGIES_BINS; bin++) {
            for (int k = 0; k < MILL_ENERGIES; k++)
                into->pair[i].count[k][bin] += from->pair[i].count[k][bin];
            into->pair[i].dissipation[bin] += from->pair[i].dissipation[bin];
        }
}

void mill_energies_clear(struct mill_energies *e)
{
    for (size_t i = 0; i < e->pairs; i++)
        e->pair[i] = (struct mill_energies_pair){.half_mass = e->pair[i].half_mass};
}

/* ---- telling ---- */

static void tell_kind(const struct mill_energies *e, enum mill_kind kind, struct mill_sink *sink)
{
    const int balls = kind == MILL_BALL_BALL;
    const size_t n = MILL_ENERGIES_BINS, pairs = e->species * e->step[kind];
    const struct mill_energies_pair *pair = e->pair + e->first[kind] - !balls;
    const size_t dims[3] = {e->species, balls ? e->species : n, n};
    sink->open(sink, mill_kind_name[kind]);
    for (int k = 0; k < MILL_ENERGIES; k++) {
        for (size_t i = 0; i < pairs; i++)
            memcpy(e->room + i * n, pair[i].count[k], n * sizeof *pair->count[k]);
        sink->values(sink, of[k].name, MILL_H5_U64, 2 + balls, dims, e->room, "1", of[k].meaning);
    }
    for (size_t i = 0; i < pairs; i++)
        memcpy(e->room + i * n, pair[i].dissipation, n * sizeof *pair->dissipation);
    sink->values(sink, "dissipation", MILL_H5_F64, 2 + balls, dims, e->room, "J",
                 "energy dissipated by those of each bin of `normal`");
    sink->close(sink);
}

double mill_energies_edge(int i)
{
    if (i < 1 || i >= MILL_ENERGIES_BINS)
        return i < 1 ? -INFINITY : INFINITY;
    return ldexp(1 + (i - 1) % 16 / 16.0, MILL_ENERGIES_LOWEST + (i - 1) / 16);
}

void mill_energies_tell(const struct mill_energies *e, struct mill_sink *sink)
{
    double edge[MILL_ENERGIES_BINS + 1];
    for (int i = 0; i <= MILL_ENERGIES_BINS; i++)
        edge[i] = mill_energies_edge(i);
    sink->open(sink, "energies");
    mill_tell_array(sink, "edges", MILL_ENERGIES_BINS + 1, edge, "J",
                    "edges of the bins: 2^k (1 + j/16) J with k = -54..9, j = 0..15, and 2^10 J, "
                    "between infinities; bin i is edges[i] <= E < edges[i+1]");
    for (int kind = 0; kind < MILL_KINDS; kind++)
        tell_kind(e, (enum mill_kind)kind, sink);
    sink->close(sink);
}
