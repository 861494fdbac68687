/* The deck's public face: read, fault, print, free. Work is split by question: deck_line.c and
 * deck_text.c what stands in the file, deck_table.c what may, deck_value.c text and numbers,
 * deck_fill.c the struct, deck_check.c what does not fit together. */
#include "deck/deck_private.h"

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
    free(deck->shape);
    free(deck->start);
    free(deck);
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

struct page {
    FILE *out;
    const char *section; /* the one being printed */
};

static void print_entry(void *self, const char *section, const char *key, const char *value,
                        const char *meaning)
{
    enum { COLUMN = 48 };
    struct page *page = self;
    if (strcmp(page->section, section) != 0) {
        page->section = section;
        fprintf(page->out, "\n[%s]\n", section);
    }
    const int used = fprintf(page->out, "%s = %s", key, value);
    fprintf(page->out, "%*s# %s\n", used > 0 && used < COLUMN ? COLUMN - used : 1, "", meaning);
}

void mill_deck_print(const struct mill_deck *deck, FILE *out)
{
    struct page page = {.out = out, .section = ""};
    fprintf(out, "# The full deck, defaults filled in, in SI units\n");
    mill_deck_each(deck, print_entry, &page);
}

struct mill_setup_drum mill_deck_drum(const struct mill_deck *deck)
{
    return (struct mill_setup_drum){
        .radius = deck->drum_radius,
        .length = deck->drum_length,
        .buckles = deck->wavy ? (int)deck->buckles : 0,
        .buckle_height = deck->wavy ? deck->buckle_height : 0.0,
        .buckle_angle = deck->wavy ? deck->buckle_angle : 0.0,
    };
}

const char *mill_deck_file(const struct mill_deck *deck)
{
    return deck->text->file;
}
