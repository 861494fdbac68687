/* The deck: an INI text, read, checked and converted to SI numbers. Tables of keys define each
 * key's meaning, unit, default and range. Reading, checking, printing and saving all use them. */
#ifndef MILLSIM_DECK_H
#define MILLSIM_DECK_H

#include "base/key.h"
#include "base/memory.h"
#include "millsim/lining.h"
#include "millsim/start.h"
#include "observe/observe.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#define MILL_NAME_LENGTH 64
enum { MILL_DECK_REMARK = 200 };

struct mill_deck_balls {
    const char *section; /* "balls", "balls.NAME" */
    long count;
    /* Given instead of the count; 0: not given. Parts of the container's volume, and of the free
     * volume with the voids between the balls; [kg] of all of them */
    double fill, bulk_fill, mass;
    const char *given; /* the key that gives the number: "count", "fill", ... */
    double diameter;   /* [m] of a ball; of a distribution: of the largest */
    double density;    /* [kg/m^3]; 0: not given */
    const char *sizes; /* the distribution, or the file of its table; NULL: all are equal */
    double smallest, d63, uniformity; /* of a distribution: [m], [m], [1]; 0: not given */
    long classes;                     /* that stand for it; 0: those of the table */
    const char *material;             /* NULL: not given */
};

/* [blades]: equal ones, spread evenly along the drum and around the rotor */
struct mill_deck_blades {
    long count;             /* 0: there is no such section */
    double angle_step;      /* [rad] */
    struct mill_blade form; /* of all blades; only place and angle depend on a blade's number */
};

/* [motion.NAME], as given; the values of `kind` have the order of the words of its key */
struct mill_deck_motion {
    int kind;
    const char *on; /* the motion that carries it; NULL: none */
    double share;   /* of the critical speed, which gives the speed of a turn; 0: not given */
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
    struct mill_body is;  /* first, as for keys of solids: its side, centre and sizes */
    int shape;            /* number in the list of solids */
    const char *motion;   /* the motion that carries it; NULL: it stands still */
    vec3 axis;            /* of any length */
    double angle;         /* [rad] */
    const char *material; /* NULL: not given */
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

/* [material.NAME]: its contact with itself; NaN: not known */
struct mill_deck_material {
    struct mill_deck_law law;
    double density; /* [kg/m^3] */
};

/* [powder] and [heat], as given, in SI; 0 or NULL: not given. They do not influence the run:
 * programs compute from them. deck_table.c says what each value is. */
struct mill_deck_powder {
    double mass, ball_to_powder, density, size, packing, layer, modulus, threshold;
    double coefficient, exponent, strength, least;
    int capture, energy, law; /* in the order of the words of their keys */
    const char *table;
};
enum { MILL_DECK_MONOLAYER, MILL_DECK_VOLUME, MILL_DECK_LAYER };
enum { MILL_DECK_NONE, MILL_DECK_POWER, MILL_DECK_THRESHOLD, MILL_DECK_VOGEL, MILL_DECK_RATES };
struct mill_deck_heat {
    double ball_capacity, powder_capacity, jar_capacity, jar_mass;
    double ball_to_jar, jar_to_room, room, share;
};
/* A kind of contact: its law, and where it comes from */
struct mill_deck_contact {
    bool occurs; /* surfaces of the mill have this kind */
    struct mill_deck_law law;
    /* where values of materials are used: of what pair, and where they come from; "": nowhere */
    char assumed[MILL_DECK_REMARK];
    struct {
        bool restitution, friction, tangential;
    } takes;                             /* these */
    char section[MILL_KINDS_LENGTH + 8]; /* "contact.KIND", which gives or prints it */
};

/* The text of a deck, and where each of its values comes from */
struct mill_deck_text {
    const char *file;                  /* name as the user gave it; the caller keeps the string */
    struct mill_deck_section *section; /* the first of a list, each with its entries */
    struct mill_memory_list files;     /* const char *: paths that the deck names */
    struct mill_deck_reading *reading; /* NULL: the deck has been read */
};

/* The values that keys give, or their defaults, in SI; the tables of keys say what each value is.
 * Those that the engine or the observers need are in `setup` and `observe`; those of [motion.NAME],
 * [body.NAME] and of other sections with a name are with their sections. */
struct mill_deck_given {
    long threads;              /* 0: the program chooses */
    const char *start;         /* [balls] path of the start file; NULL: a random start */
    struct mill_lining lining; /* [drum]: its profile; the radius is that of the drum */
    const char *contour;       /* its file; NULL: not given */
    double tool;               /* [m] radius of the tool that mills the contour; 0: any */
    const char *drum_motion, *drum_material, *rotor_material; /* NULL: not given */
    struct mill_turn rotor;  /* its speed follows from the tip speed, where that is given */
    double tip_speed, share; /* 0: not given, or at rest; share of the critical speed: the same */
    double shaft_radius;     /* 0: no shaft */
    struct mill_deck_blades blades;
    struct mill_deck_material unknown; /* all that a [material.NAME] does not give */
    struct mill_deck_law general;      /* [contact], for kinds that have no value of their own */
    const char *between;               /* material between the surfaces; NULL: none */
    struct mill_deck_powder powder;
    struct mill_deck_heat heat;
    struct mill_wear_law worn; /* for kinds that have no values of their own */
    double checkpoint;         /* [output] */
};

/* What follows from the values: the mill */
struct mill_deck_mill {
    struct mill_deck_balls *balls; /* of each kind */
    int64_t all;                   /* balls of all kinds */
    bool drum;                     /* true: a drum holds the balls; false: a body does */
    const struct mill_setup_surface *container; /* the body that holds the balls, or NULL */
    int carrier;         /* number of the motion that carries the container; MILL_STILL: none */
    double critical;     /* [rad/s] speed of this turn at which balls stay at the wall; 0: none */
    double share;        /* speed of this turn divided by the critical one, without its sign */
    double volume, mass; /* [m^3], [kg] of all balls */
    double widest;       /* [m] their largest diameter */
    bool rotor;
    struct mill_setup_motion motion[MILL_MOTIONS_MOST];
    struct mill_deck_motion form[MILL_MOTIONS_MOST]; /* the numbers of the motions */
    /* of each: struct mill_setup_surface, and const char *, its section. Shaft, those of [blades],
     * then the [blade.NAME]: so many parts; then the [body.NAME] with each copy */
    struct mill_memory_list surface, section;
    int parts;
    struct mill_kinds contacts;        /* kinds of contact */
    const char *kind[MILL_KINDS_MOST]; /* names of those of bodies, without "ball_" */
    struct mill_deck_contact contact[MILL_KINDS_MOST];
};

struct mill_deck {
    struct mill_deck_text text;
    struct mill_deck_given given;
    struct mill_deck_mill mill;
    struct mill_setup setup;        /* of the world, without the balls of a start file */
    struct mill_observe observe;    /* what the observers are asked for */
    struct mill_memory_list memory; /* void *: all that the deck owns */
    void (*warn)(const char *line); /* NULL: warnings are dropped */
};

/* Reads `path`, applies `count` overrides "SECTION.KEY=VALUE" and checks every key and value. The
 * caller keeps the strings while the deck is in use. On failure: NULL and a filled error
 * (MILL_BAD_DECK for a wrong deck; MILL_FAILED for a file that cannot be read or for lack of
 * memory). `warn` (may be NULL) is called for each warning, with one line. If the deck has several
 * faults, `fault` is called for each of them but the last, which is in `error`, in the order of the
 * lines; with more than 20 faults, `error` says how many more there are. NULL for `fault`: `error`
 * is the first one. watch (may be NULL) hears of the progress. Owner: the caller. */
enum mill_status mill_deck_read(const char *path, int count, const char *const *overrides,
                                void (*warn)(const char *line), void (*fault)(const char *line),
                                const struct mill_start_watch *watch, struct mill_deck **deck,
                                struct mill_error *error);
void mill_deck_free(struct mill_deck *deck);

/* The key of this name in section [title]. Where several kinds of the section have such a key:
 * number `n` of these, from 0. NULL: there are no more. */
const struct mill_key *mill_deck_table_key(const char *title, const char *name, int n);

/* Calls `entry` for every entry of the full deck (with defaults), in the order of the table. The
 * value with its unit is a text that reads back to the same bits. */
typedef void mill_deck_entry_fn(void *self, const char *section, const struct mill_key *key,
                                const char *value);
void mill_deck_each(const struct mill_deck *deck, mill_deck_entry_fn *entry, void *self);

/* Prints a line for each of `count` values "SECTION.KEY=VALUE". It has six columns with tabs
 * between them: key, kind (number, whole, choice, vector or file), value in SI that reads back to
 * the same bits, SI unit ("1": a plain number), meaning of the key, and the words of a choice
 * ("circle|wavy"). Each value is checked alone. Stops at the first wrong one: MILL_BAD_DECK. */
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

/* Prints the contours of drum and bodies: for each "# [section]", then a row "x y bulge" for each
 * corner, which reads back to the same bits. */
void mill_deck_lining_print(const struct mill_deck *deck, FILE *out);

/* Prints the full deck, itself a deck. */
void mill_deck_print(const struct mill_deck *deck, FILE *out);

/* What one of these prints. NULL: out of memory. Owner: the caller. */
char *mill_deck_printed(const struct mill_deck *deck,
                        void (*print)(const struct mill_deck *deck, FILE *out));

#endif
