/* What the deck_*.c files share: the table of sections, the entries as read, values as text. */
#ifndef MILL_DECK_PRIVATE_H
#define MILL_DECK_PRIVATE_H

#include "base/key.h"
#include "deck/deck.h"
#include "deck/units.h"
#include "geometry/solid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where a value of the deck comes from. line 0 and no override: it is a default */
struct mill_deck_origin {
    int line;             /* in the file, from 1; 0: not from the file */
    const char *override; /* "SECTION.KEY=VALUE", or NULL */
};

/* What is needed only while a deck is read */
struct mill_deck_reading {
    struct mill_error *error;             /* filled when reading fails, or at its end */
    struct mill_memory_list *memory;      /* of the deck */
    const struct mill_start_watch *watch; /* NULL, or hears of the progress */
    struct mill_deck_origin at;           /* what is being read now */
    struct mill_deck_section *open;       /* that the next lines belong to; NULL: none */
    struct mill_units *units;             /* NULL until they are needed */
    struct mill_deck_fault *fault;        /* the first of a list, in the order of the lines */
    int faults;
    long more;   /* faults without a message */
    bool lost;   /* a section could not be read, or is missing: one that is missing may be that */
    bool failed; /* the system has failed, not the deck: no memory, for example */
    bool over;   /* it has failed, or there is no room for more faults: reading is to end */
};

/* Functions that can find a fault, or fail, return false then. */

/* ---- what a deck may contain (deck_table.c, deck_entries.c) ---- */

#define MILL_DECK_BALL "ball_" /* prefix of kinds of contact */
enum { MILL_DECK_MOST_BALLS = 50000000, MILL_DECK_MOST_BLADES = 10000 };
enum { MILL_DECK_MOST_CLASSES = 64, MILL_DECK_MOST_EDITS = 8 /* see suggestions */ };

/* A block: keys of a section with their values in one struct. A section may have several. */
struct mill_deck_block {
    const char *title; /* "run": of [run], or of the [TITLE.NAME] where `named` */
    bool named;
    bool optional;     /* without the section: true: no values, false: the defaults */
    bool unless_named; /* if there are [TITLE.NAME], only these may have the keys */
    bool inherits;     /* the section's own struct starts as a copy of the one at `values` */
    size_t values;     /* offset in struct mill_deck of the struct with the keys' values */
    size_t size;       /* of the struct that every such section has for itself; 0: it has none */
    const struct mill_key *key; /* the last one has no name: end of the list */
    /* the keys are those of this solid, where it has some */
    const struct mill_solid *solid;
    /* the section may be missing if there is a [SPARED_BY.NAME] */
    const char *spared_by;
    /* Bit k: it belongs to sections whose first key, a choice, is word k. 0: to all sections */
    unsigned words;
};

/* All blocks, in the order in which decks are read and printed; the last one has no title. */
extern const struct mill_deck_block mill_deck_table[];

const struct mill_key *mill_deck_table_keys(const struct mill_deck_block *block);

/* Does this block describe the section [title]? */
bool mill_deck_table_belongs(const struct mill_deck_block *block, const char *title);

/* The first block that does, or NULL */
const struct mill_deck_block *mill_deck_table_find(const char *title);

/* ---- suggestions for wrong names (deck_suggest.c) ---- */

/* Number of edits that turn `text` into `word`; MILL_DECK_MOST_EDITS: more than a third */
int mill_deck_suggest_edits(const char *word, const char *text);

/* Sets hint to "; did you mean ...?" or a similar text for a wrong section (name: NULL) or key.
 * hint becomes empty if no name is similar. Returns the key of section [title] that was probably
 * meant, or the section without a NAME, or NULL. */
const char *mill_deck_suggest_key(const char *title, const char *name, char *hint, size_t size);

/* Words that users type for something that has another name here; the last one has no `of` */
extern const struct mill_deck_synonym {
    const char *of; /* section of the typed keys; "*": any; "": the words are sections */
    /* in lower case, separated by blanks, '_' for '_', '-' or a blank in a key */
    const char *words;
    const char *here;   /* key or section, "balls.NAME.mass", "drum"; NULL: none */
    const char *remark; /* follows; NULL: nothing */
} mill_deck_suggest_synonyms[];

/* ---- faults (deck_faults.c) ---- */

/* Keeps the fault "FILE:LINE: [section] key: ..." until it is told, and marks its section. If the
 * value came from --set or is a default, the text says so. Returns false. */
bool mill_deck_wrong(const struct mill_deck_text *text, const char *section, const char *key,
                     const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Ends the reading of the deck with MILL_FAILED. Returns false. */
bool mill_deck_failed(const struct mill_deck_text *text, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The deck frees the memory when it is freed. Returns it; NULL for `memory`, or if there is none
 * for the list: reading has failed. */
void *mill_deck_keep(const struct mill_deck_text *text, void *memory);
void mill_deck_release(struct mill_memory_list *memory);

/* A body leaves the container: " by 2 mm" or "", time [s] */
#define MILL_DECK_LEAVES "leaves the container%s at t = %.6g s: make it smaller, or move it"

/* Is there a fault in one of these sections, or is it perhaps one that could not be read? "drum
 * blade" stands for [drum], [blade.NAME]. */
bool mill_deck_faults_concern(const struct mill_deck_text *text, const char *sections);

/* Warns of what is allowed but is probably a mistake. */
void mill_deck_faults_warn(const struct mill_deck *deck, const char *section, const char *key,
                           const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Tells all faults as mill_deck_read does. Returns the status of reading. */
enum mill_status mill_deck_faults_tell(const struct mill_deck_text *text,
                                       void (*fault)(const char *line));

/* ---- file and overrides into sections and entries (deck_parse.c) ---- */

/* The mend for the name of a file that a comment cuts off */
#define MILL_DECK_QUOTE "put a name with ' #' or ' ;' in double quotes"

/* A value as the file has it: plain, in "", cut by a # or ; */
enum mill_deck_look { MILL_DECK_PLAIN, MILL_DECK_QUOTED, MILL_DECK_CUT };

struct mill_deck_entry {
    struct mill_deck_entry *next;
    const char *key, *value;  /* value NULL: a line that could not be read gives this key */
    enum mill_deck_look look; /* of the value in the file */
    struct mill_deck_origin origin;
};

struct mill_deck_section {
    struct mill_deck_section *next;
    const char *title; /* as in [title] */
    struct mill_deck_origin origin;
    bool broken;  /* it has a fault */
    bool guessed; /* it is missing, but an unknown section probably stands for it */
    struct mill_deck_entry *entry; /* the first of a list */
    void *form; /* the own struct of the section, filled from its entries and defaults */
    int word;   /* its first key, if that is a choice; -1: not known */
};

/* Reads the file (NULL: none), then the overrides. Checks section titles and keys. Adds the
 * sections that are missing at the end, without entries. */
void mill_deck_parse(struct mill_deck_text *text, const char *path, int count,
                     const char *const *overrides);

/* Adds a section without entries; the caller keeps the title. NULL: reading has failed. */
struct mill_deck_section *mill_deck_section_add(struct mill_deck_text *text, const char *title);

/* Writes `value` so that a line with it reads back the same, in quotes where necessary. */
void mill_deck_parse_quote(const char *value, char *out, size_t size);

/* ---- the sections and entries (deck_entries.c) ---- */

/* The section [title], or NULL. */
struct mill_deck_section *mill_deck_section(const struct mill_deck_text *text, const char *title);
/* The next [TITLE.NAME] after `last`; NULL for `last`: the first one. NULL: no more. */
struct mill_deck_section *mill_deck_named(const struct mill_deck_text *text, const char *title,
                                          const struct mill_deck_section *last);
/* The same for the kinds of balls: all [balls.NAME], or [balls] */
struct mill_deck_section *mill_deck_next_balls(const struct mill_deck_text *text,
                                               const struct mill_deck_section *last);
/* The section [TITLE.NAME], or NULL */
struct mill_deck_section *mill_deck_find(const struct mill_deck_text *text, const char *title,
                                         const char *name);
/* The NAME in its title; of a section without a name: the title */
const char *mill_deck_name(const struct mill_deck_section *section);
/* May a section be called [TITLE.NAME]? */
bool mill_deck_is_name(const char *name);
/* Is `text` one of the words, which are `apart`? Upper and lower case are equal. */
bool mill_deck_is_among(const char *words, char apart, const char *text);
/* NULL: there is no such entry, or `section` is NULL. */
struct mill_deck_entry *mill_deck_entry(const struct mill_deck_section *section, const char *key);

/* ---- values (deck_value.c) ---- */

/* Reads a finite decimal number at *at and moves *at behind it. false: there is no number. */
bool mill_deck_value_number(const char **at, double *value);

/* Reads `text` into form + key->offset. false: `why` says what was expected and what was found.
 * *units: the database, which is loaded when it is first needed; NULL until then. */
bool mill_deck_value_read(struct mill_units **units, const struct mill_key *key, const char *text,
                          void *form, struct mill_error *why);
/* What a key expects: "a length such as '75 mm'", or "a length with its unit such as ..." */
void mill_deck_value_wanted(const struct mill_key *key, bool with_unit, char *out, size_t size);
/* Word number `n` of a choice, from 0, and its length; NULL: there are fewer. */
const char *mill_deck_value_word(const struct mill_key *key, int n, int *length);
/* Writes the value in SI with its unit; it reads back to the same bits. */
void mill_deck_value_print(const struct mill_key *key, const void *form, char *out, size_t size);

/* ---- files that a deck names (deck_files.c) ---- */

/* Makes the name of a file, *path, absolute. Relative names start from the deck's folder. The deck
 * owns *path afterwards. NULL stays NULL. */
bool mill_deck_files_find(struct mill_deck_text *text, const char *section, const char *key,
                          const char **path);
/* A file with rows of numbers, which a section names with a key; the deck owns the rows. */
struct mill_deck_rows {
    const struct mill_deck_text *text;
    const char *section, *key, *path;
    const char *form; /* "2 numbers 'v e': speed in m/s, restitution" */
    unsigned columns; /* bit n: a row may have n numbers; those that it does not have are 0 */
    long most;        /* rows */
    bool alone;       /* a row for each ball; faults of rows do not name the key in the deck */
    struct mill_memory_list row;  /* double[the most that `columns` allows] */
    struct mill_memory_list line; /* long: of each row, from 1 */
};

bool mill_deck_files_read(struct mill_deck_rows *rows);
/* A fault of the row in this line. Returns false. */
bool mill_deck_files_wrong(const struct mill_deck_rows *rows, long line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* ---- motions (deck_motions.c) ---- */

/* Sets *motion to the motion of this name (NULL: MILL_STILL), the value of `key` of [section]. */
bool mill_deck_motions_find(const struct mill_deck *deck, const char *section, const char *key,
                            const char *name, int *motion);
/* The vector scaled to length 1; exactly 1 along x, y or z */
vec3 mill_deck_motions_unit(vec3 a);

/* ---- materials and contact laws (deck_laws.c) ---- */

/* A material of the deck, or of the table, or of both */
struct mill_deck_found {
    char name[MILL_NAME_LENGTH];
    struct mill_deck_material is;
    const char *remark; /* "": all values are the deck's */
};
/* Finds the material that [section] names with `key`. */
bool mill_deck_materials_find(const struct mill_deck *deck, const char *section, const char *key,
                              const char *name, struct mill_deck_found *found);

/* ---- values that must agree with others (deck_checks.c) ---- */

void mill_deck_checks_run(struct mill_deck *deck);
void mill_deck_checks_parts(struct mill_deck *deck);
void mill_deck_checks_balls(struct mill_deck *deck);
void mill_deck_checks_starts(struct mill_deck *deck);
void mill_deck_checks_frames(struct mill_deck *deck);
void mill_deck_checks_powder(struct mill_deck *deck);
/* Warns of what is allowed but is probably a mistake. */
void mill_deck_warn(const struct mill_deck *deck);
/* [m^3] of the empty container: what is inside is not subtracted */
double mill_deck_checks_volume(const struct mill_deck *deck);
/* The section of surface k of the setup */
static inline const char *mill_deck_section_of(const struct mill_deck *deck, long k)
{
    return ((const char **)deck->mill.section.item)[k];
}

/* The section of what holds the balls */
static inline const char *mill_deck_holder(const struct mill_deck *deck)
{
    return deck->mill.container
               ? mill_deck_section_of(deck, deck->mill.container - deck->setup.surface)
               : "drum";
}

/* ---- what follows from the values: steps of reading ---- */

/* The contour of the drum */
void mill_deck_lining_make(struct mill_deck *deck);
/* Reads the corners of a body; *file becomes its path. */
bool mill_deck_lining_read(struct mill_deck *deck, const char *section, const char **file,
                           struct mill_body *is);
/* Warns of places of the drum's contour where not all balls fit. */
void mill_deck_lining_warn(const struct mill_deck *deck);
/* [m] the maximum height of buckles up to which all profiles are valid; at most the radius */
double mill_deck_lining_highest(int buckles, double radius);

/* Rotor and [motion.NAME], carriers first, and the drum's motion; shares of the critical speed */
void mill_deck_motions_list(struct mill_deck *deck);
void mill_deck_motions_turn(struct mill_deck *deck);

/* Shaft and blades as bodies; the [body.NAME] with their copies and kinds of contact; the speed of
 * the rotor, where that of its tips is given */
void mill_deck_bodies_parts(struct mill_deck *deck);
void mill_deck_bodies_list(struct mill_deck *deck);
void mill_deck_bodies_turn(struct mill_deck *deck);
/* Tells all blades beyond the drum. */
void mill_deck_bodies_inside(struct mill_deck *deck);

/* [m] The largest distance of the body from the x axis of its motion's frame. -1: out of memory */
double mill_deck_bodies_reach(const struct mill_solid *solid, const struct mill_body *body);
/* [m] The sides of the box around a mesh */
vec3 mill_deck_bodies_size(const struct mill_body *mesh);

/* Something gives the restitution. The law of each kind of contact, and its values of [wear] */
void mill_deck_laws_require(struct mill_deck *deck);
void mill_deck_laws_list(struct mill_deck *deck);

/* The kinds of balls, also of each class of sizes, the start file; mass and table of the powder */
void mill_deck_balls_list(struct mill_deck *deck);
void mill_deck_balls_powder(struct mill_deck *deck);

#endif
