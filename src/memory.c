/* Aligned memory. Without large pages a mill of 10^5 balls and more spends a good part of its time
 * on looking up where pages lie: every event reaches into dozens of them. */
#define _DEFAULT_SOURCE /* madvise */
#include "memory.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define LINE 64
#define LARGE ((size_t)2 << 20) /* bytes of a large page on most machines */

void *mill_memory_get(size_t count, size_t size)
{
    void *memory = NULL;
    if (size > 0 && count > (SIZE_MAX - LARGE) / size)
        return NULL;
    const size_t bytes = count * size, align = bytes < LARGE ? LINE : LARGE;
    if (posix_memalign(&memory, align, bytes > 0 ? bytes : LINE) != 0)
        return NULL;
#ifdef MADV_HUGEPAGE
    if (align == LARGE)
        (void)madvise(memory, bytes, MADV_HUGEPAGE); /* a wish: without it all is as before */
#endif
    return memset(memory, 0, bytes);
}
