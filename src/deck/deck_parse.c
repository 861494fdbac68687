/* From the deck's file and the command line's overrides to sections and entries, each of which
 * knows where it came from. Section titles, keys and repetitions are checked on the way, so a
 * message names the first wrong line of the file. */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SECTIONS = 10000, LARGEST = 1 << 24 /* [B] of a deck */ };

/* What is being read, and where it stands */
struct reading {
    struct mill_deck_text *text;
    struct mill_deck_origin origin;
    struct mill_error *error;
};

/* Room for one more item behind `count`: grows at powers of two. NULL: no memory, items still
 * valid. */
static void *extend(void *items, int count, size_t size)
{
    if ((count & (count - 1)) != 0)
        return items;
    return realloc(items, (count ? 2 * (size_t)count : 1) * size);
}

static enum mill_status no_memory(const struct reading *reading)
{
    return mill_error_set(reading->error, MILL_FAILED, "out of memory");
}

/* Title and key may be NULL. */
static enum mill_status refuse(const struct reading *reading, const char *title, const char *key,
                               const char *format, ...)
{
    char what[400];
    va_list list;
    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    return mill_deck_text_refuse(reading->text, reading->origin, title, key, what, reading->error);
}

/* Of a section [contact.KIND] */
static enum mill_status check_contact(const struct reading *reading, const char *title,
                                      const char *name)
{
    char names[40 * MILL_KINDS] = "";
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        if (strcmp(name, mill_kind_name[kind]) == 0)
            return MILL_OK;
        strcat(strcat(names, kind > 0 ? ", " : ""), mill_kind_name[kind]);
    }
    return refuse(reading, title, NULL, "unknown kind of contact; there are %s", names);
}

/* [title] may be a section. */
static enum mill_status check_title(const struct reading *reading, const char *title)
{
    static const char allowed[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+.";
    char hint[160];
    const char *name = NULL;
    struct mill_deck_block block;
    for (int i = 0; !name && mill_deck_table_block(i, &block); i++)
        mill_deck_table_belongs(&block, title, &name);
    if (!name) {
        mill_deck_table_suggest_section(title, hint, sizeof hint);
        return refuse(reading, title, NULL, "unknown section%s", hint);
    }
    if (!block.named)
        return MILL_OK;
    if (strcmp(block.title, "contact") == 0)
        return check_contact(reading, title, name);
    if (strlen(name) >= MILL_NAME_LENGTH)
        return refuse(reading, title, NULL, "the name is longer than 63 characters");
    if (!*name || strchr("-+.", *name) || name[strspn(name, allowed)])
        return refuse(reading, title, NULL,
                      "a name consists of letters, digits, '_', '-', '+' and '.', and begins with "
                      "one of the first three");
    return MILL_OK;
}

static enum mill_status add_section(const struct reading *reading, const char *title,
                                    struct mill_deck_section **section)
{
    struct mill_deck_text *text = reading->text;
    struct mill_deck_section *more = extend(text->section, text->sections, sizeof *more);
    if (!more)
        return no_memory(reading);
    text->section = more;
    *section = &text->section[text->sections];
    **section = (struct mill_deck_section){.title = title, .origin = reading->origin};
    text->sections++;
    return MILL_OK;
}

static enum mill_status open_section(const struct reading *reading, const char *title,
                                     struct mill_deck_section **section)
{
    const enum mill_status status = check_title(reading, title);
    if (status != MILL_OK)
        return status;
    if (reading->text->sections == MOST_SECTIONS)
        return refuse(reading, title, NULL, "there are more than 10000 sections");
    return add_section(reading, title, section);
}

/* Adds key = value to the section, or replaces the value there when an override says so. */
static enum mill_status add_entry(const struct reading *reading, struct mill_deck_section *section,
                                  const char *key, const char *value, bool quoted)
{
    char hint[160];
    if (!mill_deck_table_key(section->title, key)) {
        mill_deck_table_suggest_key(section->title, key, hint, sizeof hint);
        return refuse(reading, section->title, key,
                      *key ? "unknown key%s" : "there is no key in front of '='%s", hint);
    }
    struct mill_deck_entry *entry = mill_deck_text_entry(section, key);
    if (entry && !reading->origin.override)
        return refuse(reading, section->title, key, "the key is given twice (first in line %d)",
                      entry->origin.line);
    if (!entry) {
        struct mill_deck_entry *more = extend(section->entry, section->entries, sizeof *more);
        if (!more)
            return no_memory(reading);
        section->entry = more;
        entry = &section->entry[section->entries++];
    }
    *entry = (struct mill_deck_entry){
        .key = key, .value = value, .quoted = quoted, .origin = reading->origin};
    return MILL_OK;
}

static enum mill_status read_lines(struct reading *reading, size_t size)
{
    struct mill_deck_section *section = NULL;
    struct mill_deck_line line = {.rest = reading->text->bytes, .end = reading->text->bytes + size};
    enum mill_status status = MILL_OK;
    while (status == MILL_OK) {
        const enum mill_deck_line_kind kind = mill_deck_line_next(&line);
        reading->origin.line = line.number;
        switch (kind) {
        case MILL_DECK_LINE_END:
            return MILL_OK;
        case MILL_DECK_LINE_EMPTY:
            break;
        case MILL_DECK_LINE_WRONG:
            return refuse(reading, NULL, NULL, "%s", line.wrong);
        case MILL_DECK_LINE_SECTION:
            section = mill_deck_text_section(reading->text, line.key);
            status = section ? refuse(reading, line.key, NULL,
                                      "the section is given twice (first in line %d)",
                                      section->origin.line)
                             : open_section(reading, line.key, &section);
            break;
        case MILL_DECK_LINE_KEY:
            status = section ? add_entry(reading, section, line.key, line.value, line.quoted)
                             : refuse(reading, NULL, line.key, "stands before the first [section]");
            break;
        }
    }
    return status;
}

static enum mill_status read_file(struct reading *reading)
{
    const char *wrong, *name = mill_deck_text_tail(reading->text->file, 400);
    size_t size;
    reading->text->bytes = mill_textfile_read(reading->text->file, LARGEST, &size, &wrong);
    if (!reading->text->bytes)
        return wrong ? mill_error_set(reading->error, MILL_BAD_DECK, "%.400s: %s", name, wrong)
                     : mill_error_set(reading->error, MILL_FAILED, "%.400s: cannot be read: %s",
                                      name, strerror(errno));
    const enum mill_status status = read_lines(reading, size);
    if (status == MILL_OK && reading->text->sections == 0)
        return mill_error_set(
            reading->error, MILL_BAD_DECK,
            "%.400s: the deck is empty: expected sections such as [run] and [drum]", name);
    return status;
}

/* SECTION.KEY=VALUE; SECTION may hold dots itself. copy: of the override, to be cut up */
static enum mill_status apply_override(const struct reading *reading, char *copy)
{
    for (const char *p = copy; *p; p++)
        if ((unsigned char)*p < 32 || *p == 127)
            return refuse(reading, NULL, NULL, "holds a control character");
    char *value = strchr(copy, '='), *key = NULL;
    if (value) {
        *value++ = '\0';
        key = strrchr(copy, '.');
    }
    if (!key || key == copy)
        return refuse(reading, NULL, NULL,
                      "expected SECTION.KEY=VALUE such as 'rotor.speed=1000 rpm'");
    *key++ = '\0';
    struct mill_deck_section *section = mill_deck_text_section(reading->text, copy);
    const enum mill_status status = section ? MILL_OK : open_section(reading, copy, &section);
    return status == MILL_OK ? add_entry(reading, section, key, mill_deck_line_trim(value), false)
                             : status;
}

static enum mill_status add_defaults(const struct reading *reading)
{
    struct mill_deck_section *section;
    struct mill_deck_block block;
    enum mill_status status = MILL_OK;
    for (int i = 0; status == MILL_OK && mill_deck_table_block(i, &block); i++)
        if (!block.named && !block.optional && !mill_deck_text_section(reading->text, block.title))
            status = add_section(reading, block.title, &section);
    return status;
}

enum mill_status mill_deck_parse(const char *path, int count, const char *const *overrides,
                                 struct mill_deck_text **text, struct mill_error *error)
{
    *text = NULL;
    struct mill_deck_text *made = calloc(1, sizeof *made);
    if (!made)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    struct reading reading = {.text = made, .error = error};
    made->file = path ? path : "";
    made->override = calloc((size_t)count + 1, sizeof *made->override);
    enum mill_status status = made->override ? MILL_OK : no_memory(&reading);
    if (status == MILL_OK && path)
        status = read_file(&reading);
    for (int i = 0; i < count && status == MILL_OK; i++) {
        char *copy = made->override[made->overrides++] = strdup(overrides[i]);
        reading.origin = (struct mill_deck_origin){.override = overrides[i]};
        status = copy ? apply_override(&reading, copy) : no_memory(&reading);
    }
    reading.origin = (struct mill_deck_origin){.line = 0};
    if (status == MILL_OK && path)
        status = add_defaults(&reading);
    if (status == MILL_OK)
        *text = made;
    else
        mill_deck_text_free(made);
    return status;
}
