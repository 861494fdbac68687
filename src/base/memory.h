/* Memory for arrays that the event loop reaches into at random. */
#ifndef MILLSIM_MEMORY_H
#define MILLSIM_MEMORY_H

#include <stddef.h>

/* count * size zero bytes that begin on a cache line; free() frees them. NULL: out of memory. */
void *mill_memory_get(size_t count, size_t size);

#endif
