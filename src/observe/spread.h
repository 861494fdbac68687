/* How accurate is a mean? */
#ifndef MILL_SPREAD_H
#define MILL_SPREAD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    MILL_SPREAD_MOST = 1152, /* values of a series */
    MILL_SPREAD_PIECES = 8,  /* of a series */
    MILL_SPREAD_FEWEST = 36, /* values of a series that an error needs */
    MILL_SPREAD_PERIODS = 3, /* of what repeats in a series, the same */
    MILL_SPREAD_SEVERAL = 4, /* independent values that an error needs */
    MILL_SPREAD_SEEN = 10    /* impacts; of fewer, only the number is known */
};

/* A number with its standard error, in its own unit. The error includes the factor of Student's t,
 * so that value +- 1.96 error is the 95 % interval for any number of starts. NaN: not known. */
struct mill_spread_mean {
    double value, error;
    double freedom; /* degrees of freedom of the error; 0 where there is none */
};

/* The d that minimises the sum of (x_i - mean)^2 over i >= d, divided by (n - d)^2. The last five
 * values of d are not allowed. 0 for n <= 5. */
size_t mill_spread_mser(const double *x, size_t n);

/* What a mean is of: values of each start, one start after the other. A single one of each start is
 * independent of the others; more are a stationary series of correlated values. */
struct mill_spread_of {
    size_t starts, each;
    size_t period; /* of what repeats in a series; 0: nothing */
};

/* Mean with its standard error. Of independent values there is no error for starts <
 * MILL_SPREAD_SEVERAL. Of series the error is from the scatter of MILL_SPREAD_PIECES pieces of
 * each. If a series is at least two periods, what repeats in each period does not count as scatter;
 * it enters the error only through an incomplete last period. Series have no error for each <
 * MILL_SPREAD_FEWEST, nor for MILL_SPREAD_SEVERAL starts. starts * each <= MILL_SPREAD_MOST. */
struct mill_spread_mean mill_spread_mean(const double *x, struct mill_spread_of of);

/* Have a few starts counted most of it, as good as fewer than MILL_SPREAD_SEVERAL equal ones?
 * (Kish, Survey Sampling, Wiley 1965, section 11.7) */
bool mill_spread_few(const double *count, struct mill_spread_of of);

/* The same for rates of counted things, within `time` in all: the error is at least that of
 * independent ones. There is none if fewer than MILL_SPREAD_SEEN were counted, or by few starts. */
struct mill_spread_mean mill_spread_counted(const double *x, struct mill_spread_of of, double time);

/* Student's quantile for `freedom` >= 3, where that of the normal distribution is z */
double mill_spread_student(double z, double freedom);

#endif
