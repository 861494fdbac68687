/* Text files that users name. A device, a socket or a pipe without a writer (a forgotten FIFO)
 * could block the program for ever and is refused. The pipe of a shell's `<(...)` is accepted. */
#include "deck/textfile.h"

#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* [ms] to wait for a writer: a shell may start writer and reader at the same time */
enum { WRITER_COMES = 2000 };

/* Is there data in the pipe, or a process that may still write? The pipe was opened with
 * O_NONBLOCK; afterwards reading waits for a slow writer. */
static bool has_writer(FILE *pipe)
{
    struct pollfd end = {.fd = fileno(pipe), .events = POLLIN};
    while (poll(&end, 1, WRITER_COMES) < 0 && errno == EINTR)
        continue;
    const int c = mill_textfile_next(pipe);
    const bool silent = c == EOF && ferror(pipe) && errno == EAGAIN;
    clearerr(pipe);
    fcntl(end.fd, F_SETFL, 0);
    return silent || ungetc(c, pipe) != EOF;
}

FILE *mill_textfile_open(const char *path, const char **wrong)
{
    int fd;
    do
        fd = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    while (fd < 0 && errno == EINTR);
    *wrong = fd < 0 && errno == ENXIO ? "is a socket, not a file" : NULL;
    FILE *file = fd < 0 ? NULL : fdopen(fd, "r");
    if (!file) {
        const int why = errno;
        if (fd >= 0)
            close(fd);
        errno = why;
        return NULL;
    }
    struct stat about = {0};
    fstat(fd, &about);
    if (S_ISREG(about.st_mode) || (S_ISFIFO(about.st_mode) && has_writer(file)))
        return file;
    if (S_ISFIFO(about.st_mode))
        *wrong = "is a pipe that nobody writes to";
    else if (!S_ISDIR(about.st_mode))
        *wrong = "is a device, not a file";
    fclose(file);
    errno = EISDIR;
    return NULL;
}

char *mill_textfile_read(const char *path, size_t most, size_t *size, const char **wrong)
{
    FILE *file = mill_textfile_open(path, wrong);
    if (!file)
        return NULL;
    size_t room = 4096;
    char *bytes = malloc(room), *more = bytes;
    *size = 0;
    for (int c; more && *size <= most && (c = mill_textfile_next(file)) != EOF;) {
        bytes[(*size)++] = (char)c;
        if (*size == room && (more = realloc(bytes, room *= 2)))
            bytes = more;
    }
    const int why = more ? errno : ENOMEM;
    const bool failed = !more || ferror(file);
    *wrong = *size > most ? "is too large" : NULL;
    fclose(file);
    errno = why;
    if (!failed && !*wrong)
        return bytes;
    free(bytes);
    return NULL;
}
