/* Contours from a few numbers, closed, counter-clockwise, about the origin; angles: x towards y */
#ifndef MILLSIM_LINING_H
#define MILLSIM_LINING_H

#include <stdbool.h>
#include <stddef.h>

struct mill_corner;

enum mill_lining_form {
    MILL_LINING_CIRCLE,
    MILL_LINING_WAVY,
    MILL_LINING_LIFTERS,
    MILL_LINING_HARMONICS,
    MILL_LINING_FILE
};
#define MILL_LINING_BULGE 1e3 /* of an arc that is almost a whole circle */
enum { MILL_LINING_WAVES = 4, MILL_LINING_MOST = 500, MILL_LINING_CORNERS = 4000 };

struct mill_lining {
    int form;
    double radius; /* [m] of the plate between lifters; mean of a wavy chamber or a free line */
    long count;    /* of buckles, lifters, equal parts of a free line; at most MILL_LINING_MOST */
    double angle;  /* [rad] of one outermost point, of the middle of a lifter, of the first wave */
    double height; /* [m] half of the whole of buckles; of lifters: above the plate in the middle */
    double second; /* [m] height of every other lifter */
    double width;  /* [m] of a lifter at its top */
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

/* The cross-section of the wavy drum (Reichardt & Wiechert 2007, figure 6): 2n circular arcs of one
 * radius that curve alternately outwards and inwards and are tangent where they meet. Outer arcs
 * (curved away from the axis) have their centres at distance `outer` from the axis, in the
 * directions angle + 2 pi k / n. Inner arcs have theirs at distance `inner`, half a pitch further.
 * An arc ends where the line from its centre to the centre of the next arc crosses it. */
struct mill_profile {
    int buckles;   /* n: there are n outer and n inner arcs */
    double radius; /* [m] mean of the extreme radii */
    double height; /* [m] h: the extreme radii are radius + h and radius - h */
    double angle;  /* [rad] of one outermost point */
    double arc;    /* [m] radius of every arc */
    double outer, inner;
    double half_outer, half_inner; /* [rad] half of the angle of an arc, at its centre */
    bool sound; /* neighbouring arcs leave room for each other, so that they enclose an area */
};

/* buckles >= 2, 0 <= height < radius. For height 0 the profile is a circle, made of n arcs around
 * the axis. With q = 1 - cos(pi/n), u is the larger root of q u^2 + 4 h u + 2 h^2 - q R^2 = 0; then
 * arc = u + h, outer = R - u, inner = R + u (docs/physics.md). u < 0: the arcs overhang. */
struct mill_profile mill_lining_profile(int buckles, double radius, double height, double angle);

/* The middle of the side from a to b; the bulge of a becomes that of both halves. */
struct mill_corner mill_lining_halve(struct mill_corner *a, const struct mill_corner *b);

/* [m^2] The area within a contour of `n` corners; < 0: it is clockwise */
double mill_lining_area(const struct mill_corner *corner, size_t n);

/* Does a contour cross or touch itself? Then *at: the corners at which two such sides begin */
bool mill_lining_crosses(const struct mill_corner *corner, size_t n, size_t at[2]);

#endif
