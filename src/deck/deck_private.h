/* What the deck_*.c files share: the table of sections, the entries as read, values as text. */
#ifndef MILL_DECK_PRIVATE_H
#define MILL_DECK_PRIVATE_H

#include "base/key.h"
#include "deck/deck.h"
#include "deck/units.h"

/* Where a value of the deck comes from. line 0 and no override: it is a default */
struct mill_deck_origin {
    int line;             /* in the file, from 1; 0: not from the file */
    const char *override; /* "SECTION.KEY=VALUE", or NULL */
};

/* What is needed only while a deck is read */
struct mill_deck_reading {
    struct mill_deck_origin at; /* what is being read now */
    int open;                 /* number of the section that the next lines belong to; -1: of none */
    struct mill_units *units; /* NULL until they are needed */
    struct mill_deck_faults *faults;      /* NULL: reading ends at the first one */
    struct mill_error *error;             /* the last one */
    const struct mill_start_watch *watch; /* NULL, or hears of the progress */
};

/* ---- what a deck may contain (deck_table.c) ---- */

enum { MILL_DECK_MOST_BALLS = 50000000 };

/* A block: keys of one kind of section whose values are in one struct. A section may have several
 * blocks. */
struct mill_deck_block {
    const char *title; /* "run": of [run], or of the [TITLE.NAME] where `named` */
    bool named;
    bool optional;     /* without the section: true: no values, false: the defaults */
    bool unless_named; /* if there are [TITLE.NAME], only these may have the keys */
    bool inherits;     /* the section's own struct starts as a copy of the one at `values` */
    size_t values;     /* offset in struct mill_deck of the struct with the keys' values */
    size_t size;       /* of the struct that every such section has for itself; 0: it has none */
    size_t at;         /* offset, in that struct, of the one that the keys are in */
    const struct mill_key *key; /* the last one has no name: end of the list */
    /* the section may be missing if there is a [SPARED_BY.NAME] */
    const char *spared_by;
    /* Bit k: the block belongs to sections whose first key (a choice, first in the struct) is word
     * k. 0: it belongs to all sections. */
    unsigned words;
};

/* Block i [0..] of the table, in the order in which decks are read and printed; false: the end. */
bool mill_deck_table_block(int i, struct mill_deck_block *block);

/* Does this block describe the section [title]? */
bool mill_deck_table_belongs(const struct mill_deck_block *block, const char *title);

/* ---- suggestions for wrong names (deck_suggest.c) ---- */

enum { MILL_DECK_MOST_EDITS = 8 };

/* Number of edits that turn `text` into `word`; MILL_DECK_MOST_EDITS: more than a third of the
 * word, too many for a typing error. */
int mill_deck_suggest_edits(const char *word, const char *text);

/* Sets hint to "; did you mean ...?" or a similar text for a wrong section (name: NULL) or key.
 * hint becomes empty if no name is similar. Returns the key of section [title] that was probably
 * meant, or the section without a NAME, or NULL. */
const char *mill_deck_suggest_key(const char *title, const char *name, char *hint, size_t size);

/* Words that users type for something that has another name here */
struct mill_deck_synonym {
    const char *of; /* section of the typed keys; "*": any; "": the words are sections */
    const char
        *words; /* in lower case, separated by blanks, '_' for '_', '-' or a blank in a key */
    const char
        *here; /* "drum.diameter", "balls.NAME.mass", "drum": a key or a section; NULL: none */
    const char *remark; /* follows; NULL: nothing */
};

/* Row i [0..] of the table of synonyms; NULL: the end */
const struct mill_deck_synonym *mill_deck_suggest_synonym(int i);

/* ---- faults (deck_faults.c) ---- */

/* Sets "FILE:LINE: [section] key: ...". If the value came from --set or is a default, the text says
 * so. Returns MILL_BAD_DECK. */
enum mill_status mill_deck_fault(const struct mill_deck_text *text, struct mill_error *error,
                                 const char *section, const char *key, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

/* The same while the deck is read */
enum mill_status mill_deck_wrong(const struct mill_deck_text *text, const char *section,
                                 const char *key, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* A body leaves the container: " by 2 mm" or "", time [s] */
#define MILL_DECK_LEAVES "leaves the container%s at t = %.6g s: make it smaller, or move it"

/* Prepares the deck to keep its faults. */
enum mill_status mill_deck_faults_create(const struct mill_deck_text *text);

/* Keeps the fault of a call that returned `status`, and marks the section of the last message of
 * mill_deck_fault. Returns MILL_OK if reading can continue, otherwise `status`. */
enum mill_status mill_deck_faults_keep(const struct mill_deck_text *text, enum mill_status status);

/* Counts faults of which there is no message. */
void mill_deck_faults_more(const struct mill_deck_text *text, long faults);

/* Was there a fault that is not in a known section? Then a section that is missing may be that
 * one. */
bool mill_deck_faults_lost(const struct mill_deck_text *text);

enum { MILL_DECK_CHECKS = 8 };

/* What may be wrong with a key, or with keys together */
struct mill_deck_check {
    bool wrong;
    const char *section, *key; /* to name in the message; key NULL: only the section */
    const char *sentence;      /* with `number`, or with number[0], `word`, number[1] */
    double number[4];
    const char *word; /* NULL: none */
};

/* A part of reading that uses the values of these sections */
struct mill_deck_step {
    enum mill_status (*run)(struct mill_deck *deck);
    const char *sections; /* "drum blade" stands for [drum], [blade.NAME] */
    /* instead of `run`: fill in up to MILL_DECK_CHECKS - 1 checks, or those of each kind of balls
     */
    void (*checks)(const struct mill_deck *deck, struct mill_deck_check *list);
    void (*each)(const struct mill_deck *deck, int kind, struct mill_deck_check *list);
};

/* Carries out the step, if none of its sections has a fault, and keeps its own faults. */
enum mill_status mill_deck_faults_step(struct mill_deck *deck, const struct mill_deck_step *step);

/* Warns of what is allowed but is probably a mistake. */
void mill_deck_faults_warn(const struct mill_deck *deck, const char *section, const char *key,
                           const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Tells all faults as mill_deck_read does. Returns the status of reading. */
enum mill_status mill_deck_faults_tell(struct mill_deck_text *text, enum mill_status status,
                                       void (*fault)(const char *line));

/* ---- file and overrides into entries (deck_parse.c) ---- */

/* The mend for the name of a file that a comment cuts off */
#define MILL_DECK_QUOTE "put a name with ' #' or ' ;' in double quotes"

enum mill_deck_look {
    MILL_DECK_PLAIN,
    MILL_DECK_QUOTED /* in "" */,
    MILL_DECK_CUT /* by a # or ; */
};

struct mill_deck_entry {
    const char *key, *value;  /* value NULL: a line that could not be read gives this key */
    enum mill_deck_look look; /* of the value in the file */
    struct mill_deck_origin origin;
};

struct mill_deck_section {
    const char *title; /* as in [title] */
    struct mill_deck_origin origin;
    bool broken;  /* it has a fault */
    bool guessed; /* it is missing, but an unknown section probably stands for it */
    int entries;
    struct mill_deck_entry *entry;
    void *form; /* the own struct of the section, filled from its entries and defaults */
};

/* Reads the file (NULL: none), then the overrides. Checks section titles and keys against
 * the table. Adds the sections that are required but missing after those of the file,
 * without entries. */
enum mill_status mill_deck_parse(struct mill_deck_text *text, const char *path, int count,
                                 const char *const *overrides);

void mill_deck_parse_free(struct mill_deck_text *text);

/* Writes `value` so that a line with it reads back the same, in quotes where necessary. */
void mill_deck_parse_quote(const char *value, char *out, size_t size);

/* ---- the sections and entries (deck_entries.c) ---- */

/* The section [title], or NULL. */
struct mill_deck_section *mill_deck_section(const struct mill_deck_text *text, const char *title);

/* Out of memory while the deck is read: MILL_FAILED */
enum mill_status mill_deck_memory(const struct mill_deck_text *text);

/* Adds a section without entries after the others. The caller keeps the title. */
enum mill_status mill_deck_section_add(struct mill_deck_text *text, const char *title);

/* The next section of the block after `last`; NULL for `last`: the first one. NULL: no more. */
struct mill_deck_section *mill_deck_next(const struct mill_deck_text *text,
                                         const struct mill_deck_block *block,
                                         const struct mill_deck_section *last);

/* The same for all [TITLE.NAME] */
struct mill_deck_section *mill_deck_named(const struct mill_deck_text *text, const char *title,
                                          const struct mill_deck_section *last);

/* The same for the kinds of balls: all [balls.NAME], or [balls] */
struct mill_deck_section *mill_deck_next_balls(const struct mill_deck_text *text,
                                               const struct mill_deck_section *last);

/* May a section be called [TITLE.NAME]? */
bool mill_deck_is_name(const char *name);

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

/* Word number `n` of a choice */
void mill_deck_value_word(const struct mill_key *key, int n, char *out, size_t size);

/* Writes the value in SI with its unit; it reads back to the same bits. */
void mill_deck_value_print(const struct mill_key *key, const void *form, char *out, size_t size);

/* ---- meshes (deck_meshes.c) ---- */

/* Reads the mesh of a body, which is placed already. Several faults are kept but the last. */
enum mill_status mill_deck_meshes_read(struct mill_deck *deck,
                                       const struct mill_deck_section *section,
                                       struct mill_body *is);

/* ---- files that a deck names (deck_files.c) ---- */

/* Makes the name of a file, *path, absolute. Relative names start from the deck's folder. The deck
 * owns *path afterwards. NULL stays NULL. */
enum mill_status mill_deck_files_find(struct mill_deck_text *text, const char *section,
                                      const char *key, const char **path);

/* Returns status. If the file has a fault, adds the deck's line and key in front of the error. */
enum mill_status mill_deck_files_told(const struct mill_deck_text *text, const char *section,
                                      const char *key, enum mill_status status);

/* The deck frees the memory when it is freed. */
void mill_deck_files_keep(struct mill_deck_text *text, void *memory);

enum { MILL_DECK_COLUMNS = 9 };

/* A file with rows of numbers, which a section names with a key */
struct mill_deck_rows {
    const struct mill_deck_text *text;
    const char *section, *key, *path;
    const char *form;                     /* "2 numbers 'v e': speed in m/s, restitution" */
    unsigned columns;                     /* bit n: a row may have n numbers */
    long most;                            /* rows */
    const char *many;                     /* "more than %ld rows" */
    bool alone;                           /* faults of rows do not name the key in the deck */
    const struct mill_start_watch *watch; /* NULL, or is told of the progress */
    long count, room;
    double (*row)[MILL_DECK_COLUMNS]; /* numbers that a row does not have are 0 */
    long *line;                       /* of each row, from 1 */
};

/* Reads the file. Owner of `row` and `line`, also after a failure: the caller. */
enum mill_status mill_deck_files_read(struct mill_deck_rows *rows, struct mill_error *error);

/* A fault of the row in this line. Returns MILL_BAD_DECK. */
enum mill_status mill_deck_files_wrong(const struct mill_deck_rows *rows, long line,
                                       struct mill_error *error, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* ---- motions (deck_motions.c) ---- */

/* Sets *motion to the motion of this name, which section [section] gives for `key`. NULL:
 * MILL_STILL */
enum mill_status mill_deck_motions_find(const struct mill_deck *deck, const char *section,
                                        const char *key, const char *name, int *motion);

/* The number of the motion of this name; MILL_STILL: there is none */
int mill_deck_motions_place(const struct mill_deck *deck, const char *name);

/* The vector scaled to length 1; exactly 1 along x, y or z */
vec3 mill_deck_motions_unit(vec3 a);

/* ---- materials (deck_materials.c) ---- */

/* A material of the deck, or of the table, or of both */
struct mill_deck_found {
    char name[MILL_NAME_LENGTH];
    struct mill_deck_material is;
    const char *remark; /* "": all values are the deck's */
};

/* Finds the material that [section] names with `key`. */
enum mill_status mill_deck_materials_find(const struct mill_deck *deck, const char *section,
                                          const char *key, const char *name,
                                          struct mill_deck_found *found);

/* The table of the restitution of this material, which `restitution_table` can name; NULL: none */
const struct mill_fall *mill_deck_materials_fall(const char *name);

/* Sets the density of balls whose section gives only a material. */
enum mill_status mill_deck_materials_density(const struct mill_deck *deck,
                                             struct mill_deck_balls *balls);

/* ---- contact laws (deck_laws.c) ---- */

/* The value, or where it is not given (NaN) the other one */
static inline double mill_deck_laws_first(double given, double other)
{
    return isnan(given) ? other : given;
}

/* ---- keys that must agree with others, and their checks ---- */

extern const struct mill_key mill_deck_run_key[], mill_deck_run_gravity[], mill_deck_run_output[];
void mill_deck_run_checks(const struct mill_deck *deck, struct mill_deck_check *list);
void mill_deck_run_frames(const struct mill_deck *deck, struct mill_deck_check *list);

/* Number of frames in the whole run, and the size of their ball states [GB] */
double mill_deck_run_count(const struct mill_deck *deck);
double mill_deck_run_size(const struct mill_deck *deck);

extern const struct mill_key mill_deck_mill_ball[], mill_deck_mill_start[], mill_deck_mill_drum[],
    mill_deck_mill_rotor[], mill_deck_mill_blades[], mill_deck_mill_spread[],
    mill_deck_mill_blade[], mill_deck_mill_blade_form[];
void mill_deck_mill_buckles(const struct mill_deck *deck, struct mill_deck_check *list);
void mill_deck_mill_parts(const struct mill_deck *deck, struct mill_deck_check *list);
void mill_deck_mill_sizes(const struct mill_deck *deck, int kind, struct mill_deck_check *list);
void mill_deck_mill_amount(const struct mill_deck *deck, int kind, struct mill_deck_check *list);
void mill_deck_mill_starts(const struct mill_deck *deck, struct mill_deck_check *list);

/* The drum's wall */
struct mill_profile mill_deck_mill_profile(const struct mill_deck *deck);

/* [m] the maximum height of buckles up to which all profiles are valid; at most the radius */
double mill_deck_mill_highest(int buckles, double radius);

/* [m^3] of the empty container: what is inside is not subtracted */
double mill_deck_mill_volume(const struct mill_deck *deck);

extern const struct mill_key mill_deck_uses_powder[], mill_deck_uses_heat[], mill_deck_uses_wear[];
void mill_deck_uses_checks(const struct mill_deck *deck, struct mill_deck_check *list);

/* ---- what follows from the values: steps of reading ---- */

/* The rotor and the [motion.NAME], carriers first, and the motion of the drum; the [body.NAME] with
 * their copies and kinds of contact; shaft and blades as bodies; the speed of the rotor, where that
 * of its tips is given */
enum mill_status mill_deck_motions_list(struct mill_deck *deck);
enum mill_status mill_deck_bodies_list(struct mill_deck *deck);
enum mill_status mill_deck_bodies_parts(struct mill_deck *deck);
enum mill_status mill_deck_bodies_turn(struct mill_deck *deck);
/* [m] The largest distance of the body's points from the x axis of its motion's frame. -1: out of
 * memory */
double mill_deck_bodies_reach(const struct mill_solid *solid, const struct mill_body *body);
void mill_deck_bodies_free(struct mill_deck_bodies *list);

/* Something gives the restitution: a number, a table or materials. The law of each kind of contact,
 * and its values of [wear] */
enum mill_status mill_deck_laws_require(struct mill_deck *deck);
enum mill_status mill_deck_laws_list(struct mill_deck *deck);

/* The kinds of balls with their numbers, and the start file; the mass of the powder, and its table
 */
enum mill_status mill_deck_balls_list(struct mill_deck *deck);
enum mill_status mill_deck_balls_powder(struct mill_deck *deck);

/* ---- the free volume, and blades beyond the drum, all told (deck_setup.c) ---- */
enum mill_status mill_deck_setup_inside(struct mill_deck *deck);

/* [m^3] The container without what is in it at the start. The balls need not be known yet. */
enum mill_status mill_deck_setup_free_volume(const struct mill_deck *deck, double *volume,
                                             struct mill_error *error);

/* ---- deck_warn.c ---- */

/* Warns of what is allowed but is probably a mistake. */
void mill_deck_warn(const struct mill_deck *deck);

#endif
