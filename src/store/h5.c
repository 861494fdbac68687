/* The common part of this module: failures, groups, links. HDF5's own error stack is never printed;
 * the reason is recorded at the first failure. After a failure (mostly a full disk) the library's
 * cache no longer matches the disk, and every later write would fail in another way. So the file is
 * then spent, and closing only frees it. */
#include "store/h5_internal.h"

#include <assert.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

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

/* Removes an object whose group exists. */
static void clear(struct mill_h5 *file, const char *path)
{
    if (H5Lexists(file->id, path, H5P_DEFAULT) > 0) {
        H5Ldelete(file->id, path, H5P_DEFAULT);
        file->way[0] = '\0';
    }
    mill_h5_check(file, "replace", path);
}

void mill_h5_remove(struct mill_h5 *file, const char *path)
{
    if (mill_h5_exists(file, path))
        clear(file, path);
}

bool mill_h5_make_way(struct mill_h5 *file, const char *path)
{
    char parent[MILL_H5_PATH];
    /* an output file has hundreds of datasets in few groups: each group is looked for once */
    if (strcmp(parent_of(path, parent), file->way) != 0) {
        if (parent[0])
            mill_h5_group(file, parent, false);
        strcpy(file->way, parent);
    }
    if (file->status == MILL_OK)
        clear(file, path);
    return file->status == MILL_OK;
}

void mill_h5_group(struct mill_h5 *file, const char *path, bool ordered)
{
    if (mill_h5_exists(file, path) || !mill_h5_make_way(file, path))
        return;
    const hid_t list = mill_h5_timeless(H5P_GROUP_CREATE);
    if (ordered)
        H5Pset_link_creation_order(list, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    mill_h5_release(H5Gcreate2(file->id, path, H5P_DEFAULT, list, H5P_DEFAULT));
    mill_h5_release(list);
    mill_h5_check(file, "create", path);
}

void mill_h5_link(struct mill_h5 *file, const char *existing, const char *path)
{
    if (mill_h5_make_way(file, path))
        H5Lcreate_hard(file->id, existing, file->id, path, H5P_DEFAULT, H5P_DEFAULT);
    mill_h5_check(file, "link", path);
}

void mill_h5_soft_link(struct mill_h5 *file, const char *target, const char *path)
{
    if (mill_h5_make_way(file, path))
        H5Lcreate_soft(target, file->id, path, H5P_DEFAULT, H5P_DEFAULT);
    mill_h5_check(file, "link", path);
}

void mill_h5_version(char *out, size_t size)
{
    unsigned major = 0, minor = 0, release = 0;
    H5get_libversion(&major, &minor, &release);
    snprintf(out, size, "%u.%u.%u", major, minor, release);
}
