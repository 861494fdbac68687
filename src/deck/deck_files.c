/* Files that a deck names: their paths, and rows of numbers in them. */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LONGEST_ROW = 4096 };

/* by open(), which the engine in a browser has as well; no waiting for a pipe's writer */
static bool is_missing(const char *path)
{
    const int fd = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (fd >= 0)
        close(fd);
    return fd < 0 && errno == ENOENT;
}

void mill_deck_files_keep(struct mill_deck_text *text, void *memory)
{
    text->kept[text->keeps++] = memory;
}

enum mill_status mill_deck_files_find(struct mill_deck_text *text, const char *section,
                                      const char *key, const char **path)
{
    const char *name = *path;
    const char *file = text->file, *slash = strrchr(file, '/');
    char here[PATH_MAX] = "", whole_path[PATH_MAX];
    if (!name)
        return MILL_OK;
    const bool whole = name[0] == '/';
    if (!whole && file[0] != '/' && !getcwd(here, sizeof here))
        return mill_error_set(text->reading->error, MILL_FAILED,
                              "the current folder has no name: %s", strerror(errno));
    const char *apart = here[0] && here[1] ? "/" : ""; /* "/" already ends with one */
    const int folder = whole || !slash ? 0 : (int)(slash - file + 1);
    if (snprintf(whole_path, sizeof whole_path, "%s%s%.*s%s", here, apart, folder, file, name) >=
        PATH_MAX)
        return mill_deck_wrong(text, section, key, "the name of the file is too long");
    const struct mill_deck_entry *entry = mill_deck_entry(mill_deck_section(text, section), key);
    if (entry && entry->look == MILL_DECK_CUT && is_missing(whole_path))
        return mill_deck_wrong(
            text, section, key,
            "cannot read '%s': %s; what follows it is a comment: " MILL_DECK_QUOTE, whole_path,
            strerror(ENOENT));
    char *copy = strdup(whole_path);
    if (!copy)
        return mill_deck_memory(text);
    mill_deck_files_keep(text, copy);
    text->file_named[text->files++] = *path = copy;
    return MILL_OK;
}

enum mill_status mill_deck_files_told(const struct mill_deck_text *text, const char *section,
                                      const char *key, enum mill_status status)
{
    const struct mill_error what = *text->reading->error;
    return status == MILL_BAD_DECK ? mill_deck_wrong(text, section, key, "%s", what.text) : status;
}

/* FNV-1a hash of 64 bits (G. Fowler, L. C. Noll & K.-P. Vo, 1991) */
static uint64_t digest(uint64_t of, size_t count, const double *value)
{
    const unsigned char *bytes = (const unsigned char *)value;
    for (size_t k = 0; k < count * sizeof *value; k++)
        of = (of ^ bytes[k]) * 0x100000001b3U;
    return of;
}

uint64_t mill_deck_files_digest(const struct mill_deck *deck)
{
    const uint64_t none = 0xcbf29ce484222325U;
    const struct mill_fall *rows;
    uint64_t all = none;
    for (int k = 0; k < deck->mill.motions; k++)
        if (deck->mill.motion[k].type == &mill_table_type)
            all = digest(all, 7 * deck->mill.form[k].as.table.rows,
                         &deck->mill.form[k].as.table.row[0][0]);
    for (int k = 0; k < deck->mill.bodies.count; k++)
        /* copies have the same facets */
        if (deck->mill.bodies.surface[k].number == 0 && deck->mill.bodies.form[k].facets > 0)
            all = digest(all, 9 * deck->mill.bodies.form[k].facets,
                         &deck->mill.bodies.form[k].facet[0][0].x);
    for (int k = 0; k < deck->mill.contacts.count; k++)
        if ((rows = deck->mill.contact[k].law.rows))
            all = digest(digest(all, (size_t)rows->points, rows->speed), (size_t)rows->points,
                         rows->restitution);
    return all == none ? 0 : all;
}

/* ---- rows of numbers ---- */

/* Reads the next row without its comment and newline. Stops at LONGEST_ROW, for files without rows.
 * false: end of the file. *good: the row is text and not too long. */
static bool next_row(FILE *in, char row[LONGEST_ROW], bool *good)
{
    int length = 0, c = mill_textfile_next(in);
    bool comment = false;
    if (c == EOF)
        return false;
    for (*good = true; c != EOF && c != '\n' && *good; c = mill_textfile_next(in)) {
        comment = comment || c == '#';
        *good = c != '\0' && (comment || length < LONGEST_ROW - 1);
        if (*good && !comment)
            row[length++] = (char)c;
    }
    row[length] = '\0';
    return true;
}

#define BLANKS " \t\r\f\v,"

/* Reads up to `most` numbers of a row; -1: it contains something else. Hexadecimal numbers are not
 * accepted, as in a deck. There must be commas between all numbers or between none. Otherwise they
 * are decimal commas, as in "0,1 0,2 0,3", which would give six numbers. */
static int read_numbers(const char *row, int most, double *value)
{
    int n = 0, separated = 0;
    for (const char *p = row;;) {
        int commas = 0;
        for (; *p && strchr(BLANKS, *p); p++)
            commas += *p == ',';
        if (!*p)
            return separated == 0 || separated == n - 1 ? n : -1;
        if (n == most || commas > 1 || !mill_deck_value_number(&p, &value[n++]) ||
            !strchr(BLANKS, *p))
            return -1;
        separated += n > 1 && commas > 0;
    }
}

/* What a row that is not only numbers probably is, and the mend */
static const char *find_mend(const struct mill_deck_rows *rows, const char *row)
{
    static const char numbers[] = "+-.0123456789eE \t\r,;";
    const bool table = strspn(row, numbers) == strlen(row);
    if (rows->count == 0 && isalpha((unsigned char)row[strspn(row, " \t\"'")]))
        return "; is this a header? put a '#' in front of it";
    if (table && strchr(row, ';'))
        return "; it has ';' between them: write blanks, and decimal points";
    return table && strchr(row, ',')
               ? "; write decimal points, and commas between all numbers or between none"
               : "";
}

/* Reads the next row with numbers. Returns how many there are; 0: end of the file; -1: a text that
 * is no number, or too many of them. */
static int next_numbers(const struct mill_deck_rows *rows, FILE *in, long *line,
                        double value[MILL_DECK_COLUMNS + 1], const char **mend)
{
    char row[LONGEST_ROW];
    bool good;
    int n = 0;
    while (n == 0 && next_row(in, row, &good)) {
        /* byte order mark of UTF-8 */
        const bool marked =
            ++*line == 1 && row[0] == '\xef' && row[1] == '\xbb' && row[2] == '\xbf';
        const char *text = row + (marked ? 3 : 0);
        n = good ? read_numbers(text, MILL_DECK_COLUMNS, value) : -1;
        *mend = good && n < 0 ? find_mend(rows, text) : "";
    }
    return n;
}

enum mill_status mill_deck_files_wrong(const struct mill_deck_rows *rows, long line,
                                       struct mill_error *error, const char *format, ...)
{
    char what[256];
    va_list list;
    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    mill_error_set(error, MILL_BAD_DECK, "%s:%ld: %s", rows->path, line, what);
    return rows->alone ? MILL_BAD_DECK
                       : mill_deck_files_told(rows->text, rows->section, rows->key, MILL_BAD_DECK);
}

/* Makes room for one more row: for twice as many as before. */
static bool make_room(struct mill_deck_rows *rows)
{
    if (rows->count < rows->room)
        return true;
    rows->room = 2 * rows->room < rows->most ? 2 * rows->room + 1 : rows->most;
    double(*row)[MILL_DECK_COLUMNS] = realloc(rows->row, (size_t)rows->room * sizeof *row);
    if (!row)
        return false;
    rows->row = row;
    long *line = realloc(rows->line, (size_t)rows->room * sizeof *line);
    if (!line)
        return false;
    rows->line = line;
    return true;
}

enum mill_status mill_deck_files_read(struct mill_deck_rows *rows, struct mill_error *error)
{
    enum { TOLD = 8192 /* rows between two progress reports */ };
    double value[MILL_DECK_COLUMNS + 1] = {0.0};
    const struct mill_start_watch *watch = rows->watch;
    enum mill_status status = MILL_OK;
    const char *wrong, *mend;
    long line = 0;
    FILE *in = mill_textfile_open(rows->path, &wrong);
    if (!in)
        return mill_deck_fault(rows->text, error, rows->section, rows->key,
                               wrong ? "'%s' %s" : "cannot read '%s': %s", rows->path,
                               wrong ? wrong : strerror(errno));
    errno = 0;
    for (int n; status == MILL_OK && (n = next_numbers(rows, in, &line, value, &mend)) != 0;) {
        if (n < 0 || !(rows->columns >> n & 1u))
            status = mill_deck_files_wrong(rows, line, error, "expected %s%s", rows->form, mend);
        else if (rows->count == rows->most)
            status = mill_deck_files_wrong(rows, line, error, rows->many, rows->most);
        else if (!make_room(rows))
            status =
                mill_error_set(error, MILL_FAILED, "out of memory for the rows of %s", rows->path);
        if (status != MILL_OK)
            break;
        memcpy(rows->row[rows->count], value, sizeof *rows->row);
        rows->line[rows->count++] = line;
        memset(value, 0, sizeof value);
        if (watch && rows->count % TOLD == 0)
            watch->tell(watch->self, "reading the start file", (int32_t)rows->count,
                        (int32_t)rows->most);
    }
    if (status == MILL_OK && ferror(in))
        status = mill_error_set(error, MILL_FAILED, "%s: %s", rows->path, strerror(errno));
    fclose(in);
    return status;
}
