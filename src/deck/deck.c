/* The deck's public face: read, print, free. Work is split by question: deck_parse.c and
 * deck_text.c what stands in the file, deck_table.c what may, deck_value.c text and numbers,
 * deck_fill.c the struct, deck_check.c what does not fit together. */
#include "deck/deck_private.h"

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

const char *mill_deck_file(const struct mill_deck *deck)
{
    return deck->text->file;
}
