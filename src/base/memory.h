/* Memory for arrays that the event loop reads in random order, and for lists that grow. */
#ifndef MILLSIM_MEMORY_H
#define MILLSIM_MEMORY_H

#include <stdbool.h>
#include <stddef.h>

/* count * size zero bytes, aligned to a cache line; free() frees them. NULL: out of memory. */
void *mill_memory_get(size_t count, size_t size);

/* A list that grows. The owner sets the size of an item, and frees `item`. */
struct mill_memory_list {
    void *item;
    size_t count, room, size;
};

/* Adds an item, without content, and returns it. NULL: out of memory */
void *mill_memory_add(struct mill_memory_list *list);

/* Memory that its owner frees at once */
struct mill_memory_pool {
    struct mill_memory_list block;
    bool failed; /* some of it was not there */
};

/* As mill_memory_get, from a pool; drop frees all of it. */
void *mill_memory_take(struct mill_memory_pool *pool, size_t count, size_t size);
void mill_memory_drop(struct mill_memory_pool *pool);

#endif
