/* Motions: they move the bodies of a mill. A motion gives the pose of its frame at any time, and
 * upper bounds of its speeds and accelerations. The certified search for contacts needs these
 * bounds. A motion can be on another motion, its carrier. */
#ifndef MILLSIM_MOTION_H
#define MILLSIM_MOTION_H

#include "millsim/pose.h"

#include <stddef.h>

struct mill_motion;

/* Upper bounds, valid at all times, for a frame and one point fixed in it */
struct mill_motion_bounds {
    vec3 home;           /* [m] a fixed place in the carrier's frame */
    double far;          /* [m] maximum distance of the point from home */
    double speed;        /* [m/s] of the point */
    double acceleration; /* [m/s^2] of the point */
    double turning;      /* [rad/s] length of the angular velocity */
    double spin_up;      /* [rad/s^2] rate of change of the angular velocity */
    vec3 axis; /* unit: the constant direction of the angular velocity; 0: the direction is not
                  constant */
};

/* A kind of motion. To add a kind, write one file with one of these tables. */
struct mill_motion_type {
    /* Do these numbers, a struct of this kind, describe a valid motion? */
    bool (*is_sound)(const void *form);
    /* form: valid numbers. NULL: out of memory. Owner: the caller; free(). */
    struct mill_motion *(*create)(const void *form);
    /* Both results are in the carrier's frame; t: local time [s] */
    struct mill_pose (*pose)(const struct mill_motion *, double t);
    struct mill_motion_bounds (*bounds)(const struct mill_motion *, vec3 point);
    /* Local time is reset: local time 0 is now the simulated time `base` [s], which is `by` [s]
     * later than before. Phases are computed from the base, exact in a run of any length. */
    void (*restart)(struct mill_motion *, double base, double by);
    /* Converts a point and its velocity from this frame to the carrier's frame. The result equals
     * that of the pose, with fewer operations. NULL: the pose is used. */
    void (*carry)(const struct mill_motion *, double t, vec3 *point, vec3 *velocity);
};

/* Every motion starts with this. */
struct mill_motion {
    const struct mill_motion_type *type;
    const struct mill_motion *on; /* its carrier; NULL: the laboratory */
    int number;                   /* in the mill's list */
    double period;                /* [s] after which it repeats; INFINITY: it does not move */
    bool axial;                   /* it turns about a line of the carrier's frame: */
    vec3 through, axis;           /* [m], unit */
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

/* A shift to and fro without rotation: x_k = amplitude_k sin(2 pi frequency t + phase_k) */
struct mill_shift {
    vec3 amplitude, phase; /* [m], [rad] */
    double frequency;      /* [1/s] */
};
extern const struct mill_motion_type mill_shift_type;

/* A measured motion: a periodic cubic spline through rows `t x y z rx ry rz`, where r is a rotation
 * vector. A point p of the frame is at R(r) p + (x, y, z). The last row repeats the first; if all r
 * are along one axis, it may be whole turns further. */
struct mill_table {
    size_t rows;
    const double (*row)[7]; /* [s], [m], [rad]; t ascends */
};
extern const struct mill_motion_type mill_table_type;

/* The pose in the laboratory at local time t [s]; motion NULL: the pose of what does not move. */
struct mill_pose mill_motion_pose(const struct mill_motion *motion, double t);

/* [m] The place in the laboratory of a point of the motion's frame; its velocity [m/s] */
vec3 mill_motion_point(const struct mill_motion *motion, double t, vec3 point, vec3 *velocity);

/* Bounds, valid at all times, for a point of the motion's frame; of the laboratory */
struct mill_motion_bounds mill_motion_bounds(const struct mill_motion *motion, vec3 point);

/* [m] A place of the laboratory in the motion's frame, at local time t; motion NULL: the same */
vec3 mill_motion_in(const struct mill_motion *motion, double t, vec3 place);

/* Where balls may be: the part of a box that is inside a cylinder about the laboratory's x axis */
struct mill_reach {
    vec3 lo, hi;   /* [m] */
    double radius; /* [m] INFINITY: the whole box */
};

/* [m] The maximum distance, at all times, of these places from the motion's axis, or from the
 * origin of its frame if it has no axis at rest. */
double mill_motion_reach(const struct mill_motion *motion, const struct mill_reach *places);

/* [m/s] Nothing that the motion moves is ever faster at these places. */
double mill_motion_fastest(const struct mill_motion *motion, const struct mill_reach *places);

/* True if a plane normal to this direction of the motion's frame does not move: the motion and its
 * carriers only turn about this direction. */
bool mill_motion_keeps(const struct mill_motion *motion, vec3 direction);

/* The innermost motion of the chain of carriers that moves the point. The motions further in all
 * turn about the point, which has the same coordinates there. NULL: none */
const struct mill_motion *mill_motion_that_moves(const struct mill_motion *motion, vec3 point);

/* The shortest time after which all motions repeat, to a relative accuracy of 1e-9 */
struct mill_motion_cycle {
    double period; /* [s] INFINITY: no motion moves */
    double single; /* [s] the longest period of a single motion */
    int singles;   /* how many in the period; 0: over a thousand, and period is single */
};

/* For `count` motions with all their carriers; an entry may be NULL: it does not move. */
struct mill_motion_cycle mill_motion_cycle(struct mill_motion *const *motion, int count);

#endif
