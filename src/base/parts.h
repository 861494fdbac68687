/* A state kept in several places as one run of bytes: good for the program that wrote them, on the
 * machine that did. Where it is large it goes to a file and comes back part by part, so that it is
 * never in memory twice. */
#ifndef MILL_PARTS_H
#define MILL_PARTS_H

#include "millsim/status.h"

#include <stddef.h>

struct mill_part {
    void *at;
    size_t bytes; /* may be 0, `at` is NULL then or not */
};

size_t mill_parts_size(const struct mill_part *part, size_t parts);

/* Copies the parts one after another to `to`, and back. Returns the first byte after them. */
unsigned char *mill_parts_pack(const struct mill_part *part, size_t parts, unsigned char *to);
const unsigned char *mill_parts_unpack(const struct mill_part *part, size_t parts,
                                       const unsigned char *from);

/* Where the bytes of a state come from, one after another. */
struct mill_source {
    /* gives the next bytes, of which there are no fewer */
    enum mill_status (*read)(struct mill_source *self, void *to, size_t bytes,
                             struct mill_error *error);
    size_t left; /* [byte] not read yet */
};

/* The next bytes go to `to`, or to the parts. MILL_FAILED when there are fewer: nothing is read
 * then. */
enum mill_status mill_parts_read(struct mill_source *source, void *to, size_t bytes,
                                 struct mill_error *error);
enum mill_status mill_parts_read_all(struct mill_source *source, const struct mill_part *part,
                                     size_t parts, struct mill_error *error);

/* Bytes in memory as a source; they must outlive it. */
struct mill_source_memory {
    struct mill_source source; /* first */
    const unsigned char *at;
};
struct mill_source_memory mill_parts_from(const unsigned char *bytes, size_t size);

#endif
