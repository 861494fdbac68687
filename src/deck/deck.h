/* The deck: an INI text, read, checked and turned into SI numbers. What a key means, its unit,
 * default and range stand in one table (deck_table.c); reading, checking, printing and saving all
 * use it. */
#ifndef MILLSIM_DECK_H
#define MILLSIM_DECK_H

#include "millsim/setup.h"
#include "millsim/status.h"

#include <stdbool.h>
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

struct mill_deck_text; /* the entries as read: section, key, value, line */

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
    int64_t all;  /* balls of all kinds */
    char *start;  /* path of the start file, resolved relative to the deck; NULL = random */
    double speed; /* [m/s] of every ball, random start only */
    double drum_radius, drum_length; /* [m] */
    bool wavy;                       /* the drum; else it is a circle, without buckles */
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
    struct mill_law general; /* [contact], for kinds that do not say otherwise */
    struct mill_law law[MILL_KINDS];
    double rebound_floor; /* [m/s] */
    double frames;        /* [s] 0 = none */
    double series;        /* [s] */
    bool log_impacts;
    double strike_window; /* [s] */
    double checkpoint;    /* [s] of wall time */
    struct mill_deck_text *text;
};

/* Reads `path`, applies `count` overrides "SECTION.KEY=VALUE", checks every key and value. The
 * strings are kept by the caller, for as long as the deck is used. NULL and a filled error on
 * failure (MILL_BAD_DECK for a wrong deck, MILL_FAILED for a file that cannot be read or no
 * memory). Warnings, one line each, are handed to `warn` (may be NULL). Owner: the caller. */
enum mill_status mill_deck_read(const char *path, int count, const char *const *overrides,
                                void (*warn)(const char *line), struct mill_deck **deck,
                                struct mill_error *error);
void mill_deck_free(struct mill_deck *deck);

/* The drum in numbers; a circle has no buckles, and these no height. */
struct mill_setup_drum mill_deck_drum(const struct mill_deck *deck);

/* The deck's file as its user named it. */
const char *mill_deck_file(const struct mill_deck *deck);

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

/* Prints the full deck, itself a deck. */
void mill_deck_print(const struct mill_deck *deck, FILE *out);

#endif
