/* Polynomials of degree <= 4: root counts by Sturm sequences, and the
 * question of contact prediction: when does a gap first close? Coefficients c[k] belong to t^k. */
#ifndef MILLSIM_POLY_H
#define MILLSIM_POLY_H

#include <stdbool.h>

/* Learns of each first rise (see below): the arguments and the result */
struct mill_poly_check {
    void (*look)(struct mill_poly_check *, const double c[5], double t_end, bool at_root, double t);
};

struct mill_poly_counts {
    unsigned long solves;          /* calls that the cheap tests could not answer */
    unsigned long fallbacks;       /* of these: answered by a Sturm sequence */
    struct mill_poly_check *check; /* other solvers look at each first rise; NULL: none */
};

/* Real roots of a x^2 + 2 b x + c in ascending order, without cancellation; returns how many (a = 0
 * gives the linear root; a double root counts once). */
int mill_poly_quadratic(double a, double b, double c, double x[2]);

/* Distinct real roots in (lo, hi] by a Sturm sequence; degree <= 4, leading zeros allowed. */
int mill_poly_sturm_count(const double *c, int degree, double lo, double hi);

/* First rise (see below) of a polynomial with f[0] != 0; f[0] > 0 means that f falls at 0. It
 * isolates the roots by Sturm counts, which takes microseconds instead of nanoseconds. */
double mill_poly_sturm_rise(const double f[5], double t_end);

/* First t in [0, t_end] at which p(t) >= 0 and p is rising (its first derivative that is not zero
 * is positive); INFINITY if there is none. If p(0) >= 0 and p rises, the result is 0. If p(0) >= 0
 * and p falls, the result is the next t at which p rises with p >= 0.
 *
 * at_root: p(0) is zero by construction, because a contact has happened now. Then c[0] counts as
 * exactly zero, whatever its value, and t = 0 is divided out. So the same contact is found again
 * only if p rises at once.
 *
 * t_end may be INFINITY (then Sturm counts are used). counts may be NULL. The result is certain if
 * all coefficients other than zero are between 1e-30 and 1e30, and for every flight of a ball.
 * Beyond this range a rise can be missed if terms differ by hundreds of orders of magnitude. */
double mill_poly_first_rise(const double c[5], double t_end, bool at_root,
                            struct mill_poly_counts *counts);

#endif
