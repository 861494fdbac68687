/* Elementary functions whose results influence a run or its statistics. C libraries differ in the
 * last bit of these functions, and one different bit changes all later impacts. Here are only
 * additions, multiplications, divisions and square roots: every library, compiler, processor gives
 * the same bits. Errors are below 1e-15 of the value (cosine and sine: a unit in the last place) */
#ifndef MILLSIM_ELEMENTARY_H
#define MILLSIM_ELEMENTARY_H

/* Cosine and sine of one angle */
struct mill_heading {
    double cos, sin;
};

/* angle [rad], finite. Beyond 1e6 rad it is first reduced by the double nearest to 2 pi. */
struct mill_heading mill_elementary_heading(double angle);

/* [rad] -pi..pi, of the direction (x, y); 0 for the zero vector. */
double mill_elementary_atan2(double y, double x);

/* [rad] -pi/2..pi/2, of -1 <= s <= 1. */
double mill_elementary_asin(double s);

/* Third and fifth root of x > 0, finite. */
double mill_elementary_cbrt(double x);
double mill_elementary_root5(double x);

/* |x| <= 700. */
double mill_elementary_exp(double x);

#endif
