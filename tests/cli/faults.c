/* Makes one call of a program fail, or kills the program at it: LD_PRELOAD this, and say
 * FAULT_CALL=write|sync|rename|open|truncate|memory, FAULT_AT=N (the Nth such call),
 * FAULT_ERROR=errno (0: the program is killed), FAULT_MARK=a file that is made then. Calls on the
 * terminal's streams are not counted. Of requests for memory, those count that are made in the code
 * from FAULT_FROM to FAULT_TO (addresses in the program's file). */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

static int strikes(const char *call)
{
    static int seen;
    const char *which = getenv("FAULT_CALL");
    if (!which || strcmp(which, call) != 0 || ++seen != atoi(getenv("FAULT_AT")))
        return 0;
    close(creat(getenv("FAULT_MARK"), 0600));
    errno = atoi(getenv("FAULT_ERROR"));
    if (errno == 0)
        kill(getpid(), SIGKILL);
    return 1;
}

#define REAL(type, name, ...)                                                                      \
    static type (*real)(__VA_ARGS__);                                                              \
    if (!real)                                                                                     \
    *(void **)&real = dlsym(RTLD_NEXT, name)

#define WRITE(name, at)                                                                            \
    ssize_t name(int fd, const void *from, size_t size, at offset)                                 \
    {                                                                                              \
        REAL(ssize_t, #name, int, const void *, size_t, at);                                       \
        return strikes("write") ? -1 : real(fd, from, size, offset);                               \
    }
WRITE(pwrite, off_t)
WRITE(pwrite64, off64_t)

ssize_t write(int fd, const void *from, size_t size)
{
    REAL(ssize_t, "write", int, const void *, size_t);
    return fd > 2 && strikes("write") ? -1 : real(fd, from, size);
}

int fsync(int fd)
{
    REAL(int, "fsync", int);
    return strikes("sync") ? -1 : real(fd);
}

int rename(const char *from, const char *to)
{
    REAL(int, "rename", const char *, const char *);
    return strikes("rename") ? -1 : real(from, to);
}

#define TRUNCATE(name, at)                                                                         \
    int name(int fd, at size)                                                                      \
    {                                                                                              \
        REAL(int, #name, int, at);                                                                 \
        return strikes("truncate") ? -1 : real(fd, size);                                          \
    }
TRUNCATE(ftruncate, off_t)
TRUNCATE(ftruncate64, off64_t)

/* of files in the current folder alone: libraries and unit databases are somewhere else */
#define OPEN(name)                                                                                 \
    int name(const char *path, int flags, ...)                                                     \
    {                                                                                              \
        REAL(int, #name, const char *, int, ...);                                                  \
        va_list list;                                                                              \
        va_start(list, flags);                                                                     \
        const mode_t mode = flags & O_CREAT ? va_arg(list, mode_t) : 0;                            \
        va_end(list);                                                                              \
        return !strchr(path, '/') && strikes("open") ? -1 : real(path, flags, mode);               \
    }
OPEN(open)
OPEN(open64)

/* ---- memory: glibc's own functions, because dlsym needs memory itself ---- */

extern void *__libc_malloc(size_t size), *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *old, size_t size), *__libc_memalign(size_t align, size_t size);

/* Finds where the first object, the program itself, is loaded. */
static int find_base(struct dl_phdr_info *info, size_t size, void *base)
{
    (void)size;
    *(uintptr_t *)base = info->dlpi_addr;
    return 1;
}

static int lacks(const void *caller)
{
    static uintptr_t from, to;
    const char *which = getenv("FAULT_CALL");
    if (!which || strcmp(which, "memory") != 0)
        return 0;
    if (!to) {
        uintptr_t base;
        dl_iterate_phdr(find_base, &base);
        from = base + strtoul(getenv("FAULT_FROM"), NULL, 16);
        to = base + strtoul(getenv("FAULT_TO"), NULL, 16);
    }
    return (uintptr_t)caller >= from && (uintptr_t)caller < to && strikes("memory");
}

#define CALLER __builtin_return_address(0)

void *malloc(size_t size)
{
    return lacks(CALLER) ? NULL : __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
    return lacks(CALLER) ? NULL : __libc_calloc(count, size);
}

void *realloc(void *old, size_t size)
{
    return lacks(CALLER) ? NULL : __libc_realloc(old, size);
}

int posix_memalign(void **to, size_t align, size_t size)
{
    if (lacks(CALLER))
        return ENOMEM;
    *to = __libc_memalign(align, size);
    return *to ? 0 : ENOMEM;
}
