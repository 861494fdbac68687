/* The entries of a deck as read: finding them, naming where each came from, letting them go. */
#include "deck/deck_private.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *mill_deck_text_tail(const char *text, size_t longest)
{
    const size_t length = strlen(text);
    return length > longest ? text + length - longest : text;
}

enum mill_status mill_deck_text_refuse(const struct mill_deck_text *text,
                                       struct mill_deck_origin origin, const char *title,
                                       const char *key, const char *what, struct mill_error *error)
{
    char where[360];
    const char *file = mill_deck_text_tail(text->file, 240);
    if (origin.override)
        snprintf(where, sizeof where, "--%s %.240s", *file ? "set" : "value", origin.override);
    else if (origin.line > 0)
        snprintf(where, sizeof where, "%s:%d", file, origin.line);
    else
        snprintf(where, sizeof where, "%s", file);
    return mill_error_set(error, MILL_BAD_DECK, "%s: %s%.80s%s%s%.60s%s%s", where, title ? "[" : "",
                          title ? title : "", title ? "]" : "", title && key ? " " : "",
                          key ? key : "", title || key ? ": " : "", what);
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

enum mill_status mill_deck_fault(const struct mill_deck *deck, struct mill_error *error,
                                 const char *section, const char *key, const char *format, ...)
{
    char what[512], named[120];
    const struct mill_deck_section *place = mill_deck_text_section(deck->text, section);
    const struct mill_deck_entry *entry = key ? mill_deck_text_entry(place, key) : NULL;
    const struct mill_key *row = key ? mill_deck_table_key(section, key) : NULL;
    struct mill_deck_origin origin = {.line = 0};
    if (place)
        origin = entry ? entry->origin : place->origin;
    if (row && !entry && row->preset)
        snprintf(named, sizeof named, "%s (default %s)", key, row->preset);
    else
        snprintf(named, sizeof named, "%s", key ? key : "");
    va_list list;
    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    return mill_deck_text_refuse(deck->text, origin, section, key ? named : NULL, what, error);
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
