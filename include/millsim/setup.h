/* A mill as plain numbers: what a world is built from. A deck is one way to fill it in; a program
 * that links libmillsim is another. SI units throughout. */
#ifndef MILLSIM_SETUP_H
#define MILLSIM_SETUP_H

#include "millsim/impact.h"
#include "millsim/motion.h"

#include <stdint.h>

/* Balls of one kind */
struct mill_setup_balls {
    const char *name;
    double diameter, density; /* [m], [kg/m^3] */
    int32_t count;
};

/* One ball as it starts */
struct mill_setup_ball {
    vec3 position, velocity, spin; /* [m], [m/s], [rad/s] */
};

/* The drum with its two flat end walls. Its axis is x, its centre the origin. */
struct mill_setup_drum {
    double radius, length; /* [m] inner ones */
    int buckles;           /* of a wavy profile; 0: a circle */
    double buckle_height;  /* [m] the wall lies between radius - buckle_height and radius + it */
    double buckle_angle;   /* [rad] of one outermost point, from +y towards +z */
};

struct mill_setup_motion {
    const struct mill_motion_type *type;
    const void *form; /* what the type takes: &(struct mill_turn){...} */
    int on;           /* the motion that carries it, an earlier one of the list; MILL_STILL: none */
};
enum { MILL_STILL = -1 };

/* A surface within the drum */
struct mill_setup_surface {
    const struct mill_shape_type *type;
    const void *form; /* what the type takes: &(struct mill_blade){...} */
    int number;       /* which of its kind, from 0; -1: the only one */
    int motion;       /* that carries it; MILL_STILL: none */
};

/* A shaft from end wall to end wall, about the x axis of its motion's frame. */
struct mill_shaft {
    double radius; /* [m] */
};
extern const struct mill_shape_type mill_cylinder_shaft_type;

/* A box from the x axis of its motion's frame outwards, turned by `pitch` about its radial mid-line
 * (positive pitch turns the +x edge towards increasing angle). */
struct mill_blade {
    double position;         /* [m] x of its centre */
    double angle;            /* [rad] from +y towards +z */
    double tip_radius;       /* [m] */
    double width, thickness; /* [m] along and around the axis before pitching */
    double pitch;            /* [rad] */
};
extern const struct mill_shape_type mill_blade_type;

struct mill_setup {
    vec3 gravity; /* [m/s^2] */
    struct mill_setup_drum drum;
    int motions;
    const struct mill_setup_motion
        *motion; /* motion 0 is the rotor: a turn about x, for the results of the rotor */
    int surfaces;
    const struct mill_setup_surface *surface;
    int species;
    const struct mill_setup_balls *balls; /* [species] */
    const struct mill_setup_ball *start;  /* of all balls, species by species; NULL: random */
    double speed;                         /* [m/s] of every ball of a random start */
    unsigned long seed;                   /* of a random start */
    struct mill_law law[MILL_KINDS];      /* of each kind of contact; zeros: no rebound */
    double rebound_floor; /* [m/s] least normal speed after any contact; at 0 time may stand still
                             where inelastic balls rest, and the run fails */
};

/* What is wrong with a setup */
enum mill_fault_code {
    MILL_FAULT_NONE,
    MILL_FAULT_MEMORY,        /* there is not enough */
    MILL_FAULT_NUMBER,        /* a number is out of range or not finite */
    MILL_FAULT_SPEED,         /* `ball` starts faster than light */
    MILL_FAULT_BALL_IN_SHAPE, /* `ball` overlaps a surface of `kind` by `amount` [m] */
    MILL_FAULT_BALL_IN_BALL,  /* `ball` overlaps ball `other` by `amount` [m] */
    MILL_FAULT_NO_ROOM, /* the balls do not fit: they would fill the share `amount` of the free
                           volume; what `fits` does */
    MILL_FAULT_SURFACE  /* surface `other` is not within the drum, or a shaft about another axis */
};

enum { MILL_FAULT_SPECIES = 64 }; /* told at most */

struct mill_fault {
    enum mill_fault_code code;
    int32_t ball, other;
    enum mill_kind kind;
    double amount;
    int32_t fits[MILL_FAULT_SPECIES]; /* balls of each species that fit; all 0: none is known */
};

/* The code in words: "two balls overlap at the start" */
const char *mill_setup_fault_text(enum mill_fault_code code);

#endif
