/* One line of a deck: a section's title, or a key and its value. Comments start with # or ; at the
 * beginning or after white space. A value in double quotes (a file name with " #" in it) is kept
 * whole; "" inside stands for one ". */
#include "deck/deck_private.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

static bool is_space(char c)
{
    return c == ' ' || c == '\t';
}

/* Does a comment begin here? */
static bool is_comment(const char *text, size_t at)
{
    return (text[at] == '#' || text[at] == ';') && (at == 0 || is_space(text[at - 1]));
}

static enum mill_deck_line_kind wrong(struct mill_deck_line *line, const char *what)
{
    snprintf(line->wrong, sizeof line->wrong, "%s", what);
    return MILL_DECK_LINE_WRONG;
}

char *mill_deck_line_trim(char *text)
{
    size_t length = strlen(text);
    while (length > 0 && is_space(text[length - 1]))
        length--;
    text[length] = '\0';
    return text + strspn(text, " \t");
}

static void strip_comment(char *text)
{
    size_t length = 0;
    while (text[length] && !is_comment(text, length))
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
        return wrong(line, "unexpected text after the ']' of the section");
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
        return wrong(line, "unexpected text after the closing '\"' of the value");
    *out = '\0';
    line->quoted = true;
    return MILL_DECK_LINE_KEY;
}

static enum mill_deck_line_kind split_key(struct mill_deck_line *line)
{
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

enum mill_deck_line_kind mill_deck_line_next(struct mill_deck_line *line)
{
    static const char mark[] = "\xef\xbb\xbf"; /* UTF-8's byte order mark, by Windows editors */
    if (line->rest == line->end)
        return MILL_DECK_LINE_END;
    char *text = line->rest, *end = memchr(text, '\n', (size_t)(line->end - text));
    line->rest = end ? end + 1 : line->end;
    end = end ? end : line->end;
    end -= end > text && end[-1] == '\r';
    *end = '\0';
    line->number++;
    line->quoted = false;
    for (const char *p = text; p < end; p++) {
        if (((unsigned char)*p >= 32 && *p != 127) || *p == '\t')
            continue;
        snprintf(line->wrong, sizeof line->wrong,
                 "holds the control character 0x%02x: a deck is plain text", (unsigned)*p);
        return MILL_DECK_LINE_WRONG;
    }
    if (line->number == 1 && strncmp(text, mark, 3) == 0)
        text += 3;
    line->key = text + strspn(text, " \t");
    if (!*line->key || is_comment(line->key, 0))
        return MILL_DECK_LINE_EMPTY;
    return *line->key == '[' ? split_section(line) : split_key(line);
}

void mill_deck_line_quote(const char *value, char *out, size_t size)
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
