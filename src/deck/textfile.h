/* Text files that users name: decks and starts. */
#ifndef MILL_TEXTFILE_H
#define MILL_TEXTFILE_H

#include <errno.h>
#include <stdio.h>

/* Opens a file, or a pipe with a writer, for reading. NULL: *wrong says what it is instead, or is
 * NULL and errno says why it cannot be read. */
FILE *mill_textfile_open(const char *path, const char **wrong);

/* All bytes of a file of at most `most` bytes, and room for one more; NULL: as above. Owner: the
 * caller. */
char *mill_textfile_read(const char *path, size_t most, size_t *size, const char **wrong);

/* getc() that goes on after a signal */
static inline int mill_textfile_next(FILE *file)
{
    int c;
    while ((c = getc_unlocked(file)) == EOF && ferror(file) && errno == EINTR)
        clearerr(file);
    return c;
}

#endif
