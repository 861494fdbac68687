/* What the tests of decks share: a deck as a file, read and printed. */
#ifndef DECK_FIXTURE_H
#define DECK_FIXTURE_H

#include "deck/deck.h"
#include "unit.h"

#include <unistd.h>

enum { MOST_READ = 100 };
static char path[32];
static struct mill_error error;
static struct mill_deck *held[MOST_READ]; /* until the end of the test, as its pages */
static char *page[MOST_READ];
static int helds, pages;

static void make_file(void)
{
    strcpy(path, "/tmp/millsim_deck_XXXXXX");
    const int fd = mkstemp(path);
    ck_assert_int_ge(fd, 0);
    close(fd);
}

static void remove_file(void)
{
    while (helds > 0)
        mill_deck_free(held[--helds]);
    while (pages > 0)
        free(page[--pages]);
    unlink(path);
}

static enum mill_status read_text(const char *text, size_t length, struct mill_deck **deck)
{
    FILE *file = fopen(path, "wb");
    ck_assert_ptr_nonnull(file);
    ck_assert_uint_eq(fwrite(text, 1, length, file), length);
    fclose(file);
    error.text[0] = '\0';
    return mill_deck_read(path, 0, NULL, NULL, NULL, NULL, deck, &error);
}

static struct mill_deck *read_good(const char *text)
{
    ck_assert_int_lt(helds, MOST_READ);
    ck_assert_msg(read_text(text, strlen(text), &held[helds]) == MILL_OK, "%s", error.text);
    return held[helds++];
}

static char *print(const struct mill_deck *deck)
{
    size_t size = 0;
    ck_assert_int_lt(pages, MOST_READ);
    FILE *out = open_memstream(&page[pages], &size);
    ck_assert_ptr_nonnull(out);
    mill_deck_print(deck, out);
    fclose(out);
    return page[pages++];
}

#endif
