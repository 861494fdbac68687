/* Finds sections and entries of a deck that has been read. */
#include "deck/deck_private.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

struct mill_deck_section *mill_deck_section(const struct mill_deck *deck, const char *title)
{
    for (int i = 0; i < deck->sections; i++)
        if (strcmp(deck->section[i].title, title) == 0)
            return &deck->section[i];
    return NULL;
}

enum mill_status mill_deck_section_add(struct mill_deck *deck, const char *title,
                                       struct mill_error *error)
{
    const size_t size = ((size_t)deck->sections + 1) * sizeof *deck->section;
    struct mill_deck_section *more = realloc(deck->section, size);
    if (!more)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    deck->section = more;
    more[deck->sections++] = (struct mill_deck_section){.title = title, .origin = deck->at};
    return MILL_OK;
}

struct mill_deck_section *mill_deck_next(const struct mill_deck *deck,
                                         const struct mill_deck_block *block,
                                         const struct mill_deck_section *last)
{
    assert(!last || (last >= deck->section && last < deck->section + deck->sections));
    for (int i = last ? (int)(last - deck->section) + 1 : 0; i < deck->sections; i++)
        if (mill_deck_table_belongs(block, deck->section[i].title))
            return &deck->section[i];
    return NULL;
}

struct mill_deck_entry *mill_deck_entry(const struct mill_deck_section *section, const char *key)
{
    for (int i = 0; section && i < section->entries; i++)
        if (strcmp(section->entry[i].key, key) == 0)
            return &section->entry[i];
    return NULL;
}
