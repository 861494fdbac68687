/* One line of a deck: a section's title, or a key and its value. Comments start with # or ; at the
 * beginning or after white space. A value in double quotes (a file name with " #" in it) is kept
 * whole; "" inside stands for one ". */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

static bool is_space(char c)
{
    return c == ' ' || c == '\t';
}

static enum mill_deck_line_kind wrong(struct mill_deck_line *line, const char *what)
{
    snprintf(line->wrong, sizeof line->wrong, "%s", what);
    return MILL_DECK_LINE_WRONG;
}

/* The bytes up to the newline into line->text; what no text file holds is refused. */
static enum mill_deck_line_kind read_bytes(struct mill_deck_line *line, FILE *file)
{
    int length = 0, c = mill_textfile_next(file);
    line->number++;
    if (c == EOF)
        return ferror(file) ? MILL_DECK_LINE_FAILED : MILL_DECK_LINE_END;
    for (; c != EOF && c != '\n'; c = mill_textfile_next(file)) {
        if (c == '\r') {
            const int next = mill_textfile_next(file);
            if (next != EOF)
                ungetc(next, file);
            if (next == '\n' || next == EOF)
                continue;
        }
        if ((c < 32 && c != '\t') || c == 127) {
            snprintf(line->wrong, sizeof line->wrong,
                     "holds the control character 0x%02x: a deck is plain text", (unsigned)c);
            return MILL_DECK_LINE_WRONG;
        }
        if (length < MILL_DECK_LINE - 1) {
            line->text[length++] = (char)c;
        } else {
            line->text[length] = '\0';
            const char first = line->text[strspn(line->text, " \t")];
            if (first != '#' && first != ';')
                return wrong(line, "the line is too long");
        }
    }
    line->text[length] = '\0';
    return ferror(file) ? MILL_DECK_LINE_FAILED : MILL_DECK_LINE_KEY;
}

char *mill_deck_line_trim(char *text)
{
    size_t length = strlen(text);
    while (length > 0 && is_space(text[length - 1]))
        length--;
    text[length] = '\0';
    return text + strspn(text, " \t");
}

/* Cuts off a comment. */
static void strip_comment(char *text)
{
    size_t length = 0;
    while (text[length] && !((text[length] == '#' || text[length] == ';') &&
                             (length == 0 || is_space(text[length - 1]))))
        length++;
    text[length] = '\0';
}

static enum mill_deck_line_kind split_section(struct mill_deck_line *line)
{
    strip_comment(line->key);
    line->key = mill_deck_line_trim(line->key) + 1;
    char *end = strchr(line->key, ']');
    if (!end)
        return wrong(line, "the closing ']' of the section is missing");
    if (end[1])
        return wrong(line, "unexpected text behind the ']' of the section");
    *end = '\0';
    return MILL_DECK_LINE_SECTION;
}

/* Takes the quotes off line->value. */
static enum mill_deck_line_kind unquote(struct mill_deck_line *line)
{
    assert(*line->value == '"');
    char *out = line->value, *p = line->value + 1;
    while (*p && (*p != '"' || p[1] == '"')) {
        p += *p == '"';
        *out++ = *p++;
    }
    if (*p != '"')
        return wrong(line, "the closing '\"' of the value is missing");
    char *rest = p + 1;
    const bool apart = !*rest || is_space(*rest);
    strip_comment(rest);
    if (!apart || *mill_deck_line_trim(rest))
        return wrong(line, "unexpected text behind the closing '\"' of the value");
    *out = '\0';
    line->quoted = true;
    return MILL_DECK_LINE_KEY;
}

enum mill_deck_line_kind mill_deck_line_next(struct mill_deck_line *line, FILE *file)
{
    static const char mark[] = "\xef\xbb\xbf"; /* UTF-8's byte order mark, by Windows editors */
    line->quoted = false;
    const enum mill_deck_line_kind kind = read_bytes(line, file);
    if (kind != MILL_DECK_LINE_KEY)
        return kind;
    line->key = line->text;
    if (line->number == 1 && strncmp(line->text, mark, 3) == 0)
        line->key += 3;
    line->key += strspn(line->key, " \t");
    if (*line->key == '[')
        return split_section(line);
    if (!*line->key || *line->key == '#' || *line->key == ';')
        return MILL_DECK_LINE_EMPTY;
    char *equals = strpbrk(line->key, "=:");
    if (!equals || equals[1 + strspn(equals + 1, " \t")] != '"') {
        strip_comment(line->key);
        equals = strpbrk(line->key, "=:");
    }
    if (!equals) {
        snprintf(line->wrong, sizeof line->wrong,
                 "expected '[section]' or 'key = value', got '%.60s'",
                 mill_deck_line_trim(line->key));
        return MILL_DECK_LINE_WRONG;
    }
    *equals = '\0';
    line->key = mill_deck_line_trim(line->key);
    line->value = mill_deck_line_trim(equals + 1);
    return *line->value == '"' ? unquote(line) : MILL_DECK_LINE_KEY;
}

void mill_deck_line_quote(const char *value, char *out, size_t size)
{
    const size_t length = strlen(value);
    assert(size >= 2 * length + 3);
    bool needed = length == 0 || value[0] == '"' || is_space(value[0]) ||
                  is_space(value[length - 1]) || value[0] == '#' || value[0] == ';';
    for (size_t i = 1; i < length; i++)
        needed = needed || ((value[i] == '#' || value[i] == ';') && is_space(value[i - 1]));
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
