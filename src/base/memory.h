/* Memory for arrays that the event loop reads in random order, and for lists that grow. */
#ifndef MILLSIM_MEMORY_H
#define MILLSIM_MEMORY_H

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

#endif
