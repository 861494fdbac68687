/* The histograms of energy. All pairs of a kind are one array: mixtures have no more datasets. */
#include "observe/energies.h"

#include "millsim/state.h"
#include "observe/sink.h"

#define PAIR "; by species of the ball, and between balls by that of the other, which is no lower"
#define AT(member) offsetof(struct mill_energies_pair, member), MILL_ENERGIES_BINS
enum { BY_NORMAL = sizeof(((struct mill_energies_pair *)0)->normal[0]), ONE = sizeof(uint64_t) };
enum { SORTS = MILL_ENERGIES_SORTS, COARSE = MILL_ENERGIES_COARSE, BLOCKS = MILL_ENERGIES_BLOCKS };
enum { BINS = MILL_ENERGIES_BINS };

static const struct mill_sum sum_of[] = {
    {"normal", "1", "impacts by m* v_n^2 / 2, with the normal speed just before" PAIR, MILL_H5_U64,
     AT(normal[0].count), BY_NORMAL},
    {"total", "1", "impacts by m* (v_n^2 + v_t^2) / 2, with normal and slip speed just before" PAIR,
     MILL_H5_U64, AT(total), ONE},
    {"dissipated", "1", "impacts by the energy dissipated" PAIR, MILL_H5_U64, AT(dissipated), ONE},
    {"dissipation", "J", "energy dissipated by those of each bin of `normal`", MILL_H5_F64,
     AT(normal[0].dissipation), BY_NORMAL}};
/* the first SORTS count energies; from DISSIPATED on: energies lost */
enum { SUMS = sizeof sum_of / sizeof *sum_of, DISSIPATED = 2 };

const struct mill_sums_list mill_energies_sums = {"energies", sizeof(struct mill_energies_pair),
                                                  SUMS, sum_of};

bool mill_energies_init(struct mill_energies *e, const struct mill_world *world)
{
    const int32_t n = world->species_count;
    const bool few = n <= MILL_ENERGIES_CLASSES;
    *e = (struct mill_energies){.world = world};
    e->class_of = malloc((size_t)n * sizeof *e->class_of);
    if (!e->class_of)
        return false;
    /* few species are classes of their own; many are put into classes by their rank in mass */
    e->classes = few ? (size_t)n : MILL_ENERGIES_CLASSES;
    for (int32_t i = 0; i < n; i++) {
        const double mass = world->species[i].mass;
        int64_t rank = 0;
        for (int32_t k = 0; k < n && !few; k++)
            rank += world->species[k].mass < mass || (k < i && world->species[k].mass == mass);
        e->class_of[i] = few ? i : (int32_t)(rank * MILL_ENERGIES_CLASSES / n);
    }
    e->pairs = e->classes * (e->classes + 1) / 2;
    for (int kind = 1; kind < world->kinds.count; kind++, e->pairs += e->classes)
        e->first[kind] = e->pairs;
    return true;
}

void mill_energies_free(struct mill_energies *e)
{
    free(e->class_of);
}

double mill_energies_cost(const struct mill_energies *e)
{
    const size_t blocks = BLOCKS * SORTS * COARSE;
    return (double)(e->pairs - (size_t)e->world->kinds.count) *
           (double)(sizeof(struct mill_energies_pair) + blocks * sizeof(int32_t));
}

/* ---- telling ---- */

double mill_energies_edge(int i)
{
    if (i < 1 || i >= BINS)
        return i < 1 ? -INFINITY : INFINITY;
    return ldexp(1 + (i - 1) % 16 / 16.0, MILL_ENERGIES_LOWEST + (i - 1) / 16) /
           MILL_ENERGIES_MILLI;
}

/* Part of the impacts of a bin that have this energy or more */
static double part_above(int bin, double energy)
{
    const double low = mill_energies_edge(bin), high = mill_energies_edge(bin + 1);
    return energy <= low || bin == BINS - 1 ? energy <= low
           : energy >= high || bin == 0     ? 0
                                            : log(high / energy) / log(high / low);
}

static size_t coarse(int bin)
{
    return bin == 0 ? 0 : (size_t)((bin - 1) / MILL_ENERGIES_JOINED) + 1;
}

/* Impacts of a pair in a bin, by this energy */
static uint64_t count_in(const struct mill_energies_pair *pair, int sort, int bin)
{
    return sort == 0 ? pair->normal[bin].count : (sort == 1 ? pair->total : pair->dissipated)[bin];
}

/* Normal energy above which half of the loss in the bins falls; *each: what such an impact loses */
static double find_half(const struct mill_energies_pair *all, double *each)
{
    double lost = 0, above = 0;
    for (int i = 1; i < BINS - 1; i++)
        lost += all->normal[i].dissipation;
    for (int i = BINS - 2; i > 0 && lost > 0; i--) {
        const double here = all->normal[i].dissipation, count = (double)all->normal[i].count;
        if (above + here >= 0.5 * lost && count > 0) {
            const double low = mill_energies_edge(i), high = mill_energies_edge(i + 1);
            *each = here / count;
            return high * pow(low / high, fmax(0, 0.5 * lost - above) / here);
        }
        above += here;
    }
    return (double)NAN;
}

struct mill_energies_hard mill_energies_find_hard(const struct mill_energies_pair *pair,
                                                  size_t pairs, double asked, int sort)
{
    double each = 0, count[COARSE] = {0};
    struct mill_energies_hard hard = {.energy = asked, .sort = sort};
    struct mill_energies_pair all = {.total = {0}}; /* pairs together */
    for (size_t i = 0; i < pairs; i++)
        mill_sums_add_records(&mill_energies_sums, 1, &all, &pair[i]);
    if (isnan(asked)) {
        hard.sort = 0;
        hard.energy = find_half(&all, &each);
    }
    for (int i = 0; i < BINS && !isnan(hard.energy); i++) {
        const double here = (double)count_in(&all, hard.sort, i);
        const double part = part_above(i, hard.energy);
        hard.count += part * here;
        count[coarse(i)] += here;
        hard.weight[coarse(i)] += part * here;
        if (each > 0) /* more loss above the energy raises it, which leaves fewer impacts above */
            hard.weight[coarse(i)] -= part * all.normal[i].dissipation / each;
    }
    hard.of_loss = each > 0 ? 0.5 / each : 0;
    for (size_t i = 0; i < COARSE; i++)
        hard.weight[i] = count[i] > 0 ? hard.weight[i] / count[i] : 0;
    return hard;
}

/* A kind's records in the order of the file, -1: none there; blocks > 0: of each, [pairs] */
static struct mill_sums_view list_pairs(const struct mill_energies *e, int kind, size_t blocks,
                                        int32_t *which)
{
    const bool balls = kind == MILL_BALL_BALL;
    struct mill_sums_view view = {.which = which};
    if (blocks > 0)
        view.dims[view.rank++] = blocks;
    view.dims[view.rank++] = e->classes;
    if (balls)
        view.dims[view.rank++] = e->classes;
    for (size_t block = 0; block == 0 || block < blocks; block++)
        for (size_t i = 0; i < e->classes; i++)
            for (size_t j = 0; j < (balls ? e->classes : 1); j++) {
                const size_t pair = balls ? mill_energies_balls(i, j) : e->first[kind] + i;
                *which++ = balls && j < i ? -1 : (int32_t)(block * e->pairs + pair);
            }
    return view;
}

/* Writes the sums of each kind of contact; blocks > 0: of each block. */
static void tell_kinds(const struct mill_energies *e, const struct mill_sums *sums, size_t blocks,
                       struct mill_sink *sink)
{
    const struct mill_listed kinds = mill_kinds_listed(e->world);
    const size_t room = e->classes * e->classes * (blocks > 0 ? blocks : 1);
    int32_t *which = mill_sink_room(sink, room, sizeof *which);
    for (int k = 0; which && k < kinds.count; k++) {
        const struct mill_sums_view view = list_pairs(e, kinds.kind[k], blocks, which);
        sink->open(sink, kinds.name[k]);
        for (int i = 0; i < sums->list->count; i++) {
            mill_sums_tell(sums, i, &view, sink);
            if (i >= DISSIPATED)
                mill_tell_part(sink);
        }
        sink->close(sink);
    }
    free(which);
}

void mill_energies_tell(const struct mill_energies *e, const struct mill_sums *sums,
                        struct mill_sink *sink)
{
    const size_t species = (size_t)e->world->species_count;
    double edge[BINS + 1];
    for (int i = 0; i <= BINS; i++)
        edge[i] = mill_energies_edge(i);
    mill_tell_array(sink, "edges", BINS + 1, edge, "J",
                    "edges of the bins: 2^k (1 + j/16) mJ with k = -44..19, j = 0..15, and 2^20 "
                    "mJ, between infinities; bin i is edges[i] <= E < edges[i+1]");
    if (e->classes < species)
        sink->values(sink, "class", MILL_H5_I32, 1, &species, e->class_of, "1",
                     "class of each species, in the order of mass: the histograms are by class "
                     "instead of species");
    tell_kinds(e, sums, 0, sink);
}

/* ---- blocks ---- */

/* Counts of one block */
static size_t size_of(const struct mill_energies_blocks *b)
{
    return b->pairs * SORTS * COARSE;
}

bool mill_energies_blocks_init(struct mill_energies_blocks *b, size_t pairs)
{
    *b = (struct mill_energies_blocks){.pairs = pairs, .length = 1};
    b->before = calloc(size_of(b), sizeof *b->before);
    b->count = calloc(BLOCKS * size_of(b), sizeof *b->count);
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

void mill_energies_blocks_close(struct mill_energies_blocks *b,
                                const struct mill_energies_pair *pair, uint64_t period)
{
    int32_t *to = b->count + b->blocks * size_of(b);
    uint64_t *last = b->before;
    for (size_t i = 0; i < b->pairs * SORTS; i++) {
        uint64_t now[COARSE] = {0};
        for (int bin = 0; bin < BINS; bin++)
            now[coarse(bin)] += count_in(pair + i / SORTS, (int)(i % SORTS), bin);
        for (size_t k = 0; k < COARSE; k++, last++) {
            *to++ = count_of(now[k] - *last);
            *last = now[k];
        }
    }
    if (++b->blocks == BLOCKS)
        join(b, period);
}

void mill_energies_blocks_weigh(const struct mill_energies_blocks *b, uint64_t first, int sort,
                                const double weight[COARSE], double series[BLOCKS])
{
    for (uint64_t k = first; k < b->blocks; k++, series++) {
        const int32_t *count = b->count + k * size_of(b) + (size_t)sort * COARSE;
        *series = 0;
        for (size_t i = 0; i < b->pairs; i++, count += SORTS * COARSE)
            for (size_t bin = 0; bin < COARSE; bin++)
                *series += weight[bin] * count[bin];
    }
}

void mill_energies_blocks_state(struct mill_energies_blocks *b, struct mill_state *state)
{
    mill_state_structs(state, "block_length", sizeof b->length, 1, &b->length);
    mill_state_structs(state, "blocks", sizeof b->blocks, 1, &b->blocks);
    if (b->blocks >= BLOCKS || b->length == 0)
        mill_state_refuse(state, "the saved statistics are damaged");
    mill_state_structs(state, "block_before", sizeof *b->before, size_of(b), b->before);
    mill_state_field(state, "block_counts", MILL_FIELD_I32, b->blocks * size_of(b), b->count);
}

void mill_energies_blocks_tell(const struct mill_energies_blocks *const *blocks, int starts,
                               const struct mill_energies *e, const struct mill_precision *batches,
                               uint64_t from, struct mill_sink *sink)
{
    static const char words[] = "impacts of each block, as in the histogram of this name" PAIR;
    const struct mill_energies_blocks *b = blocks[0];
    const uint64_t first = mill_energies_blocks_first(b, from);
    const size_t size = size_of(b), bytes = COARSE * sizeof(int32_t);
    double edge[COARSE + 1];
    struct mill_sum sum[SORTS];
    if (first >= b->blocks)
        return;
    const bool one = starts >= MILL_SPREAD_SEVERAL;
    const size_t each = one ? 1 : b->blocks - first, n = (size_t)starts * each;
    const double length = (double)b->length * batches->at.batch;
    int32_t *rows = mill_sink_room(sink, n * size, sizeof *rows);
    for (size_t s = 0; rows && s < (size_t)starts; s++)
        for (uint64_t k = first; k < b->blocks; k++)
            for (size_t i = 0; i < size; i++) {
                int32_t *to = &rows[(s * each + (one ? 0 : k - first)) * size + i];
                *to = count_of((uint64_t)*to + (uint64_t)blocks[s]->count[k * size + i]);
            }
    for (size_t i = 0; i < SORTS; i++)
        sum[i] = (struct mill_sum){sum_of[i].name, "1",    words,       MILL_H5_I32,
                                   i * bytes,      COARSE, sizeof *rows};
    const struct mill_sums_list list = {"blocks", SORTS * bytes, SORTS, sum};
    for (int i = 0; i < BINS; i++)
        edge[coarse(i)] = mill_energies_edge(i - (i > 0 ? (i - 1) % MILL_ENERGIES_JOINED : 0));
    edge[COARSE] = mill_energies_edge(BINS);
    sink->open(sink, "blocks");
    mill_tell_array(sink, "edges", COARSE + 1, edge, "J",
                    "edges of the bins of the blocks: four bins of the histograms each");
    mill_tell_number(sink, "duration", one ? (double)(b->blocks - first) * length : length, "s",
                     "length of a block; each of four starts or more is a block");
    mill_tell_count(sink, "period", mill_energies_blocks_period(b, batches->at.period),
                    "blocks in a period of the motions; 0: a block is one or more periods, or "
                    "nothing moves");
    if (rows)
        tell_kinds(e, &(struct mill_sums){&list, n * e->pairs, rows}, n, sink);
    sink->close(sink);
    free(rows);
}
