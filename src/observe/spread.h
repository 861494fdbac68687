/* How accurate is a mean? */
#ifndef MILL_SPREAD_H
#define MILL_SPREAD_H

#include <stddef.h>
#include <stdint.h>

enum {
    MILL_SPREAD_MOST = 1152, /* values of a series */
    MILL_SPREAD_PIECES = 8,  /* of a series */
    MILL_SPREAD_FEWEST = 36, /* values of a series that an error needs */
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

/* As a period: the values are those of several starts */
#define MILL_SPREAD_APART SIZE_MAX

/* Mean of x[n] with its standard error. For MILL_SPREAD_APART they are independent, and there is
 * no error for n < MILL_SPREAD_SEVERAL. Else they are a stationary series with correlated
 * values: the error is from the scatter of MILL_SPREAD_PIECES pieces. If n is at least two
 * `period`s, what repeats in each period does not count as scatter; it enters the error only
 * through an incomplete last period. No error for n < MILL_SPREAD_FEWEST. n <=
 * MILL_SPREAD_MOST. */
struct mill_spread_mean mill_spread_mean(const double *x, size_t n, size_t period);

/* To how many values of the same weight these are equal: few, if few of them have most of it (Kish,
 * Survey Sampling, Wiley 1965, section 11.7) */
double mill_spread_effective(const double *weight, size_t n);

/* The same for rates of counted things, within `time` in all: the error is at least that of
 * independent ones. There is none if fewer than MILL_SPREAD_SEEN were counted, or if the starts
 * that saw most of them are equal to fewer than MILL_SPREAD_SEVERAL. */
struct mill_spread_mean mill_spread_counted(const double *x, size_t n, size_t period, double time);

/* Student's quantile for `freedom` >= 3, where that of the normal distribution is z */
double mill_spread_student(double z, double freedom);

#endif
