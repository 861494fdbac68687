/* A state kept in several places as one run of bytes: good for the program that wrote them, on the
 * machine that did. */
#ifndef MILL_PARTS_H
#define MILL_PARTS_H

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

#endif
