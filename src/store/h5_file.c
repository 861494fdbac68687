/* Opening, publishing and closing HDF5 files. */
#include "store/h5_internal.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
    METADATA = 262144, /* [byte] of the file's structure that HDF5 keeps in memory */
    CONVERTED = 4096   /* [byte] at a time, of texts: HDF5's own 1 MiB is zeroed for each of them */
};

static const char hdf5_begins[] = "\211HDF\r\n\032\n";

static void fail_draft(struct mill_h5 *file, const char *verb, int failed)
{
    file->spent = mill_draft_tell(file->draft, file->path, verb, failed, &file->cause);
    mill_h5_detach(file);
}

static bool keep_little(hid_t list)
{
    H5AC_cache_config_t cache = {.version = H5AC__CURR_CACHE_CONFIG_VERSION};
    if (H5Pget_mdc_config(list, &cache) < 0)
        return false;
    cache.set_initial_size = true;
    cache.initial_size = cache.min_size = METADATA / 4;
    cache.max_size = METADATA;
    return H5Pset_mdc_config(list, &cache) >= 0;
}

/* Files that HDF5 1.10 and later read, in the compact format of 1.8; closing takes all that is
 * still open along. PATH.lock keeps writers apart, and disks that know no locks are fine. */
static hid_t access_list(void)
{
    const hid_t list = H5Pcreate(H5P_FILE_ACCESS);
#if H5_VERSION_GE(1, 10, 2)
    H5Pset_libver_bounds(list, H5F_LIBVER_V18, H5F_LIBVER_V110);
#else
    H5Pset_libver_bounds(list, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
#endif
#if H5_VERSION_GE(1, 12, 1) || (H5_VERS_MINOR == 10 && H5_VERS_RELEASE >= 7)
    H5Pset_file_locking(list, false, true);
#endif
    if (H5Pset_fclose_degree(list, H5F_CLOSE_STRONG) >= 0 && keep_little(list))
        return list;
    mill_h5_release(list);
    return -1;
}

/* Through the draft, which is open, or for reading only. A new file is flushed at once, so that
 * what a killed run leaves begins as HDF5 files do. */
static void open_file(struct mill_h5 *file, enum mill_h5_open how, const char *verb)
{
    const hid_t list = access_list(), create = mill_h5_timeless(H5P_FILE_CREATE);
    if (how == MILL_H5_READ)
        file->id = H5Fopen(file->path, H5F_ACC_RDONLY, list);
    else if (how == MILL_H5_UPDATE)
        file->id = H5Fopen(mill_draft_part(file->draft), H5F_ACC_RDWR, list);
    else
        file->id = H5Fcreate(mill_draft_part(file->draft), H5F_ACC_TRUNC, create, list);
    mill_h5_release(create);
    mill_h5_release(list);
    if (file->id < 0 && (how == MILL_H5_READ || how == MILL_H5_UPDATE))
        mill_h5_suppose("it is no HDF5 file, or damaged or cut off");
    /* what is empty then is not what HDF5 has opened: somebody put another file in its place */
    if (file->id < 0 ||
        (file->draft && (H5Fflush(file->id, H5F_SCOPE_GLOBAL) < 0 ||
                         lseek(mill_draft_descriptor(file->draft), 0, SEEK_END) <= 0)))
        mill_h5_fail(file, verb, NULL);
}

static void release(struct mill_h5 *file)
{
    if (file->id >= 0)
        H5Fclose(file->id);
    mill_h5_release(file->text);
    mill_h5_release(file->access);
    mill_h5_release(file->transfer);
    mill_draft_free(file->draft);
    free(file->path);
    free(file);
}

static struct mill_h5 *allocate(const char *path, enum mill_h5_open how)
{
    struct mill_h5 *file = calloc(1, sizeof *file);
    if (!file)
        return NULL;
    file->id = -1;
    file->text = H5Tcopy(H5T_C_S1);
    H5Tset_size(file->text, H5T_VARIABLE);
    H5Tset_cset(file->text, H5T_CSET_UTF8);
    file->access = H5Pcreate(H5P_DATASET_ACCESS);
    H5Pset_chunk_cache(file->access, H5D_CHUNK_CACHE_NSLOTS_DEFAULT, 0, H5D_CHUNK_CACHE_W0_DEFAULT);
    file->transfer = H5Pcreate(H5P_DATASET_XFER);
    H5Pset_buffer(file->transfer, CONVERTED, NULL, NULL);
    file->path = strdup(path);
    file->draft = how == MILL_H5_READ ? NULL : mill_draft_create(path, hdf5_begins);
    if (!file->path || (how != MILL_H5_READ && !file->draft)) {
        release(file);
        return NULL;
    }
    return file;
}

/* The draft, if the file is to be written, and the file in it. */
static void open_draft(struct mill_h5 *file, enum mill_h5_open how)
{
    static const enum mill_draft_way way[] = {[MILL_H5_NEW] = MILL_DRAFT_EMPTY,
                                              [MILL_H5_RESTART] = MILL_DRAFT_EMPTY,
                                              [MILL_H5_OVERWRITE] = MILL_DRAFT_FORCE,
                                              [MILL_H5_UPDATE] = MILL_DRAFT_COPY};
    const char *verb = how == MILL_H5_UPDATE || how == MILL_H5_READ ? "open" : "create";
    const int failed = file->draft ? mill_draft_open(file->draft, way[how]) : 0;
    if (failed)
        fail_draft(file, verb, failed);
    /* asked for only now, under the lock: a run that ends makes the file */
    else if (how == MILL_H5_NEW && access(file->path, F_OK) == 0)
        mill_h5_spend(file, "exists already; --force overwrites it, -o gives another name");
    else
        open_file(file, how, verb);
}

enum mill_status mill_h5_create(const char *path, enum mill_h5_open how, struct mill_h5 **out,
                                struct mill_error *error)
{
    mill_h5_listen();
    struct mill_h5 *file = *out = allocate(path, how);
    if (!file)
        return mill_error_set(error, MILL_FAILED, "%s: out of memory", path);
    open_draft(file, how);
    const enum mill_status status = mill_h5_status(file, error);
    if (status != MILL_OK) {
        release(file);
        *out = NULL;
    }
    return status;
}

static void publish(struct mill_h5 *file, bool last)
{
    const int failed = mill_draft_publish(file->draft, last);
    if (failed)
        fail_draft(file, "write", failed);
}

static void flush(struct mill_h5 *file)
{
    mill_h5_flush_columns(file);
    /* a failure that nobody looked at, such as that of asking whether a name exists, counts too */
    if (mill_h5_good(file) && (H5Fflush(file->id, H5F_SCOPE_GLOBAL) < 0 || mill_h5_failed()))
        mill_h5_fail(file, "write", NULL);
}

enum mill_status mill_h5_flush(struct mill_h5 *file, struct mill_error *error)
{
    flush(file);
    if (mill_h5_good(file))
        publish(file, false);
    return mill_h5_status(file, error);
}

enum mill_status mill_h5_close(struct mill_h5 *file, struct mill_error *error)
{
    if (!file)
        return MILL_OK;
    if (file->draft)
        flush(file);
    mill_h5_free_columns(file);
    const hid_t id = file->id;
    file->id = -1;
    if (H5Fclose(id) < 0)
        mill_h5_fail(file, "close", NULL);
    if (mill_h5_good(file) && file->draft)
        publish(file, true);
    const enum mill_status status = mill_h5_status(file, error);
    release(file);
    return status;
}

void mill_h5_abandon(struct mill_h5 *file)
{
    if (!file)
        return;
    mill_h5_spend(file, "abandoned");
    mill_h5_close(file, NULL);
}
