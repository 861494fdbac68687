/* The common part of this module: failures, groups, links. HDF5's own error stack is never printed;
 * the reason is recorded at the first failure. After it (mostly a full disk) the library's cache no
 * longer matches the disk: the file is spent, and closing only frees it. */
#include "store/h5_internal.h"

#include <assert.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- failures ---- */

/* Why HDF5 failed first since the last report: HDF5 itself forgets the reason at its next call. */
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

void mill_h5_listen(void)
{
    H5dont_atexit(); /* HDF5 would report failures at exit on stderr, or hang */
    H5Eset_auto2(H5E_DEFAULT, note_first, NULL);
    reason.words[0] = '\0';
}

void mill_h5_detach(struct mill_h5 *file)
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
    mill_h5_detach(file);
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

bool mill_h5_exists(struct mill_h5 *file, const char *path)
{
    char parent[MILL_H5_PATH]; /* the group that holds it, "" for the root */
    const char *name = strrchr(path, '/');
    if (!path[0])
        return file->status == MILL_OK;
    assert(name && name - path < MILL_H5_PATH);
    snprintf(parent, sizeof parent, "%.*s", (int)(name - path), path);
    /* H5Lexists fails if a group on the way is missing */
    const bool held = mill_h5_exists(file, parent);
    const bool there = held && H5Lexists(file->id, path, H5P_DEFAULT) > 0;
    mill_h5_check(file, "read", path);
    return there;
}

void mill_h5_leave(struct mill_h5 *file)
{
    while (file->depth > 0)
        mill_h5_release(file->group[--file->depth]);
    file->way[0] = '\0';
}

/* A file has hundreds of datasets in few groups: those in common with the path before stay open. */
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
    mill_h5_leave(file); /* an open group would live on, without a name */
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
