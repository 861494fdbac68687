/* Motions: what carries the bodies of a mill. A motion gives the pose of its frame at any time, and
 * bounds of how fast that changes, which certify the search for contacts. Motions may ride on
 * others. */
#ifndef MILLSIM_MOTION_H
#define MILLSIM_MOTION_H

#include "millsim/pose.h"

struct mill_motion;

/* At most, at any time */
struct mill_motion_bounds {
    double far;          /* [m] from the carrier's origin to the frame's */
    double speed;        /* [m/s] of the frame's origin */
    double acceleration; /* [m/s^2] of the origin */
    double turning;      /* [rad/s] length of the angular velocity */
    double spin_up;      /* [rad/s^2] of its change */
    vec3 axis;           /* unit: the angular velocity keeps this direction; 0: it does not */
};

/* A kind of motion; a new one is one file with one of these. */
struct mill_motion_type {
    /* Do these numbers, a struct of this kind, make a motion? */
    bool (*is_sound)(const void *form);
    /* form: sound numbers. NULL: out of memory. Owner: the caller; free(). */
    struct mill_motion *(*create)(const void *form);
    /* Both in the carrier's frame; t: local time [s] */
    struct mill_pose (*pose)(const struct mill_motion *, double t);
    struct mill_motion_bounds (*bounds)(const struct mill_motion *);
    /* Local time restarts: what was time t is 0 from now on. Angles stay reduced. */
    void (*restart)(struct mill_motion *, double t);
};

/* Every motion starts with this. */
struct mill_motion {
    const struct mill_motion_type *type;
    const struct mill_motion *on; /* what carries it; NULL: the laboratory */
    int number;                   /* in the mill's list */
};

/* A turn at constant speed about an axis through `centre`, right-handed: angle + speed t. */
struct mill_turn {
    vec3 centre, axis;   /* [m]; need not be of length 1 */
    double speed, angle; /* [rad/s]; [rad] at t = 0 */
};
extern const struct mill_motion_type mill_turn_type;

/* The pose in the laboratory at local time t [s]; motion NULL: what stands still. */
struct mill_pose mill_motion_pose(const struct mill_motion *motion, double t);

/* Bounds of the same at any time; the axis is the laboratory's. */
struct mill_motion_bounds mill_motion_bounds(const struct mill_motion *motion);

/* [m] No place of a cylinder about the laboratory's x axis is ever farther from the motion's axis
 * or, where that is not the same, from the frame's origin. */
double mill_motion_reach(const struct mill_motion *motion, double radius, double half_length);

#endif
