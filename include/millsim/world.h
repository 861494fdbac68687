/* The state of the mill between two events, with its account. Observers get it as const. */
#ifndef MILLSIM_WORLD_H
#define MILLSIM_WORLD_H

#include "millsim/impact.h"
#include "millsim/motion.h"
#include "millsim/poly.h"
#include "millsim/soft.h"
#include "millsim/status.h"

#include <stdint.h>

/* The record that is read most often: one cache line. At its own time t the ball is at r with
 * velocity v; then it flies freely. A ball that is asleep stays at r. */
struct mill_ball {
    vec3 r, v;         /* [m], [m/s] */
    double t;          /* [s] local time of r and v; HUGE_VAL: it is asleep, and v is zero */
    uint32_t contacts; /* so far, modulo 2^32; a change shows that a plan is stale */
    int16_t species;
    int16_t relief; /* enum mill_relief */
};

/* In a relief, a ball that was pinched ignores bodies that can pinch, until it is clear of them. */
enum mill_relief {
    MILL_RELIEF_NONE,
    MILL_RELIEF_LASTS,
    MILL_RELIEF_ENDS /* only within the event that finds the ball clear */
};

struct mill_species {
    char name[64];
    double radius, mass, inertia; /* [m], [kg], [kg m^2] about any diameter */
};

/* Impacts with at least these normal speeds [m/s] are fast. They are counted separately, because
 * rates of fast impacts get a standard error, which needs counts per block. */
enum { MILL_WORLD_FAST = 3 };
extern const double mill_world_fast[MILL_WORLD_FAST];

/* Results of impacts do not depend on the rebound floor from so many floors on; a floor that
 * follows from the mill keeps this below a speed [m/s]. */
#define MILL_WORLD_FLOORS 6.0
#define MILL_WORLD_SLOW 0.2

enum { MILL_MOTIONS_MOST = 16 }; /* in one mill */

/* Sums since t = 0, the counts last. Work = change of energy + dissipation + elastic energy. A
 * motion's own work is that of the velocity that it alone adds, at contacts of all bodies that it
 * moves. */
struct mill_account {
    double work;        /* [J] done on the balls by all motions */
    double work_gross;  /* [J] sum of |work| of the single impacts */
    double pinch_work;  /* [J] part of work: on pressed balls */
    double bridge_work; /* [J] part of work, at most: on pairs that bridge sliding surfaces */
    struct {
        double work;    /* [J] */
        double impulse; /* [N m s] angular impulse about its axis, given to the balls; 0: no axis */
    } motion[MILL_MOTIONS_MOST];
    double dissipation[MILL_KINDS_MOST];        /* [J] all of it */
    double dissipation_normal[MILL_KINDS_MOST]; /* [J] its normal part */
    double dissipation_gross;                   /* [J] sum of |dissipation| */
    double elastic;                             /* [J] in the springs of soft spheres now */
    double incident; /* [J] sum of the energies of normal approach, m* v_n^2 / 2 */
    uint64_t collisions[MILL_KINDS_MOST];
    uint64_t floored[MILL_KINDS_MOST];               /* at the rebound floor */
    uint64_t fast[MILL_KINDS_MOST][MILL_WORLD_FAST]; /* at these speeds or above */
};

struct mill_counts {
    uint64_t cell_crossings;
    uint64_t stale; /* discarded events: the partner had another contact, or a search continues */
    uint64_t predictions; /* plans over all cells around the ball */
    uint64_t pair_tests;
    uint64_t not_closing; /* anomaly: the gap of a due contact was opening; the floor was applied */
    uint64_t bridges;     /* pairs between sliding surfaces that gave way */
    uint64_t pinch_contacts; /* contacts of pressed balls, not counted as impacts */
    uint64_t reliefs;        /* anomaly: balls let go that a moving body had pinched */
    uint64_t smoothed;       /* anomaly: contacts computed without friction */
    uint64_t overlaps;       /* anomaly: balls found more than 1e-9 m deep in another body */
    int64_t asleep;          /* balls that are asleep now */
    double pinch_time;       /* [s] sum of the times in which balls were pressed */
    double sleep; /* [s] sum of the times for which balls were asleep, until this epoch */
    struct mill_poly_counts quartics;
    double largest_overlap; /* [m] of all contacts and audits */
};

/* Adds another account to `all`. */
void mill_world_add_account(struct mill_account *all, const struct mill_account *account);

/* Adds counts of other events to `all`. */
void mill_world_add_counts(struct mill_counts *all, const struct mill_counts *counts);

struct mill_energy {
    double kinetic, rotational, potential; /* [J]; the potential energy is 0 at the origin */
};

struct mill_shape;

enum { MILL_MOTION_NAME = 64 };

/* What holds the balls. The origin of its frame is its centre, and x is its axis. For a drum this
 * is the drum's frame. For a body, x, y and z of the frame are its own z, x and y axes. */
struct mill_container {
    const struct mill_motion *motion; /* the motion that moves it; NULL: none */
    /* The charge is steady in the frame of this motion: that of `motion`, or of its carrier, if the
     * container is round and only turns about its own axis there */
    const struct mill_motion *mapped;
    struct mill_pose frame;   /* in the frame of that motion */
    bool still;               /* the frame is always that of the laboratory */
    vec3 lo, hi;              /* [m] the box of the laboratory around it at t = 0 */
    struct mill_reach places; /* all places of the laboratory that it reaches */
    double volume;            /* [m^3] enclosed, including the bodies inside */
    double radius; /* [m] of the circle around its cross-section, without a drum's buckles */
    bool drum;     /* its cross-section is the same along x, between flat ends of another kind */
    /* [m] The length along x of a mill without end walls. Balls that leave it at one end enter it
     * at the other end. 0: the mill has ends. */
    double period;
};

struct mill_world {
    double base; /* [s] simulated time at local time 0; local times stay small, thus exact */
    vec3 g;
    int32_t balls;
    struct mill_ball *ball;
    vec3 *spin; /* [rad/s] */
    int species_count;
    struct mill_species *species;
    struct mill_container container;
    double drum_radius, drum_length; /* [m] of the cylinder around the container, about its axis */
    int motions;
    struct mill_motion **motion;
    char (*motion_name)[MILL_MOTION_NAME];
    int rotor;          /* number of the motion named "rotor", or -1 */
    double rotor_speed; /* [rad/s] about +x; 0: no rotor, or it does not turn */
    /* [s] after which all motions repeat. If that is more than 12 times the longest period of a
     * single motion: this longest period. INFINITY: nothing moves. */
    double period;
    int shapes;
    struct mill_shape **shape;
    struct mill_kinds kinds;
    struct mill_law law[MILL_KINDS_MOST];
    struct mill_fall fall[MILL_KINDS_MOST]; /* with points: in place of the law's restitution */
    double rebound_floor;                   /* [m/s] */
    struct mill_soft_setup soft;
    struct mill_soft_facts soft_facts;
    struct mill_energy start; /* at t = 0 */
    struct mill_account account;
    struct mill_counts counts;
};

void mill_world_free(struct mill_world *world);

/* Can contacts of this kind happen: has the mill a surface of it, or is it that of two balls? */
bool mill_world_has(const struct mill_world *world, int kind);

static inline const struct mill_species *mill_world_species(const struct mill_world *w, int32_t i)
{
    return &w->species[w->ball[i].species];
}

static inline double mill_world_radius(const struct mill_world *w, int32_t i)
{
    return mill_world_species(w, i)->radius;
}

/* [m] A coordinate along x, or a difference; in a periodic mill, of the image nearest to 0 */
static inline double mill_world_image(const struct mill_world *world, double x)
{
    const double period = world->container.period;
    return period > 0.0 && fabs(x) > 0.5 * period ? x - copysign(period, x) : x;
}

/* [s] length of an epoch, after which local time restarts: a power of two, for exact sums */
#define MILL_WORLD_EPOCH 0.0625

/* Begins a new epoch at local time MILL_WORLD_EPOCH: sets base and the motions to the new local
 * time. The caller converts the times of the balls. */
void mill_world_restart(struct mill_world *world);

/* Is the ball asleep (docs/design.md)? */
static inline bool mill_world_asleep(const struct mill_world *world, int32_t i)
{
    return world->ball[i].t == HUGE_VAL;
}

/* [s] for which a ball has flown since its own time until local time t; 0: it is asleep */
static inline double mill_world_flown(const struct mill_ball *ball, double t)
{
    return ball->t < HUGE_VAL ? t - ball->t : 0.0;
}

/* Position [m] and velocity [m/s] of ball i at local time t >= its own time. */
vec3 mill_world_position(const struct mill_world *world, int32_t i, double t);
vec3 mill_world_velocity(const struct mill_world *world, int32_t i, double t);

/* Energies of all balls at local time t. */
struct mill_energy mill_world_energy(const struct mill_world *world, double t);

/* The container's frame at local time t; and the one in which the charge is steady: without a turn
 * of a round container about its own axis */
struct mill_pose mill_world_frame(const struct mill_world *world, double t);
struct mill_pose mill_world_steady_frame(const struct mill_world *world, double t);

/* [J] until local time t: |work - change of energy - dissipation|, and the energy turned over */
void mill_world_balance(const struct mill_world *world, double t, double *error, double *turnover);

#endif
