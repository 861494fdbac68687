/* How a file that is written for hours can be whole at every moment: write a copy, sync it, rename
 * it over the old one, sync the folder (the usual way of replacing a file; POSIX makes rename
 * atomic). The copy that comes next is free on file systems that share blocks, else it costs what
 * reading and writing the file costs. */
#define _XOPEN_SOURCE 700 /* realpath */
#include "store/draft.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#ifdef __linux__
#include <linux/fs.h>
#include <sys/ioctl.h>
#endif

struct mill_draft {
    char *path, *part, *lock;
    int fd;      /* of PATH.part; -1: none */
    int lock_fd; /* -1: not locked */
};

static char *join(const char *path, const char *end)
{
    const size_t size = strlen(path) + strlen(end) + 1;
    char *name = malloc(size);
    if (name)
        snprintf(name, size, "%s%s", path, end);
    return name;
}

/* A link stays a link: what it points to is replaced, or made. NULL: out of memory. */
static char *follow(const char *path)
{
    char *target = realpath(path, NULL);
    if (target)
        return target;
    /* nothing there yet, or a link to nothing: one step, the rest is for open to refuse */
    char link[4096];
    const ssize_t length = readlink(path, link, sizeof link - 1);
    if (length <= 0)
        return join(path, "");
    link[length] = '\0';
    const char *slash = strrchr(path, '/');
    if (link[0] == '/' || !slash)
        return join(link, "");
    const size_t folder = (size_t)(slash - path) + 1;
    target = malloc(folder + (size_t)length + 1);
    if (target) {
        memcpy(target, path, folder);
        strcpy(target + folder, link);
    }
    return target;
}

struct mill_draft *mill_draft_create(const char *path)
{
    struct mill_draft *draft = calloc(1, sizeof *draft);
    if (!draft)
        return NULL;
    draft->fd = draft->lock_fd = -1;
    draft->path = follow(path);
    if (draft->path) {
        draft->part = join(draft->path, ".part");
        draft->lock = join(draft->path, ".lock");
    }
    if (!draft->part || !draft->lock) {
        mill_draft_free(draft);
        return NULL;
    }
    return draft;
}

bool mill_draft_replaces(const struct mill_draft *draft, const char *path)
{
    const char *const own[] = {draft->part, draft->lock};
    struct stat file, here;
    for (int i = 0; i < 2; i++)
        if (stat(own[i], &here) == 0 && stat(path, &file) == 0 && file.st_dev == here.st_dev &&
            file.st_ino == here.st_ino)
            return true;
    return false;
}

int mill_draft_read(int fd, uint64_t offset, void *to, size_t length)
{
    unsigned char *at = to;
    while (length > 0) {
        const ssize_t got = pread(fd, at, length, (off_t)offset);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return errno;
        if (got == 0) {
            memset(at, 0, length);
            return 0;
        }
        at += got;
        offset += (uint64_t)got;
        length -= (size_t)got;
    }
    return 0;
}

int mill_draft_write(int fd, uint64_t offset, const void *from, size_t length)
{
    const unsigned char *at = from;
    while (length > 0) {
        const ssize_t put = pwrite(fd, at, length, (off_t)offset);
        if (put < 0 && errno == EINTR)
            continue;
        if (put <= 0)
            return put < 0 ? errno : ENOSPC;
        at += put;
        offset += (uint64_t)put;
        length -= (size_t)put;
    }
    return 0;
}

static bool names(const char *path, int fd)
{
    struct stat there, here;
    return stat(path, &there) == 0 && fstat(fd, &here) == 0 && there.st_dev == here.st_dev &&
           there.st_ino == here.st_ino;
}

/* Disks that know no locks are no reason to fail. */
static int take_lock(struct mill_draft *draft)
{
    for (;;) {
        draft->lock_fd = open(draft->lock, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
        if (draft->lock_fd < 0)
            return errno;
        if (flock(draft->lock_fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            close(draft->lock_fd);
            draft->lock_fd = -1;
            return EWOULDBLOCK;
        }
        /* the writer before may have removed the name between our opening and locking it */
        if (names(draft->lock, draft->lock_fd))
            return 0;
        close(draft->lock_fd);
    }
}

static int copy(int from, int to)
{
    enum { PIECE = 1 << 20 };
    struct stat about;
#ifdef FICLONE
    if (ioctl(to, FICLONE, from) == 0)
        return 0;
#endif
    if (fstat(from, &about) != 0)
        return errno;
    unsigned char *piece = malloc(PIECE);
    int failed = piece ? 0 : ENOMEM;
    for (off_t at = 0; !failed && at < about.st_size; at += PIECE) {
        const size_t left = (size_t)(about.st_size - at), n = left < PIECE ? left : PIECE;
        failed = mill_draft_read(from, (uint64_t)at, piece, n);
        if (!failed)
            failed = mill_draft_write(to, (uint64_t)at, piece, n);
    }
    free(piece);
    return failed;
}

/* A new PATH.part with the bytes and the mode of `from`, or an empty one where from < 0. */
static int begin(struct mill_draft *draft, int from)
{
    struct stat about;
    unlink(draft->part); /* one that a killed run has left, or a link laid in our way */
    draft->fd = open(draft->part, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (draft->fd < 0)
        return errno;
    if (from < 0)
        return 0;
    if (fstat(from, &about) == 0)
        fchmod(draft->fd, about.st_mode & 0777);
    return copy(from, draft->fd);
}

static void drop(struct mill_draft *draft)
{
    if (draft->fd < 0)
        return;
    if (names(draft->part, draft->fd))
        unlink(draft->part);
    close(draft->fd);
    draft->fd = -1;
}

int mill_draft_open(struct mill_draft *draft, bool again)
{
    const int published = again ? open(draft->path, O_RDONLY | O_CLOEXEC) : -1;
    if (again && published < 0)
        return errno;
    int failed = take_lock(draft);
    if (!failed)
        failed = begin(draft, published);
    if (failed)
        drop(draft);
    if (published >= 0)
        close(published);
    return failed;
}

int mill_draft_descriptor(const struct mill_draft *draft)
{
    return draft->fd;
}

/* So that the new name outlives a loss of power; a folder that cannot be synced is none of ours. */
static void sync_folder(const char *path)
{
    char *folder = join(path, "");
    if (!folder)
        return;
    char *slash = strrchr(folder, '/');
    if (slash)
        slash[slash == folder] = '\0';
    const int fd = open(slash ? folder : ".", O_RDONLY | O_CLOEXEC);
    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
    free(folder);
}

/* Somebody removed PATH.part, or put another file there: the draft is written out once more. */
static int name_again(struct mill_draft *draft)
{
    const int old = draft->fd;
    const int failed = begin(draft, old);
    if (failed)
        drop(draft);
    close(old);
    return failed;
}

int mill_draft_publish(struct mill_draft *draft, bool go_on)
{
    if (draft->fd < 0)
        return EBADF;
    int failed = names(draft->part, draft->fd) ? 0 : name_again(draft);
    if (failed)
        return failed;
    if (fsync(draft->fd) != 0 && errno != EINVAL && errno != ENOTSUP)
        return errno;
    if (rename(draft->part, draft->path) != 0)
        return errno;
    sync_folder(draft->path);
    const int published = draft->fd;
    draft->fd = -1;
    if (go_on) {
        failed = begin(draft, published);
        if (failed)
            drop(draft);
    }
    /* an error that closing tells comes too late: the bytes have been synced */
    close(published);
    return failed;
}

void mill_draft_free(struct mill_draft *draft)
{
    if (!draft)
        return;
    drop(draft);
    if (draft->lock_fd >= 0) {
        if (names(draft->lock, draft->lock_fd)) /* and not another writer's by now */
            unlink(draft->lock);
        close(draft->lock_fd);
    }
    free(draft->path);
    free(draft->part);
    free(draft->lock);
    free(draft);
}
