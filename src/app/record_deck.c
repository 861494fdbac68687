/* What a reader needs to repeat a run: the deck as run (/deck), entry by entry and as a text that
 * is itself a deck. And the comparison of such a text with the deck of a run that is to go on. */
#include "app/record.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void write_entry(void *self, const char *section, const char *key, const char *value,
                        const char *meaning)
{
    char path[4 * MILL_NAME_LENGTH];
    char *name = path + strlen("/deck/");
    snprintf(path, sizeof path, "/deck/%s|%s", section, key);
    for (; *name; name++) /* a name from the deck must not become a path of its own */
        *name = *name == '/' ? '_' : *name;
    *strrchr(path, '|') = '/';
    mill_h5_write_text(self, path, value, meaning);
}

/* NULL: out of memory. Owner: the caller. */
static char *print_deck(const struct mill_deck *deck)
{
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (!stream)
        return NULL;
    mill_deck_print(deck, stream);
    if (fclose(stream) == 0)
        return text;
    free(text);
    return NULL;
}

void mill_record_deck(struct mill_h5 *file, const struct mill_deck *deck)
{
    mill_deck_each(deck, write_entry, file);
    char *text = print_deck(deck);
    if (text)
        mill_h5_write_text(file, "/deck/text", text,
                           "the deck as run, with all defaults; itself a deck");
    else
        mill_h5_spend(file, "out of memory for the deck's text");
    free(text);
}

/* The next line that says something of the run, without the comment behind it: neither empty, nor
 * where the checkpoints' interval is set, which changes nothing; of a start file the name without
 * its folder, which may have moved. Headers go to `section`. False at the end of the text. */
static bool next_line(const char **text, char *section, char *line, size_t size)
{
    while (**text) {
        const size_t length = strcspn(*text, "\n");
        snprintf(line, size, "%.*s", (int)length, *text);
        *text += length + ((*text)[length] == '\n');
        char *comment = strstr(line, " #");
        if (comment)
            *comment = '\0';
        for (size_t end = strlen(line); end > 0 && line[end - 1] == ' '; end--)
            line[end - 1] = '\0';
        const char *folder = strrchr(line, '/');
        if (folder && strncmp(line, "start = /", 9) == 0)
            memmove(line + strlen("start = "), folder + 1, strlen(folder));
        if (line[0] == '[')
            snprintf(section, size, "%s", line);
        if (line[0] && line[0] != '#' && strncmp(line, "checkpoint = ", 13) != 0)
            return true;
    }
    line[0] = section[0] = '\0';
    return false;
}

/* Says where two decks differ, at the lines `there` and `here` (empty: at the end). */
static enum mill_status tell_difference(const char *name, const char *old, const char *new,
                                        const char *section, const char *there, const char *here,
                                        struct mill_error *error)
{
    static const char mend[] = "resume it with its own deck, or start again with --force";
    if (there[0] == '[' && !strstr(new, there))
        return mill_error_set(error, MILL_BAD_DECK,
                              "%s: is of another deck: it has a section %s, and this one has none; "
                              "%s",
                              name, there, mend);
    if (here[0] == '[' && !strstr(old, here))
        return mill_error_set(error, MILL_BAD_DECK,
                              "%s: is of another deck: it has no section %s, and this one has; %s",
                              name, here, mend);
    return mill_error_set(
        error, MILL_BAD_DECK, "%s: is of another deck: %s '%.400s' there, '%.400s' here; %s", name,
        section, there[0] ? there : "nothing more", here[0] ? here : "nothing more", mend);
}

enum mill_status mill_record_compare(struct mill_h5 *file, const char *name,
                                     const struct mill_deck *deck, struct mill_error *error)
{
    enum { LINE = 4500 }; /* a path, and what stands around it */
    char there[LINE], here[LINE], section_there[LINE] = "", section_here[LINE] = "";
    char *old = NULL, *new = print_deck(deck);
    if (!new)
        return mill_error_set(error, MILL_FAILED, "out of memory for the deck's text");
    enum mill_status status = mill_h5_read_text(file, "/deck/text", &old, NULL);
    if (status != MILL_OK)
        mill_error_set(error, status, "%s: is not an output file of millsim", name);
    const char *from = old, *to = new;
    bool more = status == MILL_OK;
    while (more) {
        more = next_line(&from, section_there, there, LINE);
        more = next_line(&to, section_here, here, LINE) || more;
        if (strcmp(there, here) == 0 && strcmp(section_there, section_here) == 0)
            continue;
        status = tell_difference(name, old, new, section_here, there, here, error);
        break;
    }
    free(old);
    free(new);
    return status;
}
