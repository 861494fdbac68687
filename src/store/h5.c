/* HDF5 files as the rest of the program sees them: opening and closing, groups, links, and how
 * failures are told. HDF5's own error stack is never printed; the errno inside it is what the user
 * needs, so it is read from there. After a first failure (disk full, mostly) the library's cache no
 * longer matches the disk, and every further write would fail in a new way: so the file is spent,
 * and closing only lets go. */
#include "store/h5_internal.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define METADATA 262144 /* [byte] of the file's structure that HDF5 keeps in memory */

static herr_t innermost(unsigned depth, const H5E_error2_t *entry, void *self)
{
    const char **words = self;
    if (depth == 0)
        *words = entry->desc;
    return 0;
}

static void find_reason(const struct mill_h5 *file, char *reason, size_t size)
{
    const char *words = NULL;
    const int number = file->disk.number;
    if (number == EWOULDBLOCK)
        words = "another run is writing it";
    else if (number)
        words = strerror(number);
    else
        H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, innermost, &words);
    snprintf(reason, size, "%s", words && words[0] ? words : "the HDF5 library refused");
}

enum mill_status mill_h5_fail(struct mill_h5 *file, struct mill_error *error, const char *verb,
                              const char *path)
{
    char reason[256];
    find_reason(file, reason, sizeof reason);
    mill_error_set(&file->cause, MILL_FAILED, "%s: cannot %s%s%s: %s", file->path, verb,
                   path ? " " : "", path ? path : "", reason);
    file->spent = MILL_FAILED;
    return mill_h5_check(file, error);
}

enum mill_status mill_h5_check(const struct mill_h5 *file, struct mill_error *error)
{
    if (file->spent != MILL_OK && error)
        *error = file->cause;
    return file->spent;
}

hid_t mill_h5_timeless(hid_t property_class)
{
    const hid_t list = H5Pcreate(property_class);
    if (list >= 0)
        H5Pset_obj_track_times(list, 0);
    return list;
}

/* HDF5 keeps 2 MiB of object headers and the like at first, some 5 MiB of memory; a run writes each
 * of them once. */
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
 * still open along. */
static hid_t access_list(struct mill_h5_disk *disk)
{
    const hid_t list = H5Pcreate(H5P_FILE_ACCESS);
    if (list < 0)
        return list;
#if H5_VERSION_GE(1, 10, 2)
    H5Pset_libver_bounds(list, H5F_LIBVER_V18, H5F_LIBVER_V110);
#else
    H5Pset_libver_bounds(list, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
#endif
    if (H5Pset_fclose_degree(list, H5F_CLOSE_STRONG) < 0 || !keep_little(list) ||
        !mill_h5_use_disk(list, disk))
        return -1;
    return list;
}

/* Through the draft, which is open, or for reading only. The lists leak where it fails, so that the
 * error stack lives on. */
static hid_t open_file(struct mill_h5 *file, enum mill_h5_open how)
{
    const hid_t list = access_list(&file->disk);
    const hid_t create = mill_h5_timeless(H5P_FILE_CREATE);
    hid_t id;
    if (list < 0 || create < 0)
        return -1;
    if (how == MILL_H5_READ)
        id = H5Fopen(file->path, H5F_ACC_RDONLY, list);
    else if (how == MILL_H5_UPDATE)
        id = H5Fopen(file->path, H5F_ACC_RDWR, list);
    else
        id = H5Fcreate(file->path, H5F_ACC_TRUNC, create, list);
    if (id >= 0) {
        H5Pclose(create);
        H5Pclose(list);
    }
    return id;
}

static void release(struct mill_h5 *file)
{
    mill_draft_free(file->disk.draft);
    free(file->path);
    free(file);
}

static struct mill_h5 *allocate(const char *path, enum mill_h5_open how)
{
    struct mill_h5 *file = calloc(1, sizeof *file);
    if (!file)
        return NULL;
    file->id = -1;
    file->path = malloc(strlen(path) + 1);
    file->disk.draft = how == MILL_H5_READ ? NULL : mill_draft_create(path);
    if (!file->path || (how != MILL_H5_READ && !file->disk.draft)) {
        release(file);
        return NULL;
    }
    strcpy(file->path, path);
    return file;
}

static enum mill_status refuse_existing(const char *path, struct mill_error *error)
{
    return mill_error_set(error, MILL_FAILED,
                          "%s: exists already; --force overwrites it, -o gives another name", path);
}

enum mill_status mill_h5_create(const char *path, enum mill_h5_open how, struct mill_h5 **out,
                                struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    *out = NULL;
    struct mill_h5 *file = allocate(path, how);
    if (!file)
        return mill_error_set(error, MILL_FAILED, "%s: out of memory", path);
    H5dont_atexit(); /* what is wrong then would be told on stderr, if it did not hang */
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    if (file->disk.draft)
        file->disk.number = mill_draft_open(file->disk.draft, how == MILL_H5_UPDATE);
    /* asked for only now, under the lock: a run that ends makes the file */
    if (!file->disk.number && how == MILL_H5_NEW && access(path, F_OK) == 0)
        status = refuse_existing(path, error);
    else if (file->disk.number || (file->id = open_file(file, how)) < 0)
        status = mill_h5_fail(
            file, error, how == MILL_H5_UPDATE || how == MILL_H5_READ ? "open" : "create", NULL);
    if (status != MILL_OK && how == MILL_H5_READ && !file->disk.number) {
        const struct mill_error why = file->cause;
        mill_error_set(error, status, "%s; it is no HDF5 file, or damaged or cut off", why.text);
    }
    if (status != MILL_OK)
        release(file);
    else
        *out = file;
    return status;
}

static enum mill_status publish(struct mill_h5 *file, bool go_on, struct mill_error *error)
{
    const int failed = mill_draft_publish(file->disk.draft, go_on);
    if (!failed)
        return MILL_OK;
    file->disk.number = failed;
    return mill_h5_fail(file, error, "write", NULL);
}

enum mill_status mill_h5_flush(struct mill_h5 *file, struct mill_error *error)
{
    if (file->spent != MILL_OK)
        return mill_h5_check(file, error);
    if (H5Fflush(file->id, H5F_SCOPE_GLOBAL) < 0)
        return mill_h5_fail(file, error, "write", NULL);
    return publish(file, true, error);
}

enum mill_status mill_h5_close(struct mill_h5 *file, struct mill_error *error)
{
    if (!file)
        return MILL_OK;
    mill_h5_orphan_columns(file); /* their datasets are closed with the file */
    if (file->spent == MILL_OK && file->disk.draft && H5Fflush(file->id, H5F_SCOPE_GLOBAL) < 0)
        mill_h5_fail(file, error, "write", NULL);
    file->disk.mute = file->spent != MILL_OK; /* what HDF5 still holds must not reach the disk */
    if (H5Fclose(file->id) < 0 && file->spent == MILL_OK)
        mill_h5_fail(file, error, "close", NULL);
    if (file->spent == MILL_OK && file->disk.draft)
        publish(file, false, error);
    const enum mill_status status = mill_h5_check(file, error);
    release(file);
    return status;
}

void mill_h5_abandon(struct mill_h5 *file)
{
    if (!file)
        return;
    if (file->spent == MILL_OK)
        file->spent = MILL_FAILED;
    mill_h5_close(file, NULL);
}

bool mill_h5_exists(const struct mill_h5 *file, const char *path)
{
    char part[1024];
    size_t i;
    /* H5Lexists fails where a group on the way is missing: ask for each in turn */
    for (i = 1; i < sizeof part; i++) {
        if (path[i] != '/' && path[i] != '\0')
            continue;
        memcpy(part, path, i);
        part[i] = '\0';
        if (i > 1 && H5Lexists(file->id, part, H5P_DEFAULT) <= 0)
            return false;
        if (path[i] == '\0')
            return true;
    }
    return false;
}

enum mill_status mill_h5_remove(struct mill_h5 *file, const char *path, struct mill_error *error)
{
    if (file->spent != MILL_OK)
        return mill_h5_check(file, error);
    if (mill_h5_exists(file, path) && H5Ldelete(file->id, path, H5P_DEFAULT) < 0)
        return mill_h5_fail(file, error, "replace", path);
    return MILL_OK;
}

static enum mill_status make_group(struct mill_h5 *file, const char *path, bool ordered,
                                   struct mill_error *error)
{
    hid_t list, group = -1;
    enum mill_status status = MILL_OK;
    if (mill_h5_exists(file, path))
        return MILL_OK;
    list = mill_h5_timeless(H5P_GROUP_CREATE);
    if (list >= 0 && (!ordered || H5Pset_link_creation_order(list, H5P_CRT_ORDER_TRACKED |
                                                                       H5P_CRT_ORDER_INDEXED) >= 0))
        group = H5Gcreate2(file->id, path, H5P_DEFAULT, list, H5P_DEFAULT);
    if (group < 0)
        status = mill_h5_fail(file, error, "create", path);
    else
        H5Gclose(group);
    H5Pclose(list);
    return status;
}

enum mill_status mill_h5_parents(struct mill_h5 *file, const char *path, struct mill_error *error)
{
    char part[1024];
    size_t i;
    enum mill_status status = mill_h5_check(file, error);
    for (i = 1; status == MILL_OK && path[i - 1] && path[i]; i++) {
        if (i >= sizeof part)
            return mill_error_set(error, MILL_FAILED, "%s: path too long: %s", file->path, path);
        if (path[i] != '/')
            continue;
        memcpy(part, path, i);
        part[i] = '\0';
        status = make_group(file, part, false, error);
    }
    return status;
}

enum mill_status mill_h5_group(struct mill_h5 *file, const char *path, bool ordered,
                               struct mill_error *error)
{
    enum mill_status status = mill_h5_parents(file, path, error);
    return status == MILL_OK ? make_group(file, path, ordered, error) : status;
}

enum mill_status mill_h5_link(struct mill_h5 *file, const char *existing, const char *path,
                              struct mill_error *error)
{
    enum mill_status status = mill_h5_parents(file, path, error);
    if (status == MILL_OK)
        status = mill_h5_remove(file, path, error);
    if (status == MILL_OK &&
        H5Lcreate_hard(file->id, existing, file->id, path, H5P_DEFAULT, H5P_DEFAULT) < 0)
        status = mill_h5_fail(file, error, "link", path);
    return status;
}

enum mill_status mill_h5_soft_link(struct mill_h5 *file, const char *target, const char *path,
                                   struct mill_error *error)
{
    enum mill_status status = mill_h5_parents(file, path, error);
    if (status == MILL_OK)
        status = mill_h5_remove(file, path, error);
    if (status == MILL_OK && H5Lcreate_soft(target, file->id, path, H5P_DEFAULT, H5P_DEFAULT) < 0)
        status = mill_h5_fail(file, error, "link", path);
    return status;
}

void mill_h5_version(char *out, size_t size)
{
    unsigned major = 0, minor = 0, release = 0;
    H5get_libversion(&major, &minor, &release);
    snprintf(out, size, "%u.%u.%u", major, minor, release);
}
