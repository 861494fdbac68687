/* The statistics of a series of values: where it becomes steady, and how accurate its mean is.
 *
 * Where does the start-up end in a series of batch means? MSER-5 (White, Simulation 69 (1997) 323;
 * White, Cobb & Spratt, Proc. Winter Simulation Conf. 2000, 755) cuts where the standard error of
 * the mean of the rest, as if it were independent, is smallest. Cuts within the last five batches
 * are excluded, because so few batches give a poor estimate (Hoad, Robinson & Davies, J. Oper. Res.
 * Soc. 61 (2010) 1632).
 *
 * How accurate is the mean of the rest? Several starts of a mill are independent: their scatter
 * over the root of their number is the standard error, with Student's t. Fewer starts are cut into
 * eight pieces each, which stand for starts: they are independent if they are much longer than what
 * the mill remembers. Where a container moves, a charge may keep its first arrangement for ever,
 * and no series of one start shows this (measured in docs/physics.md). */
#include "observe/spread.h"

#include <assert.h>
#include <math.h>

/* Relative to a mean: smaller scatter is rounding */
static const double rounding = 1e-9;

enum { LAST = 5 };

size_t mill_spread_mser(const double *x, size_t n)
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

/* Student's quantile where that of the normal distribution is z: an expansion in 1/freedom (Fisher
 * & Cornish, Technometrics 2 (1960) 209), accurate to 2e-3 for z <= 2 and freedom >= 3 */
double mill_spread_student(double z, double freedom)
{
    const double u = 1 / freedom, q = z * z;
    return z *
           (1 + u * ((q + 1) / 4 +
                     u * (((5 * q + 16) * q + 3) / 96 +
                          u * ((((3 * q + 19) * q + 17) * q - 15) / 384 +
                               u * ((((79 * q + 776) * q + 1482) * q - 1920) * q - 945) / 92160))));
}

/* rest[n]: x minus the mean of its phase. Returns how an incomplete last period shifts the mean. */
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

/* The mean of n independent values */
static struct mill_spread_mean mean_of(const double *x, size_t n)
{
    struct mill_spread_mean mean = {0, NAN, 0};
    const double many = (double)n;
    double squares = 0;
    for (size_t i = 0; i < n; i++)
        mean.value += x[i] / many;
    for (size_t i = 0; i < n; i++)
        squares += (x[i] - mean.value) * (x[i] - mean.value);
    if (n < MILL_SPREAD_SEVERAL)
        return mean;
    const bool exact = !(squares > rounding * rounding * mean.value * mean.value);
    mean.freedom = exact ? (double)INFINITY : many - 1;
    mean.error =
        exact ? 0 : sqrt(squares / (many - 1) / many) * mill_spread_student(1.96, many - 1) / 1.96;
    return mean;
}

struct mill_spread_mean mill_spread_mean(const double *x, struct mill_spread_of of)
{
    const size_t n = of.each;
    double rest[MILL_SPREAD_MOST], piece[MILL_SPREAD_SEVERAL * MILL_SPREAD_PIECES] = {0};
    double shift = 0;
    assert(n * of.starts <= MILL_SPREAD_MOST);
    struct mill_spread_mean mean = mean_of(x, n * of.starts);
    if (n == 1)
        return mean;
    mean = (struct mill_spread_mean){mean.value, NAN, 0};
    if (n < MILL_SPREAD_FEWEST || n < MILL_SPREAD_PERIODS * of.period ||
        of.starts >= MILL_SPREAD_SEVERAL)
        return mean;
    const bool repeats = of.period > 1;
    for (size_t s = 0; s < of.starts; s++, x += n) {
        const double own = mean_of(x, n).value;
        shift += remove_phases(x, n, repeats ? of.period : 1, rest) / (double)of.starts;
        for (size_t k = 0; k < MILL_SPREAD_PIECES; k++) {
            const size_t first = k * n / MILL_SPREAD_PIECES;
            const size_t next = (k + 1) * n / MILL_SPREAD_PIECES;
            double *to = &piece[s * MILL_SPREAD_PIECES + k];
            *to = own;
            for (size_t i = first; i < next; i++)
                *to += rest[i] / (double)(next - first);
        }
    }
    const struct mill_spread_mean all = mean_of(piece, of.starts * MILL_SPREAD_PIECES);
    /* subtracting the means of the phases has removed a part of the scatter */
    const double share = repeats ? 1 - 1 / (double)(n / of.period) : 1;
    mean.error = sqrt(all.error * all.error / share + shift * shift);
    mean.freedom = all.freedom;
    return mean;
}

bool mill_spread_few(const double *count, struct mill_spread_of of)
{
    double sum = 0, squares = 0;
    for (size_t i = 0; i < of.starts; i++) {
        sum += count[i];
        squares += count[i] * count[i];
    }
    const size_t least = of.starts < 2 * MILL_SPREAD_SEVERAL ? of.starts : 2 * MILL_SPREAD_SEVERAL;
    return of.each == 1 && 2 * sum * sum < (double)least * squares;
}

struct mill_spread_mean mill_spread_counted(const double *x, struct mill_spread_of of, double t)
{
    struct mill_spread_mean mean = mill_spread_mean(x, of);
    /* a count: compare with half of one less, because rates are rounded */
    if (mill_spread_few(x, of) || mean.value * t < MILL_SPREAD_SEEN - 0.5)
        return (struct mill_spread_mean){mean.value, NAN, 0};
    if (mean.freedom > 0)
        mean.error = fmax(mean.error, sqrt(mean.value / t));
    return mean;
}
