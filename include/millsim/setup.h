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
    int rides; /* 1 + the motion that carries it, whose x its axis is then; 0: it stands still */
};

struct mill_setup_motion {
    const struct mill_motion_type *type;
    const void *form; /* what the type takes: &(struct mill_turn){...} */
    int on;           /* the motion that carries it, an earlier one of the list; MILL_STILL: none */
    const char *name; /* "rotor": results are told of it apart; NULL: so is the first one */
};
enum { MILL_STILL = -1 };

/* A surface within the container, or the container: a body that the balls are inside of */
struct mill_setup_surface {
    const struct mill_shape_type *type;
    const void *form; /* what the type takes: &(struct mill_blade){...} */
    int number;       /* which of its kind, from 0; -1: the only one */
    int motion;       /* that carries it; MILL_STILL: none */
    int kind; /* of its contacts: MILL_KINDS + its place in the setup's list; 0: of its type */
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

/* A body, met from outside or from inside, at a place in its motion's frame */
struct mill_body {
    bool inside;            /* it holds the balls */
    vec3 centre, x, y, z;   /* [m]; its own axes: unit, orthogonal, right-handed */
    vec3 size;              /* [m] of a box, along these */
    double radius;          /* [m] of round ones; of a cone at z = -length / 2 */
    double end_radius;      /* [m] of a cone at z = length / 2 */
    double length;          /* [m] along z; of a capsule without its round ends */
    double rounding;        /* [m] radius of rounded edges: shrunk by it and grown again as far */
    size_t facets;          /* of a mesh: closed, corners counter-clockwise seen from outside it */
    const vec3 (*facet)[3]; /* [m] in its own frame */
};
extern const struct mill_shape_type mill_box_type, mill_round_cylinder_type, mill_round_cone_type,
    mill_round_capsule_type, mill_round_sphere_type, mill_facets_type;

struct mill_setup {
    vec3 gravity;                /* [m/s^2] */
    struct mill_setup_drum drum; /* radius 0: there is none, and one of the surfaces is it */
    int motions;
    const struct mill_setup_motion *motion;
    int surfaces;
    const struct mill_setup_surface *surface;
    int species;
    const struct mill_setup_balls *balls; /* [species] */
    const struct mill_setup_ball *start;  /* of all balls, species by species; NULL: random */
    double speed;                         /* [m/s] of every ball of a random start */
    bool at_rest;       /* a random start in a moving container: it is not carried along with it */
    unsigned long seed; /* of a random start */
    int kinds;          /* of contact, beyond the MILL_KINDS of every mill */
    const char *const *kind;              /* [kinds] their names, without "ball_" */
    struct mill_law law[MILL_KINDS_MOST]; /* of each kind of contact; zeros: no rebound */
    double rebound_floor; /* [m/s] least normal speed after any contact; at 0 time may stand still
                             where inelastic balls rest, and the run fails */
    double horizon;       /* [s] how long motions without a common period are checked for clashes of
                             what they carry; 0: 1 s */
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
    MILL_FAULT_SURFACE, /* surface `other` is not within the drum, or a shaft about another axis */
    MILL_FAULT_CONTAINER, /* there is none, or more than one */
    MILL_FAULT_OUTSIDE, /* surface `other` leaves the container at `when` [s], by `amount` [m] if it
                           is outside then */
    MILL_FAULT_CLASH    /* surfaces `ball` and `other`, of different motions, meet at `when` */
};

enum { MILL_FAULT_SPECIES = 64 }; /* told at most */

/* Two surfaces of different motions that pass each other, as the check for clashes saw them */
struct mill_passing {
    int32_t one, other; /* their numbers; other -1: the drum */
    double gap, when;   /* [m] to some 10 % of it, [s] */
};

struct mill_fault {
    enum mill_fault_code code;
    /* Where nothing is wrong: */
    struct mill_passing narrowest; /* gap INFINITY: there is none */
    struct mill_passing unchecked; /* from `when` on nobody has looked; INFINITY: all are checked */
    int32_t ball, other;
    int kind;
    double amount, when;
    int32_t fits[MILL_FAULT_SPECIES]; /* balls of each species that fit; all 0: none is known */
};

/* The code in words: "two balls overlap at the start" */
const char *mill_setup_fault_text(enum mill_fault_code code);

#endif
