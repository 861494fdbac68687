/* A mill as plain numbers, from which a world is built. The program fills it in from a deck; a
 * program that links libmillsim can fill it in itself. All units are SI. */
#ifndef MILLSIM_SETUP_H
#define MILLSIM_SETUP_H

#include "millsim/impact.h"
#include "millsim/motion.h"
#include "millsim/soft.h"

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

/* A corner of a closed line, and the side that begins there and goes to the next corner: straight,
 * or a circular arc. bulge: tangent of a quarter of the arc's angle, > 0: counter-clockwise. */
struct mill_corner {
    double x, y; /* [m] */
    double bulge;
};

/* The drum with its two flat end walls. Its axis is x, its centre the origin. */
struct mill_setup_drum {
    double radius, length;            /* [m] inner dimensions; of a contour no radius */
    size_t corners;                   /* of the contour that is its wall; 0: a circle */
    const struct mill_corner *corner; /* its x and y are y and z of the frame */
    /* 1 + the number of the drum's motion, whose x axis is the drum's axis; 0: it stands still */
    int rides;
    /* 1: a slice without end walls, which balls leave at one end and enter at the other end */
    int periodic;
};

struct mill_setup_motion {
    const struct mill_motion_type *type;
    const void *form; /* struct of this type: &(struct mill_turn){...} */
    int on;           /* its carrier, an earlier motion of the list; MILL_STILL: none */
    const char *name; /* of its results; NULL: "rotor" for the rotor, no name for others */
};
enum { MILL_STILL = -1 };

struct mill_solid;

/* The kinds of solids, each with the word for it in a deck. To add a kind, write one file with its
 * table (geometry/solid.h) and add a row here. */
#define MILL_SOLID_LIST(row)                                                                       \
    row(box, mill_box_solid) row(cylinder, mill_round_cylinder_solid)                              \
        row(cone, mill_round_cone_solid) row(capsule, mill_round_capsule_solid)                    \
            row(sphere, mill_round_sphere_solid) row(mesh, mill_facets_solid)                      \
                row(contour, mill_contour_solid)
#define MILL_SOLID_DECLARE(word, solid) extern const struct mill_solid solid;
MILL_SOLID_LIST(MILL_SOLID_DECLARE)

/* A prism over a circle, about the x axis of its motion's frame: round drums, and shafts
 * (mill_setup_drum_body, mill_setup_shaft) */
extern const struct mill_solid mill_prism_solid;

/* A body at a place in its motion's frame. Balls meet it from outside or from inside. The kind of
 * solid says which of the sizes it has. */
struct mill_body {
    int inside;           /* 1: the balls are inside it */
    vec3 centre, x, y, z; /* [m]; directions of its own axes: unit, orthogonal, right-handed */
    vec3 size;            /* [m] of a box, along these axes */
    double radius;        /* [m] of round bodies; of a cone: at z = -length / 2 */
    double end_radius;    /* [m] of a cone: at z = length / 2 */
    double length;        /* [m] along z; of a capsule: without its round ends */
    double rounding; /* [m] radius of the edges: the body is shrunk by it and then grown by it */
    size_t facets; /* number; the mesh is closed, its corners counter-clockwise seen from outside */
    const vec3 (*facet)[3];           /* [m] in its own frame */
    size_t corners;                   /* of a contour */
    const struct mill_corner *corner; /* counter-clockwise, in its own x and y */
    bool open;                        /* without ends: a slice of a long mill */
};

/* A body in the container, or the container itself, which has the balls inside */
struct mill_setup_surface {
    const struct mill_solid *solid;
    const struct mill_body *body;
    int number; /* its number among the bodies of its kind, from 0; -1: the only one */
    int motion; /* the motion that moves it; MILL_STILL: none */
    int kind;   /* of its contacts: one of the kinds that all mills have, MILL_BALL_DRUM or later;
                   or MILL_KINDS + its index in the setup's list */
    int ends;   /* the kind of a container's flat ends, which are its numbers 0 and 1; 0: the same
                   kind */
};

/* The drum as a body, and its solid */
static inline const struct mill_solid *mill_setup_drum_solid(const struct mill_setup_drum *drum)
{
    return drum->corners > 0 ? &mill_contour_solid : &mill_prism_solid;
}
struct mill_body mill_setup_drum_body(const struct mill_setup_drum *drum);

/* A shaft about the x axis of its motion's frame, from end wall to end wall of a drum [m] */
struct mill_body mill_setup_shaft(double radius, double length);

/* A blade points outwards from the x axis of its motion's frame, turned by `pitch` about its radial
 * centre line (positive pitch turns the +x edge towards increasing angle). */
struct mill_blade {
    double position;         /* [m] x of its centre */
    double angle;            /* [rad] from +y towards +z */
    double tip_radius;       /* [m] */
    double width, thickness; /* [m] along and around the axis, without the pitch */
    double pitch;            /* [rad] */
};

/* The blade as a box, from the axis to its tip */
struct mill_body mill_setup_blade(const struct mill_blade *blade);

struct mill_setup {
    vec3 gravity;                /* [m/s^2] */
    struct mill_setup_drum drum; /* radius 0: no drum; one of the surfaces is the container */
    int motions;
    const struct mill_setup_motion *motion;
    int rotor; /* number of the motion that is the rotor; MILL_STILL: none */
    int surfaces;
    const struct mill_setup_surface *surface;
    int species;
    const struct mill_setup_balls *balls; /* [species] */
    const struct mill_setup_ball *start;  /* of all balls, species by species; NULL: random */
    double speed;                         /* [m/s] of every ball, for a random start */
    int at_rest;        /* 1: random start in a moving container: the balls do not move with it */
    unsigned long seed; /* of a random start */
    int kinds;          /* number of kinds of contact in addition to the MILL_KINDS of every mill */
    const char *const *kind;                /* [kinds] their names, without "ball_" */
    struct mill_law law[MILL_KINDS_MOST];   /* for each kind of contact; zeros: no rebound */
    struct mill_fall fall[MILL_KINDS_MOST]; /* with points: in place of the law's restitution */
    /* [m/s] minimum normal speed after any contact; NAN: it follows from accelerations and depth of
     * the charge. With 0, a run may fail: infinitely many contacts in a finite time */
    double rebound_floor;
    /* [J] a floor that follows from the mill is low enough for impacts of this energy; 0: none */
    double asked;
    struct mill_soft_setup soft; /* zeros: the spheres are hard */
    /* [s] Bodies on motions without a common period are checked for clashes this long; 0: 1 s */
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
    /* the balls would fill the fraction `amount` of the free volume; `fits`: how many would fit */
    MILL_FAULT_NO_ROOM,
    MILL_FAULT_CONTAINER, /* no container, or more than one */
    /* surface `other` leaves the container at `when` [s]; `amount` [m]: how far outside it is */
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

enum { MILL_FAULT_SPECIES = 64, MILL_FAULT_PASSINGS = 8 }; /* the maximum numbers in a fault */

/* Two surfaces of different motions that pass each other, found by the check for clashes */
struct mill_passing {
    int32_t one, other; /* their numbers; other -1: the drum */
    int kind[2];        /* of contact, of both */
    double gap, when;   /* [m] accurate to about 10 %, [s] */
};

struct mill_fault {
    enum mill_fault_code code;
    /* If nothing is wrong: */
    /* of each two kinds, the narrowest first; gap INFINITY: there are no more */
    struct mill_passing narrowest[MILL_FAULT_PASSINGS];
    struct mill_passing unchecked; /* not checked from `when` on; INFINITY: fully checked */
    int32_t ball, other;
    int kind;
    double amount, when;
    int32_t fits[MILL_FAULT_SPECIES]; /* balls of each species that would fit; all 0: not known */
};

/* The code in words: "two balls overlap at the start" */
const char *mill_setup_fault_text(enum mill_fault_code code);

#endif
