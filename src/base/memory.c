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

void *mill_memory_take(struct mill_memory_pool *pool, size_t count, size_t size)
{
    pool->block.size = sizeof(void *);
    void **block = mill_memory_add(&pool->block), *memory = mill_memory_get(count, size);
    if (block && memory)
        return *block = memory;
    free(memory);
    pool->block.count -= block != NULL;
    pool->failed = true;
    return NULL;
}

void mill_memory_drop(struct mill_memory_pool *pool)
{
    void **block = pool->block.item;
    while (pool->block.count > 0)
        free(block[--pool->block.count]);
    free(block);
    *pool = (struct mill_memory_pool){.failed = false};
}
