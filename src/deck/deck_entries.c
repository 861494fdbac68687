/* Finds sections and entries of a deck that has been read. */
#include "deck/deck_private.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

struct mill_deck_section *mill_deck_section(const struct mill_deck_text *text, const char *title)
{
    for (int i = 0; i < text->sections; i++)
        if (strcmp(text->section[i].title, title) == 0)
            return &text->section[i];
    return NULL;
}

enum mill_status mill_deck_memory(const struct mill_deck_text *text)
{
    return mill_error_set(text->reading->error, MILL_FAILED, "out of memory");
}

enum mill_status mill_deck_section_add(struct mill_deck_text *text, const char *title)
{
    const size_t size = ((size_t)text->sections + 1) * sizeof *text->section;
    struct mill_deck_section *more = realloc(text->section, size);
    if (!more)
        return mill_deck_memory(text);
    text->section = more;
    more[text->sections++] =
        (struct mill_deck_section){.title = title, .origin = text->reading->at};
    return MILL_OK;
}

struct mill_deck_section *mill_deck_next(const struct mill_deck_text *text,
                                         const struct mill_deck_block *block,
                                         const struct mill_deck_section *last)
{
    assert(!last || (last >= text->section && last < text->section + text->sections));
    for (int i = last ? (int)(last - text->section) + 1 : 0; i < text->sections; i++)
        if (mill_deck_table_belongs(block, text->section[i].title))
            return &text->section[i];
    return NULL;
}

struct mill_deck_section *mill_deck_named(const struct mill_deck_text *text, const char *title,
                                          const struct mill_deck_section *last)
{
    return mill_deck_next(text, &(struct mill_deck_block){.title = title, .named = true}, last);
}

struct mill_deck_section *mill_deck_next_balls(const struct mill_deck_text *text,
                                               const struct mill_deck_section *last)
{
    struct mill_deck_section *next = mill_deck_named(text, "balls", last);
    return next || last ? next : mill_deck_section(text, "balls");
}

bool mill_deck_is_name(const char *name)
{
    static const char allowed[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+.";
    return *name && !strchr("-+.", *name) && !name[strspn(name, allowed)];
}

struct mill_deck_entry *mill_deck_entry(const struct mill_deck_section *section, const char *key)
{
    for (int i = 0; section && i < section->entries; i++)
        if (strcmp(section->entry[i].key, key) == 0)
            return &section->entry[i];
    return NULL;
}
