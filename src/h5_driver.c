/* How HDF5 reaches the disk: a file driver much like its own "sec2", which in addition saves to the
 * undo journal what it is about to overwrite, remembers the errno of a failure, and can be switched
 * to let a file be closed without writing. The file on the disk is an ordinary one, for every
 * reader. */
#include "h5_internal.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#if H5_VERSION_GE(1, 13, 0)
#include <H5FDdevelop.h>
#endif

struct driver {
    H5FD_t base;
    int fd;
    haddr_t eoa, eof; /* [byte] end of what HDF5 has allotted; of the file */
    dev_t device;
    ino_t inode;
    struct mill_h5_disk *disk;
};

static herr_t fail(struct mill_h5_disk *disk, int number)
{
    if (!disk->number)
        disk->number = number;
    return -1;
}

/* What opening means beyond open(2): the lock, the old state back, and a journal from here on. */
static int prepare(const struct driver *file, unsigned flags, uint64_t *size)
{
    struct mill_journal *journal = file->disk->journal;
    struct stat about;
    bool found;
    int failed = 0;
    /* disks that know no locks are no reason to fail */
    if (flock(file->fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        return EWOULDBLOCK;
    if (flags & (H5F_ACC_TRUNC | H5F_ACC_EXCL)) {
        failed = mill_journal_commit(journal, 0);
        if (!failed && ftruncate(file->fd, 0) != 0)
            failed = errno;
    } else if (file->disk->recover) {
        failed = mill_journal_roll_back(journal, file->fd, &found);
    }
    if (!failed && fstat(file->fd, &about) != 0)
        failed = errno;
    if (failed)
        return failed;
    *size = file->disk->size = (uint64_t)about.st_size;
    return file->disk->recover ? mill_journal_commit(journal, *size) : 0;
}

static H5FD_t *driver_open(const char *name, unsigned flags, hid_t fapl, haddr_t maxaddr)
{
    struct mill_h5_disk *const *disk = H5Pget_driver_info(fapl);
    struct driver *file = calloc(1, sizeof *file);
    int mode = flags & H5F_ACC_RDWR ? O_RDWR : O_RDONLY, failed;
    uint64_t size = 0;
    struct stat about;
    (void)maxaddr;
    if (!file || !disk) {
        free(file);
        return NULL;
    }
    file->disk = *disk;
    file->disk->number = 0;
    if (flags & H5F_ACC_CREAT)
        mode |= O_CREAT;
    if (flags & H5F_ACC_EXCL)
        mode |= O_EXCL;
    file->fd = open(name, mode | O_CLOEXEC, 0666);
    failed = file->fd < 0 || fstat(file->fd, &about) != 0 ? errno : prepare(file, flags, &size);
    if (failed) {
        if (file->fd >= 0)
            close(file->fd);
        fail(file->disk, failed);
        free(file);
        return NULL;
    }
    file->eof = size;
    file->device = about.st_dev;
    file->inode = about.st_ino;
    return (H5FD_t *)file;
}

static herr_t driver_close(H5FD_t *base)
{
    struct driver *file = (struct driver *)base;
    const int failed = close(file->fd) != 0 ? errno : 0;
    struct mill_h5_disk *disk = file->disk;
    free(file);
    return failed ? fail(disk, failed) : 0;
}

static int driver_compare(const H5FD_t *a, const H5FD_t *b)
{
    const struct driver *one = (const struct driver *)a, *two = (const struct driver *)b;
    if (one->device != two->device)
        return one->device < two->device ? -1 : 1;
    return one->inode == two->inode ? 0 : (one->inode < two->inode ? -1 : 1);
}

static herr_t driver_query(const H5FD_t *base, unsigned long *flags)
{
    (void)base;
    *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
             H5FD_FEAT_AGGREGATE_SMALLDATA;
#ifdef H5FD_FEAT_DEFAULT_VFD_COMPATIBLE
    *flags |= H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
#endif
    return 0;
}

static haddr_t driver_get_eoa(const H5FD_t *base, H5FD_mem_t type)
{
    (void)type;
    return ((const struct driver *)base)->eoa;
}

static herr_t driver_set_eoa(H5FD_t *base, H5FD_mem_t type, haddr_t eoa)
{
    (void)type;
    ((struct driver *)base)->eoa = eoa;
    return 0;
}

static haddr_t driver_get_eof(const H5FD_t *base, H5FD_mem_t type)
{
    (void)type;
    return ((const struct driver *)base)->eof;
}

static herr_t driver_read(H5FD_t *base, H5FD_mem_t type, hid_t dxpl, haddr_t at, size_t length,
                          void *to)
{
    struct driver *file = (struct driver *)base;
    const int failed = mill_journal_read(file->fd, at, to, length);
    (void)type;
    (void)dxpl;
    return failed ? fail(file->disk, failed) : 0;
}

static herr_t driver_write(H5FD_t *base, H5FD_mem_t type, hid_t dxpl, haddr_t at, size_t length,
                           const void *from)
{
    struct driver *file = (struct driver *)base;
    int failed;
    (void)type;
    (void)dxpl;
    if (file->disk->mute)
        return 0;
    failed = mill_journal_preserve(file->disk->journal, file->fd, at, length);
    if (!failed)
        failed = mill_journal_write(file->fd, at, from, length);
    if (failed)
        return fail(file->disk, failed);
    if (at + length > file->eof)
        file->disk->size = file->eof = at + length;
    return 0;
}

static herr_t driver_truncate(H5FD_t *base, hid_t dxpl, hbool_t closing)
{
    struct driver *file = (struct driver *)base;
    int failed = 0;
    (void)dxpl;
    (void)closing;
    if (file->disk->mute || file->eoa == file->eof)
        return 0;
    if (file->eoa < file->eof)
        failed =
            mill_journal_preserve(file->disk->journal, file->fd, file->eoa, file->eof - file->eoa);
    if (!failed && ftruncate(file->fd, (off_t)file->eoa) != 0)
        failed = errno;
    if (failed)
        return fail(file->disk, failed);
    file->disk->size = file->eof = file->eoa;
    return 0;
}

static const H5FD_class_t driver = {
#if H5_VERSION_GE(1, 13, 0)
    .version = H5FD_CLASS_VERSION,
    .value = (H5FD_class_value_t)510, /* 256 to 511: free for unregistered drivers */
#endif
    .name = "millsim",
    .maxaddr = INT64_MAX,
    .fc_degree = H5F_CLOSE_WEAK,
    .fapl_size = sizeof(struct mill_h5_disk *),
    .open = driver_open,
    .close = driver_close,
    .cmp = driver_compare,
    .query = driver_query,
    .get_eoa = driver_get_eoa,
    .set_eoa = driver_set_eoa,
    .get_eof = driver_get_eof,
    .read = driver_read,
    .write = driver_write,
    .truncate = driver_truncate,
    .fl_map = H5FD_FLMAP_DICHOTOMY,
};

bool mill_h5_use_disk(hid_t access_list, struct mill_h5_disk *disk)
{
    const hid_t id = H5FDregister(&driver);
    /* never unregistered: H5FD_close drops the file's own reference and then still calls through
     * the class, which the last reference would have freed */
    return id >= 0 && H5Pset_driver(access_list, id, &disk) >= 0;
}

int mill_h5_restore(const char *path, const struct mill_h5_disk *disk)
{
    const int fd = open(path, O_RDWR | O_CLOEXEC);
    bool found;
    int failed;
    if (fd < 0)
        return errno;
    failed = mill_journal_roll_back(disk->journal, fd, &found);
    if (close(fd) != 0 && !failed)
        failed = errno;
    return failed;
}
