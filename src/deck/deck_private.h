/* What the deck_*.c files share: the table of keys, the entries as read, values as text. */
#ifndef MILL_DECK_PRIVATE_H
#define MILL_DECK_PRIVATE_H

#include "deck/deck.h"
#include "deck/units.h"

#include <stddef.h>

/* ---- the table (deck_table.c) ---- */

/* Bound of all values that have no closer one: products of several stay far from overflow. */
#define MILL_DECK_LARGEST 1e9

enum { MILL_DECK_MOST_BALLS = 50000000 };

enum mill_deck_part {
    DECK_RUN,
    DECK_GRAVITY,
    DECK_BALLS,
    DECK_BALLS_NAME,
    DECK_DRUM,
    DECK_ROTOR,
    DECK_BLADES,
    DECK_BLADE_NAME,
    DECK_CONTACT,
    DECK_CONTACT_KIND,
    DECK_OUTPUT,
    DECK_PARTS
};

enum mill_deck_type {
    DECK_NUMBER, /* double; with a unit unless unit is NULL */
    DECK_VECTOR, /* vec3, three numbers and one unit */
    DECK_WHOLE,  /* long */
    DECK_SEED,   /* unsigned long */
    DECK_CHOICE, /* bool: the second of two words; or nothing when there is no home */
    DECK_FILE    /* char *, NULL for the word in `words` */
};

/* Where a value lives: the struct that `offset` counts from. */
enum mill_deck_home {
    DECK_NOWHERE,
    DECK_IN_DECK,   /* struct mill_deck */
    DECK_IN_BALLS,  /* struct mill_deck_balls */
    DECK_IN_BLADES, /* struct mill_deck_blades */
    DECK_IN_BLADE,  /* struct mill_deck_blade */
    DECK_IN_LAW     /* struct mill_law */
};

struct mill_deck_key {
    enum mill_deck_part part;
    const char *name;
    enum mill_deck_type type;
    const char *unit;   /* SI; NULL: dimensionless; "1": the same, and % is understood */
    double lo, hi;      /* range in SI, ends included unless `above` */
    bool above;         /* lo itself is out */
    bool wavy;          /* of the wavy profile alone */
    const char *preset; /* default as text; NULL: required, or `derived` */
    bool derived;       /* its default follows from other keys */
    enum mill_deck_home home;
    size_t offset;
    const char *words; /* DECK_CHOICE: "first|second"; DECK_FILE: the word for "no file" */
    const char *meaning;
};

extern const struct mill_deck_key mill_deck_table[];
extern const int mill_deck_table_length;

/* "run", ..., "balls.", "blade.", "contact.": a part whose title ends in a dot takes a NAME. */
const char *mill_deck_table_title(enum mill_deck_part part);

/* Which part a section title belongs to; DECK_PARTS when unknown. *name (may be NULL) points at
 * NAME. */
enum mill_deck_part mill_deck_table_part(const char *title, const char **name);

const struct mill_deck_key *mill_deck_table_key(enum mill_deck_part part, const char *name);

/* Adds "; did you mean ...?" or the like to why[size] for a wrong section or key, or nothing. */
void mill_deck_table_suggest_section(const char *title, char *hint, size_t size);
void mill_deck_table_suggest_key(enum mill_deck_part part, const char *name, char *hint,
                                 size_t size);

/* ---- the entries as read (deck_text.c) ---- */

struct mill_deck_entry {
    char *key;
    char *value;
    bool quoted;       /* the value stood in double quotes */
    int line;          /* in the file, from 1; 0: came by an override */
    const char *order; /* the override "SECTION.KEY=VALUE", or NULL */
};

struct mill_deck_section {
    char *title; /* as in [title] */
    enum mill_deck_part part;
    const char *name; /* NAME of a named section: points into title */
    int line;
    const char *order;
    int entries;
    struct mill_deck_entry *entry;
};

/* [blades] as given */
struct mill_deck_blades {
    long count;
    double tip_radius, width, thickness; /* [m] */
    double pitch, angle_step;            /* [rad] */
};

struct mill_deck_text {
    char *file; /* the deck as named by the user */
    int orders; /* copies of the overrides, owned */
    char **order;
    int sections;
    struct mill_deck_section *section;
    struct mill_law law;            /* [contact], before the kinds' own */
    struct mill_deck_blades blades; /* count 0: no [blades] */
};

enum { MILL_DECK_WHERE = 360 };

void mill_deck_text_free(struct mill_deck_text *text);

/* The section [title], or the first of this part when title is NULL; NULL when there is none. */
struct mill_deck_section *mill_deck_text_section(const struct mill_deck_text *text,
                                                 enum mill_deck_part part, const char *title);
const struct mill_deck_entry *mill_deck_text_entry(const struct mill_deck_section *section,
                                                   const char *key);

/* "FILE:LINE", "FILE", or "--set SECTION.KEY=VALUE"; section and entry may be NULL. */
void mill_deck_text_where(const struct mill_deck_text *text,
                          const struct mill_deck_section *section,
                          const struct mill_deck_entry *entry, char where[MILL_DECK_WHERE]);

/* The same from its parts: line 0 and order NULL leave the file alone. */
void mill_deck_text_place(const char *file, int line, const char *order,
                          char where[MILL_DECK_WHERE]);

/* The last `longest` characters: the end of a long file name tells more than its beginning. */
const char *mill_deck_text_tail(const char *text, size_t longest);

/* ---- file and overrides into entries (deck_parse.c) ---- */

/* Reads the file (NULL: none), then the overrides; section titles and keys are checked against the
 * table. */
enum mill_status mill_deck_parse(const char *path, int count, const char *const *overrides,
                                 struct mill_deck_text **text, struct mill_error *error);

/* ---- one line of the file (deck_line.c) ---- */

enum { MILL_DECK_LINE = 8192 };

enum mill_deck_line_kind {
    MILL_DECK_LINE_EMPTY,
    MILL_DECK_LINE_SECTION, /* text: "[title]" */
    MILL_DECK_LINE_KEY,     /* text: "key = value" or, when quoted, "key =" */
    MILL_DECK_LINE_WRONG,   /* wrong: what is wrong */
    MILL_DECK_LINE_END,
    MILL_DECK_LINE_FAILED /* errno tells */
};

struct mill_deck_line {
    int number; /* from 1 */
    char text[MILL_DECK_LINE];
    bool quoted;
    char value[MILL_DECK_LINE]; /* of a quoted value, its quotes removed */
    char wrong[160];
};

/* Reads the next line, comments and outer white space removed. Start with number = 0. */
enum mill_deck_line_kind mill_deck_line_next(struct mill_deck_line *line, FILE *file);

/* Writes `value` such that a deck line holding it reads back the same: in quotes where need be. */
void mill_deck_line_quote(const char *value, char *out, size_t size);

/* ---- values (deck_value.c) ---- */

/* Reads `text` into home + key->offset. false: `why` says what was expected and what is there. */
bool mill_deck_value_read(const struct mill_units *units, const struct mill_deck_key *key,
                          const char *text, void *home, struct mill_error *why);

/* What a key takes, such as "a length such as '75 mm'". */
void mill_deck_value_wanted(const struct mill_deck_key *key, char *out, size_t size);

/* The value in SI, with unit, that reads back to the same bits. */
void mill_deck_value_print(const struct mill_deck_key *key, const void *home, char *out,
                           size_t size);

/* The shortest decimal that reads back to the same double; out holds 32 characters. */
void mill_deck_value_shortest(double value, char out[32]);

/* ---- entries into the struct (deck_fill.c), and what single keys cannot tell (deck_check.c) ----
 */

enum mill_status mill_deck_fill(struct mill_deck *deck, const struct mill_units *units,
                                struct mill_error *error);
enum mill_status mill_deck_check(const struct mill_deck *deck, void (*warn)(const char *line),
                                 struct mill_error *error);

/* Is the key balls.fill, which says the count in another way and is never printed? */
bool mill_deck_fill_is_share(const struct mill_deck_key *key);

/* The struct that a key of this section lives in; `index` counts the sections of one part from 0.
 */
void *mill_deck_fill_home(const struct mill_deck *deck, const struct mill_deck_key *key,
                          const struct mill_deck_section *section, int index);

#endif
