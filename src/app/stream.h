/* A stream of records on standard input: the run of another program, for --digest. What they mean
 * is the reader's to know; docs/file-format.md has all of it. */
#ifndef MILL_STREAM_H
#define MILL_STREAM_H

#include "millsim/status.h"

#include <signal.h>
#include <stddef.h>
#include <stdint.h>

enum { MILL_STREAM_TYPE = 8 }; /* bytes of a record's type */

/* From descriptor 0; numbers are little-endian, as this machine's are. */
struct mill_stream {
    const volatile sig_atomic_t *stop; /* asks for an end where it is not 0 */
    uint64_t records;                  /* begun so far */
    char type[MILL_STREAM_TYPE + 1];   /* of the present record; "": the stream is over */
    uint64_t length;                   /* [bytes] of what it holds, */
    char *bytes;                       /* and that, with a 0 behind it */
    size_t room;
};

/* Reads the first line. MILL_BAD_DECK: it is no such stream. MILL_STOPPED: it was asked for. */
enum mill_status mill_stream_begin(struct mill_stream *stream, struct mill_error *error);

/* Reads type and length of the next record, then what it holds. Where the stream ends in between it
 * is cut: MILL_FAILED. */
enum mill_status mill_stream_next(struct mill_stream *stream, struct mill_error *error);
enum mill_status mill_stream_take(struct mill_stream *stream, struct mill_error *error);

/* What is wrong with the present record: "standard input: record 3 (state): WHY" */
enum mill_status mill_stream_refuse(const struct mill_stream *stream, enum mill_status status,
                                    const char *why, struct mill_error *error);

void mill_stream_free(struct mill_stream *stream);

#endif
