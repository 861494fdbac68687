/* The entries of a deck as read: finding them, naming where each came from, letting them go. */
#include "deck/deck_private.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

const char *mill_deck_text_tail(const char *text, size_t longest)
{
    const size_t length = strlen(text);
    return length > longest ? text + length - longest : text;
}

void mill_deck_text_place(const char *file, struct mill_deck_origin origin,
                          char where[MILL_DECK_WHERE])
{
    enum { LONGEST = 240 };
    if (origin.override)
        snprintf(where, MILL_DECK_WHERE, "--set %.*s", LONGEST, origin.override);
    else if (origin.line > 0)
        snprintf(where, MILL_DECK_WHERE, "%s:%d", mill_deck_text_tail(file, LONGEST), origin.line);
    else
        snprintf(where, MILL_DECK_WHERE, "%s", mill_deck_text_tail(file, LONGEST));
}

struct mill_deck_section *mill_deck_text_section(const struct mill_deck_text *text,
                                                 const char *title)
{
    for (int i = 0; i < text->sections; i++)
        if (strcmp(text->section[i].title, title) == 0)
            return &text->section[i];
    return NULL;
}

struct mill_deck_section *mill_deck_text_next(const struct mill_deck_text *text,
                                              const struct mill_deck_block *block,
                                              const struct mill_deck_section *last)
{
    assert(!last || (last >= text->section && last < text->section + text->sections));
    for (int i = last ? (int)(last - text->section) + 1 : 0; i < text->sections; i++)
        if (mill_deck_table_belongs(block, text->section[i].title, NULL))
            return &text->section[i];
    return NULL;
}

struct mill_deck_entry *mill_deck_text_entry(const struct mill_deck_section *section,
                                             const char *key)
{
    for (int i = 0; section && i < section->entries; i++)
        if (strcmp(section->entry[i].key, key) == 0)
            return &section->entry[i];
    return NULL;
}

void mill_deck_text_free(struct mill_deck_text *text)
{
    if (!text)
        return;
    for (int i = 0; i < text->sections; i++) {
        free(text->section[i].entry);
        free(text->section[i].form);
    }
    for (int i = 0; i < text->overrides; i++)
        free(text->override[i]);
    free(text->override);
    free(text->section);
    free(text->bytes);
    free(text);
}
