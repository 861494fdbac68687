/* Datasets written in one piece, each with its unit and description; and views, which show the
 * elements of another dataset of the file under another shape (HDF5 virtual datasets, since 1.10).
 */
#include "store/h5_internal.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum {
    MAX_RANK = 8,
    CHECKED = 1 << 20 /* [byte] with one checksum, at most: HDF5 copies so many at a time */
};

static hid_t make_space(int rank, const size_t *dims)
{
    hsize_t extent[MAX_RANK];
    assert(rank <= MAX_RANK);
    for (int i = 0; i < rank; i++)
        extent[i] = dims[i];
    return rank == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(rank, extent, NULL);
}

/* Makes the dataset with its labels and, where values is not NULL, its content. Closes space and
 * list, which may be invalid. */
static void store(struct mill_h5 *file, const char *path, hid_t file_type, hid_t memory_type,
                  hid_t space, hid_t list, const void *values, const char *unit,
                  const char *description)
{
    hid_t set = -1;
    if (mill_h5_make_way(file, path) && space >= 0 && list >= 0)
        set = H5Dcreate2(file->id, path, file_type, space, H5P_DEFAULT, list, file->access);
    const bool done = set >= 0 && mill_h5_label(file, set, unit, description) &&
                      (!values || H5Sget_simple_extent_npoints(space) == 0 ||
                       H5Dwrite(set, memory_type, H5S_ALL, H5S_ALL, file->transfer, values) >= 0);
    if (!mill_h5_release(set) || !done)
        mill_h5_fail(file, "write", path);
    mill_h5_release(list);
    mill_h5_release(space);
}

void mill_h5_write(struct mill_h5 *file, const char *path, enum mill_h5_type type, int rank,
                   const size_t *dims, const void *values, const char *unit,
                   const char *description)
{
    store(file, path, mill_h5_file_type(type), mill_h5_memory_type(type), make_space(rank, dims),
          mill_h5_timeless(H5P_DATASET_CREATE), values, unit, description);
}

/* Chunks as long as may be, cut along the first axes: equal pieces, the last a little shorter. */
static hid_t checked(enum mill_h5_type type, int rank, const size_t *dims)
{
    const hid_t list = mill_h5_timeless(H5P_DATASET_CREATE);
    hsize_t chunk[MAX_RANK];
    size_t bytes = mill_h5_type_size(type);
    for (int i = 0; i < rank; i++)
        bytes *= dims[i];
    if (bytes == 0)
        return list; /* HDF5 makes no chunks of nothing */
    for (int i = 0; i < rank; i++) {
        const size_t row = bytes / dims[i], most = row < CHECKED ? CHECKED / row : 1;
        const size_t pieces = (dims[i] + most - 1) / most;
        chunk[i] = (dims[i] + pieces - 1) / pieces;
        bytes = row * (size_t)chunk[i];
    }
    if (H5Pset_chunk(list, rank, chunk) >= 0 && H5Pset_fletcher32(list) >= 0 &&
        H5Pset_fill_time(list, H5D_FILL_TIME_NEVER) >= 0)
        return list;
    mill_h5_release(list);
    return -1;
}

void mill_h5_write_checked(struct mill_h5 *file, const char *path, enum mill_h5_type type, int rank,
                           const size_t *dims, const void *values, const char *description)
{
    assert(rank > 0);
    mill_h5_flush_columns(file);
    store(file, path, mill_h5_file_type(type), mill_h5_memory_type(type), make_space(rank, dims),
          checked(type, rank, dims), values, "", description);
}

void mill_h5_write_text(struct mill_h5 *file, const char *path, const char *text,
                        const char *description)
{
    store(file, path, file->text, file->text, make_space(0, NULL),
          mill_h5_timeless(H5P_DATASET_CREATE), &text, "", description);
}

void mill_h5_view(struct mill_h5 *file, const char *path, enum mill_h5_type type, int rank,
                  const size_t *dims, const char *source, int source_rank,
                  const size_t *source_dims, const char *unit, const char *description)
{
    const hid_t space = make_space(rank, dims), origin = make_space(source_rank, source_dims);
    const hid_t list = mill_h5_timeless(H5P_DATASET_CREATE);
    /* "." is this file, whatever its name will be */
    if (H5Pset_virtual(list, space, ".", source, origin) < 0)
        mill_h5_fail(file, "write", path);
    mill_h5_release(origin);
    store(file, path, mill_h5_file_type(type), -1, space, list, NULL, unit, description);
}

/* A dataset opened for reading, and how many elements it has; -1 on failure. */
static hid_t open_set(struct mill_h5 *file, const char *path, size_t *count)
{
    const bool there = mill_h5_good(file) && mill_h5_exists(file, path);
    const hid_t set = there ? H5Dopen2(file->id, path, H5P_DEFAULT) : -1;
    const hid_t space = set >= 0 ? H5Dget_space(set) : -1;
    const hssize_t n = space >= 0 ? H5Sget_simple_extent_npoints(space) : -1;
    mill_h5_release(space);
    *count = n < 0 ? 0 : (size_t)n;
    if (n >= 0)
        return set;
    mill_h5_release(set);
    return -1;
}

enum mill_status mill_h5_read_text(struct mill_h5 *file, const char *path, char **text,
                                   struct mill_error *error)
{
    size_t count;
    const hid_t set = open_set(file, path, &count);
    char *held = NULL; /* HDF5's own memory */
    *text = NULL;
    if (set >= 0 && count == 1 &&
        H5Dread(set, file->text, H5S_ALL, H5S_ALL, H5P_DEFAULT, &held) >= 0 && held)
        *text = strdup(held);
    if (held)
        H5free_memory(held);
    mill_h5_release(set);
    if (!*text)
        mill_h5_fail(file, "read", path);
    return mill_h5_status(file, error);
}

/* Are its elements of that type? */
static bool holds(hid_t set, enum mill_h5_type type)
{
    const hid_t there = H5Dget_type(set);
    const bool so = there >= 0 && H5Tequal(there, mill_h5_file_type(type)) > 0;
    mill_h5_release(there);
    return so;
}

/* The file is spent, for the dataset is not as it must be. */
static void find_damaged(struct mill_h5 *file, const char *path, const char *how)
{
    struct mill_error text;
    mill_error_set(&text, MILL_FAILED, "damaged: %s %s", path, how);
    mill_h5_spend(file, text.text);
}

enum mill_status mill_h5_read(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                              size_t count, void *values, struct mill_error *error)
{
    size_t there;
    const hid_t set = open_set(file, path, &there), memory = mill_h5_memory_type(type);
    if (set < 0)
        find_damaged(file, path, "is missing");
    else if (!holds(set, type))
        find_damaged(file, path, "is of another type");
    else if (there != count)
        find_damaged(file, path, "is of another length");
    else if (count > 0 && H5Dread(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
        find_damaged(file, path, "cannot be read, or its checksum is wrong");
    mill_h5_release(set);
    return mill_h5_status(file, error);
}
