/* Opening, publishing and closing HDF5 files. */
#include "store/h5_internal.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* [byte] of a file's structure in memory: HDF5's 2 MiB take 5 MiB; a run writes each only once */
enum {
    METADATA = 262144,
    /* [byte] buffer for converting texts: HDF5's default, 1 MiB, is zeroed for each text */
    CONVERTED = 4096
};

/* failed: an errno of the draft; 0: no failure */
static void tell(struct mill_h5 *file, const char *verb, int failed)
{
    if (failed == 0)
        return;
    file->status = mill_draft_tell(&file->draft, file->path, verb, failed, &file->cause);
    mill_h5_detach(file);
}

/* Properties for opening a file. HDF5 1.10 and later can read it, in the compact format of 1.8.
 * Closing also closes all open objects. HDF5's own locks are off: PATH.lock prevents a second
 * writer, also on disks without locks. Chunks are written whole, so none is kept in memory. */
static hid_t access_list(void)
{
    const hid_t list = H5Pcreate(H5P_FILE_ACCESS);
    H5AC_cache_config_t cache = {.version = H5AC__CURR_CACHE_CONFIG_VERSION};
#if H5_VERSION_GE(1, 10, 2)
    H5Pset_libver_bounds(list, H5F_LIBVER_V18, H5F_LIBVER_V110);
#else
    H5Pset_libver_bounds(list, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
#endif
#if H5_VERSION_GE(1, 12, 1) || (H5_VERS_MINOR == 10 && H5_VERS_RELEASE >= 7)
    H5Pset_file_locking(list, false, true);
#endif
    H5Pset_fclose_degree(list, H5F_CLOSE_STRONG);
    H5Pset_cache(list, 0, 0, 0, 0);
    H5Pget_mdc_config(list, &cache);
    cache.set_initial_size = true;
    cache.initial_size = cache.min_size = METADATA / 4;
    cache.max_size = METADATA;
    H5Pset_mdc_config(list, &cache);
    return list;
}

/* Opens the draft's file, or a file that is only read. A new file is flushed at once, so that a
 * file left by a killed run begins with HDF5's signature. */
static void open_file(struct mill_h5 *file, enum mill_h5_open how, const char *verb)
{
    const hid_t list = access_list(), create = mill_h5_timeless(H5P_FILE_CREATE);
    const bool old = how == MILL_H5_READ || how == MILL_H5_UPDATE;
    if (how == MILL_H5_READ)
        file->id = H5Fopen(file->path, H5F_ACC_RDONLY, list);
    else if (how == MILL_H5_UPDATE)
        file->id = H5Fopen(file->draft.part, H5F_ACC_RDWR, list);
    else
        file->id = H5Fcreate(file->draft.part, H5F_ACC_TRUNC, create, list);
    mill_h5_release(create);
    mill_h5_release(list);
    if (file->id < 0)
        mill_h5_fail(file, verb, NULL,
                     old ? "it is not an HDF5 file, or it is damaged or cut off" : NULL);
    /* an empty file is not the one that HDF5 opened: somebody has replaced it */
    else if (how != MILL_H5_READ &&
             (H5Fflush(file->id, H5F_SCOPE_GLOBAL) < 0 || lseek(file->draft.fd, 0, SEEK_END) <= 0))
        mill_h5_fail(file, verb, NULL, NULL);
}

enum mill_status mill_h5_create(const char *path, enum mill_h5_open how, struct mill_h5 **out,
                                struct mill_error *error)
{
    const char *verb = how == MILL_H5_UPDATE || how == MILL_H5_READ ? "open" : "create";
    const enum mill_draft_way way = how == MILL_H5_OVERWRITE ? MILL_DRAFT_FORCE
                                    : how == MILL_H5_UPDATE  ? MILL_DRAFT_COPY
                                                             : MILL_DRAFT_EMPTY;
    struct mill_h5 *file = *out = calloc(1, sizeof *file + strlen(path) + 1);
    if (!file)
        return mill_error_set(error, MILL_FAILED, "%s: out of memory", path);
    mill_h5_listen();
    file->id = -1;
    file->text = H5Tcopy(H5T_C_S1);
    H5Tset_size(file->text, H5T_VARIABLE);
    H5Tset_cset(file->text, H5T_CSET_UTF8);
    file->transfer = H5Pcreate(H5P_DATASET_XFER);
    H5Pset_buffer(file->transfer, CONVERTED, NULL, NULL);
    file->simple = mill_h5_timeless(H5P_DATASET_CREATE);
    strcpy(file->path, path);
    mill_draft_init(&file->draft, path, "\211HDF\r\n\032\n");
    if (how != MILL_H5_READ)
        tell(file, verb, mill_draft_open(&file->draft, way));
    /* checked only now, while holding the lock: an ending run may have made the file */
    if (file->status == MILL_OK && how == MILL_H5_NEW && access(path, F_OK) == 0)
        mill_h5_spend(file, "exists already; --force overwrites it, -o gives another name");
    if (file->status == MILL_OK)
        open_file(file, how, verb);
    if (file->status == MILL_OK)
        return MILL_OK;
    *out = NULL;
    return mill_h5_close(file, error);
}

static void publish(struct mill_h5 *file, bool last)
{
    const bool written = file->draft.fd >= 0;
    mill_h5_flush_columns(file);
    if (written && file->status == MILL_OK)
        H5Fflush(file->id, H5F_SCOPE_GLOBAL);
    mill_h5_check(file, "write", NULL);
    if (last) {
        const hid_t id = file->id;
        while (file->columns)
            mill_h5_column_close(file->columns);
        mill_h5_leave(file);
        file->id = -1; /* so that a later failure does not try to detach the closed file */
        H5Fclose(id);
        mill_h5_check(file, "close", NULL);
    }
    if (written && file->status == MILL_OK)
        tell(file, "write", mill_draft_publish(&file->draft, last));
}

enum mill_status mill_h5_flush(struct mill_h5 *file, struct mill_error *error)
{
    publish(file, false);
    return mill_h5_status(file, error);
}

enum mill_status mill_h5_close(struct mill_h5 *file, struct mill_error *error)
{
    if (!file)
        return MILL_OK;
    publish(file, true);
    const enum mill_status status = mill_h5_status(file, error);
    mill_h5_release(file->text);
    mill_h5_release(file->transfer);
    mill_h5_release(file->simple);
    mill_draft_end(&file->draft);
    free(file);
    return status;
}

void mill_h5_abandon(struct mill_h5 *file)
{
    if (file)
        mill_h5_spend(file, "abandoned");
    mill_h5_close(file, NULL);
}
