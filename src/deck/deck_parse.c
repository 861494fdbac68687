/* Reads the deck's file and the command line's overrides into sections and entries, and records
 * where each of them comes from. A line is a section's title, or a key and its value; both are cut
 * out of the file's bytes. Comments start with # or ; at the start of a line or after white space.
 * A value in double quotes (a file name with " #" in it) is kept whole; "" inside stands for one ".
 * Titles, keys and repetitions are checked during reading: a message names the first wrong line. */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <assert.h>
#include <ctype.h>

enum { MOST_SECTIONS = 10000, LARGEST = 1 << 24 /* [B] of a deck */ };

struct mill_deck_section *mill_deck_section_add(struct mill_deck_text *text, const char *title)
{
    struct mill_deck_section *made = mill_deck_keep(text, calloc(1, sizeof *made)),
                             **end = &text->section;
    int sections = 0;
    for (; *end; end = &(*end)->next)
        sections++;
    if (sections == MOST_SECTIONS) {
        mill_deck_wrong(text, title, NULL, "there are more than 10000 sections");
        return NULL;
    }
    if (made)
        *made = (struct mill_deck_section){.title = title, .origin = text->reading->at, .word = -1};
    return *end = made;
}

/* Adds a section if it may have this title; otherwise NULL. */
static struct mill_deck_section *open_section(struct mill_deck_text *text, const char *title)
{
    char hint[400];
    const struct mill_deck_block *block = mill_deck_table_find(title);
    const char *wrong = NULL;
    if (!block) {
        /* it probably stands for a section, which is then not missing; the next fault is in that */
        const char *meant = mill_deck_suggest_key(title, NULL, hint, sizeof hint);
        struct mill_deck_section *other = meant ? mill_deck_section(text, meant) : NULL;
        if (meant && !other && (other = mill_deck_section_add(text, meant)))
            other->guessed = true;
        text->reading->open = other ? other : text->reading->open;
        mill_deck_wrong(text, title, NULL, "unknown section%s", hint);
        return NULL;
    }
    if (block->named) {
        const char *name = strchr(title, '.') + 1;
        const bool kind = strcmp(block->title, "contact") == 0 || strcmp(block->title, "wear") == 0;
        const bool prefixed = kind && strncmp(name, MILL_DECK_BALL, strlen(MILL_DECK_BALL)) == 0;
        name += prefixed ? strlen(MILL_DECK_BALL) : 0;
        wrong = strcmp(title, "motion.rotor") == 0
                    ? "'rotor' is the motion of [rotor]; give this one another name"
                : kind && !prefixed ? "unknown kind of contact; its name begins with 'ball_': "
                                      "[contact.ball_drum], or [contact.ball_NAME] for [body.NAME]"
                : strlen(name) >= MILL_NAME_LENGTH ? "the name is longer than 63 characters"
                : !mill_deck_is_name(name) ? "a name consists of letters, digits, '_', '-', '+' "
                                             "and '.', and begins with one of the first three"
                                           : NULL;
    }
    if (wrong)
        mill_deck_wrong(text, title, NULL, "%s", wrong);
    return wrong ? NULL : mill_deck_section_add(text, title);
}

/* Adds key = value to the section. An override replaces an earlier value. value NULL: the key is
 * given, but what it is cannot be read. */
static void add_entry(struct mill_deck_text *text, struct mill_deck_section *section,
                      const char *key, const char *value, enum mill_deck_look look)
{
    char hint[400];
    struct mill_deck_entry *entry = mill_deck_entry(section, key), **end = &section->entry;
    if (!mill_deck_table_key(section->title, key, 0)) {
        const char *meant = mill_deck_suggest_key(section->title, key, hint, sizeof hint);
        if (meant && !mill_deck_entry(section, meant)) /* it is not missing */
            add_entry(text, section, meant, NULL, MILL_DECK_PLAIN);
        mill_deck_wrong(text, section->title, key,
                        *key ? "unknown key%s" : "there is no key in front of '='%s", hint);
    } else if (entry && entry->value && !text->reading->at.override) {
        mill_deck_wrong(text, section->title, key, "the key is given twice (first in line %d)",
                        entry->origin.line);
    } else {
        while (!entry && *end)
            end = &(*end)->next;
        if (!entry)
            entry = *end = mill_deck_keep(text, calloc(1, sizeof *entry));
        if (entry)
            *entry = (struct mill_deck_entry){entry->next, key, value, look, text->reading->at};
    }
}

/* ---- lines ---- */

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
static void read_title(struct mill_deck_text *text, char *line)
{
    strip_comment(line);
    text->reading->open = NULL;
    char *title = trim(line) + 1, *end = strchr(title, ']');
    if (!end || end[1]) {
        mill_deck_wrong(text, NULL, NULL,
                        end ? "unexpected text after the ']' of the section"
                            : "the closing ']' of the section is missing");
        return;
    }
    *end = '\0';
    title = trim(title);
    struct mill_deck_section *first = mill_deck_section(text, title);
    text->reading->open = first;
    if (first && !first->guessed) {
        mill_deck_wrong(text, title, NULL, "the section is given twice (first in line %d)",
                        first->origin.line);
    } else if (first) {
        first->guessed = false;
        first->origin = text->reading->at;
    } else {
        text->reading->open = open_section(text, title);
    }
}

/* A line of the section cannot be read. If `key` is one of its keys, this key is not missing. */
static void excuse(struct mill_deck_text *text, const char *key)
{
    struct mill_deck_section *section = text->reading->open;
    const struct mill_key *row = section ? mill_deck_table_key(section->title, key, 0) : NULL;
    if (row && !mill_deck_entry(section, key))
        add_entry(text, section, row->name, NULL, MILL_DECK_PLAIN);
}

static void read_entry(struct mill_deck_text *text, char *line)
{
    struct mill_deck_section *section = text->reading->open;
    if (!section && (text->section || text->reading->lost))
        return; /* the section is unknown, and so are its keys */
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
        excuse(text, word);
        mill_deck_wrong(text, NULL, NULL, "expected '[section]' or 'key = value', got '%.60s'",
                        trim(line));
        return;
    }
    *equals = '\0';
    char *key = trim(line), *value = trim(equals + 1);
    const char *wrong = quoted ? unquote(value) : NULL;
    if (wrong) {
        excuse(text, key);
        mill_deck_wrong(text, NULL, NULL, "%s", wrong);
    } else if (section) {
        add_entry(text, section, key, value, look);
    } else {
        mill_deck_wrong(text, NULL, key, "stands before the first [section]");
    }
}

/* A file that is not a text has one fault, not one per line. */
static bool check_text(struct mill_deck_text *text, const char *bytes, size_t size)
{
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
    return true;
}

static void read_file(struct mill_deck_text *text)
{
    const char *wrong;
    size_t size = 0;
    struct mill_deck_reading *r = text->reading;
    char *bytes = mill_textfile_read(text->file, LARGEST, &size, &wrong), *next;
    if (bytes && !mill_deck_keep(text, bytes))
        return;
    if (!bytes && wrong)
        mill_deck_wrong(text, NULL, NULL, "%s", wrong);
    else if (!bytes)
        mill_deck_failed(text, "%s: cannot be read: %s", text->file, strerror(errno));
    if (!bytes || !check_text(text, bytes, size))
        return;
    bytes[size] = '\0';
    for (char *line = bytes; line < bytes + size && !r->over; line = next) {
        const size_t length = strcspn(line, "\n");
        next = line + length + 1;
        line[length] = '\0';
        line[strcspn(line, "\r")] = '\0';
        line += ++r->at.line == 1 ? mill_textfile_mark(line) : 0;
        line += strspn(line, " \t");
        if (*line == '[')
            read_title(text, line);
        else if (*line && !is_comment(line, 0))
            read_entry(text, line);
    }
    r->at.line = 0;
    r->open = NULL;
    if (!text->section && !r->lost && !r->over)
        mill_deck_wrong(text, NULL, NULL,
                        "the deck is empty: expected sections such as [run] and [drum]");
}

/* SECTION.KEY=VALUE; SECTION may contain dots. copy: of the override; it is changed */
static void apply_override(struct mill_deck_text *text, char *copy)
{
    for (const char *p = copy; *p; p++)
        if (iscntrl((unsigned char)*p)) {
            mill_deck_wrong(text, NULL, NULL, "holds a control character");
            return;
        }
    char *value = strchr(copy, '='), *key = NULL;
    if (value) {
        *value++ = '\0';
        key = strrchr(copy, '.');
    }
    if (!key || key == copy) {
        mill_deck_wrong(text, NULL, NULL,
                        "expected SECTION.KEY=VALUE such as 'rotor.speed=1000 rpm'");
        return;
    }
    *key++ = '\0';
    struct mill_deck_section *section = mill_deck_section(text, copy);
    section = section ? section : open_section(text, copy);
    if (section)
        add_entry(text, section, key, trim(value), MILL_DECK_PLAIN);
}

void mill_deck_parse(struct mill_deck_text *text, const char *path, int count,
                     const char *const *overrides)
{
    struct mill_deck_reading *r = text->reading;
    text->file = path ? path : "";
    if (path)
        read_file(text);
    for (int i = 0; i < count && !r->over; i++) {
        char *copy = mill_deck_keep(text, strdup(overrides[i]));
        r->at.override = overrides[i];
        if (copy)
            apply_override(text, copy);
        r->open = NULL;
    }
    r->at.override = NULL;
    for (const struct mill_deck_block *b = mill_deck_table; path && !r->lost && b->title; b++)
        if (!b->named && !b->optional && !r->over && !mill_deck_section(text, b->title) &&
            !(b->spared_by && mill_deck_named(text, b->spared_by, NULL)))
            mill_deck_section_add(text, b->title);
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
