/* The deck: an INI text, read, checked and converted to SI numbers. One table (deck_table.c)
 * defines each key's meaning, unit, default and range. Reading, checking, printing and saving all
 * use this table. */
#ifndef MILLSIM_DECK_H
#define MILLSIM_DECK_H

#include "base/key.h"
#include "millsim/start.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#define MILL_NAME_LENGTH 64
enum { MILL_DECK_REMARK = 200 };

struct mill_deck_balls {
    const char *section; /* "balls", "balls.NAME" */
    const char *name;    /* NAME; "balls" for the plain section */
    long count;
    /* Given instead of the count; 0: not given. Parts of the container's volume, and of the free
     * volume with the voids between the balls; [kg] of all of them */
    double fill, bulk_fill, mass;
    const char *given;    /* the key that gives the number: "count", "fill", ... */
    double diameter;      /* [m] */
    double density;       /* [kg/m^3]; 0: not given */
    const char *material; /* NULL: not given */
};

/* [blades]: equal ones, spread evenly along the drum and around the rotor */
struct mill_deck_blades {
    long count;             /* 0: there is no such section */
    double angle_step;      /* [rad] */
    struct mill_blade form; /* of all blades; only place and angle depend on a blade's number */
};

/* Bodies as the engine needs them */
struct mill_deck_bodies {
    int count;
    struct mill_setup_surface *surface;
    struct mill_body *form; /* of each */
    const char **section;   /* of each */
};

/* [motion.NAME], as given; the values of `kind` have the order of the words of its key */
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
    int shape;            /* number in the list of solids */
    const char *motion;   /* the motion that carries it; NULL: it stands still */
    vec3 axis;            /* of any length */
    double angle;         /* [rad] */
    const char *material; /* NULL: not given */
    struct mill_body is;  /* its side, centre and sizes */
    const char *file;     /* of a mesh */
    double unit;          /* [m] length of one unit in the file */
    long copies;          /* number of all copies; 0 for a container */
    double turn_by;       /* [rad] */
    vec3 turn_about;      /* of any length */
    vec3 shift_by;        /* [m] */
    const char *kind;     /* kind of contact; NULL: "ball_NAME" */
};

/* [contact], [contact.KIND]; NaN: not given */
struct mill_deck_law {
    double restitution, friction, tangential;
    double speed;                 /* [m/s] at which the restitution is given; 0: at any */
    const char *table;            /* file, or NULL */
    const struct mill_fall *rows; /* of the table, which gives the restitution instead */
};

/* The restitution that falls with the speed; without points: it is the same at any speed */
struct mill_fall mill_deck_laws_fall(const struct mill_deck_law *law);

/* Which values of a contact law are those of materials */
struct mill_deck_takes {
    bool restitution, friction, tangential;
};

/* [material.NAME]: its contact with itself; NaN: not known */
struct mill_deck_material {
    struct mill_deck_law law;
    double density; /* [kg/m^3] */
};

/* [powder], as given. It does not influence the run: programs compute the dose from it. */
struct mill_deck_powder {
    double mass;           /* [kg] 0: there is no such section */
    double ball_to_powder; /* mass of the balls / mass of the powder, where given instead */
    double density;        /* [kg/m^3] of its material */
    double size;           /* [m] of its particles; 0: not given */
    double packing;        /* share of a layer that particles fill */
    int capture;           /* how much powder an impact catches; values in the order of the words */
    double layer;          /* [m] thickness of the powder on a surface; 0: not given */
    double modulus;        /* [Pa] reduced modulus of the surfaces */
    int energy;            /* of an impact; values in the order of the words of its key */
    double threshold;      /* [J] impacts from here on are hard */
    int law;               /* of the reaction or breakage; values in the order of the words */
    double coefficient, exponent; /* 0: not given */
    double strength;              /* [kg/(J m)] Vogel & Peukert; 0: not given */
    double least;                 /* [J m/kg] Vogel & Peukert */
    const char *table;            /* file, or NULL */
};

enum { MILL_DECK_MONOLAYER, MILL_DECK_VOLUME, MILL_DECK_LAYER };
enum { MILL_DECK_NONE, MILL_DECK_POWER, MILL_DECK_THRESHOLD, MILL_DECK_VOGEL, MILL_DECK_RATES };

/* [heat], as given; programs compute temperatures from it */
struct mill_deck_heat {
    double ball_capacity, powder_capacity, jar_capacity; /* [J/(kg K)]; powder: 0: not given */
    double jar_mass;                                     /* [kg] */
    double ball_to_jar, jar_to_room;                     /* [W/K] */
    double room;                                         /* [K] */
    double share;                                        /* of the power that heats the balls */
};

/* [wear], [wear.KIND]: coefficients; 0: not given */
struct mill_deck_wear {
    double archard;  /* Archard's K */
    double hardness; /* [Pa] */
    double erosion;  /* [kg/J] Finnie's k */
};

/* A kind of contact: its law, and where it comes from */
struct mill_deck_contact {
    bool occurs; /* surfaces of the mill have this kind */
    struct mill_deck_law law;
    /* where values of materials are used: of what pair, and where they come from; "": nowhere */
    char assumed[MILL_DECK_REMARK];
    struct mill_deck_takes takes;
    char section[MILL_NAME_LENGTH + 16]; /* "contact.KIND", which gives or prints it */
    struct mill_deck_wear wear;
};

/* The text of a deck, and where each of its values comes from */
struct mill_deck_text {
    const char *file; /* name as the user gave it; the caller keeps the string */
    char *bytes;      /* contents of the file; keys and values point into it */
    int overrides;    /* keys and values point into these, too */
    char **override;
    int sections;
    struct mill_deck_section *section; /* each with its entries */
    int files;                         /* that the deck names: start, tables, meshes */
    const char **file_named;           /* their paths */
    int keeps;                         /* other memory that the deck owns */
    void **kept;
    struct mill_deck_reading *reading; /* NULL: the deck has been read */
};

/* The values that keys give, or their defaults. Those of [motion.NAME], [body.NAME] and of other
 * sections with a name are with their sections. */
struct mill_deck_given {
    /* [run] */
    double time;           /* [s] */
    double sample_from;    /* [s] */
    double precision;      /* relative standard error that ends the run; 0: not used */
    double max_collisions; /* number of collisions that ends the run; 0: not used */
    long seed;
    long threads; /* 0: the program chooses */
    /* [gravity] */
    vec3 gravity; /* [m/s^2] */
    /* [balls] */
    const char *start; /* path of the start file, resolved relative to the deck; NULL = random */
    double speed;      /* [m/s] of every ball, random start only */
    int at_rest;       /* 1: balls of a random start begin at rest, although the container moves */
    /* [drum] */
    double drum_radius, drum_length; /* [m] */
    int periodic;                    /* 1: the drum has no end walls; 0: it has */
    int wavy;                        /* 1: wavy drum; 0: a circle, and the buckles are 0 */
    long buckles;
    double buckle_height;    /* [m] the wall is within drum_radius +- buckle_height */
    double buckle_angle;     /* [rad] of one outermost point, from +y towards +z */
    const char *drum_motion; /* the motion that carries the drum; NULL: none */
    const char *drum_material, *rotor_material; /* NULL: not given */
    /* [rotor] */
    struct mill_turn rotor; /* its speed follows from the tip speed, where that is given */
    double tip_speed;       /* [m/s] 0: not given, or at rest */
    double shaft_radius;    /* [m] 0 = no shaft */
    struct mill_deck_blades blades;
    /* [contact], [material.NAME] */
    struct mill_deck_material unknown; /* all that a [material.NAME] does not give */
    struct mill_deck_law general;      /* [contact], for kinds that have no value of their own */
    const char *between;               /* material between the surfaces; NULL: none */
    double rebound_floor;              /* [m/s] */
    /* [powder], [heat], [wear] */
    struct mill_deck_powder powder;
    struct mill_deck_heat heat;
    struct mill_deck_wear worn; /* for kinds that have no values of their own */
    /* [output] */
    double frames;        /* [s] 0 = none */
    double series;        /* [s] */
    int log_impacts;      /* 1: yes */
    double strike_window; /* [s] */
    double checkpoint;    /* [s] of wall time */
};

/* What follows from the values: the mill */
struct mill_deck_mill {
    bool sample_found; /* the run finds sample_from (only run.precision is given) */
    int kinds;         /* of balls */
    struct mill_deck_balls *balls;
    int64_t all; /* balls of all kinds */
    bool drum;   /* true: a drum holds the balls; false: a body does */
    const struct mill_setup_surface *container; /* the body that holds the balls, or NULL */
    bool carried;                               /* true: a motion carries the container */
    int drum_rides;                             /* 1 + number of the drum's motion; 0: none */
    bool rotor;
    int motions; /* the rotor's first; each motion after the one that carries it */
    struct mill_setup_motion motion[MILL_MOTIONS_MOST];
    struct mill_deck_motion form[MILL_MOTIONS_MOST]; /* the numbers of the motions */
    struct mill_deck_bodies parts;  /* shaft and blades: those of [blades], then the [blade.NAME] */
    struct mill_deck_bodies bodies; /* of the [body.NAME], with each copy */
    struct mill_kinds contacts;     /* kinds of contact */
    struct mill_deck_contact contact[MILL_KINDS_MOST];
    struct mill_deck_text printed; /* the sections of the printed deck */
};

struct mill_deck {
    struct mill_deck_text text;
    struct mill_deck_given given;
    struct mill_deck_mill mill;
    void (*warn)(const char *line); /* NULL: warnings are dropped */
};

/* Reads `path`, applies `count` overrides "SECTION.KEY=VALUE" and checks every key and value. The
 * caller keeps the strings while the deck is in use. On failure: NULL and a filled error
 * (MILL_BAD_DECK for a wrong deck; MILL_FAILED for a file that cannot be read or for lack of
 * memory). `warn` (may be NULL) is called for each warning, with one line. If the deck has several
 * faults, `fault` is called for each of them but the last, which is in `error`, in the order of the
 * lines; with more than 20 faults, `error` says how many more there are. NULL for `fault`: reading
 * ends at the first one. Owner: the caller. */
enum mill_status mill_deck_read(const char *path, int count, const char *const *overrides,
                                void (*warn)(const char *line), void (*fault)(const char *line),
                                struct mill_deck **deck, struct mill_error *error);
void mill_deck_free(struct mill_deck *deck);

/* The drum in numbers */
struct mill_setup_drum mill_deck_drum(const struct mill_deck *deck);

/* The key of this name in section [title]. Where several kinds of the section have such a key:
 * number `n` of these, from 0. NULL: there are no more. */
const struct mill_key *mill_deck_table_key(const char *title, const char *name, int n);

/* Calls `entry` for every entry of the full deck (with defaults), in the order of the table:
 * section, key, value with unit. The value is a text that reads back to the same bits. */
void mill_deck_each(const struct mill_deck *deck,
                    void (*entry)(void *self, const char *section, const struct mill_key *key,
                                  const char *value),
                    void *self);

/* Prints a line for each of `count` values "SECTION.KEY=VALUE". It has six columns with tabs
 * between them: key, kind (number, whole, choice, vector or file), value in SI that reads back to
 * the same bits, SI unit ("1": a plain number), meaning of the key, and the words of a choice
 * ("circle|wavy"). Each value is checked alone, not against the others. Stops at the first wrong
 * value with MILL_BAD_DECK. */
enum mill_status mill_deck_tell(int count, const char *const *values, FILE *out,
                                struct mill_error *error);

/* Builds the deck's world. watch may be NULL. MILL_BAD_DECK: balls do not fit or overlap, or the
 * start file is wrong (the error names the line). A start file has one ball a line, x y z [vx vy vz
 * [wx wy wz]] in SI, and # comments. Owner: the caller. */
enum mill_status mill_deck_setup_world(const struct mill_deck *deck,
                                       const struct mill_start_watch *watch,
                                       struct mill_world **world, struct mill_error *error);

/* A hash of the tables and meshes that the deck names; 0: it names none */
uint64_t mill_deck_files_digest(const struct mill_deck *deck);

/* Prints the full deck, itself a deck. */
void mill_deck_print(const struct mill_deck *deck, FILE *out);

#endif
