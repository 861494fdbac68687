/* The certain half of first_rise, shared inside the polynomial solver only. */
#ifndef MILLSIM_POLY_STURM_H
#define MILLSIM_POLY_STURM_H

/* First rise (as in mill_poly_first_rise) of a polynomial with f[0] != 0 over [0, t_end], where
 * f[0] > 0 means that f is falling at 0. Isolates roots by Sturm counts; microseconds, not
 * nanoseconds. */
double mill_poly_sturm_rise(const double f[5], double t_end);

#endif
