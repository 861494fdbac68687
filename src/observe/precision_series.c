/* Two questions to a series of batch means. Where does its start-up end? MSER-5 (White, Simulation
 * 69 (1997) 323; White, Cobb & Spratt, Proc. Winter Simulation Conf. 2000, 755) cuts where the
 * standard error of the mean of the rest, as if it were independent, is least; the five last
 * batches make a poor rest and are no candidates (Hoad, Robinson & Davies, J. Oper. Res. Soc. 61
 * (2010) 1632). How sure is its mean? Batches grow with the series so that some 16 to 32 remain,
 * and what memory they still have enters as that of an autoregressive process of first order, the
 * factor (1 + phi)/(1 - phi) of the variance (Lada, Steiger & Wilson, Eur. J. Oper. Res. 184 (2008)
 * 707; Tafazzoli & Wilson, IIE Trans. 43 (2011) 110), with phi freed of its bias in short series
 * (Kendall, Biometrika 41 (1954) 403). */
#include "observe/precision.h"

#include <math.h>

enum { LAST = 5, FEWEST = 16 };

/* phi beyond these is not believed: few batches tell it to some 0.2 only */
static const double least_memory = -0.25, most_memory = 0.9;

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

/* x - its mean, or - the mean of those of the same phase */
static void centre(const double *x, size_t n, size_t period, double *out)
{
    const size_t step = period > 0 ? period : 1;
    for (size_t phase = 0; phase < step; phase++) {
        double sum = 0;
        for (size_t i = phase; i < n; i += step)
            sum += x[i];
        for (size_t i = phase; i < n; i += step)
            out[i] = x[i] - sum / (double)(n / step);
    }
}

double mill_precision_error(const double *x, size_t n, size_t period, double *room)
{
    if (n < MILL_PRECISION_FEWEST)
        return NAN;
    const size_t size = size_of_batch(n), batches = n / size;
    const bool repeats = period > size && n / period >= 2;
    const double turns = repeats ? (double)(n / period) : 0;
    const size_t skipped = n - batches * size;
    double mean = 0, squares = 0, products = 0;
    centre(x, n, repeats ? period : 0, room);
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
