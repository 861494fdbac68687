/* What the deck_*.c files share: the table of sections, the entries as read, values as text. */
#ifndef MILL_DECK_PRIVATE_H
#define MILL_DECK_PRIVATE_H

#include "base/key.h"
#include "deck/deck.h"
#include "deck/units.h"

/* ---- what may stand in a deck (deck_table.c) ---- */

enum { MILL_DECK_MOST_BALLS = 50000000 };

/* Keys of one kind of section whose values live in one struct. A section may have several blocks.
 */
struct mill_deck_block {
    const char *title; /* "run": of [run], or of the [TITLE.NAME] where `named` */
    bool named;        /* every such section has a struct of its own, of `size` bytes */
    bool optional;     /* no section, no values; else all have their defaults then */
    bool unless_named; /* where there are [TITLE.NAME], the keys stand in these alone */
    bool inherits;     /* a named section's struct begins as a copy of that at `values` */
    size_t values;     /* in struct mill_deck: the struct that the keys' offsets count from */
    size_t size;
    const struct mill_key *key;          /* the last one has no name */
    const struct mill_shape_type *shape; /* of sections that name a shape, else NULL */
    const char *spared_by;               /* it may be missing where there is a [SPARED_BY.NAME] */
    /* Bits: only of sections whose first key, a choice at the start of their struct, is one of
     * these words; 0: of all. */
    unsigned words;
};

/* Block i [0..] of the table, in the order in which decks are read and printed; false: the end. */
bool mill_deck_table_block(int i, struct mill_deck_block *block);

/* Is [title] a section of this block? */
bool mill_deck_table_belongs(const struct mill_deck_block *block, const char *title);

/* The key of this name in section [title]: number `n` from 0 where the kinds of such a section have
 * several; NULL: there are no more. */
const struct mill_key *mill_deck_table_key(const char *title, const char *name, int n);

/* ---- what was meant (deck_suggest.c) ---- */

enum { MILL_DECK_MOST_EDITS = 8 };

/* How many edits make `word` of `text`; MILL_DECK_MOST_EDITS: more than a third of the word, no
 * slip of the finger. */
int mill_deck_suggest_edits(const char *word, const char *text);

/* Sets hint to "; did you mean ...?" or the like for a wrong section (name: NULL) or key, or to
 * nothing. */
void mill_deck_suggest_key(const char *title, const char *name, char *hint, size_t size);

/* ---- file and overrides into entries (deck_parse.c) ---- */

struct mill_deck_entry {
    const char *key, *value;
    bool quoted; /* the value stood in double quotes */
    struct mill_deck_origin origin;
};

struct mill_deck_section {
    const char *title; /* as in [title] */
    struct mill_deck_origin origin;
    int entries;
    struct mill_deck_entry *entry;
    void *form; /* the struct of a named section, filled from its entries and defaults */
};

/* Reads the file (NULL: none), then the overrides; section titles and keys are checked against the
 * table. Sections that are not optional and not there are added behind a file's, empty. */
enum mill_status mill_deck_parse(struct mill_deck *deck, const char *path, int count,
                                 const char *const *overrides, struct mill_error *error);

/* The section [title], or NULL. */
struct mill_deck_section *mill_deck_section(const struct mill_deck *deck, const char *title);

/* The section of the block behind `last`, or the first one where that is NULL; NULL: no more. */
struct mill_deck_section *mill_deck_next(const struct mill_deck *deck,
                                         const struct mill_deck_block *block,
                                         const struct mill_deck_section *last);

/* NULL: there is none, or no section. */
struct mill_deck_entry *mill_deck_entry(const struct mill_deck_section *section, const char *key);

/* Writes `value` such that a line holding it reads back the same: in quotes where need be. */
void mill_deck_parse_quote(const char *value, char *out, size_t size);

/* ---- values (deck_value.c) ---- */

/* Reads a finite decimal number at *at and moves on. false: there is none. */
bool mill_deck_value_number(const char **at, double *value);

/* Reads `text` into form + key->offset. false: `why` says what was expected and what is there. */
bool mill_deck_value_read(const struct mill_units *units, const struct mill_key *key,
                          const char *text, void *form, struct mill_error *why);

/* What a key takes: "a length such as '75 mm'", or "a length with its unit such as ..." */
void mill_deck_value_wanted(const struct mill_key *key, bool with_unit, char *out, size_t size);

/* Word number `n` of a choice */
void mill_deck_value_word(const struct mill_key *key, int n, char *out, size_t size);

/* The value in SI, with unit, that reads back to the same bits. */
void mill_deck_value_print(const struct mill_key *key, const void *form, char *out, size_t size);

/* ---- files that a deck names (deck_files.c) ---- */

/* The file's name, made absolute: relative names are counted from the deck's folder. *path is kept
 * by the deck. */
enum mill_status mill_deck_files_find(struct mill_deck *deck, const char *section, const char *key,
                                      const char *name, const char **path,
                                      struct mill_error *error);

/* status; a fault in such a file is told with the deck's line and key before it. */
enum mill_status mill_deck_files_told(const struct mill_deck *deck, const char *section,
                                      const char *key, enum mill_status status,
                                      struct mill_error *error);

/* Until the deck is freed */
void mill_deck_files_keep(struct mill_deck *deck, void *memory);

struct mill_deck_rows {
    FILE *in;
    const char *path;
    long line; /* of the row, from 1 */
};

/* The next row that has numbers, `most` at most: how many; 0: the end, -1: something else stands
 * there, or too many. value[most + 1] */
int mill_deck_files_row(struct mill_deck_rows *rows, int most, double *value);

/* ---- what moves (deck_motions.c), and what it carries (deck_bodies.c) ---- */

/* Lists the rotor and the [motion.NAME], carriers first, and finds who carries the drum. */
enum mill_status mill_deck_motions_list(struct mill_deck *deck, struct mill_error *error);

/* *motion: the one of this name, that section [section] gives for `key`; MILL_STILL for NULL */
enum mill_status mill_deck_motions_find(const struct mill_deck *deck, const char *section,
                                        const char *key, const char *name, int *motion,
                                        struct mill_error *error);

/* Of length 1, exactly so where that can be: along x, y or z */
vec3 mill_deck_motions_unit(vec3 a);

/* Lists the [body.NAME] with their copies and kinds of contact. */
enum mill_status mill_deck_bodies_list(struct mill_deck *deck, struct mill_error *error);

/* [m^3] of the container, whatever stands in it */
double mill_deck_bodies_volume(const struct mill_deck *deck);

/* ---- what single keys cannot tell (deck_check.c) ---- */

enum mill_status mill_deck_check(const struct mill_deck *deck, struct mill_error *error);

#endif
