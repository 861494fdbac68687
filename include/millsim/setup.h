/* A mill as plain numbers, from which a world is built. The program fills it in from a deck; a
 * program that links libmillsim can fill it in itself. All units are SI. */
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

/* One ball at the start */
struct mill_setup_ball {
    vec3 position, velocity, spin; /* [m], [m/s], [rad/s] */
};

/* The drum with its two flat end walls. Its axis is x, its centre the origin. */
struct mill_setup_drum {
    double radius, length; /* [m] inner dimensions */
    int buckles;           /* of a wavy profile; 0: a circle */
    double buckle_height;  /* [m] the wall is between radius - buckle_height and radius +
                              buckle_height */
    double buckle_angle;   /* [rad] of one outermost point, from +y towards +z */
    /* 1 + the number of the motion that moves the drum, whose x axis is then the drum's axis; 0:
     * the drum does not move */
    int rides;
    /* It has no end walls: it is a slice of a long mill. Balls that leave it at one end enter it at
     * the other end. */
    bool periodic;
};

struct mill_setup_motion {
    const struct mill_motion_type *type;
    const void *form; /* struct of this type: &(struct mill_turn){...} */
    int on;           /* its carrier, an earlier motion of the list; MILL_STILL: none */
    const char *name; /* name of its results, for example "rotor"; NULL: "rotor" for the first
                         motion, no name for others */
};
enum { MILL_STILL = -1 };

/* A surface in the container, or the container itself: a body that has the balls inside */
struct mill_setup_surface {
    const struct mill_shape_type *type;
    const void *form; /* struct of this type: &(struct mill_blade){...} */
    int number;       /* its number among surfaces of its kind, from 0; -1: the only one */
    int motion;       /* the motion that moves it; MILL_STILL: none */
    int kind; /* of its contacts: MILL_KINDS + its index in the setup's list; 0: the kind of its
                 type */
};

/* A shaft from end wall to end wall, about the x axis of its motion's frame. */
struct mill_shaft {
    double radius; /* [m] */
};
extern const struct mill_shape_type mill_cylinder_shaft_type;

/* A box that points outwards from the x axis of its motion's frame, turned by `pitch` about its
 * radial centre line (positive pitch turns the +x edge towards increasing angle). */
struct mill_blade {
    double position;         /* [m] x of its centre */
    double angle;            /* [rad] from +y towards +z */
    double tip_radius;       /* [m] */
    double width, thickness; /* [m] along and around the axis, without the pitch */
    double pitch;            /* [rad] */
};
extern const struct mill_shape_type mill_blade_type;

/* A body at a place in its motion's frame. Balls meet it from outside or from inside. */
struct mill_body {
    bool inside;          /* the balls are inside it */
    vec3 centre, x, y, z; /* [m]; directions of its own axes: unit, orthogonal, right-handed */
    vec3 size;            /* [m] of a box, along these axes */
    double radius;        /* [m] of round bodies; of a cone: at z = -length / 2 */
    double end_radius;    /* [m] of a cone: at z = length / 2 */
    double length;        /* [m] along z; of a capsule: without its round ends */
    double rounding; /* [m] radius of the edges: the body is shrunk by it and then grown by it */
    size_t facets; /* number; the mesh is closed, its corners counter-clockwise seen from outside */
    const vec3 (*facet)[3]; /* [m] in its own frame */
};
extern const struct mill_shape_type mill_box_type, mill_round_cylinder_type, mill_round_cone_type,
    mill_round_capsule_type, mill_round_sphere_type, mill_facets_type;

struct mill_setup {
    vec3 gravity;                /* [m/s^2] */
    struct mill_setup_drum drum; /* radius 0: no drum; one of the surfaces is the container */
    int motions;
    const struct mill_setup_motion *motion;
    int surfaces;
    const struct mill_setup_surface *surface;
    int species;
    const struct mill_setup_balls *balls; /* [species] */
    const struct mill_setup_ball *start;  /* of all balls, species by species; NULL: random */
    double speed;                         /* [m/s] of every ball, for a random start */
    bool at_rest;       /* random start in a moving container: the balls do not move with it */
    unsigned long seed; /* of a random start */
    int kinds;          /* number of kinds of contact in addition to the MILL_KINDS of every mill */
    const char *const *kind;                /* [kinds] their names, without "ball_" */
    struct mill_law law[MILL_KINDS_MOST];   /* for each kind of contact; zeros: no rebound */
    struct mill_fall fall[MILL_KINDS_MOST]; /* with points: in place of the law's restitution */
    /* [m/s] minimum normal speed after any contact. With 0, inelastic balls at rest can have
     * infinitely many contacts in a finite time; then the run fails. */
    double rebound_floor;
    /* [s] Motions without a common period are checked for clashes of their bodies during this time;
     * 0: 1 s */
    double horizon;
};

/* What is wrong with a setup */
enum mill_fault_code {
    MILL_FAULT_NONE,
    MILL_FAULT_MEMORY,        /* not enough memory */
    MILL_FAULT_NUMBER,        /* a number is out of range or not finite */
    MILL_FAULT_SPEED,         /* `ball` starts faster than light */
    MILL_FAULT_BALL_IN_SHAPE, /* `ball` overlaps a surface of `kind` by `amount` [m] */
    MILL_FAULT_BALL_IN_BALL,  /* `ball` overlaps ball `other` by `amount` [m] */
    /* the balls do not fit: they would fill the fraction `amount` of the free volume; `fits`: how
     * many would fit */
    MILL_FAULT_NO_ROOM,
    MILL_FAULT_SURFACE,   /* surface `other` is not in the drum, or is a shaft on another axis */
    MILL_FAULT_CONTAINER, /* no container, or more than one */
    /* surface `other` leaves the container at `when` [s]; `amount` [m]: how far it is outside, if
     * it is outside at `when` */
    MILL_FAULT_OUTSIDE,
    MILL_FAULT_CLASH, /* surfaces `ball` and `other`, of different motions, meet at `when` */
    /* of a periodic drum: */
    MILL_FAULT_SHORT, /* its length is less than three diameters of a ball, `amount` [m] */
    MILL_FAULT_TILT,  /* gravity has a component along its axis */
    /* surface `other`, or the drum where this is -1, does not only turn about the drum's axis */
    MILL_FAULT_MOVES,
    /* surface `other` is nearer than a ball's radius, `amount` [m], to an end of the drum, and does
     * not reach from end to end with the same cross-section */
    MILL_FAULT_END,
    MILL_FAULT_BALL_OUTSIDE /* `ball` starts beyond an end, `amount` [m] from the middle */
};

enum { MILL_FAULT_SPECIES = 64 }; /* the maximum number in a fault */

/* Two surfaces of different motions that pass each other, found by the check for clashes */
struct mill_passing {
    int32_t one, other; /* their numbers; other -1: the drum */
    double gap, when;   /* [m] accurate to about 10 %, [s] */
};

struct mill_fault {
    enum mill_fault_code code;
    /* If nothing is wrong: */
    struct mill_passing narrowest; /* gap INFINITY: there is none */
    struct mill_passing unchecked; /* not checked from `when` on; INFINITY: fully checked */
    int32_t ball, other;
    int kind;
    double amount, when;
    int32_t fits[MILL_FAULT_SPECIES]; /* balls of each species that would fit; all 0: not known */
};

/* The code in words: "two balls overlap at the start" */
const char *mill_setup_fault_text(enum mill_fault_code code);

#endif
