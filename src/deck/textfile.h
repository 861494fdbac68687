/* Text files that users name: decks and start files. */
#ifndef MILL_TEXTFILE_H
#define MILL_TEXTFILE_H

#include <errno.h>
#include <stdio.h>

/* Opens a file for reading, or a pipe that another process writes to. NULL: *wrong says what else
 * the path is; if *wrong is NULL, errno says why it cannot be read. */
FILE *mill_textfile_open(const char *path, const char **wrong);

/* Reads a file of at most `most` bytes; the memory has room for one byte more. NULL: as for
 * mill_textfile_open. Owner: the caller. */
char *mill_textfile_read(const char *path, size_t most, size_t *size, const char **wrong);

/* [B] length of the byte order mark of UTF-8 with which Windows editors begin a text */
static inline size_t mill_textfile_mark(const char *text)
{
    return text[0] == '\xef' && text[1] == '\xbb' && text[2] == '\xbf' ? 3 : 0;
}

/* getc() that continues after a signal */
static inline int mill_textfile_next(FILE *file)
{
    int c;
    while ((c = getc_unlocked(file)) == EOF && ferror(file) && errno == EINTR)
        clearerr(file);
    return c;
}

#endif
