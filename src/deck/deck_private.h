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
};

/* Block i [0..] of the table, in the order in which decks are read and printed; false: the end. */
bool mill_deck_table_block(int i, struct mill_deck_block *block);

/* Is [title] a section of this block? */
bool mill_deck_table_belongs(const struct mill_deck_block *block, const char *title);

/* The key of this name in section [title]; NULL: there is none. */
const struct mill_key *mill_deck_table_key(const char *title, const char *name);

/* Sets hint to "; did you mean ...?" or the like for a wrong section (name: NULL) or key, or to
 * nothing. */
void mill_deck_table_suggest(const char *title, const char *name, char *hint, size_t size);

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

/* The value in SI, with unit, that reads back to the same bits. */
void mill_deck_value_print(const struct mill_key *key, const void *form, char *out, size_t size);

/* ---- what single keys cannot tell (deck_check.c) ---- */

enum mill_status mill_deck_check(const struct mill_deck *deck, void (*warn)(const char *line),
                                 struct mill_error *error);

#endif
