/* From the deck's file and the command line's overrides to sections and entries, each of which
 * knows where it came from. A line is a section's title, or a key and its value, which are cut out
 * of the file's bytes. Comments start with # or ; at the beginning or after white space. A value in
 * double quotes (a file name with " #" in it) is kept whole; "" inside stands for one ". Section
 * titles, keys and repetitions are checked on the way, so a message names the first wrong line of
 * the file. */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <assert.h>
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

static bool is_control(char c)
{
    return (unsigned char)c < 32 || c == 127;
}

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
__attribute__((format(printf, 4, 5))) static enum mill_status
refuse(const struct reading *reading, const char *title, const char *key, const char *format, ...)
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

static bool is_space(char c)
{
    return c == ' ' || c == '\t';
}

/* Does a comment begin here? */
static bool is_comment(const char *text, size_t at)
{
    return (text[at] == '#' || text[at] == ';') && (at == 0 || is_space(text[at - 1]));
}

static void strip_comment(char *text)
{
    size_t length = 0;
    while (text[length] && !is_comment(text, length))
        length++;
    text[length] = '\0';
}

/* Cuts white space off the end of text, and returns where it begins behind white space. */
static char *trim(char *text)
{
    size_t length = strlen(text);
    while (length > 0 && is_space(text[length - 1]))
        length--;
    text[length] = '\0';
    return text + strspn(text, " \t");
}

/* Takes the quotes off a value. NULL, or what is wrong with them */
static const char *unquote(char *value)
{
    char *out = value, *p = value + 1;
    assert(*value == '"');
    while (*p && (*p != '"' || p[1] == '"')) {
        p += *p == '"';
        *out++ = *p++;
    }
    if (*p != '"')
        return "the closing '\"' of the value is missing";
    char *rest = p + 1;
    const bool apart = !*rest || is_space(*rest);
    strip_comment(rest);
    if (!apart || *trim(rest))
        return "unexpected text after the closing '\"' of the value";
    *out = '\0';
    return NULL;
}

/* line: from its '[' on */
static enum mill_status read_title(const struct reading *reading, char *line,
                                   struct mill_deck_section **section)
{
    strip_comment(line);
    char *title = trim(line) + 1, *end = strchr(title, ']');
    if (!end || end[1])
        return refuse(reading, NULL, NULL,
                      end ? "unexpected text after the ']' of the section"
                          : "the closing ']' of the section is missing");
    *end = '\0';
    *section = mill_deck_text_section(reading->text, title);
    return *section ? refuse(reading, title, NULL, "the section is given twice (first in line %d)",
                             (*section)->origin.line)
                    : open_section(reading, title, section);
}

static enum mill_status read_entry(const struct reading *reading, char *line,
                                   struct mill_deck_section *section)
{
    char *equals = strpbrk(line, "=:");
    const bool quoted = equals && equals[1 + strspn(equals + 1, " \t")] == '"';
    if (!quoted) {
        strip_comment(line);
        equals = strpbrk(line, "=:");
    }
    if (!equals)
        return refuse(reading, NULL, NULL, "expected '[section]' or 'key = value', got '%.60s'",
                      trim(line));
    *equals = '\0';
    char *key = trim(line), *value = trim(equals + 1);
    const char *wrong = quoted ? unquote(value) : NULL;
    if (wrong)
        return refuse(reading, NULL, NULL, "%s", wrong);
    return section ? add_entry(reading, section, key, value, quoted)
                   : refuse(reading, NULL, key, "stands before the first [section]");
}

/* A line of `length` bytes, behind which there is room for a zero */
static enum mill_status read_line(const struct reading *reading, char *line, size_t length,
                                  struct mill_deck_section **section)
{
    static const char mark[] = "\xef\xbb\xbf"; /* UTF-8's byte order mark, by Windows editors */
    length -= length > 0 && line[length - 1] == '\r';
    line[length] = '\0';
    for (size_t i = 0; i < length; i++)
        if (is_control(line[i]) && line[i] != '\t')
            return refuse(reading, NULL, NULL,
                          "holds the control character 0x%02x: a deck is plain text",
                          (unsigned)line[i]);
    if (reading->origin.line == 1 && strncmp(line, mark, 3) == 0)
        line += 3;
    line += strspn(line, " \t");
    if (!*line || is_comment(line, 0))
        return MILL_OK;
    return *line == '[' ? read_title(reading, line, section) : read_entry(reading, line, *section);
}

static enum mill_status read_file(struct reading *reading)
{
    const char *wrong, *name = mill_deck_text_tail(reading->text->file, 400);
    size_t size;
    char *bytes = mill_textfile_read(reading->text->file, LARGEST, &size, &wrong);
    reading->text->bytes = bytes;
    if (!bytes)
        return wrong ? mill_error_set(reading->error, MILL_BAD_DECK, "%.400s: %s", name, wrong)
                     : mill_error_set(reading->error, MILL_FAILED, "%.400s: cannot be read: %s",
                                      name, strerror(errno));
    struct mill_deck_section *section = NULL;
    enum mill_status status = MILL_OK;
    for (char *line = bytes, *end = bytes + size; status == MILL_OK && line < end;) {
        char *newline = memchr(line, '\n', (size_t)(end - line));
        const size_t length = (size_t)((newline ? newline : end) - line);
        reading->origin.line++;
        status = read_line(reading, line, length, &section);
        line += length + 1;
    }
    if (status == MILL_OK && !section)
        return mill_error_set(
            reading->error, MILL_BAD_DECK,
            "%.400s: the deck is empty: expected sections such as [run] and [drum]", name);
    return status;
}

/* SECTION.KEY=VALUE; SECTION may hold dots itself. copy: of the override, to be cut up */
static enum mill_status apply_override(const struct reading *reading, char *copy)
{
    for (const char *p = copy; *p; p++)
        if (is_control(*p))
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
    return status == MILL_OK ? add_entry(reading, section, key, trim(value), false) : status;
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

void mill_deck_parse_quote(const char *value, char *out, size_t size)
{
    const size_t length = strlen(value);
    assert(size >= 2 * length + 3);
    bool needed =
        length == 0 || value[0] == '"' || is_space(value[0]) || is_space(value[length - 1]);
    for (size_t i = 0; i < length; i++)
        needed = needed || is_comment(value, i);
    if (!needed) {
        snprintf(out, size, "%s", value);
        return;
    }
    *out++ = '"';
    for (const char *p = value; *p; p++) {
        if (*p == '"')
            *out++ = '"';
        *out++ = *p;
    }
    *out++ = '"';
    *out = '\0';
}
