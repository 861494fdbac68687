/* One list of places serves for the size, for saving and for loading, so these cannot disagree. */
#include "base/parts.h"

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

enum mill_status mill_parts_read(struct mill_source *source, void *to, size_t bytes,
                                 struct mill_error *error)
{
    if (bytes > source->left)
        return mill_error_set(error, MILL_FAILED, "the saved state is cut short");
    source->left -= bytes;
    return bytes > 0 ? source->read(source, to, bytes, error) : MILL_OK;
}

enum mill_status mill_parts_read_all(struct mill_source *source, const struct mill_part *part,
                                     size_t parts, struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    if (mill_parts_size(part, parts) > source->left)
        return mill_error_set(error, MILL_FAILED, "the saved state is cut short");
    for (size_t i = 0; i < parts && status == MILL_OK; i++)
        status = mill_parts_read(source, part[i].at, part[i].bytes, error);
    return status;
}

static enum mill_status read_memory(struct mill_source *self, void *to, size_t bytes,
                                    struct mill_error *error)
{
    struct mill_source_memory *memory = (struct mill_source_memory *)self;
    (void)error;
    memcpy(to, memory->at, bytes);
    memory->at += bytes;
    return MILL_OK;
}

struct mill_source_memory mill_parts_from(const unsigned char *bytes, size_t size)
{
    return (struct mill_source_memory){{read_memory, size}, bytes};
}
