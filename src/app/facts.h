/* Facts: what another program says of its run, numbers and texts for /run, each with unit and
 * meaning */
#ifndef MILL_FACTS_H
#define MILL_FACTS_H

#include "store/h5.h"

#define MILL_FACTS_PART "normal" /* the part of the loss in a single impact that is known of it */

struct mill_facts_list {
    size_t count;
    struct mill_fact *fact;
};

/* Adds a fact from a record: name, unit, meaning, type ("f8", "u8", "text"), each followed by a 0,
 * and the value. Replaces an earlier fact of this name. MILL_FAILED: the record is no fact. */
enum mill_status mill_facts_take(struct mill_facts_list *facts, const char *bytes, size_t length,
                                 struct mill_error *error);

/* The text of a fact, or "" */
const char *mill_facts_text(const struct mill_facts_list *facts, const char *name);

/* MILL_FAILED: a fact that every file needs is missing. */
enum mill_status mill_facts_check(const struct mill_facts_list *facts, struct mill_error *error);

/* Writes all facts to /run except the one named `except`. */
void mill_facts_write(const struct mill_facts_list *facts, struct mill_h5 *file,
                      const char *except);
void mill_facts_free(struct mill_facts_list *facts);

#endif
