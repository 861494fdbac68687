/* Polynomials of degree <= 4: roots in closed form, root counts by Sturm sequences, and the
 * question of contact prediction: when does a gap first close? Coefficients c[k] belong to t^k. */
#ifndef MILLSIM_POLY_H
#define MILLSIM_POLY_H

#include <stdbool.h>

/* Is t the first rise (see below) for these arguments? c[4] is not zero, the polynomial begins
 * below zero, and t or t_end is finite. */
typedef bool mill_poly_opinion_fn(const double c[5], double t_end, bool at_root, double t);

struct mill_poly_check {
    mill_poly_opinion_fn *second;   /* beside the closed form; NULL: none */
    unsigned long asked;            /* first rises that were compared */
    unsigned long refuted, doubted; /* by the closed form, by the second opinion */
};

struct mill_poly_counts {
    unsigned long solves;          /* calls that the cheap tests could not answer */
    unsigned long fallbacks;       /* of these: answered by a Sturm sequence */
    struct mill_poly_check *check; /* compare each first rise with other solvers; NULL: do not */
};

/* Real roots of a x^2 + 2 b x + c in ascending order, without cancellation; returns how many (a = 0
 * gives the linear root; a double root counts once). */
int mill_poly_quadratic(double a, double b, double c, double x[2]);

/* All four roots of c[4] t^4 + ... + c[0], c[4] != 0, re[k] + i im[k]; conjugates adjacent. */
void mill_poly_quartic_roots(const double c[5], double re[4], double im[4]);

/* By the roots in closed form, to 1e-9 of the terms */
mill_poly_opinion_fn mill_poly_quartic_agrees;

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
