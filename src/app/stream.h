/* A stream of records on standard input: another program's run, for --digest. docs/file-format.md
 * describes the records. */
#ifndef MILL_STREAM_H
#define MILL_STREAM_H

#include "millsim/status.h"

#include <signal.h>
#include <stddef.h>
#include <stdint.h>

enum { MILL_STREAM_TYPE = 8 }; /* bytes of a record's type */

/* From file descriptor 0. Numbers are little-endian, as on this machine. */
struct mill_stream {
    const volatile sig_atomic_t *stop; /* non-zero: stop */
    uint64_t records;                  /* number of records begun */
    char type[MILL_STREAM_TYPE + 1];   /* of the present record; "": end of the stream */
    uint64_t length;                   /* [bytes] length of the present record's contents */
    char *bytes;                       /* the contents, followed by a 0 */
    size_t room;
};

/* Reads the first line. MILL_BAD_DECK: this is no such stream. MILL_STOPPED: *stop
 * became non-zero. */
enum mill_status mill_stream_begin(struct mill_stream *stream, struct mill_error *error);

/* next: reads type and length of the next record. take: reads its contents. MILL_FAILED: the stream
 * is cut off. */
enum mill_status mill_stream_next(struct mill_stream *stream, struct mill_error *error);
enum mill_status mill_stream_take(struct mill_stream *stream, struct mill_error *error);

/* Describes what is wrong with the present record: "standard input: record 3 (state): WHY" */
enum mill_status mill_stream_refuse(const struct mill_stream *stream, enum mill_status status,
                                    const char *why, struct mill_error *error);

void mill_stream_free(struct mill_stream *stream);

#endif
