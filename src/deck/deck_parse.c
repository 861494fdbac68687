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

void mill_deck_free(struct mill_deck *deck)
{
    if (!deck)
        return;
    for (int i = 0; i < deck->sections; i++) {
        free(deck->section[i].entry);
        free(deck->section[i].form);
    }
    for (int i = 0; i < deck->overrides; i++)
        free(deck->override[i]);
    free(deck->override);
    free(deck->section);
    free(deck->bytes);
    for (int i = 0; i < deck->keeps; i++)
        free(deck->kept[i]);
    free(deck->kept);
    free(deck->file_named);
    free(deck->bodies.surface);
    free(deck->bodies.section);
    free(deck->bodies.form);
    free(deck->balls);
    free(deck->parts.surface);
    free(deck->parts.section);
    free(deck->parts.form);
    free(deck);
}

/* An unknown section probably stands for `meant` (NULL: not known for which), which is then not
 * missing. The next fault is in this section. */
static enum mill_status guess(struct mill_deck *deck, const char *meant, struct mill_error *error)
{
    if (!meant)
        return MILL_OK;
    if (!mill_deck_section(deck, meant)) {
        if (mill_deck_section_add(deck, meant, error) != MILL_OK)
            return MILL_FAILED;
        deck->section[deck->sections - 1].guessed = true;
    }
    deck->open = (int)(mill_deck_section(deck, meant) - deck->section);
    return MILL_OK;
}

/* Checks that a section may have this title. */
static enum mill_status check_title(struct mill_deck *deck, const char *title,
                                    struct mill_error *error)
{
    static const char allowed[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+.";
    char hint[400];
    struct mill_deck_block block;
    bool known = false;
    for (int i = 0; !known && mill_deck_table_block(i, &block); i++)
        known = mill_deck_table_belongs(&block, title);
    if (!known) {
        if (guess(deck, mill_deck_suggest_key(title, NULL, hint, sizeof hint), error) != MILL_OK)
            return MILL_FAILED;
        return mill_deck_fault(deck, error, title, NULL, "unknown section%s", hint);
    }
    if (!block.named)
        return MILL_OK;
    const char *name = strchr(title, '.') + 1;
    if (strcmp(title, "motion.rotor") == 0)
        return mill_deck_fault(deck, error, title, NULL,
                               "'rotor' is the motion of [rotor]; give this one another name");
    if (strcmp(block.title, "contact") == 0 || strcmp(block.title, "wear") == 0) {
        if (strncmp(name, PREFIX, strlen(PREFIX)) != 0)
            return mill_deck_fault(deck, error, title, NULL,
                                   "unknown kind of contact; its name begins with 'ball_': "
                                   "[contact.ball_drum], or [contact.ball_NAME] for [body.NAME]");
        name += strlen(PREFIX);
    }
    if (strlen(name) >= MILL_NAME_LENGTH)
        return mill_deck_fault(deck, error, title, NULL, "the name is longer than 63 characters");
    if (!*name || strchr("-+.", *name) || name[strspn(name, allowed)])
        return mill_deck_fault(deck, error, title, NULL,
                               "a name consists of letters, digits, '_', '-', '+' and '.', and "
                               "begins with one of the first three");
    return MILL_OK;
}

static enum mill_status open_section(struct mill_deck *deck, const char *title,
                                     struct mill_error *error)
{
    const enum mill_status status = check_title(deck, title, error);
    if (status == MILL_OK && deck->sections == MOST_SECTIONS)
        return mill_deck_fault(deck, error, title, NULL, "there are more than 10000 sections");
    return status == MILL_OK ? mill_deck_section_add(deck, title, error) : status;
}

/* Adds key = value to the section. An override replaces an earlier value. value NULL: the key is
 * given, but what it is cannot be read. */
static enum mill_status add_entry(struct mill_deck *deck, struct mill_deck_section *section,
                                  const char *key, const char *value, enum mill_deck_look look,
                                  struct mill_error *error)
{
    char hint[400];
    struct mill_deck_entry *entry = mill_deck_entry(section, key);
    if (!mill_deck_table_key(section->title, key, 0)) {
        const char *meant = mill_deck_suggest_key(section->title, key, hint, sizeof hint);
        if (meant && !mill_deck_entry(section, meant) && /* it is not missing */
            add_entry(deck, section, meant, NULL, MILL_DECK_PLAIN, error) != MILL_OK)
            return MILL_FAILED;
        return mill_deck_fault(deck, error, section->title, key,
                               *key ? "unknown key%s" : "there is no key in front of '='%s", hint);
    }
    if (entry && entry->value && !deck->at.override)
        return mill_deck_fault(deck, error, section->title, key,
                               "the key is given twice (first in line %d)", entry->origin.line);
    if (!entry) {
        const size_t size = ((size_t)section->entries + 1) * sizeof *entry;
        struct mill_deck_entry *more = realloc(section->entry, size);
        if (!more)
            return mill_error_set(error, MILL_FAILED, "out of memory");
        section->entry = more;
        entry = &more[section->entries++];
    }
    *entry = (struct mill_deck_entry){key, value, look, deck->at};
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
static enum mill_status read_title(struct mill_deck *deck, char *line, struct mill_error *error)
{
    strip_comment(line);
    deck->open = -1;
    char *title = trim(line) + 1, *end = strchr(title, ']');
    if (!end || end[1])
        return mill_deck_fault(deck, error, NULL, NULL,
                               end ? "unexpected text after the ']' of the section"
                                   : "the closing ']' of the section is missing");
    *end = '\0';
    struct mill_deck_section *first = mill_deck_section(deck, title);
    if (first && first->guessed) {
        deck->open = (int)(first - deck->section);
        first->guessed = false;
        first->origin = deck->at;
        return MILL_OK;
    }
    if (first) {
        deck->open = (int)(first - deck->section);
        return mill_deck_fault(deck, error, title, NULL,
                               "the section is given twice (first in line %d)", first->origin.line);
    }
    const enum mill_status status = open_section(deck, title, error);
    deck->open = status == MILL_OK ? deck->sections - 1 : -1;
    return status;
}

/* A line of the section cannot be read. If `key` is one of its keys, this key is not missing. */
static enum mill_status excuse(struct mill_deck *deck, const char *key, struct mill_error *error)
{
    struct mill_deck_section *section = deck->open < 0 ? NULL : &deck->section[deck->open];
    const struct mill_key *row = section ? mill_deck_table_key(section->title, key, 0) : NULL;
    return row && !mill_deck_entry(section, key)
               ? add_entry(deck, section, row->name, NULL, MILL_DECK_PLAIN, error)
               : MILL_OK;
}

static enum mill_status read_entry(struct mill_deck *deck, char *line, struct mill_error *error)
{
    if (deck->open < 0 && (deck->sections > 0 || mill_deck_faults_lost(deck)))
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
        return excuse(deck, word, error) != MILL_OK
                   ? MILL_FAILED
                   : mill_deck_fault(deck, error, NULL, NULL,
                                     "expected '[section]' or 'key = value', got '%.60s'",
                                     trim(line));
    }
    *equals = '\0';
    char *key = trim(line), *value = trim(equals + 1);
    const char *wrong = quoted ? unquote(value) : NULL;
    if (wrong && excuse(deck, key, error) != MILL_OK)
        return MILL_FAILED;
    if (wrong)
        return mill_deck_fault(deck, error, NULL, NULL, "%s", wrong);
    if (deck->open < 0)
        return mill_deck_fault(deck, error, NULL, key, "stands before the first [section]");
    return add_entry(deck, &deck->section[deck->open], key, value, look, error);
}

/* A line of `length` bytes, with room for a zero after them */
static enum mill_status read_line(struct mill_deck *deck, char *line, size_t length,
                                  struct mill_error *error)
{
    /* byte order mark of UTF-8, written by Windows editors */
    static const char mark[] = "\xef\xbb\xbf";
    length -= length > 0 && line[length - 1] == '\r';
    line[length] = '\0';
    if (deck->at.line == 1 && strncmp(line, mark, 3) == 0)
        line += 3;
    line += strspn(line, " \t");
    if (!*line || is_comment(line, 0))
        return MILL_OK;
    return *line == '[' ? read_title(deck, line, error) : read_entry(deck, line, error);
}

/* A file that is not a text has one fault, not one per line. */
static enum mill_status check_text(struct mill_deck *deck, size_t size, struct mill_error *error)
{
    const char *bytes = deck->bytes;
    deck->at.line = 1;
    for (size_t i = 0; i < size; i++) {
        const bool ends =
            bytes[i] == '\n' || (bytes[i] == '\r' && (i + 1 == size || bytes[i + 1] == '\n'));
        if (iscntrl((unsigned char)bytes[i]) && bytes[i] != '\t' && !ends)
            return mill_deck_fault(deck, error, NULL, NULL,
                                   "holds the control character 0x%02x: a deck is plain text",
                                   (unsigned)bytes[i]);
        deck->at.line += bytes[i] == '\n';
    }
    deck->at.line = 0;
    return MILL_OK;
}

static enum mill_status read_file(struct mill_deck *deck, struct mill_error *error)
{
    const char *wrong;
    size_t size = 0;
    deck->bytes = mill_textfile_read(deck->file, LARGEST, &size, &wrong);
    if (!deck->bytes && wrong)
        return mill_deck_fault(deck, error, NULL, NULL, "%s", wrong);
    if (!deck->bytes) {
        mill_deck_fault(deck, error, NULL, NULL, "cannot be read: %s", strerror(errno));
        return MILL_FAILED;
    }
    enum mill_status status = check_text(deck, size, error);
    for (char *line = deck->bytes, *end = line + size; status == MILL_OK && line < end;) {
        char *newline = memchr(line, '\n', (size_t)(end - line));
        const size_t length = (size_t)((newline ? newline : end) - line);
        deck->at.line++;
        status = mill_deck_faults_keep(deck, read_line(deck, line, length, error), error);
        line += length + 1;
    }
    deck->at.line = 0;
    deck->open = -1;
    if (status == MILL_OK && deck->sections == 0 && !mill_deck_faults_lost(deck))
        return mill_deck_fault(deck, error, NULL, NULL,
                               "the deck is empty: expected sections such as [run] and [drum]");
    return status;
}

/* SECTION.KEY=VALUE; SECTION may contain dots. copy: of the override; it is changed */
static enum mill_status apply_override(struct mill_deck *deck, char *copy, struct mill_error *error)
{
    for (const char *p = copy; *p; p++)
        if (iscntrl((unsigned char)*p))
            return mill_deck_fault(deck, error, NULL, NULL, "holds a control character");
    char *value = strchr(copy, '='), *key = NULL;
    if (value) {
        *value++ = '\0';
        key = strrchr(copy, '.');
    }
    if (!key || key == copy)
        return mill_deck_fault(deck, error, NULL, NULL,
                               "expected SECTION.KEY=VALUE such as 'rotor.speed=1000 rpm'");
    *key++ = '\0';
    const enum mill_status status =
        mill_deck_section(deck, copy) ? MILL_OK : open_section(deck, copy, error);
    return status == MILL_OK
               ? add_entry(deck, mill_deck_section(deck, copy), key, trim(value), false, error)
               : status;
}

enum mill_status mill_deck_parse(struct mill_deck *deck, const char *path, int count,
                                 const char *const *overrides, struct mill_error *error)
{
    struct mill_deck_block block;
    deck->file = path ? path : "";
    deck->open = -1;
    deck->override = calloc((size_t)count + 1, sizeof *deck->override);
    if (!deck->override)
        return mill_error_set(error, MILL_FAILED, "out of memory");
    enum mill_status status = path ? read_file(deck, error) : MILL_OK;
    status = mill_deck_faults_keep(deck, status, error);
    for (int i = 0; i < count && status == MILL_OK; i++) {
        char *copy = deck->override[deck->overrides++] = strdup(overrides[i]);
        deck->at.override = overrides[i];
        status = copy ? apply_override(deck, copy, error)
                      : mill_error_set(error, MILL_FAILED, "out of memory");
        status = mill_deck_faults_keep(deck, status, error);
        deck->open = -1;
    }
    deck->at.override = NULL;
    for (int i = 0; path && !mill_deck_faults_lost(deck) && status == MILL_OK &&
                    mill_deck_table_block(i, &block);
         i++) {
        const struct mill_deck_block other = {.title = block.spared_by, .named = true};
        if (!block.named && !block.optional && !mill_deck_section(deck, block.title) &&
            !(other.title && mill_deck_next(deck, &other, NULL)))
            status = mill_deck_section_add(deck, block.title, error);
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
