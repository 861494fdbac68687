/* Finds rows of the tables of keys, and sections and entries of a deck that has been read. */
#include "deck/deck_private.h"

#include <strings.h>

const struct mill_key *mill_deck_table_keys(const struct mill_deck_block *block)
{
    return block->solid && block->solid->key ? block->solid->key : block->key;
}

bool mill_deck_table_belongs(const struct mill_deck_block *block, const char *title)
{
    const size_t length = strlen(block->title);
    return strncmp(title, block->title, length) == 0 &&
           title[length] == (block->named ? '.' : '\0');
}

const struct mill_deck_block *mill_deck_table_find(const char *title)
{
    const struct mill_deck_block *b = mill_deck_table;
    while (b->title && !mill_deck_table_belongs(b, title))
        b++;
    return b->title ? b : NULL;
}

const struct mill_key *mill_deck_table_key(const char *title, const char *name, int n)
{
    for (const struct mill_deck_block *b = mill_deck_table; b->title; b++)
        for (const struct mill_key *key = mill_deck_table_keys(b); key->name; key++)
            if (mill_deck_table_belongs(b, title) && strcmp(key->name, name) == 0 && n-- == 0)
                return key;
    return NULL;
}

struct mill_deck_section *mill_deck_section(const struct mill_deck_text *text, const char *title)
{
    struct mill_deck_section *s = text->section;
    while (s && strcmp(s->title, title) != 0)
        s = s->next;
    return s;
}

struct mill_deck_section *mill_deck_named(const struct mill_deck_text *text, const char *title,
                                          const struct mill_deck_section *last)
{
    const struct mill_deck_block block = {.title = title, .named = true};
    struct mill_deck_section *s = last ? last->next : text->section;
    while (s && !mill_deck_table_belongs(&block, s->title))
        s = s->next;
    return s;
}

struct mill_deck_section *mill_deck_find(const struct mill_deck_text *text, const char *title,
                                         const char *name)
{
    struct mill_deck_section *s = NULL;
    while ((s = mill_deck_named(text, title, s)) && strcmp(mill_deck_name(s), name) != 0)
        continue;
    return s;
}

struct mill_deck_section *mill_deck_next_balls(const struct mill_deck_text *text,
                                               const struct mill_deck_section *last)
{
    struct mill_deck_section *next = mill_deck_named(text, "balls", last);
    return next || last ? next : mill_deck_section(text, "balls");
}

const char *mill_deck_name(const struct mill_deck_section *section)
{
    const char *point = strchr(section->title, '.');
    return point ? point + 1 : section->title;
}

bool mill_deck_is_name(const char *name)
{
    static const char allowed[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+.";
    return *name && !strchr("-+.", *name) && !name[strspn(name, allowed)];
}

bool mill_deck_is_among(const char *words, char apart, const char *text)
{
    const size_t length = strlen(text);
    for (const char *p = words; p; p = strchr(p, apart), p = p ? p + 1 : p)
        if (strncasecmp(p, text, length) == 0 && (!p[length] || p[length] == apart))
            return true;
    return false;
}

struct mill_deck_entry *mill_deck_entry(const struct mill_deck_section *section, const char *key)
{
    struct mill_deck_entry *e = section ? section->entry : NULL;
    while (e && strcmp(e->key, key) != 0)
        e = e->next;
    return e;
}
