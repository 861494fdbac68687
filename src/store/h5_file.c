/* Opening, publishing and closing HDF5 files. */
#include "store/h5_internal.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* [byte] of a file's structure that HDF5 keeps in memory. Its own 2 MiB take some 5; a run writes
 * each piece once. */
enum { METADATA = 262144 };

static void fail_draft(struct mill_h5 *file, const char *verb, int failed)
{
    file->spent = mill_draft_tell(&file->draft, file->path, verb, failed, &file->cause);
    mill_h5_detach(file);
}

/* Files that HDF5 1.10 and later read, in the compact format of 1.8; closing takes all that is
 * still open along. PATH.lock keeps writers apart, and disks that know no locks are fine. Whole
 * chunks are written, so none is kept in memory. */
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

/* Through the draft, which is open, or for reading only. A new file is flushed at once, so that
 * what a killed run leaves begins as HDF5 files do. */
static void open_file(struct mill_h5 *file, enum mill_h5_open how, const char *verb)
{
    const hid_t list = access_list(), create = mill_h5_timeless(H5P_FILE_CREATE);
    const char *part = file->draft.name[MILL_DRAFT_PART];
    if (how == MILL_H5_READ)
        file->id = H5Fopen(file->path, H5F_ACC_RDONLY, list);
    else if (how == MILL_H5_UPDATE)
        file->id = H5Fopen(part, H5F_ACC_RDWR, list);
    else
        file->id = H5Fcreate(part, H5F_ACC_TRUNC, create, list);
    mill_h5_release(create);
    mill_h5_release(list);
    if (file->id < 0 && (how == MILL_H5_READ || how == MILL_H5_UPDATE))
        mill_h5_suppose("it is no HDF5 file, or damaged or cut off");
    if (file->draft.fd >= 0)
        H5Fflush(file->id, H5F_SCOPE_GLOBAL);
    mill_h5_check(file, verb, NULL);
    /* what is empty then is not what HDF5 has opened: somebody put another file in its place */
    if (file->draft.fd >= 0 && lseek(file->draft.fd, 0, SEEK_END) <= 0)
        mill_h5_fail(file, verb, NULL);
}

/* The draft, if the file is to be written, and the file in it. */
static void open_draft(struct mill_h5 *file, enum mill_h5_open how)
{
    static const enum mill_draft_way way[] = {[MILL_H5_NEW] = MILL_DRAFT_EMPTY,
                                              [MILL_H5_RESTART] = MILL_DRAFT_EMPTY,
                                              [MILL_H5_OVERWRITE] = MILL_DRAFT_FORCE,
                                              [MILL_H5_UPDATE] = MILL_DRAFT_COPY};
    const char *verb = how == MILL_H5_UPDATE || how == MILL_H5_READ ? "open" : "create";
    const int failed = how == MILL_H5_READ ? 0 : mill_draft_open(&file->draft, way[how]);
    if (failed)
        fail_draft(file, verb, failed);
    /* asked for only now, under the lock: a run that ends makes the file */
    else if (how == MILL_H5_NEW && access(file->path, F_OK) == 0)
        mill_h5_spend(file, "exists already; --force overwrites it, -o gives another name");
    else
        open_file(file, how, verb);
}

static void release(struct mill_h5 *file)
{
    if (file->id >= 0)
        H5Fclose(file->id);
    mill_h5_release(file->text);
    mill_draft_end(&file->draft);
    free(file);
}

enum mill_status mill_h5_create(const char *path, enum mill_h5_open how, struct mill_h5 **out,
                                struct mill_error *error)
{
    struct mill_h5 *file = *out = calloc(1, sizeof *file + strlen(path) + 1);
    if (!file)
        return mill_error_set(error, MILL_FAILED, "%s: out of memory", path);
    mill_h5_listen();
    file->id = -1;
    file->text = H5Tcopy(H5T_C_S1);
    H5Tset_size(file->text, H5T_VARIABLE);
    H5Tset_cset(file->text, H5T_CSET_UTF8);
    strcpy(file->path, path);
    mill_draft_init(&file->draft, path, "\211HDF\r\n\032\n");
    open_draft(file, how);
    const enum mill_status status = mill_h5_status(file, error);
    if (status != MILL_OK) {
        release(file);
        *out = NULL;
    }
    return status;
}

static void flush(struct mill_h5 *file)
{
    mill_h5_flush_columns(file);
    if (mill_h5_good(file))
        H5Fflush(file->id, H5F_SCOPE_GLOBAL);
    mill_h5_check(file, "write", NULL);
}

static void publish(struct mill_h5 *file, bool last)
{
    const int failed = mill_h5_good(file) ? mill_draft_publish(&file->draft, last) : 0;
    if (failed)
        fail_draft(file, "write", failed);
}

enum mill_status mill_h5_flush(struct mill_h5 *file, struct mill_error *error)
{
    flush(file);
    publish(file, false);
    return mill_h5_status(file, error);
}

enum mill_status mill_h5_close(struct mill_h5 *file, struct mill_error *error)
{
    if (!file)
        return MILL_OK;
    const bool written = file->draft.fd >= 0;
    if (written)
        flush(file);
    while (file->columns)
        mill_h5_column_close(file->columns);
    const hid_t id = file->id;
    file->id = -1;
    H5Fclose(id);
    mill_h5_check(file, "close", NULL);
    if (written)
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
