/* How HDF5 reaches the disk: a file driver much like its own "sec2", which in addition writes to a
 * draft that may change its descriptor at each publication, remembers the errno of a failure, and
 * can be switched to let a file be closed without writing. The file on the disk is an ordinary one,
 * for every reader. */
#include "store/h5_internal.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#if H5_VERSION_GE(1, 13, 0)
#include <H5FDdevelop.h>
#endif

struct driver {
    H5FD_t base;
    int own;          /* descriptor of a file that is only read; -1: the draft's */
    haddr_t eoa, eof; /* [byte] end of what HDF5 has allotted; of the file */
    struct mill_h5_disk *disk;
};

static herr_t fail(struct mill_h5_disk *disk, int number)
{
    if (!disk->number)
        disk->number = number;
    return -1;
}

static int descriptor(const struct driver *file)
{
    return file->own >= 0 ? file->own : mill_draft_descriptor(file->disk->draft);
}

static H5FD_t *driver_open(const char *name, unsigned flags, hid_t fapl, haddr_t maxaddr)
{
    struct mill_h5_disk *const *disk = H5Pget_driver_info(fapl);
    struct driver *file = calloc(1, sizeof *file);
    struct stat about;
    (void)maxaddr;
    (void)flags;
    if (!file || !disk) {
        free(file);
        return NULL;
    }
    file->disk = *disk;
    file->disk->number = 0;
    file->own = -1;
    if (!file->disk->draft && (file->own = open(name, O_RDONLY | O_CLOEXEC)) < 0) {
        fail(file->disk, errno);
        free(file);
        return NULL;
    }
    if (fstat(descriptor(file), &about) != 0) {
        fail(file->disk, errno);
        if (file->own >= 0)
            close(file->own);
        free(file);
        return NULL;
    }
    file->eof = (haddr_t)about.st_size;
    return (H5FD_t *)file;
}

static herr_t driver_close(H5FD_t *base)
{
    struct driver *file = (struct driver *)base;
    if (file->own >= 0)
        close(file->own);
    free(file);
    return 0;
}

/* Files are told apart by their drafts; the same one twice does not happen. */
static int driver_compare(const H5FD_t *a, const H5FD_t *b)
{
    const struct mill_h5_disk *one = ((const struct driver *)a)->disk,
                              *two = ((const struct driver *)b)->disk;
    return one == two ? 0 : (one < two ? -1 : 1);
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
    const int failed = mill_draft_read(descriptor(file), at, to, length);
    (void)type;
    (void)dxpl;
    return failed ? fail(file->disk, failed) : 0;
}

static herr_t driver_write(H5FD_t *base, H5FD_mem_t type, hid_t dxpl, haddr_t at, size_t length,
                           const void *from)
{
    struct driver *file = (struct driver *)base;
    (void)type;
    (void)dxpl;
    if (file->disk->mute)
        return 0;
    const int failed = mill_draft_write(descriptor(file), at, from, length);
    if (failed)
        return fail(file->disk, failed);
    if (at + length > file->eof)
        file->eof = at + length;
    return 0;
}

static herr_t driver_truncate(H5FD_t *base, hid_t dxpl, hbool_t closing)
{
    struct driver *file = (struct driver *)base;
    (void)dxpl;
    (void)closing;
    if (file->disk->mute || file->eoa == file->eof)
        return 0;
    if (ftruncate(descriptor(file), (off_t)file->eoa) != 0)
        return fail(file->disk, errno);
    file->eof = file->eoa;
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
