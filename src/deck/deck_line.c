/* One line of a deck, cleaned up: libinih keeps no line numbers, cuts long lines and glues indented
 * ones to the line before, so lines are read, checked and stripped here and handed to it one by
 * one. Comments start with # or ; at the beginning or after white space. A value in double quotes
 * (a file name with " #" in it, or longer than libinih's 199 characters) is kept whole; "" inside
 * stands for one ". */
#include "deck/deck_private.h"
#include "deck/textfile.h"

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

static void strip_front(struct mill_deck_line *line)
{
    static const char mark[] = "\xef\xbb\xbf"; /* UTF-8's byte order mark, by Windows editors */
    size_t skip = line->number == 1 && strncmp(line->text, mark, 3) == 0 ? 3 : 0;
    while (is_space(line->text[skip]))
        skip++;
    memmove(line->text, line->text + skip, strlen(line->text + skip) + 1);
}

/* Cuts a comment and white space off the end of text. */
static void strip_end(char *text)
{
    size_t length = 0;
    while (text[length] && !((text[length] == '#' || text[length] == ';') &&
                             (length == 0 || is_space(text[length - 1]))))
        length++;
    while (length > 0 && is_space(text[length - 1]))
        length--;
    text[length] = '\0';
}

/* Moves a quoted value from line->text to line->value; the key and '=' stay. */
static enum mill_deck_line_kind take_quoted(struct mill_deck_line *line, char *quote)
{
    size_t length = 0;
    char *p = quote + 1;
    while (*p && (*p != '"' || p[1] == '"')) {
        p += *p == '"';
        line->value[length++] = *p++;
    }
    line->value[length] = '\0';
    if (*p != '"')
        return wrong(line, "the closing '\"' of the value is missing");
    char *rest = p + 1;
    if (*rest && !is_space(*rest))
        return wrong(line, "there is more behind the closing '\"' of the value");
    strip_end(rest);
    if (*rest)
        return wrong(line, "there is more behind the closing '\"' of the value");
    *quote = '\0';
    line->quoted = true;
    return MILL_DECK_LINE_KEY;
}

enum mill_deck_line_kind mill_deck_line_next(struct mill_deck_line *line, FILE *file)
{
    line->quoted = false;
    const enum mill_deck_line_kind kind = read_bytes(line, file);
    if (kind != MILL_DECK_LINE_KEY)
        return kind;
    strip_front(line);
    if (!line->text[0] || line->text[0] == '#' || line->text[0] == ';')
        return MILL_DECK_LINE_EMPTY;
    if (line->text[0] == '[') {
        strip_end(line->text);
        const char *end = strchr(line->text, ']');
        if (!end)
            return wrong(line, "the closing ']' of the section is missing");
        return end[1] ? wrong(line, "there is more behind the ']' of the section")
                      : MILL_DECK_LINE_SECTION;
    }
    char *value = strpbrk(line->text, "=:");
    if (value) {
        do
            value++;
        while (is_space(*value));
        if (*value == '"')
            return take_quoted(line, value);
    }
    strip_end(line->text);
    if (!strpbrk(line->text, "=:")) {
        snprintf(line->wrong, sizeof line->wrong,
                 "expected '[section]' or 'key = value', got '%.60s'", line->text);
        return MILL_DECK_LINE_WRONG;
    }
    return MILL_DECK_LINE_KEY;
}

void mill_deck_line_quote(const char *value, char *out, size_t size)
{
    enum { LONG = 120 }; /* well below what libinih takes */
    const size_t length = strlen(value);
    bool needed = length == 0 || length > LONG || value[0] == '"' || is_space(value[0]) ||
                  is_space(value[length - 1]) || value[0] == '#' || value[0] == ';';
    for (size_t i = 1; i < length; i++)
        needed = needed || ((value[i] == '#' || value[i] == ';') && is_space(value[i - 1]));
    if (!needed) {
        snprintf(out, size, "%s", value);
        return;
    }
    size_t at = 0;
    out[at++] = '"';
    for (size_t i = 0; i < length && at + 4 < size; i++) {
        if (value[i] == '"')
            out[at++] = '"';
        out[at++] = value[i];
    }
    out[at++] = '"';
    out[at] = '\0';
}
