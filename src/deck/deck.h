/* The deck: an INI text, read, checked and turned into SI numbers. What a key means, its unit,
 * default and range stand in one table (deck_table.c); reading, checking, printing and saving all
 * use it. */
#ifndef MILLSIM_DECK_H
#define MILLSIM_DECK_H

#include "millsim/start.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#define MILL_NAME_LENGTH 64

struct mill_deck_balls {
    const char *section; /* "balls", "balls.NAME" */
    const char *name;    /* NAME; "balls" for the plain section */
    long count;
    double fill;     /* of the drum's volume, as given instead of the count; 0: it was not */
    double diameter; /* [m] */
    double density;  /* [kg/m^3] */
};

/* [blades]: equal ones, spread evenly along the drum and around the rotor */
struct mill_deck_blades {
    long count;             /* 0: there is no such section */
    double angle_step;      /* [rad] */
    struct mill_blade form; /* of all; place and angle follow from their number */
};

/* A shape within the drum, beside the shaft */
struct mill_deck_shape {
    const struct mill_shape_type *type;
    const char *section; /* "blades", "blade.NAME" */
    const void *form;    /* the struct of numbers that the type takes */
    int number;          /* which of its type, from 0 */
};

/* [motion.NAME], as given; the kinds are in the order of the words of its key */
struct mill_deck_motion {
    int kind;
    const char *on; /* the motion that carries it; NULL: none */
    union {
        struct mill_turn turn;
        struct mill_swing swing;
        struct mill_shift shift;
        struct mill_table table;
        const char *file; /* of the table, as given */
    } as;
};
enum { MILL_DECK_TURN, MILL_DECK_SWING, MILL_DECK_SHIFT, MILL_DECK_TABLE };

/* [body.NAME], as given */
struct mill_deck_body {
    int shape;           /* as in the words of its key */
    int inside;          /* 1: it holds the balls */
    const char *motion;  /* that carries it; NULL: it stands still */
    vec3 axis;           /* of any length */
    double angle;        /* [rad] */
    struct mill_body is; /* its centre and sizes */
    const char *file;    /* of a mesh */
    double unit;         /* [m] of that file */
    long copies;         /* in all; of a container 0 */
    double turn_by;      /* [rad] */
    vec3 turn_about;     /* of any length */
    vec3 shift_by;       /* [m] */
    const char *kind;    /* of its contacts; NULL: "ball_NAME" */
};
enum {
    MILL_DECK_BOX,
    MILL_DECK_CYLINDER,
    MILL_DECK_CONE,
    MILL_DECK_CAPSULE,
    MILL_DECK_SPHERE,
    MILL_DECK_MESH
};

/* Where something of a deck came from; nowhere: of the defaults */
struct mill_deck_origin {
    int line;             /* in the file, from 1; else 0 */
    const char *override; /* "SECTION.KEY=VALUE", or NULL */
};

struct mill_deck {
    double time;           /* [s] */
    double sample_from;    /* [s] */
    bool sample_found;     /* sample_from is to be found: run.precision is given and it is not */
    double precision;      /* relative standard error that ends the run; 0: none does */
    double max_collisions; /* that end the run; 0: no number does */
    long seed;
    vec3 gravity;                 /* [m/s^2] */
    struct mill_deck_balls alike; /* [balls], where all are of one kind */
    int kinds;                    /* of balls */
    struct mill_deck_balls *balls;
    int64_t all;       /* balls of all kinds */
    const char *start; /* path of the start file, resolved relative to the deck; NULL = random */
    double speed;      /* [m/s] of every ball, random start only */
    int at_rest;       /* 1: balls of a random start do not move along with the container */
    bool drum;         /* there is one; else a body holds the balls: */
    const struct mill_setup_surface *container; /* that body, or NULL */
    bool carried;                               /* the container, by a motion */
    double drum_radius, drum_length;            /* [m] */
    const char *drum_motion;                    /* that carries the drum; NULL: none */
    int drum_rides;                             /* 1 + its number; 0 */
    int wavy; /* 1: the drum; else it is a circle, all of these 0: */
    long buckles;
    double buckle_height; /* [m] the wall lies between drum_radius - that and drum_radius + that */
    double buckle_angle;  /* [rad] of one outermost point, from +y towards +z */
    bool rotor;
    double rotor_speed;  /* [rad/s], positive turns about +x */
    double shaft_radius; /* [m] 0 = no shaft */
    double rotor_angle;  /* [rad] at t = 0 */
    struct mill_deck_blades blades;
    struct mill_blade *blade; /* the forms of these */
    int shapes;               /* those of [blades] first, then the [TYPE.NAME] in their order */
    struct mill_deck_shape *shape;
    int motions; /* the rotor's first, carriers before what they carry */
    struct mill_setup_motion motion[MILL_MOTIONS_MOST];
    struct mill_deck_motion form[MILL_MOTIONS_MOST]; /* what these take */
    int bodies; /* of the [body.NAME], their copies one by one */
    struct mill_setup_surface *body;
    const char **body_section;   /* of each */
    struct mill_body *body_form; /* of each */
    struct mill_kinds contacts;  /* kinds of contact */
    struct mill_law general;     /* [contact], for kinds that do not say otherwise */
    struct mill_law law[MILL_KINDS_MOST];
    double rebound_floor;           /* [m/s] */
    double frames;                  /* [s] 0 = none */
    double series;                  /* [s] */
    int log_impacts;                /* 1: yes */
    double strike_window;           /* [s] */
    double checkpoint;              /* [s] of wall time */
    void (*warn)(const char *line); /* NULL: nobody listens */
    /* The text behind it */
    const char *file; /* as named by the user, who keeps the name */
    char *bytes;      /* of the file, cut into keys and values */
    int overrides;    /* cut in the same way */
    char **override;
    int sections;
    struct mill_deck_section *section;
    int files; /* that it names, by path, as input: start, tables, meshes */
    const char **file_named;
    int keeps; /* what else it owns */
    void **kept;
    struct mill_deck_origin at; /* what is being read */
    struct mill_units *units;   /* while it is */
};

/* Reads `path`, applies `count` overrides "SECTION.KEY=VALUE", checks every key and value. The
 * strings are kept by the caller, for as long as the deck is used. NULL and a filled error on
 * failure (MILL_BAD_DECK for a wrong deck, MILL_FAILED for a file that cannot be read or no
 * memory). Warnings, one line each, are handed to `warn` (may be NULL). Owner: the caller. */
enum mill_status mill_deck_read(const char *path, int count, const char *const *overrides,
                                void (*warn)(const char *line), struct mill_deck **deck,
                                struct mill_error *error);
void mill_deck_free(struct mill_deck *deck);

/* The drum in numbers */
struct mill_setup_drum mill_deck_drum(const struct mill_deck *deck);

/* Sets "FILE:LINE: [section] key: ..." for a fault found later (the start does not fit, balls
 * overlap): a key that came by --set or by default is named accordingly. Returns MILL_BAD_DECK. */
enum mill_status mill_deck_fault(const struct mill_deck *deck, struct mill_error *error,
                                 const char *section, const char *key, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

/* Hands every entry of the full deck (defaults filled in) to `entry`, in the order of the table, as
 * text that reads back to the same bits: section, key, value with unit, and what the key means. */
void mill_deck_each(const struct mill_deck *deck,
                    void (*entry)(void *self, const char *section, const char *key,
                                  const char *value, const char *meaning),
                    void *self);

/* Tells of each of `count` values "SECTION.KEY=VALUE" what it is, as a line of six columns with
 * tabs between them: key, kind (number, whole, choice, vector or file), value in SI that reads back
 * to the same bits, its SI unit ("1": a plain number), what the key means, and the words of a
 * choice ("circle|wavy"). Values are checked one by one, not against each other. The first wrong
 * one ends it with MILL_BAD_DECK. */
enum mill_status mill_deck_tell(int count, const char *const *values, FILE *out,
                                struct mill_error *error);

/* The deck's world. watch may be NULL. MILL_BAD_DECK when balls do not fit or overlap, or for a
 * start file that is wrong, with its line: x y z [vx vy vz [wx wy wz]] in SI a line, # comments.
 * Owner: the caller. */
enum mill_status mill_deck_setup_world(const struct mill_deck *deck,
                                       const struct mill_start_watch *watch,
                                       struct mill_world **world, struct mill_error *error);

/* A number that changes with the tables and meshes that the deck names; 0: there are none */
uint64_t mill_deck_files_digest(const struct mill_deck *deck);

/* Prints the full deck, itself a deck. */
void mill_deck_print(const struct mill_deck *deck, FILE *out);

#endif
