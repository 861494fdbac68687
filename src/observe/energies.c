/* The histograms of energy are in one block of memory. In a file, all pairs of a kind are one
 * array, so that the file of a mixture has no more datasets than others. */
#include "observe/energies.h"

#include "observe/sink.h"

#include <stddef.h>
#include <stdlib.h>

#define PAIR "; by species of the ball, and between balls by that of the other, which is no lower"

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
    for (int kind = MILL_BALL_BALL + 1; kind < world->kinds.count; kind++, as.pairs += species) {
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
            into->pair[i].normal[bin].count += from->pair[i].normal[bin].count;
            into->pair[i].normal[bin].dissipation += from->pair[i].normal[bin].dissipation;
            into->pair[i].total[bin] += from->pair[i].total[bin];
            into->pair[i].dissipated[bin] += from->pair[i].dissipated[bin];
        }
}

void mill_energies_clear(struct mill_energies *e)
{
    for (size_t i = 0; i < e->pairs; i++)
        e->pair[i] = (struct mill_energies_pair){.half_mass = e->pair[i].half_mass};
}

/* ---- telling ---- */

enum { DISSIPATED = 2 }; /* from this number on: energies lost */

static void tell_kind(const struct mill_energies *e, int kind, const char *name,
                      struct mill_sink *sink)
{
    const int balls = kind == MILL_BALL_BALL;
    const size_t n = MILL_ENERGIES_BINS, pairs = e->species * e->step[kind];
    const struct mill_energies_pair *pair = e->pair + e->first[kind] - !balls;
    const struct {
        const char *name, *unit, *meaning;
        size_t at, step; /* [bytes] offset in a pair; step from bin to bin */
        enum mill_h5_type type;
    } of[] = {
        {"normal", "1", "impacts by m* v_n^2 / 2, with the normal speed just before" PAIR,
         offsetof(struct mill_energies_pair, normal[0].count), sizeof pair->normal[0], MILL_H5_U64},
        {"total", "1",
         "impacts by m* (v_n^2 + v_t^2) / 2, with normal and slip speed just before" PAIR,
         offsetof(struct mill_energies_pair, total), sizeof pair->total[0], MILL_H5_U64},
        {"dissipated", "1", "impacts by the energy dissipated" PAIR,
         offsetof(struct mill_energies_pair, dissipated), sizeof pair->dissipated[0], MILL_H5_U64},
        {"dissipation", "J", "energy dissipated by those of each bin of `normal`",
         offsetof(struct mill_energies_pair, normal[0].dissipation), sizeof pair->normal[0],
         MILL_H5_F64},
    };
    const size_t dims[3] = {e->species, balls ? e->species : n, n};
    sink->open(sink, name);
    for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
        for (size_t i = 0; i < pairs * n; i++)
            memcpy(e->room + i, (const char *)&pair[i / n] + of[k].at + i % n * of[k].step,
                   sizeof *e->room);
        sink->values(sink, of[k].name, of[k].type, 2 + balls, dims, e->room, of[k].unit,
                     of[k].meaning);
        if (k >= DISSIPATED)
            mill_tell_part(sink);
    }
    sink->close(sink);
}

double mill_energies_edge(int i)
{
    if (i < 1 || i >= MILL_ENERGIES_BINS)
        return i < 1 ? -INFINITY : INFINITY;
    return ldexp(1 + (i - 1) % 16 / 16.0, MILL_ENERGIES_LOWEST + (i - 1) / 16);
}

void mill_energies_tell(const struct mill_energies *e, const struct mill_kinds *kinds,
                        struct mill_sink *sink)
{
    double edge[MILL_ENERGIES_BINS + 1];
    for (int i = 0; i <= MILL_ENERGIES_BINS; i++)
        edge[i] = mill_energies_edge(i);
    sink->open(sink, "energies");
    mill_tell_array(sink, "edges", MILL_ENERGIES_BINS + 1, edge, "J",
                    "edges of the bins: 2^k (1 + j/16) J with k = -54..9, j = 0..15, and 2^10 J, "
                    "between infinities; bin i is edges[i] <= E < edges[i+1]");
    for (int kind = 0; kind < kinds->count; kind++)
        tell_kind(e, kind, kinds->name[kind], sink);
    sink->close(sink);
}
