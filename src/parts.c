/* One list of places serves for the size, for saving and for loading, so these cannot disagree. */
#include "parts.h"

#include <string.h>

size_t mill_parts_size(const struct mill_part *part, size_t parts)
{
    size_t size = 0;
    for (size_t i = 0; i < parts; i++)
        size += part[i].bytes;
    return size;
}

unsigned char *mill_parts_pack(const struct mill_part *part, size_t parts, unsigned char *to)
{
    for (size_t i = 0; i < parts; i++) {
        if (part[i].bytes > 0)
            memcpy(to, part[i].at, part[i].bytes);
        to += part[i].bytes;
    }
    return to;
}

const unsigned char *mill_parts_unpack(const struct mill_part *part, size_t parts,
                                       const unsigned char *from)
{
    for (size_t i = 0; i < parts; i++) {
        if (part[i].bytes > 0)
            memcpy(part[i].at, from, part[i].bytes);
        from += part[i].bytes;
    }
    return from;
}
