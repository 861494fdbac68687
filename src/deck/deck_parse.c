/* Reads the deck's file and the command line's overrides into sections and entries, and records
 * where each of them comes from. A line is a section's title, or a key and its value; both are cut
 * out of the file's bytes. Comments start with # or ; at the start of a line or after white space.
 * A value in double quotes (a file name with " #" in it) is kept whole; "" inside stands for one ".
 * Section titles, keys and repetitions are checked during reading, so that a message names the
 * first wrong line of the file. */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <assert.h>
#include <ctype.h>
#include <stdlib.h>
#include <string.h>

#define PREFIX "ball_" /* prefix of kinds of contact */
enum { MOST_SECTIONS = 10000, LARGEST = 1 << 24 /* [B] of a deck */ };

void mill_deck_parse_free(struct mill_deck_text *text)
{
    for (int i = 0; i < text->sections; i++) {
        free(text->section[i].entry);
        free(text->section[i].form);
    }
    for (int i = 0; i < text->overrides; i++)
        free(text->override[i]);
    for (int i = 0; i < text->keeps; i++)
        free(text->kept[i]);
    free(text->override);
    free(text->section);
    free(text->bytes);
    free(text->kept);
    free(text->file_named);
}

/* An unknown section probably stands for `meant` (NULL: not known for which), which is then not
 * missing. The next fault is in this section. */
static enum mill_status guess(struct mill_deck_text *text, const char *meant)
{
    if (!meant)
        return MILL_OK;
    if (!mill_deck_section(text, meant)) {
        if (mill_deck_section_add(text, meant) != MILL_OK)
            return MILL_FAILED;
        text->section[text->sections - 1].guessed = true;
    }
    text->reading->open = (int)(mill_deck_section(text, meant) - text->section);
    return MILL_OK;
}

/* Checks that a section may have this title. */
static enum mill_status check_title(struct mill_deck_text *text, const char *title)
{
    char hint[400];
    struct mill_deck_block block;
    bool known = false;
    for (int i = 0; !known && mill_deck_table_block(i, &block); i++)
        known = mill_deck_table_belongs(&block, title);
    if (!known) {
        if (guess(text, mill_deck_suggest_key(title, NULL, hint, sizeof hint)) != MILL_OK)
            return MILL_FAILED;
        return mill_deck_wrong(text, title, NULL, "unknown section%s", hint);
    }
    if (!block.named)
        return MILL_OK;
    const char *name = strchr(title, '.') + 1;
    if (strcmp(title, "motion.rotor") == 0)
        return mill_deck_wrong(text, title, NULL,
                               "'rotor' is the motion of [rotor]; give this one another name");
    if (strcmp(block.title, "contact") == 0 || strcmp(block.title, "wear") == 0) {
        if (strncmp(name, PREFIX, strlen(PREFIX)) != 0)
            return mill_deck_wrong(text, title, NULL,
                                   "unknown kind of contact; its name begins with 'ball_': "
                                   "[contact.ball_drum], or [contact.ball_NAME] for [body.NAME]");
        name += strlen(PREFIX);
    }
    if (strlen(name) >= MILL_NAME_LENGTH)
        return mill_deck_wrong(text, title, NULL, "the name is longer than 63 characters");
    if (!mill_deck_is_name(name))
        return mill_deck_wrong(text, title, NULL,
                               "a name consists of letters, digits, '_', '-', '+' and '.', and "
                               "begins with one of the first three");
    return MILL_OK;
}

static enum mill_status open_section(struct mill_deck_text *text, const char *title)
{
    const enum mill_status status = check_title(text, title);
    if (status == MILL_OK && text->sections == MOST_SECTIONS)
        return mill_deck_wrong(text, title, NULL, "there are more than 10000 sections");
    return status == MILL_OK ? mill_deck_section_add(text, title) : status;
}

/* Adds key = value to the section. An override replaces an earlier value. value NULL: the key is
 * given, but what it is cannot be read. */
static enum mill_status add_entry(struct mill_deck_text *text, struct mill_deck_section *section,
                                  const char *key, const char *value, enum mill_deck_look look)
{
    char hint[400];
    struct mill_deck_entry *entry = mill_deck_entry(section, key);
    if (!mill_deck_table_key(section->title, key, 0)) {
        const char *meant = mill_deck_suggest_key(section->title, key, hint, sizeof hint);
        if (meant && !mill_deck_entry(section, meant) && /* it is not missing */
            add_entry(text, section, meant, NULL, MILL_DECK_PLAIN) != MILL_OK)
            return MILL_FAILED;
        return mill_deck_wrong(text, section->title, key,
                               *key ? "unknown key%s" : "there is no key in front of '='%s", hint);
    }
    if (entry && entry->value && !text->reading->at.override)
        return mill_deck_wrong(text, section->title, key,
                               "the key is given twice (first in line %d)", entry->origin.line);
    if (!entry) {
        const size_t size = ((size_t)section->entries + 1) * sizeof *entry;
        struct mill_deck_entry *more = realloc(section->entry, size);
        if (!more)
            return mill_deck_memory(text);
        section->entry = more;
        entry = &more[section->entries++];
    }
    *entry = (struct mill_deck_entry){key, value, look, text->reading->at};
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

/* Returns whether it might have been meant as part of a name: a remark begins with a blank. */
static bool strip_comment(char *text)
{
    size_t length = 0;
    while (text[length] && !is_comment(text, length))
        length++;
    const bool meant = text[length] && text[length + 1] && !is_space(text[length + 1]);
    text[length] = '\0';
    return meant;
}

/* Cuts white space off the end of text. Returns the place after the white space at its start. */
static char *trim(char *text)
{
    size_t length = strlen(text);
    while (length > 0 && is_space(text[length - 1]))
        length--;
    text[length] = '\0';
    return text + strspn(text, " \t");
}

/* Removes the quotes of a value. Returns NULL, or a text that says what is wrong with them. */
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

/* line: starts with '[' */
static enum mill_status read_title(struct mill_deck_text *text, char *line)
{
    strip_comment(line);
    text->reading->open = -1;
    char *title = trim(line) + 1, *end = strchr(title, ']');
    if (!end || end[1])
        return mill_deck_wrong(text, NULL, NULL,
                               end ? "unexpected text after the ']' of the section"
                                   : "the closing ']' of the section is missing");
    *end = '\0';
    struct mill_deck_section *first = mill_deck_section(text, title);
    if (first && first->guessed) {
        text->reading->open = (int)(first - text->section);
        first->guessed = false;
        first->origin = text->reading->at;
        return MILL_OK;
    }
    if (first) {
        text->reading->open = (int)(first - text->section);
        return mill_deck_wrong(text, title, NULL, "the section is given twice (first in line %d)",
                               first->origin.line);
    }
    const enum mill_status status = open_section(text, title);
    text->reading->open = status == MILL_OK ? text->sections - 1 : -1;
    return status;
}

/* A line of the section cannot be read. If `key` is one of its keys, this key is not missing. */
static enum mill_status excuse(struct mill_deck_text *text, const char *key)
{
    struct mill_deck_section *section =
        text->reading->open < 0 ? NULL : &text->section[text->reading->open];
    const struct mill_key *row = section ? mill_deck_table_key(section->title, key, 0) : NULL;
    return row && !mill_deck_entry(section, key)
               ? add_entry(text, section, row->name, NULL, MILL_DECK_PLAIN)
               : MILL_OK;
}

static enum mill_status read_entry(struct mill_deck_text *text, char *line)
{
    if (text->reading->open < 0 && (text->sections > 0 || mill_deck_faults_lost(text)))
        return MILL_OK; /* the section is unknown, and so are its keys */
    char *equals = strpbrk(line, "=:");
    const bool quoted = equals && equals[1 + strspn(equals + 1, " \t")] == '"';
    enum mill_deck_look look = MILL_DECK_QUOTED;
    if (!quoted) {
        look = strip_comment(line) ? MILL_DECK_CUT : MILL_DECK_PLAIN;
        equals = strpbrk(line, "=:");
    }
    if (!equals) {
        char word[40];
        snprintf(word, sizeof word, "%.*s", (int)strcspn(line, " \t"), line);
        return excuse(text, word) != MILL_OK
                   ? MILL_FAILED
                   : mill_deck_wrong(text, NULL, NULL,
                                     "expected '[section]' or 'key = value', got '%.60s'",
                                     trim(line));
    }
    *equals = '\0';
    char *key = trim(line), *value = trim(equals + 1);
    const char *wrong = quoted ? unquote(value) : NULL;
    if (wrong && excuse(text, key) != MILL_OK)
        return MILL_FAILED;
    if (wrong)
        return mill_deck_wrong(text, NULL, NULL, "%s", wrong);
    if (text->reading->open < 0)
        return mill_deck_wrong(text, NULL, key, "stands before the first [section]");
    return add_entry(text, &text->section[text->reading->open], key, value, look);
}

/* A line of `length` bytes, with room for a zero after them */
static enum mill_status read_line(struct mill_deck_text *text, char *line, size_t length)
{
    /* byte order mark of UTF-8, written by Windows editors */
    static const char mark[] = "\xef\xbb\xbf";
    length -= length > 0 && line[length - 1] == '\r';
    line[length] = '\0';
    if (text->reading->at.line == 1 && strncmp(line, mark, 3) == 0)
        line += 3;
    line += strspn(line, " \t");
    if (!*line || is_comment(line, 0))
        return MILL_OK;
    return *line == '[' ? read_title(text, line) : read_entry(text, line);
}

/* A file that is not a text has one fault, not one per line. */
static enum mill_status check_text(struct mill_deck_text *text, size_t size)
{
    const char *bytes = text->bytes;
    text->reading->at.line = 1;
    for (size_t i = 0; i < size; i++) {
        const bool ends =
            bytes[i] == '\n' || (bytes[i] == '\r' && (i + 1 == size || bytes[i + 1] == '\n'));
        if (iscntrl((unsigned char)bytes[i]) && bytes[i] != '\t' && !ends)
            return mill_deck_wrong(text, NULL, NULL,
                                   "holds the control character 0x%02x: a deck is plain text",
                                   (unsigned)bytes[i]);
        text->reading->at.line += bytes[i] == '\n';
    }
    text->reading->at.line = 0;
    return MILL_OK;
}

static enum mill_status read_file(struct mill_deck_text *text)
{
    const char *wrong;
    size_t size = 0;
    text->bytes = mill_textfile_read(text->file, LARGEST, &size, &wrong);
    if (!text->bytes && wrong)
        return mill_deck_wrong(text, NULL, NULL, "%s", wrong);
    if (!text->bytes) {
        mill_deck_wrong(text, NULL, NULL, "cannot be read: %s", strerror(errno));
        return MILL_FAILED;
    }
    enum mill_status status = check_text(text, size);
    for (char *line = text->bytes, *end = line + size; status == MILL_OK && line < end;) {
        char *newline = memchr(line, '\n', (size_t)(end - line));
        const size_t length = (size_t)((newline ? newline : end) - line);
        text->reading->at.line++;
        status = mill_deck_faults_keep(text, read_line(text, line, length));
        line += length + 1;
    }
    text->reading->at.line = 0;
    text->reading->open = -1;
    if (status == MILL_OK && text->sections == 0 && !mill_deck_faults_lost(text))
        return mill_deck_wrong(text, NULL, NULL,
                               "the deck is empty: expected sections such as [run] and [drum]");
    return status;
}

/* SECTION.KEY=VALUE; SECTION may contain dots. copy: of the override; it is changed */
static enum mill_status apply_override(struct mill_deck_text *text, char *copy)
{
    for (const char *p = copy; *p; p++)
        if (iscntrl((unsigned char)*p))
            return mill_deck_wrong(text, NULL, NULL, "holds a control character");
    char *value = strchr(copy, '='), *key = NULL;
    if (value) {
        *value++ = '\0';
        key = strrchr(copy, '.');
    }
    if (!key || key == copy)
        return mill_deck_wrong(text, NULL, NULL,
                               "expected SECTION.KEY=VALUE such as 'rotor.speed=1000 rpm'");
    *key++ = '\0';
    const enum mill_status status =
        mill_deck_section(text, copy) ? MILL_OK : open_section(text, copy);
    return status == MILL_OK
               ? add_entry(text, mill_deck_section(text, copy), key, trim(value), false)
               : status;
}

enum mill_status mill_deck_parse(struct mill_deck_text *text, const char *path, int count,
                                 const char *const *overrides)
{
    struct mill_deck_block block;
    text->file = path ? path : "";
    text->reading->open = -1;
    text->override = calloc((size_t)count + 1, sizeof *text->override);
    if (!text->override)
        return mill_deck_memory(text);
    enum mill_status status = path ? read_file(text) : MILL_OK;
    status = mill_deck_faults_keep(text, status);
    for (int i = 0; i < count && status == MILL_OK; i++) {
        char *copy = text->override[text->overrides++] = strdup(overrides[i]);
        text->reading->at.override = overrides[i];
        status = copy ? apply_override(text, copy) : mill_deck_memory(text);
        status = mill_deck_faults_keep(text, status);
        text->reading->open = -1;
    }
    text->reading->at.override = NULL;
    for (int i = 0; path && !mill_deck_faults_lost(text) && status == MILL_OK &&
                    mill_deck_table_block(i, &block);
         i++) {
        if (!block.named && !block.optional && !mill_deck_section(text, block.title) &&
            !(block.spared_by && mill_deck_named(text, block.spared_by, NULL)))
            status = mill_deck_section_add(text, block.title);
    }
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
