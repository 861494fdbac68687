/* Facts: what another program says of its run, numbers and texts for /run, each with unit and
 * meaning */
#ifndef MILL_FACTS_H
#define MILL_FACTS_H

#include "store/h5.h"

struct mill_fact {
    char *name; /* the memory that holds all texts of the fact */
    const char *unit, *meaning, *text;
    enum mill_h5_type type; /* MILL_H5_F64, MILL_H5_U64 or MILL_H5_TEXT */
    double number;
    uint64_t count;
};

struct mill_facts_list {
    size_t count;
    struct mill_fact *fact;
};

/* Adds a fact from a record: name, unit, meaning, type ("f8", "u8", "text"), each followed by a 0,
 * and the value. Replaces an earlier fact of this name. MILL_FAILED: the record is no fact. */
enum mill_status mill_facts_take(struct mill_facts_list *facts, const char *bytes, size_t length,
                                 struct mill_error *error);

/* NULL: there is no fact of this name. */
const struct mill_fact *mill_facts_find(const struct mill_facts_list *facts, const char *name);

/* The text of a fact, or "" */
const char *mill_facts_text(const struct mill_facts_list *facts, const char *name);

/* MILL_FAILED: a fact that every file needs is missing. */
enum mill_status mill_facts_check(const struct mill_facts_list *facts, struct mill_error *error);

/* Writes all facts to /run except the one named `except`. */
void mill_facts_write(const struct mill_facts_list *facts, struct mill_h5 *file,
                      const char *except);
void mill_facts_free(struct mill_facts_list *facts);

#endif
