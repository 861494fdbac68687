/* Memory for arrays that the event loop reads in random order. */
#ifndef MILLSIM_MEMORY_H
#define MILLSIM_MEMORY_H

#include <stddef.h>

/* count * size zero bytes, aligned to a cache line; free() frees them. NULL: out of memory. */
void *mill_memory_get(size_t count, size_t size);

#endif
