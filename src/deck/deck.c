/* The deck's public face: read, fault, each, print, free. Work is split by question: deck_line.c
 * and deck_text.c what stands in the file, deck_table.c what may, deck_value.c text and numbers,
 * deck_fill.c the struct, deck_check.c what does not fit together. */
#include "deck/deck_private.h"

#include <limits.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

enum mill_status mill_deck_read(const char *path, int count, const char *const *overrides,
                                void (*warn)(const char *line), struct mill_deck **deck,
                                struct mill_error *error)
{
    *deck = NULL;
    struct mill_units *units = NULL;
    struct mill_deck *made = calloc(1, sizeof *made);
    if (!made)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    enum mill_status status = mill_deck_parse(path, count, overrides, &made->text, error);
    if (status == MILL_OK)
        status = mill_units_create(&units, error);
    if (status == MILL_OK)
        status = mill_deck_fill(made, units, error);
    if (status == MILL_OK)
        status = mill_deck_check(made, warn, error);
    mill_units_free(units);
    if (status == MILL_OK)
        *deck = made;
    else
        mill_deck_free(made);
    return status;
}

void mill_deck_free(struct mill_deck *deck)
{
    if (!deck)
        return;
    mill_deck_text_free(deck->text);
    free(deck->balls);
    free(deck->blade);
    free(deck->start);
    free(deck);
}

enum mill_status mill_deck_fault(const struct mill_deck *deck, struct mill_error *error,
                                 const char *section, const char *key, const char *format, ...)
{
    char where[MILL_DECK_WHERE], what[512], remark[80] = "";
    const struct mill_deck_section *place = mill_deck_text_section(deck->text, DECK_PARTS, section);
    const struct mill_deck_entry *entry = key ? mill_deck_text_entry(place, key) : NULL;
    const struct mill_deck_key *row =
        key ? mill_deck_table_key(mill_deck_table_part(section, NULL), key) : NULL;
    if (row && !entry && row->preset)
        snprintf(remark, sizeof remark, " (default %s)", row->preset);
    va_list list;
    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    mill_deck_text_where(deck->text, place, entry, where);
    return mill_error_set(error, MILL_BAD_DECK, "%s: [%s]%s%s%s: %s", where, section,
                          key ? " " : "", key ? key : "", remark, what);
}

struct printing {
    const struct mill_deck *deck;
    void (*entry)(void *self, const char *section, const char *key, const char *value,
                  const char *meaning);
    void *self;
    char *value; /* room for one */
    size_t size;
};

/* A key that is off and says nothing of the run, or whose value is yet to be found. */
static bool says_nothing(const struct mill_deck *deck, const struct mill_deck_key *key)
{
    if (key->home != DECK_IN_DECK)
        return false;
    return (key->offset == offsetof(struct mill_deck, precision) && deck->precision == 0) ||
           (key->offset == offsetof(struct mill_deck, max_collisions) &&
            deck->max_collisions == 0) ||
           (key->offset == offsetof(struct mill_deck, sample_from) && deck->sample_found);
}

static void print_section(const struct printing *p, enum mill_deck_part part,
                          const struct mill_deck_section *section, int index)
{
    const bool mixture = mill_deck_text_section(p->deck->text, DECK_BALLS_NAME, NULL) != NULL;
    for (int i = 0; i < mill_deck_table_length; i++) {
        const struct mill_deck_key *key = &mill_deck_table[i];
        if (key->part != part || (key->wavy && !p->deck->wavy))
            continue;
        if (mill_deck_fill_is_share(key))
            continue;
        if (mixture && part == DECK_BALLS && key->home == DECK_IN_BALLS)
            continue;
        if (says_nothing(p->deck, key))
            continue;
        mill_deck_value_print(key, mill_deck_fill_home(p->deck, key, section, index), p->value,
                              p->size);
        p->entry(p->self, section ? section->title : mill_deck_table_title(part), key->name,
                 p->value, key->meaning);
    }
}

void mill_deck_each(const struct mill_deck *deck,
                    void (*entry)(void *self, const char *section, const char *key,
                                  const char *value, const char *meaning),
                    void *self)
{
    char value[2 * PATH_MAX + 8];
    const struct printing p = {deck, entry, self, value, sizeof value};
    const struct mill_deck_text *text = deck->text;
    for (int part = 0; part < DECK_PARTS; part++) {
        const char *title = mill_deck_table_title((enum mill_deck_part)part);
        const bool named = title[strlen(title) - 1] == '.';
        const bool optional = part == DECK_ROTOR || part == DECK_BLADES;
        int index = 0;
        for (int i = 0; named && i < text->sections; i++)
            if (text->section[i].part == (enum mill_deck_part)part)
                print_section(&p, (enum mill_deck_part)part, &text->section[i], index++);
        const struct mill_deck_section *section =
            mill_deck_text_section(text, (enum mill_deck_part)part, NULL);
        if (!named && (section || !optional))
            print_section(&p, (enum mill_deck_part)part, section, 0);
    }
}

struct page {
    FILE *out;
    char section[MILL_NAME_LENGTH + 16]; /* the one being printed */
};

static void print_entry(void *self, const char *section, const char *key, const char *value,
                        const char *meaning)
{
    enum { COLUMN = 48 };
    struct page *page = self;
    if (strcmp(page->section, section) != 0) {
        snprintf(page->section, sizeof page->section, "%s", section);
        fprintf(page->out, "\n[%s]\n", section);
    }
    const int used = fprintf(page->out, "%s = %s", key, value);
    fprintf(page->out, "%*s# %s\n", used > 0 && used < COLUMN ? COLUMN - used : 1, "", meaning);
}

void mill_deck_print(const struct mill_deck *deck, FILE *out)
{
    struct page page = {out, ""};
    fprintf(out, "# The full deck, defaults filled in, in SI units\n");
    mill_deck_each(deck, print_entry, &page);
}

double mill_deck_drum_reach(const struct mill_deck *deck)
{
    return deck->drum_radius + (deck->wavy ? deck->buckle_height : 0.0);
}

double mill_deck_drum_bore(const struct mill_deck *deck)
{
    return deck->drum_radius - (deck->wavy ? deck->buckle_height : 0.0);
}

const char *mill_deck_file(const struct mill_deck *deck)
{
    return deck->text->file;
}
