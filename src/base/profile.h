/* The wavy drum's cross-section (Reichardt & Wiechert 2007, figure 6): 2n circular arcs of one
 * radius, alternately bulging outwards and inwards, tangent where they join. Numbers only: where
 * the arcs lie, what area they enclose, which heights there can be. */
#ifndef MILLSIM_PROFILE_H
#define MILLSIM_PROFILE_H

#include <stdbool.h>

/* Outer arcs (bulging away from the axis) are centred at distance `outer` from the axis in the
 * directions angle + 2 pi k / n, inner ones at distance `inner`, half a pitch further. An arc ends
 * where the line from its centre to the next one's crosses it, halfway between the two. */
struct mill_profile {
    int buckles;   /* n, the number of outer arcs and of inner ones */
    double radius; /* [m] mean of the extreme radii */
    double height; /* [m] h: these are radius + h and radius - h */
    double angle;  /* [rad] of one outermost point */
    double arc;    /* [m] radius of every arc */
    double outer, inner;
    double half_outer, half_inner; /* [rad] half of what an arc spans, seen from its centre */
};

/* buckles >= 2, 0 <= height < radius; height 0 is the circle, of n arcs around the axis itself.
 * Contract, section 3: with q = 1 - cos(pi/n), u is the larger root of
 * q u^2 + 4 h u + 2 h^2 - q R^2 = 0, and arc = u + h, outer = R - u, inner = R + u. It is negative
 * beyond h = R sin(pi/2n), where the arcs have come to overhang. */
struct mill_profile mill_profile_make(int buckles, double radius, double height, double angle);

/* Do neighbouring bulges leave each other room, so that the arcs are the boundary of something? */
bool mill_profile_is_sound(const struct mill_profile *profile);

/* [m] the height up to which (all lesser ones included) a profile is sound, at most the radius. */
double mill_profile_highest(int buckles, double radius);

/* [m^2] enclosed: the polygon of the centres, more by the outer sectors and less by the inner. */
double mill_profile_area(const struct mill_profile *profile);

#endif
