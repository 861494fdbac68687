/* Polynomials of degree <= 4: closed-form roots, Sturm counts, and the one question that contact
 * prediction asks: when does a gap first close? Coefficients c[k] belong to t^k. */
#ifndef MILLSIM_POLY_H
#define MILLSIM_POLY_H

#include <stdbool.h>

struct mill_poly_counts {
    unsigned long solves;    /* calls that got past the cheap rejections */
    unsigned long fallbacks; /* of these: bounds did not suffice, a Sturm sequence took over */
    bool checked;            /* each first rise is held against the closed form, */
    unsigned long refuted;   /* and so many did not agree with it */
};

/* Real roots of a x^2 + 2 b x + c in ascending order, without cancellation; returns how many (a = 0
 * gives the linear root; a double root counts once). */
int mill_poly_quadratic(double a, double b, double c, double x[2]);

/* All four roots of c[4] t^4 + ... + c[0], c[4] != 0, re[k] + i im[k]; conjugates adjacent. */
void mill_poly_quartic_roots(const double c[5], double re[4], double im[4]);

/* The second opinion on a first rise t found for these arguments: between the closed form's roots
 * nothing lies above zero before t, to 1e-9 of the terms. false: something does, or p(t) is far
 * from zero. */
bool mill_poly_quartic_agrees(const double c[5], double t_end, bool at_root, double t);

/* Distinct real roots in (lo, hi] by a Sturm sequence; degree <= 4, leading zeros allowed. */
int mill_poly_sturm_count(const double *c, int degree, double lo, double hi);

/* First rise (see below) of a polynomial with f[0] != 0, where f[0] > 0 means that f is falling at
 * 0, with roots isolated by Sturm counts: microseconds, not nanoseconds. */
double mill_poly_sturm_rise(const double f[5], double t_end);

/* First t in [0, t_end] at which p(t) >= 0 and p is rising (the first derivative that does not
 * vanish is positive), INFINITY when there is none. p(0) >= 0 and rising gives 0; p(0) >= 0 and
 * falling waits until p is next rising with p >= 0. With at_root, p(0) is zero by construction (a
 * contact has just happened): c[0] is taken as exactly zero whatever its value and t = 0 is divided
 * out, so the contact that was just resolved can return only if p rises at once. t_end may be
 * INFINITY (then by Sturm counts). counts may be NULL. None is missed, and none invented, where the
 * coefficients other than zero lie between 1e-30 and 1e30, nor for any flight; beyond that a rise
 * may hide behind terms that differ by hundreds of orders of magnitude. */
double mill_poly_first_rise(const double c[5], double t_end, bool at_root,
                            struct mill_poly_counts *counts);

#endif
