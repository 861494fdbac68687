/* Opening, publishing and closing HDF5 files; failures, groups, links. HDF5's own error stack is
 * never printed; the reason is recorded at the first failure. After a failure (mostly a full disk)
 * the library's cache no longer matches the disk, and every later write would fail in another way.
 * So the file is then spent, and closing only frees it. */
#include "store/h5_internal.h"

#include <assert.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* [byte] of a file's structure that HDF5 keeps in memory. HDF5's default of 2 MiB takes about 5
 * MiB. A run writes each piece only once. */
enum {
    METADATA = 262144,
    /* [byte] buffer for converting texts: HDF5's default, 1 MiB, is zeroed for each text */
    CONVERTED = 4096
};

/* ---- failures ---- */

/* Why HDF5 failed for the first time since the last failure was reported. HDF5 itself forgets the
 * reason at its next call. */
static struct {
    int number;      /* errno, 0 = none */
    char words[256]; /* "": nothing has failed */
} reason;

static herr_t note(unsigned depth, const H5E_error2_t *entry, void *self)
{
    const char *number = strstr(entry->desc, "errno = ");
    (void)self;
    if (depth > 0)
        return 0;
    reason.number = number ? atoi(number + strlen("errno = ")) : 0;
    snprintf(reason.words, sizeof reason.words, "%s",
             reason.number ? strerror(reason.number) : entry->desc);
    return 0;
}

static herr_t note_first(hid_t stack, void *self)
{
    return reason.words[0] ? 0 : (herr_t)H5Ewalk2(stack, H5E_WALK_UPWARD, note, self);
}

/* Switches off HDF5's own messages, and records the reasons of its failures. */
static void listen_to_failures(void)
{
    H5dont_atexit(); /* HDF5 would report failures at exit on stderr, or hang */
    H5Eset_auto2(H5E_DEFAULT, note_first, NULL);
    reason.words[0] = '\0';
}

/* For a spent file: data that HDF5 still holds must not reach the disk, and freeing them must not
 * fail. From now on HDF5 writes to nowhere. */
static void detach(struct mill_h5 *file)
{
    void *descriptor;
    const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
    if (nowhere >= 0 && file->draft.fd >= 0 && file->id >= 0 &&
        H5Fget_vfd_handle(file->id, H5P_DEFAULT, &descriptor) >= 0)
        dup2(nowhere, *(const int *)descriptor);
    close(nowhere);
}

void mill_h5_spend(struct mill_h5 *file, const char *why)
{
    reason.words[0] = '\0';
    if (file->status != MILL_OK)
        return; /* the first failure is the one that is reported */
    file->status = mill_error_set(&file->cause, MILL_FAILED, "%s: %s", file->path, why);
    detach(file);
}

void mill_h5_fail(struct mill_h5 *file, const char *verb, const char *path, const char *why)
{
    struct mill_error text;
    if (reason.words[0] && (reason.number || !why))
        why = reason.words;
    mill_error_set(&text, MILL_FAILED, "cannot %s%s%s: %s", verb, path ? " " : "", path ? path : "",
                   why ? why : "the HDF5 library refused");
    mill_h5_spend(file, text.text);
}

void mill_h5_check(struct mill_h5 *file, const char *verb, const char *path)
{
    if (reason.words[0])
        mill_h5_fail(file, verb, path, NULL);
}

enum mill_status mill_h5_status(const struct mill_h5 *file, struct mill_error *error)
{
    if (file->status != MILL_OK && error)
        *error = file->cause;
    return file->status;
}

/* ---- groups and links ---- */

void mill_h5_release(hid_t object)
{
    if (object >= 0)
        H5Idec_ref(object);
}

hid_t mill_h5_timeless(hid_t property_class)
{
    const hid_t list = H5Pcreate(property_class);
    H5Pset_obj_track_times(list, 0);
    return list;
}

/* The group that holds `path`, "" for the root. */
static const char *parent_of(const char *path, char parent[MILL_H5_PATH])
{
    const char *name = strrchr(path, '/');
    assert(name && name - path < MILL_H5_PATH);
    memcpy(parent, path, (size_t)(name - path));
    parent[name - path] = '\0';
    return parent;
}

bool mill_h5_exists(struct mill_h5 *file, const char *path)
{
    char parent[MILL_H5_PATH];
    if (!path[0])
        return file->status == MILL_OK;
    /* H5Lexists fails if a group on the way is missing */
    const bool held = mill_h5_exists(file, parent_of(path, parent));
    const bool there = held && H5Lexists(file->id, path, H5P_DEFAULT) > 0;
    mill_h5_check(file, "read", path);
    return there;
}

/* Closes the open groups. */
static void leave(struct mill_h5 *file)
{
    while (file->depth > 0)
        mill_h5_release(file->group[--file->depth]);
    file->way[0] = '\0';
}

/* An output file has hundreds of datasets in few groups: so the groups stay open that the path has
 * in common with the one before. */
hid_t mill_h5_enter(struct mill_h5 *file, const char *path, const char **name)
{
    *name = strrchr(path, '/') + 1;
    const size_t length = (size_t)(*name - path) - 1;
    size_t common = strlen(file->way);
    assert(length < MILL_H5_PATH);
    if (file->status == MILL_OK && file->depth == 0)
        file->group[file->depth++] = H5Gopen2(file->id, "/", H5P_DEFAULT);
    while (common > length || strncmp(path, file->way, common) != 0 ||
           (common < length && path[common] != '/')) {
        common = (size_t)(strrchr(file->way, '/') - file->way);
        file->way[common] = '\0';
        mill_h5_release(file->group[--file->depth]);
    }
    while (file->status == MILL_OK && common < length) {
        const size_t next = common + 1 + strcspn(path + common + 1, "/");
        const hid_t in = file->group[file->depth - 1], list = mill_h5_timeless(H5P_GROUP_CREATE);
        memcpy(file->way + common, path + common, next - common);
        file->way[next] = '\0';
        const char *one = file->way + common + 1;
        const hid_t group = H5Lexists(in, one, H5P_DEFAULT) > 0
                                ? H5Gopen2(in, one, H5P_DEFAULT)
                                : H5Gcreate2(in, one, H5P_DEFAULT, list, H5P_DEFAULT);
        assert(file->depth < MILL_H5_DEPTH);
        file->group[file->depth++] = group;
        common = next;
        mill_h5_release(list);
        mill_h5_check(file, "create", file->way);
    }
    return file->status == MILL_OK ? file->group[file->depth - 1] : -1;
}

void mill_h5_remove(struct mill_h5 *file, const char *path)
{
    leave(file); /* an open group would live on, without a name */
    if (mill_h5_exists(file, path))
        H5Ldelete(file->id, path, H5P_DEFAULT);
    mill_h5_check(file, "replace", path);
}

hid_t mill_h5_make_way(struct mill_h5 *file, const char *path, const char **name)
{
    const hid_t in = mill_h5_enter(file, path, name);
    if (in >= 0 && H5Lexists(in, *name, H5P_DEFAULT) > 0)
        H5Ldelete(in, *name, H5P_DEFAULT);
    mill_h5_check(file, "replace", path);
    return file->status == MILL_OK ? in : -1;
}

void mill_h5_group(struct mill_h5 *file, const char *path, bool ordered)
{
    const char *name;
    const hid_t in = mill_h5_enter(file, path, &name);
    if (in < 0 || H5Lexists(in, name, H5P_DEFAULT) > 0)
        return;
    const hid_t list = mill_h5_timeless(H5P_GROUP_CREATE);
    if (ordered)
        H5Pset_link_creation_order(list, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    mill_h5_release(H5Gcreate2(in, name, H5P_DEFAULT, list, H5P_DEFAULT));
    mill_h5_release(list);
    mill_h5_check(file, "create", path);
}

void mill_h5_link(struct mill_h5 *file, const char *existing, const char *path)
{
    const char *name;
    const hid_t in = mill_h5_make_way(file, path, &name);
    if (in >= 0)
        H5Lcreate_hard(file->id, existing, in, name, H5P_DEFAULT, H5P_DEFAULT);
    mill_h5_check(file, "link", path);
}

void mill_h5_soft_link(struct mill_h5 *file, const char *target, const char *path)
{
    const char *name;
    const hid_t in = mill_h5_make_way(file, path, &name);
    if (in >= 0)
        H5Lcreate_soft(target, in, name, H5P_DEFAULT, H5P_DEFAULT);
    mill_h5_check(file, "link", path);
}

void mill_h5_version(char *out, size_t size)
{
    unsigned major = 0, minor = 0, release = 0;
    H5get_libversion(&major, &minor, &release);
    snprintf(out, size, "%u.%u.%u", major, minor, release);
}

/* ---- the file ---- */

/* failed: an errno of the draft; 0: no failure */
static void tell(struct mill_h5 *file, const char *verb, int failed)
{
    if (failed == 0)
        return;
    file->status = mill_draft_tell(&file->draft, file->path, verb, failed, &file->cause);
    detach(file);
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
    listen_to_failures();
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
        leave(file);
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
