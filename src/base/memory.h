/* Memory for arrays that the event loop reaches into at random. */
#ifndef MILLSIM_MEMORY_H
#define MILLSIM_MEMORY_H

#include <stddef.h>

/* count * size zero bytes that begin on a cache line. NULL when out of memory. To be freed by
 * free().
 */
void *mill_memory_get(size_t count, size_t size);

#endif
