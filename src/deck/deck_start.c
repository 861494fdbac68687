/* The start file: one ball a line. */
#include "deck/deck_setup.h"
#include "deck/textfile.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { LONGEST_ROW = 4096, TOLD = 8192 /* rows between two reports */ };

/* The next row, without comment and newline, but no more of a file that has no rows than fits.
 * false: the end. *good: it is text. */
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

/* Reads up to nine numbers of a row; -1: something else stands there. Hexadecimal ones are none, as
 * in a deck. A comma stands between all numbers or between none: some, as in "0,1 0,2 0,3", are
 * decimal commas, and would give six numbers. */
static int read_numbers(const char *row, double value[10])
{
    int n = 0, separated = 0;
    for (const char *p = row;;) {
        int commas = 0;
        for (; *p && strchr(BLANKS, *p); p++)
            commas += *p == ',';
        if (!*p)
            return separated == 0 || separated == n - 1 ? n : -1;
        const char *digits = p + (*p == '+' || *p == '-');
        char *end;
        const double x = strtod(p, &end);
        if (end == p || !isfinite(x) || !strchr(BLANKS, *end) || n == 9 || commas > 1 ||
            (digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X')))
            return -1;
        separated += n > 0 && commas > 0;
        value[n++] = x;
        p = end;
    }
}

static enum mill_status read_rows(const struct mill_deck *deck, FILE *in,
                                  const struct mill_start_watch *watch, int32_t balls,
                                  struct mill_deck_start *start, struct mill_error *error)
{
    char row[LONGEST_ROW];
    int32_t rows = 0;
    bool good;
    enum mill_status status = MILL_OK;
    errno = 0;
    for (long number = 1; status == MILL_OK && next_row(in, row, &good); number++) {
        double x[10] = {0.0};
        /* of UTF-8 */
        const bool marked = number == 1 && row[0] == '\xef' && row[1] == '\xbb' && row[2] == '\xbf';
        const int n = good ? read_numbers(row + (marked ? 3 : 0), x) : -1;
        if (n == 0)
            continue;
        if (n != 3 && n != 6 && n != 9) {
            status = mill_error_set(error, MILL_BAD_DECK,
                                    "%s:%ld: expected 3, 6 or 9 numbers "
                                    "'x y z [vx vy vz [wx wy wz]]' in SI units",
                                    deck->start, number);
        } else if (rows == balls) {
            status = mill_error_set(error, MILL_BAD_DECK,
                                    "%s:%ld: more rows than the %ld balls of the deck", deck->start,
                                    number, (long)balls);
        } else {
            start->ball[rows].position = vec3_make(x[0], x[1], x[2]);
            start->ball[rows].velocity = vec3_make(x[3], x[4], x[5]);
            start->ball[rows].spin = vec3_make(x[6], x[7], x[8]);
            start->line[rows++] = number;
            if (watch && rows % TOLD == 0)
                watch->tell(watch->self, "reading the start file", rows, balls);
        }
    }
    const int failed = ferror(in), why = errno;
    if (status == MILL_OK && failed)
        status = mill_error_set(error, MILL_FAILED, "%s: %s", deck->start, strerror(why));
    if (status == MILL_OK && rows != balls)
        status = mill_deck_fault(deck, error, "balls", "start",
                                 "'%s' has %ld rows, but the deck has %ld balls", deck->start,
                                 (long)rows, (long)balls);
    return status;
}

enum mill_status mill_deck_start_read(const struct mill_deck *deck, int32_t balls,
                                      const struct mill_start_watch *watch,
                                      struct mill_deck_start *start, struct mill_error *error)
{
    const char *wrong;
    FILE *in = mill_textfile_open(deck->start, &wrong);
    if (!in && wrong)
        return mill_deck_fault(deck, error, "balls", "start", "'%s' %s", deck->start, wrong);
    if (!in)
        return mill_deck_fault(deck, error, "balls", "start", "cannot read '%s': %s", deck->start,
                               strerror(errno));
    start->ball = malloc(sizeof *start->ball * ((size_t)balls + 1));
    start->line = malloc(sizeof *start->line * ((size_t)balls + 1));
    enum mill_status status =
        start->ball && start->line
            ? read_rows(deck, in, watch, balls, start, error)
            : mill_error_set(error, MILL_FAILED, "out of memory for %ld balls", (long)balls);
    fclose(in);
    return status;
}
