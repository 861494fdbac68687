/* Files that a deck names: their paths, and rows of numbers in them. */
#include "deck/deck_private.h"
#include "deck/textfile.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdint.h>
#include <unistd.h>

enum { LONGEST_ROW = 4096, COLUMNS = 9 };

/* by open(), which the engine in a browser has as well; no waiting for a pipe's writer */
static bool is_missing(const char *path)
{
    const int fd = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (fd >= 0)
        close(fd);
    return fd < 0 && errno == ENOENT;
}

bool mill_deck_files_find(struct mill_deck_text *text, const char *section, const char *key,
                          const char **path)
{
    const char *name = *path, *file = text->file, *slash = strrchr(file, '/');
    char here[PATH_MAX] = "", whole_path[PATH_MAX];
    if (!name)
        return true;
    const bool whole = name[0] == '/';
    if (!whole && file[0] != '/' && !getcwd(here, sizeof here))
        return mill_deck_failed(text, "the current folder has no name: %s", strerror(errno));
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
    const char **listed = mill_memory_add(&text->files);
    char *copy = mill_deck_keep(text, listed ? strdup(whole_path) : NULL);
    if (copy)
        *listed = *path = copy;
    return copy != NULL;
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
    uint64_t all = none;
    for (int k = 0; k < deck->setup.motions; k++)
        if (deck->mill.motion[k].type == &mill_table_type)
            all = digest(all, 7 * deck->mill.form[k].as.table.rows,
                         &deck->mill.form[k].as.table.row[0][0]);
    if (deck->given.contour)
        all = digest(all, 3 * deck->setup.drum.corners, &deck->setup.drum.corner->x);
    for (int k = 0; k < deck->setup.surfaces; k++) {
        const struct mill_setup_surface *s = &deck->setup.surface[k];
        if (s->number <= 0 && s->body->corners > 0)
            all = digest(all, 3 * s->body->corners, &s->body->corner->x);
        if (s->number == 0 && s->body->facets > 0) /* copies have the same facets */
            all = digest(all, 9 * s->body->facets, &s->body->facet[0][0].x);
    }
    for (int k = 0; k < deck->mill.contacts.count; k++) {
        const struct mill_fall *rows = deck->mill.contact[k].law.rows;
        if (rows)
            all = digest(digest(all, (size_t)rows->points, rows->speed), (size_t)rows->points,
                         rows->restitution);
    }
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
    if (rows->row.count == 0 && isalpha((unsigned char)row[strspn(row, " \t\"'")]))
        return "; is this a header? put a '#' in front of it";
    if (table && strchr(row, ';'))
        return "; it has ';' between them: write blanks, and decimal points";
    return table && strchr(row, ',')
               ? "; write decimal points, and commas between all numbers or between none"
               : "";
}

/* Reads the next row with numbers; returns how many. 0: the file ends; -1: no numbers, too many */
static int next_numbers(const struct mill_deck_rows *rows, FILE *in, long *line,
                        double value[COLUMNS + 1], const char **mend)
{
    char row[LONGEST_ROW];
    bool good;
    int n = 0;
    while (n == 0 && next_row(in, row, &good)) {
        const char *text = row + (++*line == 1 ? mill_textfile_mark(row) : 0);
        n = good ? read_numbers(text, COLUMNS, value) : -1;
        *mend = good && n < 0 ? find_mend(rows, text) : "";
    }
    return n;
}

bool mill_deck_files_wrong(const struct mill_deck_rows *rows, long line, const char *format, ...)
{
    char what[256];
    va_list list;
    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    if (!rows->alone)
        return mill_deck_wrong(rows->text, rows->section, rows->key, "%s:%ld: %s", rows->path, line,
                               what);
    struct mill_deck_text text = *rows->text;
    text.file = rows->path;
    text.reading->at.line = (int)line;
    return mill_deck_wrong(&text, NULL, NULL, "%s", what);
}

static bool keep(const struct mill_deck_text *text, void *item)
{
    return !item || mill_deck_keep(text, item);
}

bool mill_deck_files_read(struct mill_deck_rows *rows)
{
    enum { TOLD = 8192 /* rows between two progress reports */ };
    double value[COLUMNS + 1] = {0.0};
    const struct mill_start_watch *watch = rows->text->reading->watch;
    const char *wrong, *mend;
    long line = 0;
    bool good = true;
    FILE *in = mill_textfile_open(rows->path, &wrong);
    if (!in)
        return mill_deck_wrong(rows->text, rows->section, rows->key,
                               wrong ? "'%s' %s" : "cannot read '%s': %s", rows->path,
                               wrong ? wrong : strerror(errno));
    for (size_t n = 0; rows->columns >> n; n++)
        rows->row.size = n * sizeof *value;
    rows->line.size = sizeof line;
    errno = 0;
    for (int n; good && (n = next_numbers(rows, in, &line, value, &mend)) != 0;) {
        if (n < 0 || !(rows->columns >> n & 1u))
            good = mill_deck_files_wrong(rows, line, "expected %s%s", rows->form, mend);
        else if (rows->row.count == (size_t)rows->most)
            good = mill_deck_files_wrong(rows, line,
                                         rows->alone ? "more rows than the %ld balls of the deck"
                                                     : "there are more than %ld rows",
                                         rows->most);
        void *row = good ? mill_memory_add(&rows->row) : NULL;
        long *at = good ? mill_memory_add(&rows->line) : NULL;
        if (good && (!row || !at))
            good = mill_deck_failed(rows->text, "out of memory for the rows of %s", rows->path);
        if (!good)
            break;
        memcpy(row, value, rows->row.size);
        *at = line;
        memset(value, 0, sizeof value);
        if (watch && rows->alone && rows->row.count % TOLD == 0)
            watch->tell(watch->self, "reading the start file", (int32_t)rows->row.count,
                        (int32_t)rows->most);
    }
    if (good && ferror(in))
        good = mill_deck_failed(rows->text, "%s: %s", rows->path, strerror(errno));
    fclose(in);
    good = keep(rows->text, rows->row.item) && good;
    return keep(rows->text, rows->line.item) && good;
}
