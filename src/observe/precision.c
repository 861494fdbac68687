/* The run as a series of batches. Each has its account and its impacts by speed, in the bins of the
 * spectra, from which the median of any window of batches follows. The standard error of the median
 * comes from the fraction of each batch's impacts below it, as for any quantile: error of the
 * fraction / density of the speeds there.
 *
 * A batch is a twelfth of the period of all motions (5 ms for a rotor at 1000 rpm). In the terms of
 * MSER-5 this is five observations of a sixtieth. Blades pass at all multiples of the parts of a
 * revolution. So what the motions cause repeats in each period, and over whole periods it does not
 * contribute to the error.
 *
 * Where does the start-up end in a series of batch means? MSER-5 (White, Simulation 69 (1997) 323;
 * White, Cobb & Spratt, Proc. Winter Simulation Conf. 2000, 755) cuts where the standard error of
 * the mean of the rest, as if it were independent, is smallest. Cuts within the last five batches
 * are excluded, because so few batches give a poor estimate (Hoad, Robinson & Davies, J. Oper. Res.
 * Soc. 61 (2010) 1632).
 *
 * How accurate is the mean of the rest? Batches are joined as the series grows, so that 24 or more
 * remain. Their remaining correlation is treated as that of an autoregressive process of first
 * order, which multiplies the variance by (1 + phi)/(1 - phi) (Lada, Steiger & Wilson, Eur. J.
 * Oper. Res. 184 (2008) 707; Tafazzoli & Wilson, IIE Trans. 43 (2011) 110). phi is corrected for
 * its bias in short series (Kendall, Biometrika 41 (1954) 403). */
#include "observe/precision.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* [s] Lengths of a batch. A charge needs more than `shortest` to change. A motion with a period
 * longer than `standing` is treated as standing still. */
static const double shortest = 1e-3, usual = 5e-3, longest = 25e-3, standing = 1e6;

/* Relative to the energy that the balls bring into contacts, and relative to a mean: smaller work
 * or scatter is rounding */
static const double rounding = 1e-9;

/* A correlation phi ("memory") outside these limits is not believed: few batches determine it only
 * to about 0.2. */
static const double least_memory = -0.25, most_memory = 0.9;

/* With fewer degrees of freedom there is no error: the batches are too few. */
static const double least_freedom = 3;

enum { PARTS = 12, LAST = 5, FEWEST = 24 };

/* Batches for motions that repeat after `turn` [s]. They must not depend on run.time, because they
 * influence where the run ends. */
static struct mill_precision_progress plan(double turn)
{
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

bool mill_precision_init(struct mill_precision *p, double origin, const struct mill_world *world,
                         const struct mill_spectrum_grid *grid)
{
    *p = (struct mill_precision){.origin = origin,
                                 .kinds = world->kinds.count,
                                 .motions = world->motions,
                                 .at = plan(world->period),
                                 .grid = grid};
    p->accounts = calloc(MILL_PRECISION_BATCHES + 1, sizeof *p->accounts);
    p->counts = calloc(MILL_PRECISION_BATCHES, sizeof *p->counts);
    return p->accounts && p->counts;
}

void mill_precision_free(struct mill_precision *p)
{
    free(p->accounts);
    free(p->counts);
}

/* Counts are stored up to 2^32 - 1 per batch, which is enough for its median. */
static uint32_t count_of(uint64_t n)
{
    return n < UINT32_MAX ? (uint32_t)n : UINT32_MAX;
}

void mill_precision_close(struct mill_precision *p, const uint64_t *count,
                          const struct mill_account *account)
{
    for (int i = 0; i < MILL_SPECTRUM_SLOTS; i++)
        p->counts[p->at.batches][i] = count_of(count[i]);
    p->accounts[++p->at.batches] = *account;
}

uint64_t mill_precision_join(struct mill_precision *p)
{
    if (p->at.batches < MILL_PRECISION_BATCHES)
        return 1;
    const uint64_t many = p->at.period == 3 ? 3 : 2, joined = p->at.batches / many;
    for (uint64_t k = 0; k < joined; k++) {
        for (int i = 0; i < MILL_SPECTRUM_SLOTS; i++) {
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
    for (size_t d = n; d-- > 0;) { /* from the end, so that each step adds one value */
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

/* How many batches are joined into one so that at least FEWEST are left. The numbers divide a
 * period, or are one or two periods. */
static size_t size_of_batch(size_t n)
{
    static const size_t size[] = {1, 2, 3, 4, 6, 12, 24};
    size_t best = 1;
    for (size_t i = 0; i < sizeof size / sizeof *size; i++)
        if (n / size[i] >= FEWEST)
            best = size[i];
    return best;
}

/* Student's quantile for 95 % over that of the normal distribution: an expansion in 1/freedom
 * (Fisher & Cornish, Technometrics 2 (1960) 209), accurate to 2e-3 for freedom >= least_freedom */
static double widening(double freedom)
{
    const double u = 1 / freedom;
    return 1 + u * (1.21036 + u * (1.44008 + u * (1.30403 + u * 0.81100)));
}

/* rest[n]: x minus the mean of all values of the same phase. Returns by how much an incomplete last
 * period shifts the mean. */
static double remove_phases(const double *x, size_t n, size_t phases, double *rest)
{
    double shift = 0;
    for (size_t phase = 0; phase < phases; phase++) {
        const double times = (double)((n - phase + phases - 1) / phases);
        double sum = 0;
        for (size_t i = phase; i < n; i += phases)
            sum += x[i];
        for (size_t i = phase; i < n; i += phases)
            rest[i] = x[i] - sum / times;
        shift += sum / (double)n - sum / times / (double)phases;
    }
    return shift;
}

/* Correlation of neighbours in a series of n values without its mean, corrected for bias. left:
 * only their mean was subtracted, not that of each phase. */
static double memory_of(const double *x, size_t n, double squares, bool left)
{
    double products = 0;
    for (size_t k = 1; k < n; k++)
        products += x[k] * x[k - 1];
    const double memory = products / squares, many = (double)n;
    const double bias = left ? (1 + 4 * memory) / many : memory / (many - 1);
    return fmin(fmax(memory + bias, least_memory), most_memory);
}

struct mill_precision_mean mill_precision_mean(const double *x, size_t n, size_t period)
{
    double rest[MILL_PRECISION_BATCHES];
    struct mill_precision_mean mean = {0, NAN, 0};
    assert(n <= MILL_PRECISION_BATCHES);
    for (size_t i = 0; i < n; i++)
        mean.value += x[i] / (double)n;
    if (n < MILL_PRECISION_FEWEST)
        return mean;
    const size_t size = size_of_batch(n), batches = n / size, skipped = n - batches * size;
    const bool repeats = period > size && n / period >= 2;
    const double shift = remove_phases(x, n, repeats ? period : 1, rest);
    double squares = 0;
    for (size_t k = 0; k < batches; k++) {
        double sum = 0;
        for (size_t i = 0; i < size; i++)
            sum += rest[skipped + k * size + i];
        rest[k] = sum / (double)size; /* overwrites only values that have been read */
        squares += rest[k] * rest[k];
    }
    mean.freedom = INFINITY;
    mean.error = fabs(shift);
    if (!(squares > rounding * rounding * mean.value * mean.value))
        return mean;
    const double memory = memory_of(rest, batches, squares, !repeats), m2 = memory * memory;
    /* subtracting the means of the phases has removed a part of the scatter */
    const double turns = repeats ? (double)(n / period) : (double)INFINITY;
    const double left = (double)batches, share = 1 - 1 / turns;
    const double variance = squares / share / (left - 1) / left * (1 + memory) / (1 - memory);
    /* Degrees of freedom of a variance of which scatter and memory are both estimated. Skart, by
     * the same authors, uses left - 1, which is too many if the memory is large. Counting the
     * uncertainty of the memory in full (3 instead of 1.5) gives too few. With this formula,
     * between the two, 95 % of the intervals contain the true mean, in series of 36 to 1000 batches
     * with memories from 0 to 0.8 and in those of mills (validation/precision). */
    mean.freedom = left * share * (1 - m2) / (1.5 + m2);
    mean.error = sqrt(variance + shift * shift) * widening(mean.freedom);
    return mean.freedom < least_freedom ? (struct mill_precision_mean){mean.value, NAN, 0} : mean;
}

/* ---- the median ---- */

/* Finds the median of the impacts in the slots from `slot` up, in the batches from `from` on. sum:
 * zeros; set to their numbers by speed */
static struct mill_spectrum_place find_median(const struct mill_precision *p, uint64_t from,
                                              int slot, struct mill_spectrum *sum)
{
    for (uint64_t k = from; k < p->at.batches; k++)
        for (int i = slot; i < MILL_SPECTRUM_SLOTS; i++)
            sum->slot[i].count += p->counts[k][i];
    return mill_spectrum_place(sum, slot, 0.5);
}

/* By how many impacts the median of a batch or a window is below the place: its impacts below the
 * place, minus half of all its impacts. *all: all its impacts */
static double excess(const uint32_t *row, const struct mill_spectrum_place *place, double *all)
{
    double below = place->within * row[place->bin], rest = (1 - place->within) * row[place->bin];
    for (int i = place->slot; i < place->bin; i++)
        below += row[i];
    for (int i = place->bin + 1; i < MILL_SPECTRUM_SLOTS; i++)
        rest += row[i];
    *all = below + rest;
    return 0.5 * (below - rest);
}

/* Fraction of the impacts per unit of ln v around the median, over 5 bins to each side, +-10 % */
static double density(const struct mill_spectrum *sum, const struct mill_spectrum_place *place)
{
    enum { REACH = 5 };
    /* slot 0 and the last one are underflow and overflow */
    const int first = place->slot > 0 ? place->slot : 1;
    const int low = place->bin > first + REACH ? place->bin - REACH : first;
    const int high =
        place->bin + REACH < MILL_SPECTRUM_BINS ? place->bin + REACH + 1 : MILL_SPECTRUM_BINS + 1;
    double share = 0;
    for (int i = low; i < high; i++)
        share += (double)sum->slot[i].count / place->count;
    return share / ((high - low) * MILL_SPECTRUM_LOG_BIN);
}

static struct mill_precision_mean tell_median(const struct mill_precision *p, uint64_t from,
                                              int slot)
{
    double below[MILL_PRECISION_BATCHES] = {0}, all;
    struct mill_spectrum sum = {0};
    const uint64_t n = p->at.batches - from;
    const struct mill_spectrum_place place = find_median(p, from, slot, &sum);
    struct mill_precision_mean median = {NAN, NAN, 0};
    if (!(place.count > 0) || place.bin == 0)
        return median;
    for (uint64_t k = 0; k < n; k++)
        below[k] = excess(p->counts[from + k], &place, &all);
    const struct mill_precision_mean scatter = mill_precision_mean(below, n, p->at.period);
    /* error of the fraction below; for n independent impacts it is 1/2 over the root of n */
    const double share = fmax(scatter.error * (double)n / place.count, 0.5 / sqrt(place.count));
    median.value = mill_spectrum_speed(p->grid, &place);
    if (scatter.freedom > 0) {
        median.error = median.value * share / density(&sum, &place);
        median.freedom = scatter.freedom;
    }
    return median;
}

/* ---- results of the batches ---- */

static double work(const struct mill_precision *p, uint64_t from, uint64_t to)
{
    return p->accounts[to].work - p->accounts[from].work;
}

uint64_t mill_precision_cut(const struct mill_precision *p, bool *settled)
{
    double power[MILL_PRECISION_BATCHES] = {0}, below[MILL_PRECISION_BATCHES] = {0}, all;
    struct mill_spectrum sum = {0};
    const uint64_t n = p->at.batches;
    const struct mill_spectrum_place place = find_median(p, n / 2, MILL_SPECTRUM_FAST, &sum);
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

#define FROM(member) offsetof(struct mill_account, member)
#define OF_MOTION FROM(motion[1]) - FROM(motion[0]), false, 1
#define TO(member) offsetof(struct mill_precision_known, member)

const struct mill_precision_rate mill_precision_rates[MILL_PRECISION_RATES] = {
    {"drive_power", "W", "mean power of all motions on the balls", MILL_PRECISION_ONE, FROM(work),
     0, false, 1, TO(drive)},
    {"power", "W", "work on the balls by this motion's own velocity / duration",
     MILL_PRECISION_MOTION, FROM(motion[0].work), OF_MOTION, TO(motion_power)},
    {"torque", "N m", "mean torque on the balls about the motion's own axis; NaN: it has none",
     MILL_PRECISION_MOTION, FROM(motion[0].impulse), OF_MOTION, TO(motion_torque)},
    {"rate", "s-1", "impacts per second", MILL_PRECISION_KIND, FROM(collisions), sizeof(uint64_t),
     true, 1, TO(rate)},
    {"fast_rate", "s-1",
     "impacts per second with a normal speed at or above each of the attribute thresholds [m/s]",
     MILL_PRECISION_KIND, FROM(fast), MILL_WORLD_FAST * sizeof(uint64_t), true, MILL_WORLD_FAST,
     TO(fast)},
    {"dissipated_power", "W", "power lost in impacts", MILL_PRECISION_KIND, FROM(dissipation),
     sizeof(double), false, 1, TO(loss)},
    {"dissipated_power_normal", "W", "its normal part", MILL_PRECISION_KIND,
     FROM(dissipation_normal), sizeof(double), false, 1, TO(loss_normal)}};

static int rows_of(const struct mill_precision *p, const struct mill_precision_rate *rate)
{
    return rate->each == MILL_PRECISION_KIND     ? p->kinds + 1
           : rate->each == MILL_PRECISION_MOTION ? p->motions
                                                 : 1;
}

/* Number k of a row in an account */
static double number(const struct mill_account *account, const struct mill_precision_rate *rate,
                     int row, size_t k)
{
    const char *at = (const char *)account + rate->at + (size_t)row * rate->step;
    double value;
    uint64_t count;
    memcpy(rate->counts ? (void *)&count : (void *)&value, at + k * sizeof value, sizeof value);
    return rate->counts ? (double)count : value;
}

/* The same minus that of an earlier account (NULL: none); in the last row of kinds the sum of all
 */
static double change(const struct mill_precision *p, const struct mill_account *from,
                     const struct mill_account *to, const struct mill_precision_rate *rate, int row,
                     size_t k)
{
    const bool all = rate->each == MILL_PRECISION_KIND && row == p->kinds;
    double sum = 0;
    for (int i = all ? 0 : row; i < (all ? p->kinds : row + 1); i++)
        sum += number(to, rate, i, k) - (from ? number(from, rate, i, k) : 0);
    return sum;
}

static struct mill_precision_mean rate_of(const struct mill_precision *p, uint64_t from,
                                          const struct mill_precision_rate *rate, int row, size_t k)
{
    double each[MILL_PRECISION_BATCHES] = {0};
    const uint64_t n = p->at.batches - from;
    double last = change(p, NULL, &p->accounts[from], rate, row, k);
    for (uint64_t i = 0; i < n; i++) {
        const double next = change(p, NULL, &p->accounts[from + i + 1], rate, row, k);
        each[i] = (next - last) / p->at.batch;
        last = next;
    }
    struct mill_precision_mean mean = mill_precision_mean(each, n, p->at.period);
    if (rate->each != MILL_PRECISION_KIND && p->at.period == 0) /* nothing moves */
        mean.error = NAN;
    if (!rate->counts)
        return mean;
    /* the error is at least that of independent impacts; without impacts there is none */
    if (!(mean.value > 0))
        return (struct mill_precision_mean){mean.value, NAN, 0};
    if (mean.freedom > 0)
        mean.error = fmax(mean.error, sqrt(mean.value / ((double)n * p->at.batch)));
    return mean;
}

struct mill_precision_known mill_precision_tell(const struct mill_precision *p, uint64_t from)
{
    const struct mill_account *now = &p->accounts[p->at.batches];
    struct mill_precision_known known = {.batches = p->at.batches - from};
    known.idle = now->work_gross <= rounding * now->incident;
    known.enough = known.batches >= MILL_PRECISION_FEWEST &&
                   (known.idle || known.batches >= MILL_PRECISION_PERIODS * p->at.period);
    known.median = tell_median(p, from, 0);
    known.median_fast = tell_median(p, from, MILL_SPECTRUM_FAST);
    for (int i = 0; i < MILL_PRECISION_RATES; i++) {
        const struct mill_precision_rate *rate = &mill_precision_rates[i];
        for (int row = 0; row < rows_of(p, rate); row++)
            for (size_t k = 0; k < rate->width; k++)
                mill_precision_of(&known, rate, row)[k] = rate_of(p, from, rate, row, k);
    }
    return known;
}

void mill_precision_whole(struct mill_precision_known *known, const struct mill_precision *p,
                          const struct mill_account *from, const struct mill_account *to,
                          double duration)
{
    for (int i = 0; i < MILL_PRECISION_RATES; i++) {
        const struct mill_precision_rate *rate = &mill_precision_rates[i];
        const double none = rate->each == MILL_PRECISION_KIND ? 0 : (double)NAN;
        for (int row = 0; row < rows_of(p, rate); row++)
            for (size_t k = 0; k < rate->width; k++)
                mill_precision_of(known, rate, row)[k].value =
                    duration > 0 ? change(p, from, to, rate, row, k) / duration : none;
    }
}

bool mill_precision_reached(const struct mill_precision_known *known, double wanted)
{
    const bool power = known->idle || (known->drive.value != 0 &&
                                       known->drive.error <= wanted * fabs(known->drive.value));
    return known->enough && power && known->median_fast.error <= wanted * known->median_fast.value;
}
