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

void mill_deck_text_place(const char *file, int line, const char *override,
                          char where[MILL_DECK_WHERE])
{
    enum { LONGEST = 240 };
    if (override)
        snprintf(where, MILL_DECK_WHERE, "--set %.*s", LONGEST, override);
    else if (line > 0)
        snprintf(where, MILL_DECK_WHERE, "%s:%d", mill_deck_text_tail(file, LONGEST), line);
    else
        snprintf(where, MILL_DECK_WHERE, "%s", mill_deck_text_tail(file, LONGEST));
}

void mill_deck_text_where(const struct mill_deck_text *text,
                          const struct mill_deck_section *section,
                          const struct mill_deck_entry *entry, char where[MILL_DECK_WHERE])
{
    if (entry)
        mill_deck_text_place(text->file, entry->line, entry->override, where);
    else
        mill_deck_text_place(text->file, section ? section->line : 0,
                             section ? section->override : NULL, where);
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

int mill_deck_text_named(const struct mill_deck_text *text, const char *title)
{
    const struct mill_deck_block block = {.title = title, .named = true};
    const struct mill_deck_section *section = NULL;
    int count = 0;
    while ((section = mill_deck_text_next(text, &block, section)))
        count++;
    return count;
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
        struct mill_deck_section *section = &text->section[i];
        for (int k = 0; k < section->entries; k++) {
            free(section->entry[k].key);
            free(section->entry[k].value);
        }
        free(section->entry);
        free(section->title);
        free(section->form);
    }
    free(text->section);
    for (int i = 0; i < text->overrides; i++)
        free(text->override[i]);
    free(text->override);
    free(text->file);
    free(text);
}
