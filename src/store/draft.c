/* How a file that is written for hours can be whole at every moment: write a copy, sync it, rename
 * it over the old one, sync the folder (the usual way of replacing a file; POSIX makes rename
 * atomic). The copy is free on file systems that share blocks, else it costs what reading and
 * writing the file costs, and for a moment the room of a third file beside PATH and PATH.part. */
#define _XOPEN_SOURCE 700 /* realpath */
#include "store/draft.h"

#include <assert.h>
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
    char *path, *part, *new, *lock;
    const char *begins;
    const char *obstacle; /* one of these names; NULL: none */
    int fd;               /* of PATH.part; -1: none */
    int lock_fd;          /* -1: not locked */
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
        return strdup(path);
    link[length] = '\0';
    const char *slash = strrchr(path, '/');
    if (link[0] == '/' || !slash)
        return strdup(link);
    const size_t folder = (size_t)(slash - path) + 1;
    target = malloc(folder + (size_t)length + 1);
    if (target) {
        memcpy(target, path, folder);
        strcpy(target + folder, link);
    }
    return target;
}

struct mill_draft *mill_draft_create(const char *path, const char *begins)
{
    struct mill_draft *draft = calloc(1, sizeof *draft);
    if (!draft)
        return NULL;
    draft->begins = begins;
    draft->fd = draft->lock_fd = -1;
    draft->path = follow(path);
    if (draft->path) {
        draft->part = join(draft->path, ".part");
        draft->new = join(draft->path, ".new");
        draft->lock = join(draft->path, ".lock");
    }
    if (draft->part && draft->new && draft->lock)
        return draft;
    mill_draft_free(draft);
    return NULL;
}

bool mill_draft_replaces(const struct mill_draft *draft, const char *path)
{
    const char *const own[] = {draft->part, draft->new, draft->lock};
    struct stat file, here;
    for (int i = 0; i < 3; i++)
        if (stat(own[i], &here) == 0 && stat(path, &file) == 0 && file.st_dev == here.st_dev &&
            file.st_ino == here.st_ino)
            return true;
    return false;
}

/* ---- calls that a signal may interrupt ---- */

static int open_file(const char *name, int flags)
{
    int fd;
    do
        fd = open(name, flags | O_CLOEXEC, 0666);
    while (fd < 0 && errno == EINTR);
    return fd;
}

static int sync_file(int fd)
{
    while (fsync(fd) != 0)
        if (errno != EINTR)
            return errno == EINVAL || errno == ENOTSUP ? 0 : errno; /* no disk behind it */
    return 0;
}

static int rename_file(const char *from, const char *to)
{
    while (rename(from, to) != 0)
        if (errno != EINTR)
            return errno;
    return 0;
}

/* Disks that know no locks are no reason to fail. */
static bool locked_by_another(int fd)
{
    while (flock(fd, LOCK_EX | LOCK_NB) != 0)
        if (errno != EINTR)
            return errno == EWOULDBLOCK;
    return false;
}

static int write_all(int fd, const unsigned char *from, size_t length)
{
    while (length > 0) {
        const ssize_t put = write(fd, from, length);
        if (put < 0 && errno == EINTR)
            continue;
        if (put <= 0)
            return put < 0 ? errno : ENOSPC;
        from += put;
        length -= (size_t)put;
    }
    return 0;
}

static int copy(int from, int to)
{
    enum { PIECE = 1 << 20 };
#ifdef FICLONE
    if (ioctl(to, FICLONE, from) == 0)
        return 0;
#endif
    unsigned char *piece = malloc(PIECE);
    int failed = piece ? 0 : ENOMEM;
    for (off_t at = 0; !failed;) {
        const ssize_t got = pread(from, piece, PIECE, at);
        if (got == 0)
            break;
        if (got > 0)
            failed = write_all(to, piece, (size_t)got);
        else if (errno != EINTR)
            failed = errno;
        at += got > 0 ? got : 0;
    }
    free(piece);
    return failed;
}

/* ---- files beside PATH ---- */

static bool names(const char *path, int fd)
{
    struct stat there, here;
    return lstat(path, &there) == 0 && fstat(fd, &here) == 0 && there.st_dev == here.st_dev &&
           there.st_ino == here.st_ino;
}

static bool is_empty_file(int fd)
{
    struct stat about;
    return fstat(fd, &about) == 0 && S_ISREG(about.st_mode) && about.st_size == 0;
}

/* Has a draft left this file? Not where it is a link, or none. */
static bool left_by_draft(const struct mill_draft *draft, const char *name)
{
    char bytes[32];
    const size_t length = draft->begins ? strlen(draft->begins) : 0;
    assert(length <= sizeof bytes);
    const int fd = open_file(name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK);
    if (fd < 0)
        return false;
    const bool begun = length > 0 && pread(fd, bytes, length, 0) == (ssize_t)length &&
                       memcmp(bytes, draft->begins, length) == 0;
    const bool left = begun || is_empty_file(fd);
    close(fd);
    return left;
}

/* A file in the way of one of ours: EEXIST, unless it may go. A link goes itself, never what it
 * leads to. */
static int clear_way(struct mill_draft *draft, const char *name, bool may_go)
{
    struct stat about;
    if (lstat(name, &about) != 0)
        return 0;
    if (may_go)
        return unlink(name) == 0 ? 0 : errno;
    draft->obstacle = name;
    return EEXIST;
}

static int take_lock(struct mill_draft *draft, bool force)
{
    for (;;) {
        int failed = 0;
        const int fd = open_file(draft->lock, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK);
        if (fd < 0 && errno != ELOOP && errno != ENXIO) /* a link, a socket */
            return errno;
        if (fd < 0 || !is_empty_file(fd))
            failed = clear_way(draft, draft->lock, force);
        else if (locked_by_another(fd))
            failed = EWOULDBLOCK;
        /* the writer before may have removed the name between our opening and locking it */
        else if (names(draft->lock, fd))
            draft->lock_fd = fd;
        if (draft->lock_fd >= 0)
            return 0;
        if (fd >= 0)
            close(fd);
        if (failed)
            return failed;
    }
}

/* A new file with the bytes and the mode of `from`, or an empty one where from < 0. */
static int make(const char *name, int from, int *made)
{
    struct stat about;
    const int fd = open_file(name, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW);
    if (fd < 0)
        return errno;
    *made = fd;
    if (from < 0)
        return 0;
    if (fstat(from, &about) == 0)
        fchmod(fd, about.st_mode & 0777);
    return copy(from, fd);
}

/* Closes the file and takes its name away, unless another file has that by now. */
static void drop(const char *name, int *fd)
{
    if (*fd < 0)
        return;
    if (names(name, *fd))
        unlink(name);
    close(*fd);
    *fd = -1;
}

int mill_draft_open(struct mill_draft *draft, enum mill_draft_way way)
{
    const bool force = way == MILL_DRAFT_FORCE;
    const int published = way == MILL_DRAFT_COPY ? open_file(draft->path, O_RDONLY) : -1;
    if (way == MILL_DRAFT_COPY && published < 0)
        return errno;
    int failed = take_lock(draft, force);
    if (!failed)
        failed = clear_way(draft, draft->part, force || left_by_draft(draft, draft->part));
    if (!failed)
        failed = clear_way(draft, draft->new, force || left_by_draft(draft, draft->new));
    if (!failed)
        failed = make(draft->part, published, &draft->fd);
    if (failed)
        drop(draft->part, &draft->fd);
    if (published >= 0)
        close(published);
    return failed;
}

enum mill_status mill_draft_tell(const struct mill_draft *draft, const char *path, const char *verb,
                                 int failed, struct mill_error *error)
{
    if (draft->obstacle)
        return mill_error_set(error, MILL_BAD_DECK,
                              "%s: exists and is not an unfinished file of millsim; move it away, "
                              "or use --force",
                              draft->obstacle);
    return mill_error_set(error, MILL_FAILED, "%s: cannot %s: %s", path, verb,
                          failed == EWOULDBLOCK ? "another run is writing it" : strerror(failed));
}

const char *mill_draft_part(const struct mill_draft *draft)
{
    return draft->part;
}

int mill_draft_descriptor(const struct mill_draft *draft)
{
    return draft->fd;
}

/* So that the new name outlives a loss of power; a folder that cannot be synced is none of ours. */
static void sync_folder(const char *path)
{
    char *folder = strdup(path);
    if (!folder)
        return;
    char *slash = strrchr(folder, '/');
    if (slash)
        slash[slash == folder] = '\0';
    const int fd = open_file(slash ? folder : ".", O_RDONLY);
    if (fd >= 0) {
        sync_file(fd);
        close(fd);
    }
    free(folder);
}

static int publish_copy(struct mill_draft *draft)
{
    int fd = -1, failed = make(draft->new, draft->fd, &fd);
    if (!failed)
        failed = sync_file(fd);
    if (!failed)
        failed = rename_file(draft->new, draft->path);
    drop(draft->new, &fd); /* the name is gone where that went well */
    return failed;
}

int mill_draft_publish(struct mill_draft *draft, bool last)
{
    if (draft->fd < 0)
        return EBADF;
    int failed;
    if (last && names(draft->part, draft->fd)) {
        failed = sync_file(draft->fd);
        if (!failed)
            failed = rename_file(draft->part, draft->path);
    } else { /* also where somebody removed PATH.part, or put another file there */
        failed = publish_copy(draft);
    }
    if (failed)
        return failed;
    sync_folder(draft->path);
    if (last)
        drop(draft->part, &draft->fd);
    return 0;
}

void mill_draft_free(struct mill_draft *draft)
{
    if (!draft)
        return;
    drop(draft->part, &draft->fd);
    drop(draft->lock, &draft->lock_fd);
    free(draft->path);
    free(draft->part);
    free(draft->new);
    free(draft->lock);
    free(draft);
}

void mill_draft_clear(const char *path)
{
    struct mill_draft *draft = mill_draft_create(path, NULL);
    if (draft && access(draft->lock, F_OK) == 0)
        take_lock(draft, false);
    mill_draft_free(draft);
}
