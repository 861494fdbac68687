/* Aligned memory: a record as long as a cache line needs one access if it begins at such a line. */
#include "base/memory.h"

#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define LINE 64

void *mill_memory_get(size_t count, size_t size)
{
    assert(size > 0);
    void *memory = NULL;
    const size_t bytes = count > 0 ? count * size : LINE;
    if (count > (SIZE_MAX - LINE) / size || posix_memalign(&memory, LINE, bytes) != 0)
        return NULL;
    return memset(memory, 0, bytes);
}

void *mill_memory_add(struct mill_memory_list *l)
{
    if (l->count == l->room) {
        const size_t room = l->room > 0 ? 2 * l->room : 64;
        void *more = realloc(l->item, room * l->size);
        if (!more)
            return NULL;
        l->item = more;
        l->room = room;
    }
    return (char *)l->item + l->count++ * l->size;
}
