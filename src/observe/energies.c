/* The histograms of energy. In a file, all pairs of a kind are one array, so that the file of a
 * mixture has no more datasets than others. */
#include "observe/energies.h"

#include "millsim/state.h"
#include "observe/sink.h"

#include <stddef.h>
#include <stdlib.h>

#define PAIR "; by species of the ball, and between balls by that of the other, which is no lower"
#define BINS(member)                                                                               \
    offsetof(struct mill_energies_pair, member), MILL_ENERGIES_BINS,                               \
        sizeof(((struct mill_energies_pair *)0)->member)
#define BY_NORMAL(member)                                                                          \
    offsetof(struct mill_energies_pair, normal[0].member), MILL_ENERGIES_BINS,                     \
        sizeof(((struct mill_energies_pair *)0)->normal[0])

static const struct mill_sum sum_of[] = {
    {"normal", "1", "impacts by m* v_n^2 / 2, with the normal speed just before" PAIR, MILL_H5_U64,
     BY_NORMAL(count)},
    {"total", "1", "impacts by m* (v_n^2 + v_t^2) / 2, with normal and slip speed just before" PAIR,
     MILL_H5_U64, BINS(total[0])},
    {"dissipated", "1", "impacts by the energy dissipated" PAIR, MILL_H5_U64, BINS(dissipated[0])},
    {"dissipation", "J", "energy dissipated by those of each bin of `normal`", MILL_H5_F64,
     BY_NORMAL(dissipation)}};
/* the first MILL_ENERGIES_SORTS count energies; from DISSIPATED on: energies lost */
enum { SUMS = sizeof sum_of / sizeof *sum_of, DISSIPATED = 2 };

const struct mill_sums_list mill_energies_sums = {"energies", sizeof(struct mill_energies_pair),
                                                  SUMS, sum_of};

/* Few species are classes of their own. Many are put into as many classes by their rank in mass. */
static void set_classes(struct mill_energies *e, const struct mill_world *world)
{
    const int32_t n = world->species_count;
    const bool few = n <= MILL_ENERGIES_CLASSES;
    e->classes = few ? (size_t)n : MILL_ENERGIES_CLASSES;
    for (int32_t i = 0; i < n; i++) {
        const double mass = world->species[i].mass;
        int64_t rank = 0;
        for (int32_t k = 0; k < n && !few; k++)
            rank += world->species[k].mass < mass || (k < i && world->species[k].mass == mass);
        e->class_of[i] = few ? i : (int32_t)(rank * MILL_ENERGIES_CLASSES / n);
    }
}

bool mill_energies_init(struct mill_energies *e, const struct mill_world *world)
{
    *e = (struct mill_energies){.world = world};
    e->class_of = malloc((size_t)world->species_count * sizeof *e->class_of);
    if (!e->class_of)
        return false;
    set_classes(e, world);
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
    const size_t blocks = MILL_ENERGIES_BLOCKS * MILL_ENERGIES_SORTS * MILL_ENERGIES_COARSE;
    return (double)(e->pairs - (size_t)e->world->kinds.count) *
           (double)(sizeof(struct mill_energies_pair) + blocks * sizeof(int32_t));
}

/* ---- telling ---- */

double mill_energies_edge(int i)
{
    if (i < 1 || i >= MILL_ENERGIES_BINS)
        return i < 1 ? -INFINITY : INFINITY;
    return ldexp(1 + (i - 1) % 16 / 16.0, MILL_ENERGIES_LOWEST + (i - 1) / 16) /
           MILL_ENERGIES_MILLI;
}

/* Part of the impacts of a bin that have this energy or more */
static double part_above(int bin, double energy)
{
    const double low = mill_energies_edge(bin), high = mill_energies_edge(bin + 1);
    return energy <= low || bin == MILL_ENERGIES_BINS - 1 ? energy <= low
           : energy >= high || bin == 0                   ? 0
                                                          : log(high / energy) / log(high / low);
}

/* A bin of all pairs together */
struct bin {
    double count, lost;
};

static size_t coarse(int bin)
{
    return bin == 0 ? 0 : (size_t)((bin - 1) / MILL_ENERGIES_JOINED) + 1;
}

static struct bin bin_of(const struct mill_energies_pair *pair, size_t pairs, int bin, int sort)
{
    struct bin all = {0, 0};
    for (const struct mill_energies_pair *end = pair + pairs; pair < end; pair++) {
        all.count += (double)(sort == 0   ? pair->normal[bin].count
                              : sort == 1 ? pair->total[bin]
                                          : pair->dissipated[bin]);
        all.lost += pair->normal[bin].dissipation;
    }
    return all;
}

/* The normal energy above which half of the energy is lost that impacts lose in the bins, and what
 * an impact of this energy loses */
static double find_half(const struct mill_energies_pair *pair, size_t pairs, double *each)
{
    double all = 0, above = 0;
    for (int i = 1; i < MILL_ENERGIES_BINS - 1; i++)
        all += bin_of(pair, pairs, i, 0).lost;
    for (int i = MILL_ENERGIES_BINS - 2; i > 0 && all > 0; i--) {
        const struct bin at = bin_of(pair, pairs, i, 0);
        if (above + at.lost >= 0.5 * all && at.count > 0) {
            const double low = mill_energies_edge(i), high = mill_energies_edge(i + 1);
            *each = at.lost / at.count;
            return high * pow(low / high, fmax(0, 0.5 * all - above) / at.lost);
        }
        above += at.lost;
    }
    return (double)NAN;
}

struct mill_energies_hard mill_energies_find_hard(const struct mill_energies_pair *pair,
                                                  size_t pairs, double asked, int sort)
{
    double each = 0, count[MILL_ENERGIES_COARSE] = {0};
    struct mill_energies_hard hard = {.energy = asked, .sort = sort};
    if (isnan(asked)) {
        hard.sort = 0;
        hard.energy = find_half(pair, pairs, &each);
    }
    for (int i = 0; i < MILL_ENERGIES_BINS && !isnan(hard.energy); i++) {
        const struct bin at = bin_of(pair, pairs, i, hard.sort);
        const double part = part_above(i, hard.energy);
        hard.count += part * at.count;
        count[coarse(i)] += at.count;
        hard.weight[coarse(i)] += part * at.count;
        if (each > 0) /* more loss above the energy raises it, which leaves fewer impacts above */
            hard.weight[coarse(i)] -= part * at.lost / each;
    }
    hard.of_loss = each > 0 ? 0.5 / each : 0;
    for (size_t i = 0; i < MILL_ENERGIES_COARSE; i++)
        hard.weight[i] = count[i] > 0 ? hard.weight[i] / count[i] : 0;
    return hard;
}

/* The pairs of a kind in the order of the file, -1: none there. Returns the rank of their array. */
static int list_pairs(const struct mill_energies *e, int kind, size_t dims[2],
                      int32_t which[MILL_ENERGIES_CLASSES * MILL_ENERGIES_CLASSES])
{
    const bool balls = kind == MILL_BALL_BALL;
    dims[0] = e->classes;
    dims[1] = balls ? e->classes : 1;
    for (size_t i = 0; i < dims[0]; i++)
        for (size_t j = 0; j < dims[1]; j++)
            *which++ = !balls  ? (int32_t)(e->first[kind] + i)
                       : j < i ? -1
                               : (int32_t)mill_energies_balls(i, j);
    return 1 + balls;
}

void mill_energies_tell(const struct mill_energies *e, const struct mill_sums *sums,
                        struct mill_sink *sink)
{
    const struct mill_listed kinds = mill_kinds_listed(e->world);
    const size_t species = (size_t)e->world->species_count;
    int32_t which[MILL_ENERGIES_CLASSES * MILL_ENERGIES_CLASSES];
    double edge[MILL_ENERGIES_BINS + 1];
    for (int i = 0; i <= MILL_ENERGIES_BINS; i++)
        edge[i] = mill_energies_edge(i);
    mill_tell_array(sink, "edges", MILL_ENERGIES_BINS + 1, edge, "J",
                    "edges of the bins: 2^k (1 + j/16) mJ with k = -44..19, j = 0..15, and 2^20 "
                    "mJ, between infinities; bin i is edges[i] <= E < edges[i+1]");
    if (e->classes < species)
        sink->values(sink, "class", MILL_H5_I32, 1, &species, e->class_of, "1",
                     "class of each species, in the order of mass: the histograms are by class "
                     "instead of species");
    for (int k = 0; k < kinds.count; k++) {
        struct mill_sums_view view = {.which = which};
        view.rank = list_pairs(e, kinds.kind[k], view.dims, which);
        sink->open(sink, kinds.name[k]);
        for (int i = 0; i < SUMS; i++) {
            mill_sums_tell(sums, i, &view, sink);
            if (i >= DISSIPATED)
                mill_tell_part(sink);
        }
        sink->close(sink);
    }
}

/* ---- blocks ---- */

/* Counts of one block */
static size_t size_of(const struct mill_energies_blocks *b)
{
    return b->pairs * MILL_ENERGIES_SORTS * MILL_ENERGIES_COARSE;
}

bool mill_energies_blocks_init(struct mill_energies_blocks *b, size_t pairs)
{
    *b = (struct mill_energies_blocks){.pairs = pairs, .length = 1};
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

void mill_energies_blocks_close(struct mill_energies_blocks *b,
                                const struct mill_energies_pair *pair, uint64_t period)
{
    int32_t *to = b->count + b->blocks * size_of(b);
    uint64_t *last = b->before;
    for (size_t i = 0; i < b->pairs; i++, pair++) {
        uint64_t now[MILL_ENERGIES_SORTS][MILL_ENERGIES_COARSE] = {{0}};
        for (int bin = 0; bin < MILL_ENERGIES_BINS; bin++) {
            now[0][coarse(bin)] += pair->normal[bin].count;
            now[1][coarse(bin)] += pair->total[bin];
            now[2][coarse(bin)] += pair->dissipated[bin];
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

size_t mill_energies_blocks_weigh(const struct mill_energies_blocks *b, uint64_t first, int sort,
                                  const double weight[MILL_ENERGIES_COARSE],
                                  double series[MILL_ENERGIES_BLOCKS])
{
    size_t n = 0;
    for (uint64_t k = first; k < b->blocks; k++, n++) {
        const int32_t *count = b->count + k * size_of(b) + (size_t)sort * MILL_ENERGIES_COARSE;
        series[n] = 0;
        for (size_t i = 0; i < b->pairs; i++, count += MILL_ENERGIES_SORTS * MILL_ENERGIES_COARSE)
            for (size_t bin = 0; bin < MILL_ENERGIES_COARSE; bin++)
                series[n] += weight[bin] * count[bin];
    }
    return n;
}

void mill_energies_blocks_state(struct mill_energies_blocks *b, struct mill_state *state)
{
    mill_state_structs(state, "block_length", sizeof b->length, 1, &b->length);
    mill_state_structs(state, "blocks", sizeof b->blocks, 1, &b->blocks);
    if (b->blocks >= MILL_ENERGIES_BLOCKS || b->length == 0)
        mill_state_refuse(state, "the saved statistics are damaged");
    mill_state_structs(state, "block_before", sizeof *b->before, size_of(b), b->before);
    mill_state_field(state, "block_counts", MILL_FIELD_I32, b->blocks * size_of(b), b->count);
}

/* Adds the blocks of a start from `first` on to rows[size_of(b)]: to one, or each to its own. */
static void add_up(const struct mill_energies_blocks *b, uint64_t first, bool one, int32_t *row)
{
    for (uint64_t k = first; k < b->blocks; k++, row += one ? 0 : size_of(b))
        for (size_t i = 0; i < size_of(b); i++)
            row[i] = count_of((uint64_t)row[i] + (uint64_t)b->count[k * size_of(b) + i]);
}

/* Writes the `n` blocks of a kind, in `room`. count: of all pairs in each block */
static void tell_blocks(const struct mill_energies *e, int kind, size_t n, const int32_t *count,
                        int32_t *room, struct mill_sink *sink)
{
    int32_t which[MILL_ENERGIES_CLASSES * MILL_ENERGIES_CLASSES];
    const size_t bins = MILL_ENERGIES_COARSE, stride = MILL_ENERGIES_SORTS * bins;
    size_t dims[4] = {n};
    const int rank = list_pairs(e, kind, dims + 1, which);
    const size_t pairs = dims[1] * dims[2];
    dims[1 + rank] = bins;
    for (size_t sort = 0; sort < MILL_ENERGIES_SORTS; sort++) {
        int32_t *to = room;
        for (size_t k = 0; k < n; k++)
            for (size_t i = 0; i < pairs; i++, to += bins)
                if (which[i] >= 0)
                    memcpy(to, count + (k * e->pairs + (size_t)which[i]) * stride + sort * bins,
                           bins * sizeof *to);
                else
                    memset(to, 0, bins * sizeof *to);
        sink->values(sink, sum_of[sort].name, MILL_H5_I32, 2 + rank, dims, room, "1",
                     "impacts of each block, as in the histogram of this name" PAIR);
        if (sort >= DISSIPATED)
            mill_tell_part(sink);
    }
}

void mill_energies_blocks_tell(const struct mill_energies_blocks *const *blocks, int starts,
                               const struct mill_energies *e, const struct mill_precision *batches,
                               uint64_t from, struct mill_sink *sink)
{
    const struct mill_energies_blocks *b = blocks[0];
    const struct mill_listed kinds = mill_kinds_listed(e->world);
    const uint64_t first = mill_energies_blocks_first(b, from);
    double edge[MILL_ENERGIES_COARSE + 1];
    if (first >= b->blocks)
        return;
    const bool one = starts >= MILL_SPREAD_SEVERAL;
    const size_t each = one ? 1 : b->blocks - first, n = (size_t)starts * each;
    const double length = (double)b->length * batches->at.batch;
    int32_t *room =
        mill_sink_room(sink, n * e->classes * e->classes * MILL_ENERGIES_COARSE, sizeof *room);
    int32_t *rows = mill_sink_room(sink, n * size_of(b), sizeof *rows);
    for (int k = 0; rows && k < starts; k++)
        add_up(blocks[k], first, one, rows + (size_t)k * each * size_of(b));
    for (int i = 0; i < MILL_ENERGIES_BINS; i++)
        edge[coarse(i)] = mill_energies_edge(i - (i > 0 ? (i - 1) % MILL_ENERGIES_JOINED : 0));
    edge[MILL_ENERGIES_COARSE] = mill_energies_edge(MILL_ENERGIES_BINS);
    sink->open(sink, "blocks");
    mill_tell_array(sink, "edges", MILL_ENERGIES_COARSE + 1, edge, "J",
                    "edges of the bins of the blocks: four bins of the histograms each");
    mill_tell_number(sink, "duration", one ? (double)(b->blocks - first) * length : length, "s",
                     "length of a block; each of four starts or more is a block");
    mill_tell_count(sink, "period", mill_energies_blocks_period(b, batches->at.period),
                    "blocks in a period of the motions; 0: a block is one or more periods, or "
                    "nothing moves");
    for (int k = 0; room && rows && k < kinds.count; k++) {
        sink->open(sink, kinds.name[k]);
        tell_blocks(e, kinds.kind[k], n, rows, room, sink);
        sink->close(sink);
    }
    sink->close(sink);
    free(rows);
    free(room);
}
