/* Contours from a few numbers: the wavy chamber, a liner with lifters, a free line. All are closed,
 * counter-clockwise, about the origin; angles are from x towards y. */
#ifndef MILLSIM_LINING_H
#define MILLSIM_LINING_H

#include <stddef.h>

struct mill_corner;

enum mill_lining_form {
    MILL_LINING_CIRCLE,
    MILL_LINING_WAVY,
    MILL_LINING_LIFTERS,
    MILL_LINING_HARMONICS,
    MILL_LINING_FILE
};
enum { MILL_LINING_WAVES = 4, MILL_LINING_MOST = 500 };

struct mill_lining {
    int form;
    double radius; /* [m] of the plate between lifters; mean of a wavy chamber or a free line */
    long count;    /* of buckles, of lifters, of equal parts of a free line; at most
                      MILL_LINING_MOST */
    double angle;  /* [rad] of one outermost point, of the middle of a lifter, of the first wave */
    double
        height; /* [m] of buckles: half of the whole; of lifters: above the plate at their middle */
    double second;      /* [m] height of every other lifter */
    double width;       /* [m] of a lifter at its top */
    double front, back; /* [rad] of its faces towards larger and smaller angles, from the radius */
    double rounding;    /* [m] of its edges */
    /* [m] The free line is at radius + sum over k of wave[k-1] cos(k a) + lean[k-1] sin(k a), where
     * a goes once around in each of the equal parts. */
    double wave[MILL_LINING_WAVES], lean[MILL_LINING_WAVES];
};

/* Of corners, at most; for which mill_lining_corners() needs room */
size_t mill_lining_most(const struct mill_lining *is);

/* Sets the corners; returns how many. 0: the lifters touch each other or have no such edges, or the
 * form has no corners (a circle). Of the wavy chamber: Reichardt & Wiechert 2007, figure 6. */
size_t mill_lining_corners(const struct mill_lining *is, struct mill_corner *corner);

#endif
