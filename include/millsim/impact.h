/* The contact law: Walton's rough spheres (physics.md: equations of the contact law). */
#ifndef MILLSIM_IMPACT_H
#define MILLSIM_IMPACT_H

#include "millsim/kinds.h"
#include "millsim/vec3.h"

#include <stdbool.h>

struct mill_law {
    double restitution; /* e_n, 0..1 */
    double friction;    /* Coulomb's mu, >= 0 */
    double tangential;  /* beta0 of a sticking contact, -1..1 */
};

enum { MILL_FALL_POINTS = 16 };

/* How the restitution of a kind of contact falls with the normal speed */
struct mill_fall {
    /* 0: it does not. 1: that of viscoelastic spheres (Kuwabara & Kono, Jpn. J. Appl. Phys. 26
     * (1987) 1230) through this point. More: linear between the points, constant outside. */
    int points;
    double speed[MILL_FALL_POINTS]; /* [m/s] ascending; that of a single point is positive */
    double restitution[MILL_FALL_POINTS];
    double loss; /* mill_impact_loss of a single point; 0: it is computed when needed */
};

/* The restitution at a normal speed [m/s]; at a negative one that of speed 0. fall->points > 0 */
double mill_impact_restitution(const struct mill_fall *fall, double normal_speed);

/* By how much viscoelastic spheres with this restitution are damped */
double mill_impact_loss(double restitution);

struct mill_rebound {
    vec3 impulse;              /* [N s] taken from body 1, given to body 2 */
    double normal_speed;       /* [m/s] approach speed just before, >= 0 */
    double tangential_speed;   /* [m/s] slip of the surfaces just before */
    double dissipation;        /* [J] all of it; negative if the rebound floor adds energy */
    double dissipation_normal; /* [J] its normal part */
    bool floored;              /* the rebound floor acted */
    bool slid;                 /* Coulomb's bound acted: the contact did not stick */
};

/* Computes one impact. n: unit normal from body 1 to body 2. slip: velocity of the surface of body
 * 1 relative to that of body 2 at the contact [m/s]. reduced_mass: m1 m2/(m1 + m2), or the mass of
 * the ball at a wall [kg]. rebound_floor [m/s]: minimum normal speed after the impact. Bodies are
 * uniform spheres or immovable. Without friction there is no tangential impulse. */
struct mill_rebound mill_impact_resolve(const struct mill_law *law, double rebound_floor,
                                        double reduced_mass, vec3 n, vec3 slip);

/* [s] The time for which two elastic spheres of steel touch when they meet with this normal speed
 * [m/s]: 2.87 (m^2 / (r E^2 v))^(1/5) (Hertz 1882; Landau & Lifshitz, Theory of Elasticity, section
 * 9). E = 1.15e11 Pa is the reduced modulus of steel on steel. At a wall, the reduced mass [kg] and
 * radius [m] are the values of the ball. The impacts of hard spheres take no time; where this
 * duration matters, the model is not valid. */
#define MILL_IMPACT_SLOW 0.1 /* [m/s] the speed in a dense bed */
double mill_impact_duration(double reduced_mass, double reduced_radius, double normal_speed);

/* [N] The force that presses a steel sphere into steel by this depth [m]: 4/3 E r^(1/2) d^(3/2) */
double mill_impact_force(double radius, double depth);

#endif
