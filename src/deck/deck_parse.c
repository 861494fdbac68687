/* From the deck's file and the command line's overrides to sections and entries, each of which
 * knows where it came from. libinih splits the lines that deck_line.c hands it; since it asks for
 * one line at a time and reports an entry at once, the number of the line last handed out is the
 * entry's. Section titles, keys and repetitions are checked on the way, so a message names the
 * first wrong line of the file. */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <errno.h>
#include <ini.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SECTIONS = 10000, LONGEST_TITLE = 49 }; /* libinih cuts a title there */

struct reading {
    FILE *file;
    struct mill_deck_text *text;
    struct mill_deck_line line;
    const char *order; /* the override at hand, or NULL */
    struct mill_deck_section *section;
    enum mill_status status;
    struct mill_error *error;
};

static char *copy(const char *text)
{
    char *made = malloc(strlen(text) + 1);
    return made ? strcpy(made, text) : NULL;
}

/* Room for one more item behind `count`: grows at powers of two. NULL: no memory, items still
 * valid. */
static void *extend(void *items, int count, size_t size)
{
    if ((count & (count - 1)) != 0)
        return items;
    return realloc(items, (count ? 2 * (size_t)count : 1) * size);
}

static enum mill_status no_memory(struct reading *reading)
{
    reading->status = mill_error_set(reading->error, MILL_FAILED, "out of memory");
    return reading->status;
}

/* "FILE:LINE: [title] key: what hint", title and key left out where NULL. */
static enum mill_status refuse(struct reading *reading, const char *title, const char *key,
                               const char *what, const char *hint)
{
    char where[MILL_DECK_WHERE];
    mill_deck_text_place(reading->text->file, reading->line.number, reading->order, where);
    reading->status =
        mill_error_set(reading->error, MILL_BAD_DECK, "%s: %s%.60s%s%.60s%s%s%s", where,
                       title ? "[" : "", title ? title : "", title ? (key ? "] " : "]: ") : "",
                       key ? key : "", key ? ": " : "", what, hint);
    return reading->status;
}

static bool good_name(const char *name)
{
    static const char allowed[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+.";
    return *name && !strchr("-+.", *name) && name[strspn(name, allowed)] == '\0';
}

static bool kind_name(const char *name)
{
    int kind = 0;
    while (kind < MILL_KINDS && strcmp(name, mill_kind_name[kind]) != 0)
        kind++;
    return kind < MILL_KINDS;
}

/* false and refused: no such section may be. */
static bool check_title(struct reading *reading, const char *title, enum mill_deck_part *part)
{
    char hint[160] = "";
    const char *name = "";
    if (strlen(title) > LONGEST_TITLE) {
        refuse(reading, title, NULL, "the section's name is longer than 49 characters", "");
        return false;
    }
    *part = mill_deck_table_part(title, &name);
    if (*part == DECK_PARTS) {
        mill_deck_table_suggest_section(title, hint, sizeof hint);
        refuse(reading, title, NULL, "unknown section", hint);
        return false;
    }
    if (*part == DECK_CONTACT_KIND && !kind_name(name)) {
        refuse(reading, title, NULL, "unknown kind of contact; there are ball_ball, ball_drum, ",
               "ball_wall, ball_shaft and ball_blade");
        return false;
    }
    if ((*part == DECK_BALLS_NAME || *part == DECK_BLADE_NAME) && !good_name(name)) {
        refuse(reading, title, NULL,
               "a name is made of letters, digits and _ and, behind these, -+.", "");
        return false;
    }
    return true;
}

/* Makes the section `title` the current one; a new one is added. */
static void open_section(struct reading *reading, const char *title)
{
    struct mill_deck_text *text = reading->text;
    enum mill_deck_part part = DECK_PARTS;
    if (!check_title(reading, title, &part))
        return;
    if (text->sections == MOST_SECTIONS) {
        refuse(reading, title, NULL, "there are more than 10000 sections", "");
        return;
    }
    struct mill_deck_section *more = extend(text->section, text->sections, sizeof *more);
    if (!more) {
        no_memory(reading);
        return;
    }
    text->section = more;
    struct mill_deck_section *made = &text->section[text->sections];
    *made = (struct mill_deck_section){0};
    made->title = copy(title);
    made->part = part;
    made->line = reading->order ? 0 : reading->line.number;
    made->order = reading->order;
    if (!made->title) {
        no_memory(reading);
        return;
    }
    mill_deck_table_part(made->title, &made->name);
    text->sections++;
    reading->section = made;
}

static void open_section_line(struct reading *reading)
{
    char title[MILL_DECK_LINE], hint[60];
    const size_t length = strlen(reading->line.text) - 2;
    memcpy(title, reading->line.text + 1, length);
    title[length] = '\0';
    const struct mill_deck_section *old = mill_deck_text_section(reading->text, DECK_PARTS, title);
    if (old) {
        snprintf(hint, sizeof hint, " (first in line %d)", old->line);
        refuse(reading, title, NULL, "the section is there twice", hint);
        return;
    }
    open_section(reading, title);
}

/* Adds key = value to the current section, or replaces the value there when an override says so. */
static void add_entry(struct reading *reading, const char *key, const char *value, bool quoted)
{
    struct mill_deck_section *section = reading->section;
    char hint[160];
    if (!mill_deck_table_key(section->part, key)) {
        mill_deck_table_suggest_key(section->part, key, hint, sizeof hint);
        refuse(reading, section->title, key,
               *key ? "unknown key" : "there is no key in front of '='", hint);
        return;
    }
    struct mill_deck_entry *entry = NULL;
    for (int i = 0; i < section->entries; i++)
        if (strcmp(section->entry[i].key, key) == 0)
            entry = &section->entry[i];
    if (entry && !reading->order) {
        snprintf(hint, sizeof hint, " (first in line %d)", entry->line);
        refuse(reading, section->title, key, "the key is there twice", hint);
        return;
    }
    if (!entry) {
        struct mill_deck_entry *more = extend(section->entry, section->entries, sizeof *more);
        if (!more) {
            no_memory(reading);
            return;
        }
        section->entry = more;
        entry = &section->entry[section->entries++];
        *entry = (struct mill_deck_entry){0};
        entry->key = copy(key);
    }
    free(entry->value);
    entry->value = copy(value);
    entry->quoted = quoted;
    entry->line = reading->order ? 0 : reading->line.number;
    entry->order = reading->order;
    if (!entry->key || !entry->value)
        no_memory(reading);
}

/* libinih's reader: the next line that says something, or NULL at the end and after a fault. */
static char *hand_line(char *room, int size, void *self)
{
    struct reading *reading = self;
    struct mill_deck_line *line = &reading->line;
    while (reading->status == MILL_OK) {
        switch (mill_deck_line_next(line, reading->file)) {
        case MILL_DECK_LINE_END:
            return NULL;
        case MILL_DECK_LINE_FAILED:
            reading->status =
                mill_error_set(reading->error, MILL_FAILED, "%.400s: cannot be read: %s",
                               mill_deck_text_tail(reading->text->file, 400), strerror(errno));
            return NULL;
        case MILL_DECK_LINE_WRONG:
            refuse(reading, NULL, NULL, line->wrong, "");
            return NULL;
        case MILL_DECK_LINE_EMPTY:
            continue;
        case MILL_DECK_LINE_SECTION:
            open_section_line(reading);
            break;
        case MILL_DECK_LINE_KEY:
            break;
        }
        if (reading->status == MILL_OK && strlen(line->text) < (size_t)size)
            return strcpy(room, line->text);
        if (reading->status == MILL_OK)
            refuse(reading, NULL, NULL,
                   "the line is longer than 199 characters; put a long file name ",
                   "in double quotes");
    }
    return NULL;
}

static int take_entry(void *self, const char *section, const char *key, const char *value)
{
    struct reading *reading = self;
    if (reading->status != MILL_OK)
        return 0;
    reading->section = mill_deck_text_section(reading->text, DECK_PARTS, section);
    if (!reading->section)
        refuse(reading, NULL, key, "stands before the first [section]", "");
    else
        add_entry(reading, key, reading->line.quoted ? reading->line.value : value,
                  reading->line.quoted);
    return reading->status == MILL_OK;
}

static void read_file(struct reading *reading, const char *path)
{
    const char *wrong, *name = mill_deck_text_tail(path, 400);
    reading->file = mill_textfile_open(path, &wrong);
    if (!reading->file) {
        reading->status =
            wrong ? mill_error_set(reading->error, MILL_BAD_DECK, "%.400s: %s", name, wrong)
                  : mill_error_set(reading->error, MILL_FAILED, "%.400s: cannot be read: %s", name,
                                   strerror(errno));
        return;
    }
    const int line = ini_parse_stream(hand_line, reading, take_entry, reading);
    fclose(reading->file);
    if (reading->status == MILL_OK && line != 0)
        refuse(reading, NULL, NULL, "expected '[section]' or 'key = value'", "");
    if (reading->status == MILL_OK && reading->text->sections == 0)
        reading->status = mill_error_set(
            reading->error, MILL_BAD_DECK,
            "%.400s: the deck is empty: expected sections such as [run] and [drum]", name);
}

/* SECTION.KEY=VALUE; SECTION may hold dots itself. */
static void apply_order(struct reading *reading, const char *order)
{
    reading->order = order;
    const char *equals = strchr(order, '=');
    const char *dot = equals;
    while (dot && dot > order && *dot != '.')
        dot--;
    if (!equals || dot == order) {
        refuse(reading, NULL, NULL, "expected SECTION.KEY=VALUE such as 'rotor.speed=1000 rpm'",
               "");
        return;
    }
    char title[64], key[64];
    if (dot - order >= (long)sizeof title || equals - dot > (long)sizeof key) {
        refuse(reading, NULL, NULL, "the name of the section or key is too long", "");
        return;
    }
    snprintf(title, sizeof title, "%.*s", (int)(dot - order), order);
    snprintf(key, sizeof key, "%.*s", (int)(equals - dot - 1), dot + 1);
    for (const char *p = order; *p; p++) {
        if ((unsigned char)*p < 32 || *p == 127) {
            refuse(reading, NULL, NULL, "holds a control character", "");
            return;
        }
    }
    const char *value = equals + 1 + strspn(equals + 1, " \t");
    size_t length = strlen(value);
    while (length > 0 && (value[length - 1] == ' ' || value[length - 1] == '\t'))
        length--;
    char *trimmed = copy(value);
    if (!trimmed) {
        no_memory(reading);
        return;
    }
    trimmed[length] = '\0';
    reading->section = mill_deck_text_section(reading->text, DECK_PARTS, title);
    if (!reading->section)
        open_section(reading, title);
    if (reading->status == MILL_OK)
        add_entry(reading, key, trimmed, false);
    free(trimmed);
}

enum mill_status mill_deck_parse(const char *path, int count, const char *const *overrides,
                                 struct mill_deck_text **text, struct mill_error *error)
{
    *text = NULL;
    struct reading *reading = calloc(1, sizeof *reading);
    struct mill_deck_text *made = calloc(1, sizeof *made);
    if (!reading || !made) {
        free(reading);
        free(made);
        return mill_error_set(error, MILL_FAILED, "out of memory");
    }
    reading->text = made;
    reading->error = error;
    made->file = copy(path ? path : "");
    made->order = calloc((size_t)count + 1, sizeof *made->order);
    if (!made->file || !made->order)
        no_memory(reading);
    else if (path)
        read_file(reading, path);
    for (int i = 0; i < count && reading->status == MILL_OK; i++) {
        made->order[made->orders++] = copy(overrides[i]);
        if (made->order[i])
            apply_order(reading, made->order[i]);
        else
            no_memory(reading);
    }
    const enum mill_status status = reading->status;
    free(reading);
    if (status == MILL_OK)
        *text = made;
    else
        mill_deck_text_free(made);
    return status;
}
