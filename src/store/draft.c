/* A file that is written for hours must be complete at every moment. So publishing writes a copy,
 * syncs it, renames it over the old file and syncs the folder (POSIX makes rename atomic). On file
 * systems that share blocks the copy costs nothing. Elsewhere the file is read and written once,
 * and for a moment there are three of its size: PATH, PATH.part and the copy. */
#define _XOPEN_SOURCE 700 /* realpath */
#include "store/draft.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
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

void mill_draft_init(struct mill_draft *draft, const char *path, const char *begins)
{
    /* A symbolic link stays a link: the file that it points to is replaced, or made. If that does
     * not exist yet, only one link is followed; open refuses everything else. */
    char link[sizeof draft->path] = "", *whole = realpath(path, NULL);
    const bool leads = !whole && readlink(path, link, sizeof link - 1) > 0;
    const char *slash = leads && link[0] != '/' ? strrchr(path, '/') : NULL;
    const char *end = leads ? link : path;
    const int length = snprintf(draft->path, sizeof draft->path, "%.*s%s",
                                slash ? (int)(slash - path) + 1 : 0, path, whole ? whole : end);
    (void)length; /* a path that is cut is still too long, and is refused */
    free(whole);
    snprintf(draft->part, sizeof draft->part, "%s.part", draft->path);
    snprintf(draft->new, sizeof draft->new, "%s.new", draft->path);
    snprintf(draft->lock, sizeof draft->lock, "%s.lock", draft->path);
    draft->begins = begins;
    draft->obstacle = NULL;
    draft->fd = draft->lock_fd = -1;
}

const char *mill_draft_meets(const struct mill_draft *draft, const char *path)
{
    const char *const own[] = {draft->path, draft->part, draft->new, draft->lock};
    struct stat file, here;
    for (int k = 0; k < 4; k++)
        if (stat(own[k], &here) == 0 && stat(path, &file) == 0 && file.st_dev == here.st_dev &&
            file.st_ino == here.st_ino)
            return own[k];
    return NULL;
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
            /* this kind of file cannot be synced */
            return errno == EINVAL || errno == ENOTSUP ? 0 : errno;
    return 0;
}

static int rename_file(const char *from, const char *to)
{
    while (rename(from, to) != 0)
        if (errno != EINTR)
            return errno;
    return 0;
}

/* Is the file locked by another process? File systems without locks are accepted. */
static bool locked_by_another(int fd)
{
    while (flock(fd, LOCK_EX | LOCK_NB) != 0)
        if (errno != EINTR)
            return errno == EWOULDBLOCK;
    return false;
}

static int copy(int from, int to)
{
    unsigned char piece[1 << 16];
#ifdef FICLONE
    if (ioctl(to, FICLONE, from) == 0)
        return 0;
#endif
    for (off_t at = 0;;) {
        const ssize_t got = pread(from, piece, sizeof piece, at);
        if (got == 0)
            return 0;
        const ssize_t put = got > 0 ? write(to, piece, (size_t)got) : -1;
        if (put == 0 || (put < 0 && errno != EINTR))
            return put == 0 ? ENOSPC : errno;
        if (put > 0)
            at += put;
    }
}

/* ---- files next to PATH ---- */

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

/* Is this file from a draft? No if it is a link or does not exist. */
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

/* Removes a file that is in the way (of a link: the link) if it may go, else EEXIST. */
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
    for (int failed = 0;;) {
        const int fd = open_file(draft->lock, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK);
        if (fd < 0 && errno != ELOOP && errno != ENXIO) /* a link, a socket */
            return errno;
        if (fd < 0 || !is_empty_file(fd))
            failed = clear_way(draft, draft->lock, force);
        else if (locked_by_another(fd))
            failed = EWOULDBLOCK;
        /* between our open and our lock, an earlier writer may have removed the name */
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

/* Makes a new file with the bytes and the mode of `from`; an empty one if from < 0. */
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

/* Closes the file and removes its name, unless the name belongs to another file now. */
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
    const bool force = way == MILL_DRAFT_FORCE, again = way == MILL_DRAFT_COPY;
    const int published = again ? open_file(draft->path, O_RDONLY) : -1;
    int failed = again && published < 0 ? errno : take_lock(draft, force);
    if (!failed)
        failed = clear_way(draft, draft->part, force || left_by_draft(draft, draft->part));
    if (!failed)
        failed = clear_way(draft, draft->new, force || left_by_draft(draft, draft->new));
    if (!failed)
        failed = make(draft->part, published, &draft->fd);
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

int mill_draft_publish(struct mill_draft *draft, bool last)
{
    char name[sizeof draft->path];
    if (draft->fd < 0)
        return EBADF;
    /* a copy is needed also if someone removed or replaced PATH.part */
    const bool itself = last && names(draft->part, draft->fd);
    int fd = -1, failed = itself ? 0 : make(draft->new, draft->fd, &fd);
    if (!failed)
        failed = sync_file(itself ? draft->fd : fd);
    if (!failed)
        failed = rename_file(itself ? draft->part : draft->new, draft->path);
    drop(draft->new, &fd); /* after a successful rename the name no longer exists */
    if (failed)
        return failed;
    /* the new name must survive a loss of power; a folder that cannot be synced is no failure */
    const int folder = open_file(dirname(strcpy(name, draft->path)), O_RDONLY);
    if (folder >= 0) {
        sync_file(folder);
        close(folder);
    }
    if (last)
        drop(draft->part, &draft->fd);
    return 0;
}

void mill_draft_end(struct mill_draft *draft)
{
    drop(draft->part, &draft->fd);
    drop(draft->lock, &draft->lock_fd);
}

void mill_draft_clear(const char *path)
{
    struct mill_draft draft;
    mill_draft_init(&draft, path, NULL);
    if (access(draft.lock, F_OK) == 0)
        take_lock(&draft, false);
    mill_draft_end(&draft);
}
