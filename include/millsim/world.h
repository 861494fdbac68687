/* The state of the mill between two events, with its account. Observers get it const. */
#ifndef MILLSIM_WORLD_H
#define MILLSIM_WORLD_H

#include "millsim/impact.h"
#include "millsim/motion.h"
#include "millsim/poly.h"
#include "millsim/status.h"

#include <stdint.h>

/* The hot record: one cache line. The ball is at r with v at its own time t and flies on freely. */
struct mill_ball {
    vec3 r, v;         /* [m], [m/s] */
    double t;          /* [s] local time of these */
    uint32_t contacts; /* so far, modulo 2^32: tells a stale prediction */
    int32_t species;
};

struct mill_species {
    char name[64];
    double radius, mass, inertia; /* [m], [kg], [kg m^2] about any diameter */
};

/* Impacts are fast from these normal speeds on [m/s]: counted apart, because rates of fast impacts
 * need an error, and that needs them block by block */
enum { MILL_WORLD_FAST = 3 };
extern const double mill_world_fast[MILL_WORLD_FAST];

enum { MILL_MOTIONS_MOST = 16 }; /* of a mill */

/* Cumulative since t = 0. Work = change of energy + dissipation. A motion's own part of the work is
 * what its own velocity does at the contacts of all that it carries. */
struct mill_account {
    double work;       /* [J] done on the balls by all motions */
    double work_gross; /* [J] sum of |work| of the single impacts */
    double pinch_work; /* [J] of it: on balls that were pressed */
    struct {
        double work;    /* [J] */
        double impulse; /* [N m s] angular impulse about its axis given to the balls; 0: no axis */
    } motion[MILL_MOTIONS_MOST];
    double dissipation[MILL_KINDS_MOST];        /* [J] all of it */
    double dissipation_normal[MILL_KINDS_MOST]; /* [J] its normal part */
    double dissipation_gross;                   /* [J] sum of |dissipation| */
    double incident; /* [J] sum of the energies of normal approach, m* v_n^2 / 2 */
    uint64_t collisions[MILL_KINDS_MOST];
    uint64_t floored[MILL_KINDS_MOST];               /* of these: the rebound floor acted */
    uint64_t fast[MILL_KINDS_MOST][MILL_WORLD_FAST]; /* and: at or above mill_world_fast */
};

struct mill_counts {
    uint64_t cell_crossings;
    uint64_t stale; /* events dropped: the partner had changed course, or a search is to go on */
    uint64_t predictions; /* full ones */
    uint64_t pair_tests;
    uint64_t not_closing; /* anomaly: a due contact found itself opening; the floor was applied */
    uint64_t pinch_contacts; /* contacts of balls while they were pressed: of no impact's count */
    double pinch_time;       /* [s] in which balls were pressed, added up */
    uint64_t reliefs;        /* anomaly: balls let go that a moving body pinched */
    uint64_t smoothed;       /* anomaly: contacts made frictionless because time stood still */
    uint64_t overlaps;       /* anomaly: balls found deeper than 1e-9 m in another body */
    struct mill_poly_counts quartics;
    double largest_overlap; /* [m] ever seen at a contact or an audit */
};

struct mill_energy {
    double kinetic, rotational, potential; /* [J]; the last 0 for a ball at the origin */
};

struct mill_shape;

enum { MILL_MOTION_NAME = 64 };

/* What holds the balls. Its frame has the origin at its centre and x along its axis, as a drum's;
 * of a body that is its own z, and its own x and y are the frame's y and z. */
struct mill_container {
    const struct mill_motion *motion; /* that carries it; NULL: it stands still */
    struct mill_pose frame;           /* in the frame of that motion */
    bool still;                       /* the frame is and stays the laboratory's */
    vec3 lo, hi;                      /* [m] the box of the laboratory that it is in at t = 0 */
    struct mill_reach places;         /* of the laboratory that it ever comes into */
    double volume;                    /* [m^3] that it encloses, whatever stands in it */
};

struct mill_world {
    double base; /* [s] simulated time at local time 0: local times stay small and exact */
    vec3 g;
    int32_t balls;
    struct mill_ball *ball;
    vec3 *spin; /* [rad/s] */
    int species_count;
    struct mill_species *species;
    struct mill_container container;
    double drum_radius, drum_length; /* [m] of the cylinder about the container's axis around it */
    int motions;
    struct mill_motion **motion;
    char (*motion_name)[MILL_MOTION_NAME];
    int rotor;          /* the motion of this name, or -1 */
    double rotor_speed; /* [rad/s] about +x; 0: no rotor or standing */
    double period; /* [s] after which all motions repeat, if that is within 12 of the longest of
                      theirs, or else that; INFINITY: all stand */
    int shapes;
    struct mill_shape **shape;
    struct mill_kinds kinds;
    struct mill_law law[MILL_KINDS_MOST];
    double rebound_floor;     /* [m/s] */
    struct mill_energy start; /* at t = 0 */
    struct mill_account account;
    struct mill_counts counts;
};

void mill_world_free(struct mill_world *world);

/* [s] between restarts of local time; a power of two, so that the sum is exact */
#define MILL_WORLD_EPOCH 0.0625

/* Local time, of motions too, begins anew at local time MILL_WORLD_EPOCH; the balls are the
 * caller's.
 */
void mill_world_restart(struct mill_world *world);

/* Where ball i is, and how fast, at local time t >= its own time. */
vec3 mill_world_position(const struct mill_world *world, int32_t i, double t);
vec3 mill_world_velocity(const struct mill_world *world, int32_t i, double t);

/* Energies of all balls at local time t. */
struct mill_energy mill_world_energy(const struct mill_world *world, double t);

/* The container's frame at local time t, and where a place of the laboratory is in it [m] */
struct mill_pose mill_world_frame(const struct mill_world *world, double t);
vec3 mill_world_place(const struct mill_world *world, vec3 position, double t);

/* [J] |work - change of energy - dissipation|, the energy turned over until local time t. */
void mill_world_balance(const struct mill_world *world, double t, double *error, double *turnover);

#endif
