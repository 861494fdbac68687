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
 * Whether the window is settled is asked of each start: the difference of its first quarter and its
 * last half. A t test of the mean of these differences finds a drift that all starts share, and
 * that their scatter does not show. */
#include "observe/precision.h"

#include <assert.h>

/* [s] Lengths of a batch. A charge needs more than `shortest` to change. A motion with a period
 * longer than `standing` is treated as standing still. */
static const double shortest = 1e-3, usual = 5e-3, longest = 25e-3, standing = 1e6;

/* Relative to what balls bring into contacts, or to a mean: smaller work or scatter is rounding */
static const double rounding = 1e-9;

/* Part of all impacts: fewer above the floor are slips of a charge that rests. In a jar at 9 g one
 * start in ten saw some, with 100 times the impacts of others; in input/ it is 0.02 and more. */
#define RARE 1e-3

enum { PARTS = 12 };

/* Normal quantiles of a two-sided test for a drift: where a cut is chosen, where one is refused */
#define SURE 0.8416    /* 40 % */
#define REFUSED 2.5758 /* 1 % */

/* Batches for motions that repeat after `turn` [s], whatever run.time, which they can shorten */
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
                                 .most = MILL_PRECISION_BATCHES,
                                 .fast = grid ? mill_spectrum_from(grid, world) : 0,
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
    if (p->at.batches < p->most)
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

/* ---- the median ---- */

/* Finds the median of the impacts in the slots from `slot` up, in the batches from `from` on. sum:
 * zeros; set to the numbers of all impacts by speed */
static struct mill_spectrum_place find_median(const struct mill_precision_set *set, uint64_t from,
                                              int slot, struct mill_spectrum *sum)
{
    for (int s = 0; s < set->count; s++)
        for (uint64_t k = from; k < set->of[s]->at.batches; k++)
            for (int i = 0; i < MILL_SPECTRUM_SLOTS; i++)
                sum->slot[i].count += set->of[s]->counts[k][i];
    return mill_spectrum_place(sum, slot, 0.5);
}

/* By how many impacts the median of some batches of a start is below the place: their impacts below
 * the place, minus half of all their impacts. *all: all their impacts */
static double excess(const struct mill_precision *p, uint64_t from, uint64_t to,
                     const struct mill_spectrum_place *place, double *all)
{
    double sum = 0;
    *all = 0;
    for (uint64_t k = from; k < to; k++) {
        const uint32_t *row = p->counts[k];
        double below = place->within * row[place->bin];
        double rest = (1 - place->within) * row[place->bin];
        for (int i = place->slot; i < place->bin; i++)
            below += row[i];
        for (int i = place->bin + 1; i < MILL_SPECTRUM_SLOTS; i++)
            rest += row[i];
        sum += 0.5 * (below - rest);
        *all += below + rest;
    }
    return sum;
}

/* The same as a share of all */
static double share_of(const struct mill_precision *p, uint64_t from, uint64_t to,
                       const struct mill_spectrum_place *place)
{
    double all;
    const double below = excess(p, from, to, place, &all);
    return all > 0 ? below / all : 0;
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

/* Values for an error: one of each of several starts, or all batches. *length: its batches */
static struct mill_spread_of values_of(const struct mill_precision_set *set, uint64_t from,
                                       uint64_t *length)
{
    const struct mill_precision_progress *at = &set->of[0]->at;
    const bool apart = set->count >= MILL_SPREAD_SEVERAL && at->batches > from;
    *length = apart ? at->batches - from : 1;
    return (struct mill_spread_of){(size_t)set->count, apart ? 1 : at->batches - from, at->period};
}

/* *rare: there are too few such impacts to know it */
static struct mill_spread_mean tell_median(const struct mill_precision_set *set, uint64_t from,
                                           int slot, bool *rare)
{
    uint64_t length;
    const struct mill_spread_of of = values_of(set, from, &length);
    const size_t n = of.starts * of.each;
    double below[MILL_SPREAD_MOST] = {0}, all[MILL_SPREAD_MOST];
    struct mill_spectrum sum = {0};
    const struct mill_spectrum_place place = find_median(set, from, slot, &sum);
    struct mill_spread_mean median = {NAN, NAN, 0};
    if (!(place.count > 0) || place.bin == 0)
        return median;
    for (size_t i = 0; i < n; i++) {
        const uint64_t first = from + i % of.each;
        below[i] = excess(set->of[i / of.each], first, first + length, &place, &all[i]);
    }
    const struct mill_spread_mean scatter = mill_spread_mean(below, of);
    /* error of the fraction below; for n independent impacts it is 1/2 over the root of n */
    const double share = fmax(scatter.error * (double)n / place.count, 0.5 / sqrt(place.count));
    median.value = mill_spectrum_speed(set->of[0]->grid, &place);
    *rare = place.count < RARE * (double)mill_spectrum_total(&sum, 0).count;
    if (scatter.freedom > 0 && place.count >= MILL_SPREAD_SEEN && !*rare &&
        !mill_spread_few(all, of)) {
        median.error = median.value * share / density(&sum, &place);
        median.freedom = scatter.freedom;
    }
    return median;
}

/* ---- results of the batches ---- */

#define AT(member) offsetof(struct mill_account, member)
#define TO(member) offsetof(struct mill_precision_known, member)
#define MOTION(member, to)                                                                         \
    MILL_PRECISION_MOTION, AT(motion[0].member), AT(motion[1]) - AT(motion[0]), false, 1, TO(to)
#define KIND(member, counts, width, to) MILL_PRECISION_KIND, AT(member), 8, counts, width, TO(to)

const struct mill_precision_rate mill_precision_rates[MILL_PRECISION_RATES] = {
    {"drive_power", "W", "mean power of all motions on the balls", MILL_PRECISION_ONE, AT(work), 0,
     false, 1, TO(drive)},
    {"power", "W", "work on the balls by this motion's own velocity / duration",
     MOTION(work, motion_power)},
    {"torque", "N m", "mean torque on the balls about the motion's own axis; NaN: it has none",
     MOTION(impulse, motion_torque)},
    {"rate", "s-1", "impacts per second", KIND(collisions, true, 1, rate)},
    {"fast_rate", "s-1",
     "impacts per second with a normal speed at or above each of the attribute thresholds [m/s]",
     KIND(fast, true, MILL_WORLD_FAST, fast)},
    {"dissipated_power", "W", "power lost in impacts", KIND(dissipation, false, 1, loss)},
    {"dissipated_power_normal", "W", "its normal part",
     KIND(dissipation_normal, false, 1, loss_normal)}};

/* Numbers of a rate, all rows of it */
static size_t numbers_of(const struct mill_precision *p, const struct mill_precision_rate *rate)
{
    const int rows = rate->each == MILL_PRECISION_KIND     ? p->kinds + 1
                     : rate->each == MILL_PRECISION_MOTION ? p->motions
                                                           : 1;
    return (size_t)rows * rate->width;
}

/* Number i of a rate in an account */
static double number(const struct mill_account *a, const struct mill_precision_rate *r, size_t i)
{
    const void *at = (const char *)a + r->at + i * r->step;
    return r->counts ? (double)*(const uint64_t *)at : *(const double *)at;
}

/* The same minus that of an earlier account; in the last row of kinds the sum of all */
static double change(const struct mill_precision *p, const struct mill_account *from,
                     const struct mill_account *to, const struct mill_precision_rate *r, size_t i)
{
    const bool all = r->each == MILL_PRECISION_KIND && i >= (size_t)p->kinds * r->width;
    double sum = 0;
    for (size_t k = all ? i % r->width : i; k < (all ? i : i + 1); k += r->width)
        sum += number(to, r, k) - number(from, r, k);
    return sum;
}

double mill_precision_one(const struct mill_precision *p, uint64_t from, uint64_t to,
                          const struct mill_precision_rate *rate, int row, size_t k)
{
    return change(p, &p->accounts[from], &p->accounts[to], rate, (size_t)row * rate->width + k) /
           ((double)(to - from) * p->at.batch);
}

static struct mill_spread_mean rate_of(const struct mill_precision_set *set, uint64_t from,
                                       const struct mill_precision_rate *rate, size_t which)
{
    uint64_t length;
    const struct mill_spread_of of = values_of(set, from, &length);
    const struct mill_precision_progress *at = &set->of[0]->at;
    double each[MILL_SPREAD_MOST] = {0};
    for (size_t i = 0; i < of.starts * of.each; i++) {
        const uint64_t first = from + i % of.each;
        each[i] = mill_precision_one(set->of[i / of.each], first, first + length, rate, 0, which);
    }
    if (rate->counts)
        return mill_spread_counted(each, of, set->count * (double)(at->batches - from) * at->batch);
    struct mill_spread_mean mean = mill_spread_mean(each, of);
    if (rate->each != MILL_PRECISION_KIND && at->period == 0) /* nothing moves */
        mean.error = NAN;
    return mean;
}

/* ---- the start-up ---- */

/* Do the starts drift from the first quarter to the last half of their batches from `from` on: what
 * they lose, or the share of their impacts below the median? z: quantile of the test */
static bool drifts(const struct mill_precision_set *set, uint64_t from, double z)
{
    const struct mill_precision *p = set->of[0];
    const struct mill_precision_rate *loss = &mill_precision_rates[MILL_PRECISION_LOSS];
    const uint64_t n = p->at.batches, first = from + (n - from + 3) / 4, last = n - (n - from) / 2;
    double off[2][MILL_PRECISION_STARTS];
    struct mill_spectrum sum = {0};
    const struct mill_spectrum_place place = find_median(set, from, p->fast, &sum);
    if (set->count < MILL_SPREAD_SEVERAL || n - from < 4)
        return false;
    for (int s = 0; s < set->count; s++) {
        const struct mill_precision *one = set->of[s];
        off[0][s] = mill_precision_one(one, from, first, loss, p->kinds, 0) -
                    mill_precision_one(one, last, n, loss, p->kinds, 0);
        off[1][s] = share_of(one, from, first, &place) - share_of(one, last, n, &place);
    }
    bool found = false;
    for (int k = 0; k < 2; k++) {
        const struct mill_spread_of each = {(size_t)set->count, 1, 0};
        const struct mill_spread_mean mean = mill_spread_mean(off[k], each);
        found = found || (isfinite(mean.freedom) &&
                          fabs(mean.value) * mill_spread_student(1.96, mean.freedom) >
                              1.96 * mean.error * mill_spread_student(z, mean.freedom));
    }
    return found;
}

uint64_t mill_precision_cut(const struct mill_precision_set *set, bool *settled)
{
    double power[MILL_PRECISION_BATCHES] = {0}, below[MILL_PRECISION_BATCHES] = {0};
    struct mill_spectrum sum = {0};
    const uint64_t n = set->of[0]->at.batches;
    const struct mill_spectrum_place place = find_median(set, n / 2, set->of[0]->fast, &sum);
    for (int s = 0; s < set->count; s++)
        for (uint64_t k = 0; k < n; k++) {
            const struct mill_precision *p = set->of[s];
            below[k] += share_of(p, k, k + 1, &place);
            power[k] += p->accounts[k + 1].work - p->accounts[k].work;
        }
    const uint64_t of_power = mill_spread_mser(power, n), of_median = mill_spread_mser(below, n);
    const uint64_t found = of_power > of_median ? of_power : of_median;
    uint64_t cut = set->count >= MILL_SPREAD_SEVERAL ? 2 * found : found;
    *settled = n >= MILL_SPREAD_FEWEST && 2 * found <= n;
    cut = cut < n / 2 ? cut : n / 2;
    for (uint64_t later = 2; later <= 8 && drifts(set, cut, SURE); later += later < 4 ? 1 : 2)
        cut = cut > later * n / 16 ? cut : later * n / 16;
    return cut;
}

struct mill_precision_known mill_precision_tell(const struct mill_precision_set *s, uint64_t from)
{
    const struct mill_precision *p = s->of[0];
    const struct mill_account *now = &p->accounts[p->at.batches];
    struct mill_precision_known known = {.batches = p->at.batches - from};
    known.idle = now->work_gross <= rounding * now->incident;
    known.enough = known.batches >= MILL_SPREAD_FEWEST &&
                   (known.idle || known.batches >= MILL_SPREAD_PERIODS * p->at.period);
    known.drifts = drifts(s, from, REFUSED);
    known.median = tell_median(s, from, 0, &known.slips);
    known.median_fast = tell_median(s, from, p->fast, &known.slips);
    const struct mill_precision_rate *rate = mill_precision_rates;
    for (; rate < mill_precision_rates + MILL_PRECISION_RATES; rate++)
        for (size_t i = 0; i < numbers_of(p, rate); i++)
            mill_precision_of(&known, rate, 0)[i] = rate_of(s, from, rate, i);
    return known;
}

void mill_precision_whole(struct mill_precision_known *known, const struct mill_precision *p,
                          const struct mill_account *from, const struct mill_account *to,
                          double duration)
{
    const struct mill_precision_rate *rate = mill_precision_rates;
    for (; rate < mill_precision_rates + MILL_PRECISION_RATES; rate++) {
        const double none = rate->each == MILL_PRECISION_KIND ? 0 : (double)NAN;
        for (size_t i = 0; i < numbers_of(p, rate); i++)
            mill_precision_of(known, rate, 0)[i].value =
                duration > 0 ? change(p, from, to, rate, i) / duration : none;
    }
}

void mill_precision_forget(struct mill_precision_known *known)
{
    enum { MEANS = offsetof(struct mill_precision_known, batches) / sizeof known->drive };
    struct mill_spread_mean *mean = (void *)known;
    for (int i = 0; i < MEANS; i++)
        mean[i] = (struct mill_spread_mean){mean[i].value, NAN, 0};
    known->enough = false;
}

bool mill_precision_reached(const struct mill_precision_known *known, double wanted)
{
    const bool power = known->idle || (known->drive.value != 0 &&
                                       known->drive.error <= wanted * fabs(known->drive.value));
    return known->enough && power &&
           (known->slips || known->median_fast.error <= wanted * known->median_fast.value);
}
