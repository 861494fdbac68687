/* Soft spheres: the same mill, with contacts that last. Springs and dashpots press balls and
 * surfaces apart, in time steps that are a fraction of the shortest contact. It is the check of the
 * hard spheres, and the answer for mills that they do not describe (docs/physics.md). */
#ifndef MILLSIM_SOFT_H
#define MILLSIM_SOFT_H

#include <stdint.h>

/* What is asked for */
struct mill_soft_setup {
    int on;         /* 1: the balls are soft spheres */
    int hertz;      /* 1: forces grow as depth^1.5 (Hertz); 0: as the depth */
    double modulus; /* [Pa] Young's modulus of all bodies; Poisson's ratio is 0.3 */
    long steps;     /* in the duration of the shortest contact */
};

/* What a run of soft spheres tells of itself */
struct mill_soft_facts {
    double step;       /* [s] */
    double duration;   /* [s] of the shortest contact */
    double speed;      /* [m/s] of the fastest surface: here linear springs equal Hertz' law */
    double force;      /* [N] greatest of all contacts so far */
    uint64_t steps;    /* so far */
    uint64_t contacts; /* begun so far */
    uint64_t crowded;  /* of these: a ball had another contact at the same time */
};

#endif
