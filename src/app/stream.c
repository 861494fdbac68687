/* Reads records: a type, a length, and that many bytes. While there is no input, it checks for a
 * signal. */
#include "app/stream.h"

#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PATIENCE 250 /* [ms] between two checks of *stop */

static const char magic[] = "millsim stream 1\n";

/* *got: number of bytes; less than `count` at the end of the stream */
static enum mill_status fill(const struct mill_stream *s, char *to, size_t count, size_t *got,
                             struct mill_error *error)
{
    struct pollfd input = {STDIN_FILENO, POLLIN, 0};
    ssize_t length = 1;
    *got = 0;
    while (*got < count && length > 0) {
        while (!*s->stop && poll(&input, 1, PATIENCE) <= 0)
            ;
        if (*s->stop)
            return mill_error_set(error, MILL_STOPPED, "%s", "");
        length = read(STDIN_FILENO, to + *got, count - *got);
        if (length < 0 && errno != EINTR)
            return mill_error_set(error, MILL_FAILED, "standard input: cannot read: %s",
                                  strerror(errno));
        *got += length > 0 ? (size_t)length : 0;
        length = length < 0 ? 1 : length;
    }
    return MILL_OK;
}

enum mill_status mill_stream_begin(struct mill_stream *s, struct mill_error *error)
{
    char line[sizeof magic] = "";
    size_t got;
    const enum mill_status status = fill(s, line, sizeof magic - 1, &got, error);
    if (status != MILL_OK || strcmp(line, magic) == 0)
        return status;
    return mill_error_set(error, MILL_BAD_DECK,
                          "standard input: is not a stream of a run: expected the line '%.*s' "
                          "first (docs/file-format.md)",
                          (int)sizeof magic - 2, magic);
}

static enum mill_status tell_cut(const struct mill_stream *s, struct mill_error *error)
{
    return mill_error_set(error, MILL_FAILED,
                          "standard input: is cut off in record %llu: expected more bytes",
                          (unsigned long long)s->records);
}

enum mill_status mill_stream_next(struct mill_stream *s, struct mill_error *error)
{
    char head[MILL_STREAM_TYPE + sizeof s->length];
    size_t got;
    memset(s->type, 0, sizeof s->type);
    s->length = 0;
    const enum mill_status status = fill(s, head, sizeof head, &got, error);
    if (status != MILL_OK || got == 0)
        return status;
    s->records++;
    if (got < sizeof head)
        return tell_cut(s, error);
    for (int i = 0; i < MILL_STREAM_TYPE && head[i] != ' '; i++)
        s->type[i] = head[i] > ' ' && head[i] < 127 ? head[i] : '?';
    memcpy(&s->length, head + MILL_STREAM_TYPE, sizeof s->length);
    if (!s->type[0])
        s->type[0] = '?';
    return MILL_OK;
}

enum mill_status mill_stream_take(struct mill_stream *s, struct mill_error *error)
{
    size_t got;
    if (s->length >= s->room) {
        char *bytes = realloc(s->bytes, s->length + 1);
        if (!bytes)
            return mill_stream_refuse(s, MILL_FAILED, "out of memory", error);
        s->bytes = bytes;
        s->room = s->length + 1;
    }
    const enum mill_status status = fill(s, s->bytes, s->length, &got, error);
    if (status != MILL_OK)
        return status;
    s->bytes[got] = '\0';
    return got < s->length ? tell_cut(s, error) : MILL_OK;
}

enum mill_status mill_stream_refuse(const struct mill_stream *s, enum mill_status status,
                                    const char *why, struct mill_error *error)
{
    return mill_error_set(error, status, "standard input: record %llu (%s): %s",
                          (unsigned long long)s->records, s->type, why);
}

void mill_stream_free(struct mill_stream *s)
{
    free(s->bytes);
    s->bytes = NULL;
}
