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
        e->pair[i].half_mass =
            0.5 * MILL_ENERGIES_MILLI * (i < balls ? mass * other / (mass + other) : mass);
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
    return ldexp(1 + (i - 1) % 16 / 16.0, MILL_ENERGIES_LOWEST + (i - 1) / 16) /
           MILL_ENERGIES_MILLI;
}

void mill_energies_tell(const struct mill_energies *e, const struct mill_kinds *kinds,
                        struct mill_sink *sink)
{
    double edge[MILL_ENERGIES_BINS + 1];
    for (int i = 0; i <= MILL_ENERGIES_BINS; i++)
        edge[i] = mill_energies_edge(i);
    mill_tell_array(sink, "edges", MILL_ENERGIES_BINS + 1, edge, "J",
                    "edges of the bins: 2^k (1 + j/16) mJ with k = -44..19, j = 0..15, and 2^20 "
                    "mJ, between infinities; bin i is edges[i] <= E < edges[i+1]");
    for (int kind = 0; kind < kinds->count; kind++)
        tell_kind(e, kind, kinds->name[kind], sink);
}

/* ---- blocks ---- */

static const char *const sorts[MILL_ENERGIES_SORTS] = {"normal", "total", "dissipated"};

/* Counts of one block */
static size_t size_of(const struct mill_energies_blocks *b)
{
    return b->pairs * MILL_ENERGIES_SORTS * MILL_ENERGIES_COARSE;
}

static size_t coarse(int bin)
{
    return bin == 0 ? 0 : (size_t)((bin - 1) / MILL_ENERGIES_JOINED) + 1;
}

bool mill_energies_blocks_init(struct mill_energies_blocks *b, const struct mill_energies *of)
{
    *b = (struct mill_energies_blocks){.pairs = of->pairs, .length = 1};
    b->before = calloc(size_of(b), sizeof *b->before);
    b->count = calloc(MILL_ENERGIES_BLOCKS * size_of(b), sizeof *b->count);
    return b->before && b->count;
}

void mill_energies_blocks_free(struct mill_energies_blocks *b)
{
    free(b->before);
    free(b->count);
}

void mill_energies_blocks_restart(struct mill_energies_blocks *b)
{
    memset(b->before, 0, size_of(b) * sizeof *b->before);
}

/* Counts are stored up to 2^31 - 1 per block, which is enough for an error. */
static int32_t count_of(uint64_t n)
{
    return n < INT32_MAX ? (int32_t)n : INT32_MAX;
}

static void join(struct mill_energies_blocks *b, uint64_t period)
{
    const size_t size = size_of(b);
    uint64_t many = 2;
    while (b->length < period && period % (b->length * many) != 0)
        many++;
    for (uint64_t k = 0; k < b->blocks / many; k++)
        for (size_t i = 0; i < size; i++) {
            uint64_t sum = 0;
            for (uint64_t m = 0; m < many; m++)
                sum += (uint64_t)b->count[(many * k + m) * size + i];
            b->count[k * size + i] = count_of(sum);
        }
    b->blocks /= many;
    b->length *= many;
}

void mill_energies_blocks_close(struct mill_energies_blocks *b, const struct mill_energies *e,
                                uint64_t period)
{
    int32_t *to = b->count + b->blocks * size_of(b);
    uint64_t *last = b->before;
    for (size_t i = 0; i < b->pairs; i++) {
        uint64_t now[MILL_ENERGIES_SORTS][MILL_ENERGIES_COARSE] = {{0}};
        for (int bin = 0; bin < MILL_ENERGIES_BINS; bin++) {
            now[0][coarse(bin)] += e->pair[i].normal[bin].count;
            now[1][coarse(bin)] += e->pair[i].total[bin];
            now[2][coarse(bin)] += e->pair[i].dissipated[bin];
        }
        for (size_t k = 0; k < MILL_ENERGIES_SORTS * MILL_ENERGIES_COARSE; k++, last++) {
            const uint64_t sum = now[k / MILL_ENERGIES_COARSE][k % MILL_ENERGIES_COARSE];
            *to++ = count_of(sum - *last);
            *last = sum;
        }
    }
    if (++b->blocks == MILL_ENERGIES_BLOCKS)
        join(b, period);
}

size_t mill_energies_blocks_hard(const struct mill_energies_blocks *b, uint64_t first,
                                 double series[MILL_ENERGIES_BLOCKS])
{
    enum { MILLIJOULE = -MILL_ENERGIES_LOWEST * 16 + 1 }; /* the bin that begins at 1 mJ */
    const size_t low = coarse(MILLIJOULE), stride = MILL_ENERGIES_SORTS * MILL_ENERGIES_COARSE;
    size_t n = 0;
    for (uint64_t k = first; k < b->blocks; k++, n++) {
        series[n] = 0;
        for (size_t i = 0; i < b->pairs; i++)
            for (size_t bin = low; bin < MILL_ENERGIES_COARSE; bin++)
                series[n] += b->count[k * size_of(b) + i * stride + bin];
    }
    return n;
}

static void tell_blocks(const struct mill_energies_blocks *b, const struct mill_energies *e,
                        int kind, uint64_t first, int32_t *room, struct mill_sink *sink)
{
    const int balls = kind == MILL_BALL_BALL;
    const size_t n = MILL_ENERGIES_COARSE, pairs = e->species * e->step[kind];
    const size_t dims[4] = {(size_t)(b->blocks - first), e->species, balls ? e->species : n, n};
    const size_t pair = e->first[kind] - !balls, stride = MILL_ENERGIES_SORTS * n;
    for (size_t sort = 0; sort < MILL_ENERGIES_SORTS; sort++) {
        int32_t *to = room;
        for (uint64_t k = first; k < b->blocks; k++)
            for (size_t i = pair; i < pair + pairs; i++, to += n)
                memcpy(to, b->count + k * size_of(b) + i * stride + sort * n, n * sizeof *to);
        sink->values(sink, sorts[sort], MILL_H5_I32, 3 + balls, dims, room, "1",
                     "impacts of each block, as in the histogram of this name" PAIR);
        if (sort >= DISSIPATED)
            mill_tell_part(sink);
    }
}

void mill_energies_blocks_tell(const struct mill_energies_blocks *b, const struct mill_energies *e,
                               const struct mill_kinds *kinds, uint64_t from, uint64_t period,
                               double batch, struct mill_sink *sink)
{
    const uint64_t first = mill_energies_blocks_first(b, from);
    double edge[MILL_ENERGIES_COARSE + 1];
    int32_t *room =
        malloc((b->blocks * e->species * e->species * MILL_ENERGIES_COARSE + 1) * sizeof *room);
    if (!room || first >= b->blocks) {
        free(room);
        return;
    }
    for (int i = 0; i < MILL_ENERGIES_BINS; i++)
        edge[coarse(i)] = mill_energies_edge(i - (i > 0 ? (i - 1) % MILL_ENERGIES_JOINED : 0));
    edge[MILL_ENERGIES_COARSE] = mill_energies_edge(MILL_ENERGIES_BINS);
    sink->open(sink, "blocks");
    mill_tell_array(sink, "edges", MILL_ENERGIES_COARSE + 1, edge, "J",
                    "edges of the bins of the blocks: four bins of the histograms each");
    mill_tell_number(sink, "duration", (double)b->length * batch, "s", "length of a block");
    mill_tell_count(sink, "period", mill_energies_blocks_period(b, period),
                    "blocks in a period of the motions; 0: a block is one or more periods, or "
                    "nothing moves");
    for (int kind = 0; kind < kinds->count; kind++) {
        sink->open(sink, kinds->name[kind]);
        tell_blocks(b, e, kind, first, room, sink);
        sink->close(sink);
    }
    sink->close(sink);
    free(room);
}
