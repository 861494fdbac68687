/* HDF5 files as the rest of the program sees them: opening and closing, groups, links, and how
 * failures are told. HDF5's own error stack is never printed; the errno inside it is what the user
 * needs, so it is read from there. After a first failure (disk full, mostly) the library's cache no
 * longer matches the disk, and every further write would fail in a new way: so the file is spent,
 * and closing only lets go. */
#include "h5_internal.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

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
        words = "another program has it open";
    else if (number == ENODATA)
        words = "its run was killed before the first checkpoint; start it again with --force";
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
    if (H5Pset_fclose_degree(list, H5F_CLOSE_STRONG) < 0 || !mill_h5_use_disk(list, disk))
        return -1;
    return list;
}

static hid_t open_file(struct mill_h5 *file, enum mill_h5_open how)
{
    const char *path = file->path;
    const hid_t list = access_list(&file->disk);
    const hid_t create = mill_h5_timeless(H5P_FILE_CREATE);
    hid_t id = -1;
    if (list >= 0 && create >= 0 && how == MILL_H5_UPDATE)
        id = H5Fopen(path, H5F_ACC_RDWR, list);
    else if (list >= 0 && create >= 0)
        id = H5Fcreate(path, how == MILL_H5_NEW ? H5F_ACC_EXCL : H5F_ACC_TRUNC, create, list);
    if (id < 0)
        return id; /* the lists leak here, so that the error stack lives on */
    H5Pclose(create);
    H5Pclose(list);
    return id;
}

static struct mill_h5 *allocate(const char *path)
{
    struct mill_h5 *file = calloc(1, sizeof *file);
    if (!file)
        return NULL;
    file->id = -1;
    file->path = malloc(strlen(path) + 1);
    file->disk.journal = mill_journal_create(path);
    if (!file->path || !file->disk.journal) {
        mill_journal_free(file->disk.journal);
        free(file->path);
        free(file);
        return NULL;
    }
    strcpy(file->path, path);
    return file;
}

static void release(struct mill_h5 *file)
{
    mill_journal_free(file->disk.journal);
    free(file->path);
    free(file);
}

enum mill_status mill_h5_create(const char *path, enum mill_h5_open how, struct mill_h5 **out,
                                struct mill_error *error)
{
    struct mill_h5 *file;
    enum mill_status status;
    *out = NULL;
    if (how == MILL_H5_NEW && access(path, F_OK) == 0)
        return mill_error_set(
            error, MILL_FAILED,
            "%s: exists already; use --force to overwrite it or -o for another name", path);
    file = allocate(path);
    if (!file)
        return mill_error_set(error, MILL_FAILED, "%s: out of memory", path);
    H5dont_atexit(); /* what is wrong then would be told on stderr, if it did not hang */
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    file->disk.recover = how == MILL_H5_UPDATE;
    file->id = open_file(file, how);
    if (file->id < 0) {
        status = mill_h5_fail(file, error, how == MILL_H5_UPDATE ? "open" : "create", NULL);
        mill_journal_discard(file->disk.journal);
        release(file);
        return status;
    }
    *out = file;
    return MILL_OK;
}

enum mill_status mill_h5_flush(struct mill_h5 *file, struct mill_error *error)
{
    int failed;
    if (file->spent != MILL_OK)
        return mill_h5_check(file, error);
    if (H5Fflush(file->id, H5F_SCOPE_GLOBAL) < 0)
        return mill_h5_fail(file, error, "write", NULL);
    failed = mill_journal_commit(file->disk.journal, file->disk.size);
    if (failed) {
        file->disk.number = failed;
        return mill_h5_fail(file, error, "write its journal", NULL);
    }
    return MILL_OK;
}

/* The file as it was at the last commit, or the fragment that it is. Should even that fail, the
 * journal stays for the next attempt. */
static void fall_back(struct mill_h5 *file)
{
    file->disk.mute = true; /* what HDF5 still holds must not reach the disk */
    if (H5Iis_valid(file->id) > 0)
        H5Fclose(file->id);
    if (!mill_journal_committed(file->disk.journal) ||
        mill_h5_restore(file->path, &file->disk) == 0)
        mill_journal_discard(file->disk.journal);
}

enum mill_status mill_h5_close(struct mill_h5 *file, struct mill_error *error)
{
    enum mill_status status;
    if (!file)
        return MILL_OK;
    mill_h5_orphan_columns(file); /* their datasets are closed with the file */
    status = mill_h5_flush(file, error);
    if (status != MILL_OK) {
        fall_back(file);
    } else if (H5Fclose(file->id) < 0) {
        status = mill_h5_fail(file, error, "close", NULL);
        fall_back(file);
    } else {
        mill_journal_discard(file->disk.journal);
    }
    release(file);
    return status;
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
