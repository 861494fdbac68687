/* The cross-section of the wavy drum (Reichardt & Wiechert 2007, figure 6): 2n circular arcs of one
 * radius that curve alternately outwards and inwards and are tangent where they meet. This file
 * only computes numbers: the places of the arcs, the enclosed area, the possible heights. */
#ifndef MILLSIM_PROFILE_H
#define MILLSIM_PROFILE_H

#include <stdbool.h>

/* Outer arcs (curved away from the axis) have their centres at distance `outer` from the axis, in
 * the directions angle + 2 pi k / n. Inner arcs have theirs at distance `inner`, half a pitch
 * further. An arc ends where the line from its centre to the centre of the next arc crosses it, in
 * the middle between the two. */
struct mill_profile {
    int buckles;   /* n: there are n outer and n inner arcs */
    double radius; /* [m] mean of the extreme radii */
    double height; /* [m] h: the extreme radii are radius + h and radius - h */
    double angle;  /* [rad] of one outermost point */
    double arc;    /* [m] radius of every arc */
    double outer, inner;
    double half_outer, half_inner; /* [rad] half of the angle of an arc, at its centre */
};

/* buckles >= 2, 0 <= height < radius. For height 0 the profile is a circle, made of n arcs around
 * the axis. With q = 1 - cos(pi/n), u is the larger root of q u^2 + 4 h u + 2 h^2 - q R^2 = 0; then
 * arc = u + h, outer = R - u, inner = R + u (docs/physics.md). For h > R sin(pi/2n), u is negative
 * and the arcs overhang. */
struct mill_profile mill_profile_make(int buckles, double radius, double height, double angle);

/* Is the profile valid: do neighbouring arcs leave room for each other, so that they enclose an
 * area? */
bool mill_profile_is_sound(const struct mill_profile *profile);

#endif
