/* The run as a series of batches: the rotor's work in each and the impacts above 0.05 m/s by speed,
 * on the bins of the spectra, so that the median of any window of batches can be told. Its standard
 * error comes from the share of each batch's impacts below it, as that of any quantile does: error
 * of the share / density of the speeds there.
 * A twelfth of a revolution is a batch (5 ms at 1000 rpm): in the words of MSER-5 five observations
 * of a sixtieth. Blades pass at all multiples of a revolution's parts, so over whole revolutions
 * what they stir up repeats and has no part in the error.
 *
 * Where does the start-up of a series of batch means end? MSER-5 (White, Simulation 69 (1997) 323;
 * White, Cobb & Spratt, Proc. Winter Simulation Conf. 2000, 755) cuts where the standard error of
 * the mean of the rest, as if it were independent, is least; the five last batches make a poor rest
 * and are no candidates (Hoad, Robinson & Davies, J. Oper. Res. Soc. 61 (2010) 1632). How sure is
 * its mean? Batches grow with the series so that some 16 to 32 remain, and what memory they still
 * have enters as that of an autoregressive process of first order, the factor (1 + phi)/(1 - phi)
 * of the variance (Lada, Steiger & Wilson, Eur. J. Oper. Res. 184 (2008) 707; Tafazzoli & Wilson,
 * IIE Trans. 43 (2011) 110), with phi freed of its bias in short series (Kendall, Biometrika 41
 * (1954) 403). */
#include "observe/precision.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* [s] of a batch. A charge needs longer than the first to change; a rotor slower than the last
 * stands. */
static const double shortest = 1e-3, usual = 5e-3, longest = 25e-3, standing = 1e6;

/* Of the energy that the balls bring into contacts: less work is rounding */
static const double rounding = 1e-9;

/* Less memory of a series than the first, or more than the second, is not believed: few batches
 * tell it to some 0.2 only. */
static const double least_memory = -0.25, most_memory = 0.9;

enum { PARTS = 12, LAST = 5, FEWEST = 16 };

/* Batches for a rotor of `rotor_speed` [rad/s] (0: none). They do not depend on how long the run
 * may last: that must not change where it ends. */
static struct mill_precision_progress plan(double rotor_speed)
{
    const double turn = rotor_speed != 0 ? 2 * MILL_PI / fabs(rotor_speed) : (double)INFINITY;
    if (!(turn < standing))
        return (struct mill_precision_progress){usual, 0, 0};
    uint64_t period = PARTS;
    while (period > 1 && turn < (double)period * shortest)
        period -= period > 6 ? 6 : period > 4 ? 2 : 1; /* 12, 6, 4, 3, 2, 1 */
    double batch = fmax(1, ceil(shortest / turn * (1 - 1e-12))) * turn / (double)period;
    for (; batch > longest; batch /= 2)
        period *= 2;
    return (struct mill_precision_progress){batch, period, 0};
}

bool mill_precision_init(struct mill_precision *p, double origin, double rotor_speed,
                         const struct mill_spectrum_grid *grid)
{
    *p = (struct mill_precision){.origin = origin, .at = plan(rotor_speed), .grid = grid};
    p->accounts = calloc(MILL_PRECISION_BATCHES + 1, sizeof *p->accounts);
    p->counts = calloc(MILL_PRECISION_BATCHES, sizeof *p->counts);
    return p->accounts && p->counts;
}

void mill_precision_free(struct mill_precision *p)
{
    free(p->accounts);
    free(p->counts);
}

/* Counts are told apart up to 2^32 - 1 in a batch: that many tell its median as well as more do. */
static uint32_t count_of(uint64_t n)
{
    return n < UINT32_MAX ? (uint32_t)n : UINT32_MAX;
}

void mill_precision_close(struct mill_precision *p, const uint64_t *count,
                          const struct mill_account *account)
{
    for (int i = 0; i < MILL_PRECISION_SLOTS; i++)
        p->counts[p->at.batches][i] = count_of(count[i]);
    p->accounts[++p->at.batches] = *account;
}

uint64_t mill_precision_join(struct mill_precision *p)
{
    if (p->at.batches < MILL_PRECISION_BATCHES)
        return 1;
    const uint64_t many = p->at.period == 3 ? 3 : 2, joined = p->at.batches / many;
    for (uint64_t k = 0; k < joined; k++) {
        for (int i = 0; i < MILL_PRECISION_SLOTS; i++) {
            uint64_t sum = 0;
            for (uint64_t m = 0; m < many; m++)
                sum += p->counts[many * k + m][i];
            p->counts[k][i] = count_of(sum);
        }
        p->accounts[k] = p->accounts[many * k];
    }
    p->accounts[joined] = p->accounts[p->at.batches];
    p->at.batches = joined;
    p->at.batch *= (double)many;
    p->at.period = p->at.period > 1 ? p->at.period / many : p->at.period;
    return many;
}

/* ---- series ---- */

size_t mill_precision_mser(const double *x, size_t n)
{
    size_t best = 0;
    double least = INFINITY, mean = 0, squares = 0;
    for (size_t d = n; d-- > 0;) { /* from the end, as each cut adds one to the rest */
        const double left = (double)(n - d), step = x[d] - mean;
        mean += step / left;
        squares += step * (x[d] - mean);
        if (n - d > LAST && squares / (left * left) <= least) {
            least = squares / (left * left);
            best = d;
        }
    }
    return best;
}

/* How many go into one so that FEWEST or more are left: parts of a revolution, then whole ones */
static size_t size_of_batch(size_t n)
{
    static const size_t size[] = {1, 2, 3, 4, 6, 12};
    size_t best = 1;
    for (size_t i = 0; i < sizeof size / sizeof *size; i++)
        if (n / size[i] >= FEWEST)
            best = size[i];
    while (best >= 12 && n / (2 * best) >= FEWEST)
        best *= 2;
    return best;
}

double mill_precision_error(const double *x, size_t n, size_t period)
{
    double room[MILL_PRECISION_BATCHES];
    assert(n <= MILL_PRECISION_BATCHES);
    if (n < MILL_PRECISION_FEWEST)
        return NAN;
    const size_t size = size_of_batch(n), batches = n / size;
    const bool repeats = period > size && n / period >= 2;
    const double turns = repeats ? (double)(n / period) : 0;
    const size_t skipped = n - batches * size, step = repeats ? period : 1;
    double mean = 0, squares = 0, products = 0;
    for (size_t phase = 0; phase < step; phase++) { /* x - the mean of those of the same phase */
        double sum = 0;
        for (size_t i = phase; i < n; i += step)
            sum += x[i];
        for (size_t i = phase; i < n; i += step)
            room[i] = x[i] - sum / (double)(n / step);
    }
    for (size_t k = 0; k < batches; k++) {
        double sum = 0;
        for (size_t i = 0; i < size; i++)
            sum += room[skipped + k * size + i];
        room[k] = sum / (double)size; /* behind what is still to be read */
        mean += room[k] / (double)batches;
    }
    for (size_t k = 0; k < batches; k++) {
        room[k] -= repeats ? 0 : mean;
        squares += room[k] * room[k];
        if (k > 0)
            products += room[k] * room[k - 1];
    }
    if (!(squares > 0))
        return 0;
    const double left = (double)batches;
    double memory = products / squares;
    memory += repeats ? memory / (left - 1) : (1 + 4 * memory) / left;
    memory = fmin(fmax(memory, least_memory), most_memory);
    /* the means of the phases took their share of the scatter along */
    const double share = repeats ? turns / (turns - 1) : 1;
    return sqrt(share * squares / (left - 1) / left * (1 + memory) / (1 - memory));
}

/* ---- the median ---- */

/* Where the median lies: share `within` of bin `bin`. count: of all. */
struct place {
    int bin;
    double within, count;
};

/* Of the batches from `from` on; sum: zeros, becomes that of their impacts by speed */
static struct place find_median(const struct mill_precision *p, uint64_t from,
                                uint64_t sum[MILL_PRECISION_SLOTS])
{
    struct place place = {0, 0, 0};
    double below = 0;
    for (uint64_t k = from; k < p->at.batches; k++)
        for (int i = 0; i < MILL_PRECISION_SLOTS; i++)
            sum[i] += p->counts[k][i];
    for (int i = 0; i < MILL_PRECISION_SLOTS; i++)
        place.count += (double)sum[i];
    while (place.bin < MILL_PRECISION_SLOTS - 1 &&
           below + (double)sum[place.bin] < 0.5 * place.count)
        below += (double)sum[place.bin++];
    if (sum[place.bin] > 0)
        place.within = (0.5 * place.count - below) / (double)sum[place.bin];
    return place;
}

/* The median of a batch or a window is below the place by that many impacts: those of the batch
 * below it, less half of all; *all: of the batch */
static double excess(const uint32_t *row, const struct place *place, double *all)
{
    double below = place->within * row[place->bin], rest = (1 - place->within) * row[place->bin];
    for (int i = 0; i < place->bin; i++)
        below += row[i];
    for (int i = place->bin + 1; i < MILL_PRECISION_SLOTS; i++)
        rest += row[i];
    *all = below + rest;
    return 0.5 * (below - rest);
}

/* Share of the impacts per unit of ln v around the median: over 5 bins to both sides, +-10 % */
static double density(const uint64_t sum[], const struct place *place)
{
    enum { REACH = 5 };
    const int bins = MILL_PRECISION_SLOTS - 1; /* the last slot is the overflow */
    const int low = place->bin > REACH ? place->bin - REACH : 0;
    const int high = place->bin + REACH + 1 < bins ? place->bin + REACH + 1 : bins;
    double share = 0;
    for (int i = low; i < high; i++)
        share += (double)sum[i] / place->count;
    return share / ((high - low) * MILL_SPECTRUM_LOG_BIN);
}

/* ---- what the batches tell ---- */

static double work(const struct mill_precision *p, uint64_t from, uint64_t to)
{
    return p->accounts[to].rotor_work - p->accounts[from].rotor_work;
}

uint64_t mill_precision_cut(const struct mill_precision *p, bool *settled)
{
    double power[MILL_PRECISION_BATCHES] = {0}, below[MILL_PRECISION_BATCHES] = {0}, all;
    uint64_t sum[MILL_PRECISION_SLOTS] = {0};
    const uint64_t n = p->at.batches;
    const struct place place = find_median(p, n / 2, sum);
    for (uint64_t k = 0; k < n; k++) {
        const double more = excess(p->counts[k], &place, &all);
        below[k] = all > 0 ? more / all : 0;
        power[k] = work(p, k, k + 1);
    }
    const uint64_t of_power = mill_precision_mser(power, n),
                   of_median = mill_precision_mser(below, n);
    const uint64_t cut = of_power > of_median ? of_power : of_median;
    *settled = n >= MILL_PRECISION_FEWEST && 2 * cut <= n;
    return cut < n / 2 ? cut : n / 2;
}

struct mill_precision_known mill_precision_tell(const struct mill_precision *p, uint64_t from,
                                                bool whole)
{
    double power[MILL_PRECISION_BATCHES] = {0}, below[MILL_PRECISION_BATCHES] = {0}, all;
    uint64_t sum[MILL_PRECISION_SLOTS] = {0};
    const uint64_t n = p->at.batches - from, period = whole ? p->at.period : 0;
    const struct mill_account *now = &p->accounts[p->at.batches];
    struct mill_precision_known known = {{NAN, NAN}, {NAN, NAN}, n, false, false};
    known.idle = now->rotor_work_gross <= rounding * now->incident;
    known.enough = n >= MILL_PRECISION_FEWEST && (known.idle || n >= 3 * p->at.period);
    if (n == 0)
        return known;
    for (uint64_t k = 0; k < n; k++)
        power[k] = work(p, from + k, from + k + 1) / p->at.batch;
    known.power.value = work(p, from, p->at.batches) / ((double)n * p->at.batch);
    known.power.error = mill_precision_error(power, n, period);
    const struct place place = find_median(p, from, sum);
    if (!(place.count > 0))
        return known;
    known.median.value =
        place.bin < MILL_PRECISION_SLOTS - 1
            ? mill_spectrum_within(p->grid, MILL_SPECTRUM_FAST + place.bin, place.within)
            : p->grid->edge[MILL_SPECTRUM_BINS];
    for (uint64_t k = 0; k < n; k++)
        below[k] = excess(p->counts[from + k], &place, &all);
    /* of the share below; independent impacts scatter it by 1/2 over the root of their number */
    const double scatter = mill_precision_error(below, n, period);
    const double share = fmax(scatter * (double)n / place.count, 0.5 / sqrt(place.count));
    if (!isnan(scatter))
        known.median.error = known.median.value * share / density(sum, &place);
    return known;
}

bool mill_precision_reached(const struct mill_precision_known *known, double wanted)
{
    const bool power = known->idle || (known->power.value != 0 &&
                                       known->power.error <= wanted * fabs(known->power.value));
    return known->enough && power && known->median.error <= wanted * known->median.value;
}
