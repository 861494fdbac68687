/* Finds sections and entries of a deck that has been read. */
#include "deck/deck_private.h"

#include <assert.h>
#include <string.h>

struct mill_deck_section *mill_deck_section(const struct mill_deck *deck, const char *title)
{
    for (int i = 0; i < deck->sections; i++)
        if (strcmp(deck->section[i].title, title) == 0)
            return &deck->section[i];
    return NULL;
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
