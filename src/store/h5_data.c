/* Datasets written in one piece, each with its unit and description; and views, which show the
 * elements of another dataset of the file under another shape (HDF5 virtual datasets, since 1.10).
 */
#include "store/h5_internal.h"

#include <stdlib.h>
#include <string.h>

#define MAX_RANK 8
#define CONVERTED                                                                                  \
    4096 /* [byte] at a time, of texts: HDF5's own 1 MiB is zeroed for each of them                \
          */

hid_t mill_h5_memory_type(enum mill_h5_type type)
{
    const hid_t types[MILL_H5_TYPES] = {H5T_NATIVE_DOUBLE, H5T_NATIVE_FLOAT,  H5T_NATIVE_INT64,
                                        H5T_NATIVE_INT32,  H5T_NATIVE_UINT64, H5T_NATIVE_UINT8};
    return types[type];
}

hid_t mill_h5_file_type(enum mill_h5_type type)
{
    const hid_t types[MILL_H5_TYPES] = {H5T_IEEE_F64LE, H5T_IEEE_F32LE, H5T_STD_I64LE,
                                        H5T_STD_I32LE,  H5T_STD_U64LE,  H5T_STD_U8LE};
    return types[type];
}

size_t mill_h5_type_size(enum mill_h5_type type)
{
    static const size_t size[MILL_H5_TYPES] = {8, 4, 8, 4, 8, 1};
    return size[type];
}

hid_t mill_h5_text_type(void)
{
    const hid_t type = H5Tcopy(H5T_C_S1);
    if (type >= 0 &&
        (H5Tset_size(type, H5T_VARIABLE) < 0 || H5Tset_cset(type, H5T_CSET_UTF8) < 0)) {
        H5Tclose(type);
        return -1;
    }
    return type;
}

static void to_extent(int rank, const size_t *dims, hsize_t *extent)
{
    int i;
    for (i = 0; i < rank; i++)
        extent[i] = dims[i];
}

static hid_t make_space(int rank, const size_t *dims)
{
    hsize_t extent[MAX_RANK];
    if (rank == 0)
        return H5Screate(H5S_SCALAR);
    to_extent(rank, dims, extent);
    return H5Screate_simple(rank, extent, NULL);
}

/* Makes the dataset with its labels and, where values is not NULL, its content. */
static enum mill_status store(struct mill_h5 *file, const char *path, hid_t file_type,
                              hid_t memory_type, hid_t space, hid_t list, const void *values,
                              const char *unit, const char *description, struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    const hid_t transfer = H5Pcreate(H5P_DATASET_XFER);
    hid_t set = -1;
    H5Pset_buffer(transfer, CONVERTED, NULL, NULL);
    if (space >= 0 && list >= 0 && file_type >= 0)
        set = H5Dcreate2(file->id, path, file_type, space, H5P_DEFAULT, list, H5P_DEFAULT);
    if (set < 0 || !mill_h5_label(set, unit, description) ||
        (values && H5Sget_simple_extent_npoints(space) > 0 &&
         H5Dwrite(set, memory_type, H5S_ALL, H5S_ALL, transfer, values) < 0))
        status = mill_h5_fail(file, error, "write", path);
    if (set >= 0 && H5Dclose(set) < 0 && status == MILL_OK)
        status = mill_h5_fail(file, error, "write", path);
    H5Pclose(transfer);
    return status;
}

static enum mill_status make_way(struct mill_h5 *file, const char *path, struct mill_error *error)
{
    enum mill_status status = mill_h5_parents(file, path, error);
    return status == MILL_OK ? mill_h5_remove(file, path, error) : status;
}

enum mill_status mill_h5_write(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                               int rank, const size_t *dims, const void *values, const char *unit,
                               const char *description, struct mill_error *error)
{
    enum mill_status status = make_way(file, path, error);
    hid_t space, list;
    if (status != MILL_OK)
        return status;
    space = make_space(rank, dims);
    list = mill_h5_timeless(H5P_DATASET_CREATE);
    status = store(file, path, mill_h5_file_type(type), mill_h5_memory_type(type), space, list,
                   values, unit, description, error);
    H5Pclose(list);
    H5Sclose(space);
    return status;
}

/* Writes `count` bytes to, or reads them from, an array of U8 at `first`. */
static bool move_bytes(hid_t set, bool write, size_t first, size_t count, void *bytes)
{
    const hsize_t from = first, length = count;
    const hid_t place = H5Dget_space(set), memory = H5Screate_simple(1, &length, NULL);
    const hid_t type = H5T_NATIVE_UINT8;
    bool good = place >= 0 && memory >= 0 && H5Sget_simple_extent_ndims(place) == 1 &&
                H5Sselect_hyperslab(place, H5S_SELECT_SET, &from, NULL, &length, NULL) >= 0;
    if (good && write)
        good = H5Dwrite(set, type, memory, place, H5P_DEFAULT, bytes) >= 0;
    else if (good)
        good = H5Dread(set, type, memory, place, H5P_DEFAULT, bytes) >= 0;
    if (!good) /* the error stack lives on until it is read */
        return false;
    H5Sclose(memory);
    H5Sclose(place);
    return true;
}

enum mill_status mill_h5_write_parts(struct mill_h5 *file, const char *path,
                                     const struct mill_part *part, size_t parts,
                                     const char *description, struct mill_error *error)
{
    const size_t size = mill_parts_size(part, parts);
    enum mill_status status =
        mill_h5_write(file, path, MILL_H5_U8, 1, &size, NULL, "byte", description, error);
    if (status != MILL_OK)
        return status;
    const hid_t set = H5Dopen2(file->id, path, H5P_DEFAULT);
    bool good = set >= 0;
    for (size_t i = 0, at = 0; good && i < parts; at += part[i++].bytes) {
        if (part[i].bytes > 0)
            good = move_bytes(set, true, at, part[i].bytes, part[i].at);
    }
    if (!good)
        status = mill_h5_fail(file, error, "write", path);
    if (set >= 0 && H5Dclose(set) < 0 && status == MILL_OK)
        status = mill_h5_fail(file, error, "write", path);
    return status;
}

enum mill_status mill_h5_write_double(struct mill_h5 *file, const char *path, double value,
                                      const char *unit, const char *description,
                                      struct mill_error *error)
{
    return mill_h5_write(file, path, MILL_H5_F64, 0, NULL, &value, unit, description, error);
}

enum mill_status mill_h5_write_count(struct mill_h5 *file, const char *path, uint64_t value,
                                     const char *description, struct mill_error *error)
{
    return mill_h5_write(file, path, MILL_H5_U64, 0, NULL, &value, "1", description, error);
}

enum mill_status mill_h5_write_text(struct mill_h5 *file, const char *path, const char *text,
                                    const char *description, struct mill_error *error)
{
    enum mill_status status = make_way(file, path, error);
    hid_t type, space, list;
    if (status != MILL_OK)
        return status;
    type = mill_h5_text_type();
    space = H5Screate(H5S_SCALAR);
    list = mill_h5_timeless(H5P_DATASET_CREATE);
    status = store(file, path, type, type, space, list, &text, "", description, error);
    H5Pclose(list);
    H5Sclose(space);
    H5Tclose(type);
    return status;
}

enum mill_status mill_h5_view(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                              int rank, const size_t *dims, const char *source, int source_rank,
                              const size_t *source_dims, const char *unit, const char *description,
                              struct mill_error *error)
{
    enum mill_status status = make_way(file, path, error);
    hid_t space, origin, list;
    if (status != MILL_OK)
        return status;
    space = make_space(rank, dims);
    origin = make_space(source_rank, source_dims);
    list = mill_h5_timeless(H5P_DATASET_CREATE);
    /* "." is this file, whatever its name will be */
    if (space < 0 || origin < 0 || list < 0 || H5Pset_virtual(list, space, ".", source, origin) < 0)
        status = mill_h5_fail(file, error, "write", path);
    else
        status = store(file, path, mill_h5_file_type(type), -1, space, list, NULL, unit,
                       description, error);
    H5Pclose(list);
    H5Sclose(origin);
    H5Sclose(space);
    return status;
}

/* A dataset opened for reading, and how many elements it has; -1 on failure. */
static hid_t open_set(struct mill_h5 *file, const char *path, size_t *count)
{
    const hid_t set = mill_h5_exists(file, path) ? H5Dopen2(file->id, path, H5P_DEFAULT) : -1;
    const hid_t space = set >= 0 ? H5Dget_space(set) : -1;
    const hssize_t n = space >= 0 ? H5Sget_simple_extent_npoints(space) : -1;
    if (space >= 0)
        H5Sclose(space);
    if (n < 0 && set >= 0)
        H5Dclose(set);
    *count = n < 0 ? 0 : (size_t)n;
    return n < 0 ? -1 : set;
}

enum mill_status mill_h5_read_text(struct mill_h5 *file, const char *path, char **text,
                                   struct mill_error *error)
{
    size_t count;
    const hid_t set = open_set(file, path, &count);
    const hid_t type = mill_h5_text_type();
    char *held = NULL; /* HDF5's own memory */
    *text = NULL;
    if (set >= 0 && count == 1 && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &held) >= 0 &&
        held && (*text = malloc(strlen(held) + 1)))
        strcpy(*text, held);
    if (held)
        H5free_memory(held);
    H5Tclose(type);
    if (set >= 0)
        H5Dclose(set);
    return *text ? MILL_OK : mill_h5_fail(file, error, "read", path);
}

/* Are its elements bytes? */
static bool holds_bytes(hid_t set)
{
    const hid_t type = H5Dget_type(set);
    const bool so = type >= 0 && H5Tequal(type, mill_h5_file_type(MILL_H5_U8)) > 0;
    if (type >= 0)
        H5Tclose(type);
    return so;
}

enum mill_status mill_h5_count_bytes(struct mill_h5 *file, const char *path, size_t *count,
                                     struct mill_error *error)
{
    const hid_t set = open_set(file, path, count);
    const bool good = set >= 0 && holds_bytes(set);
    if (set >= 0)
        H5Dclose(set);
    return good ? MILL_OK : mill_h5_fail(file, error, "read", path);
}

enum mill_status mill_h5_read_bytes(struct mill_h5 *file, const char *path, size_t first,
                                    size_t count, void *bytes, struct mill_error *error)
{
    size_t there;
    const hid_t set = open_set(file, path, &there);
    const bool good =
        set >= 0 && first + count <= there && move_bytes(set, false, first, count, bytes);
    const enum mill_status status = good ? MILL_OK : mill_h5_fail(file, error, "read", path);
    if (set >= 0)
        H5Dclose(set);
    return status;
}
