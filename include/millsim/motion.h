/* Motions: what carries the bodies of a mill. A motion gives the pose of its frame at any time, and
 * bounds of how fast that changes, which certify the search for contacts. Motions may ride on
 * others. */
#ifndef MILLSIM_MOTION_H
#define MILLSIM_MOTION_H

#include "millsim/pose.h"

#include <stddef.h>

struct mill_motion;

/* Of a frame and of one point fixed in it: at most, at any time */
struct mill_motion_bounds {
    vec3 home;           /* [m] place in the carrier's frame */
    double far;          /* [m] from which the point is never farther */
    double speed;        /* [m/s] of the point */
    double acceleration; /* [m/s^2] of the point */
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
    struct mill_motion_bounds (*bounds)(const struct mill_motion *, vec3 point);
    /* Takes a point and its velocity from this frame to the carrier's: what the pose says of one
     * point, by fewer operations. NULL: by the pose. */
    void (*carry)(const struct mill_motion *, double t, vec3 *point, vec3 *velocity);
    /* [s] after which it repeats; INFINITY: it stands still */
    double (*period)(const struct mill_motion *);
    /* The line about which it turns; false: there is none. NULL: there never is. */
    bool (*axis)(const struct mill_motion *, vec3 *through, vec3 *direction);
    /* Local time 0 is simulated time `base` [s] from now on, `by` later than it was. Phases are
     * reduced anew from the base, so that they stay exact however long a run is. */
    void (*restart)(struct mill_motion *, double base, double by);
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

/* A swing about an axis through `centre`, right-handed: the angle is amplitude
 * sin(2 pi frequency t + phase). */
struct mill_swing {
    vec3 centre, axis;                  /* [m]; need not be of length 1 */
    double amplitude, frequency, phase; /* [rad], [1/s], [rad] */
};
extern const struct mill_motion_type mill_swing_type;

/* To and fro without turning: x_k = amplitude_k sin(2 pi frequency t + phase_k) */
struct mill_shift {
    vec3 amplitude, phase; /* [m], [rad] */
    double frequency;      /* [1/s] */
};
extern const struct mill_motion_type mill_shift_type;

/* A measured motion: a periodic cubic spline through rows `t x y z rx ry rz`, r a rotation vector;
 * a point p of the frame is at R(r) p + (x, y, z). The last row repeats the first. */
struct mill_table {
    size_t rows;
    const double (*row)[7]; /* [s], [m], [rad]; t ascends */
};
extern const struct mill_motion_type mill_table_type;

/* The pose in the laboratory at local time t [s]; motion NULL: what stands still. */
struct mill_pose mill_motion_pose(const struct mill_motion *motion, double t);

/* [m] Where a point of the motion's frame is in the laboratory, and how fast [m/s]: of that pose */
vec3 mill_motion_point(const struct mill_motion *motion, double t, vec3 point, vec3 *velocity);

/* [m] Where a place of the laboratory is in the motion's frame then */
vec3 mill_motion_place(const struct mill_motion *motion, double t, vec3 place);

/* Bounds of the pose at any time, for a point of the motion's frame; home and axis are the
 * laboratory's. */
struct mill_motion_bounds mill_motion_bounds(const struct mill_motion *motion, vec3 point);

/* Where balls may be: a box of the laboratory, and of it no more than a cylinder about its x axis
 */
struct mill_reach {
    vec3 lo, hi;   /* [m] */
    double radius; /* [m] INFINITY: the whole box */
};

/* [m] No such place is ever farther from the motion's axis or, where there is none that stands
 * still, from the frame's origin. */
double mill_motion_reach(const struct mill_motion *motion, const struct mill_reach *places);

/* A plane across this direction of the motion's frame stays where it is: all turns are about it. */
bool mill_motion_keeps(const struct mill_motion *motion, vec3 direction);

/* The innermost motion of the chain that moves the point: further in all turn about it, and it has
 * the same coordinates there. NULL: it stands still. */
const struct mill_motion *mill_motion_that_moves(const struct mill_motion *motion, vec3 point);

/* The shortest time after which motions repeat, to 1e-9 of it */
struct mill_motion_cycle {
    double period; /* [s] INFINITY: all stand still */
    double single; /* [s] the longest period of a single one */
    int singles;   /* in the period; 0: there are more than a thousand, and period is single */
};

/* Of `count` motions with all that carry them; those that are NULL stand still. */
struct mill_motion_cycle mill_motion_cycle(struct mill_motion *const *motion, int count);

#endif
