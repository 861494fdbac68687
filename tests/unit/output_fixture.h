/* What the tests of output files share: reading them through HDF5 itself. */
#ifndef OUTPUT_FIXTURE_H
#define OUTPUT_FIXTURE_H

#include "store/h5.h"
#include "unit.h"

#include <hdf5.h>
#include <stdio.h>
#include <unistd.h>

static inline hid_t look_open(const char *path)
{
    const hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    ck_assert_msg(file >= 0, "%s does not open", path);
    return file;
}

/* All elements of a dataset, as doubles; *count of them; its shape in dims[rank]. */
static inline double *look(const char *path, const char *name, int rank, hsize_t *dims)
{
    const hid_t file = look_open(path);
    const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    hid_t space;
    double *values;
    ck_assert_msg(set >= 0, "no dataset %s", name);
    space = H5Dget_space(set);
    ck_assert_int_eq(H5Sget_simple_extent_ndims(space), rank);
    H5Sget_simple_extent_dims(space, dims, NULL);
    values = malloc((size_t)(H5Sget_simple_extent_npoints(space) + 1) * sizeof *values);
    ck_assert(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
    H5Sclose(space);
    H5Dclose(set);
    H5Fclose(file);
    return values;
}

/* One element of a one-dimensional dataset, or a scalar. */
static inline double look_at(const char *path, const char *name, int rank, size_t i)
{
    hsize_t dims[8];
    double *values = look(path, name, rank, dims);
    const double value = values[i];
    free(values);
    return value;
}

/* Rows of a dataset of the given rank. */
static inline size_t look_rows(const char *path, const char *name, int rank)
{
    hsize_t dims[8];
    free(look(path, name, rank, dims));
    return (size_t)dims[0];
}

/* A text attribute, or with attribute NULL the text dataset itself; the caller frees it. Fails
 * unless it is a scalar UTF-8 text of variable length. */
static inline char *look_text(const char *path, const char *name, const char *attribute)
{
    const hid_t file = look_open(path);
    const hid_t owner = attribute ? H5Aopen_by_name(file, name, attribute, H5P_DEFAULT, H5P_DEFAULT)
                                  : H5Dopen2(file, name, H5P_DEFAULT);
    hid_t type;
    char *text = NULL, *copy;
    ck_assert_msg(owner >= 0, "no %s of %s", attribute ? attribute : "text", name);
    type = attribute ? H5Aget_type(owner) : H5Dget_type(owner);
    ck_assert(H5Tis_variable_str(type) > 0);
    ck_assert_int_eq(H5Tget_cset(type), H5T_CSET_UTF8);
    if (attribute)
        ck_assert(H5Aread(owner, type, &text) >= 0);
    else
        ck_assert(H5Dread(owner, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &text) >= 0);
    copy = malloc(strlen(text) + 1);
    strcpy(copy, text);
    H5free_memory(text);
    H5Tclose(type);
    H5Oclose(owner);
    H5Fclose(file);
    return copy;
}

static inline void assert_text(const char *path, const char *name, const char *attribute,
                               const char *expected)
{
    char *text = look_text(path, name, attribute);
    ck_assert_str_eq(text, expected);
    free(text);
}

/* Both names lead to one object. */
static inline bool look_same(const char *path, const char *a, const char *b)
{
    const hid_t file = look_open(path);
#if H5_VERSION_GE(1, 12, 0)
    H5O_info2_t one, other;
    ck_assert(H5Oget_info_by_name3(file, a, &one, H5O_INFO_BASIC, H5P_DEFAULT) >= 0);
    ck_assert(H5Oget_info_by_name3(file, b, &other, H5O_INFO_BASIC, H5P_DEFAULT) >= 0);
    const bool same = memcmp(&one.token, &other.token, sizeof one.token) == 0;
#else
    H5O_info_t one, other;
    ck_assert(H5Oget_info_by_name(file, a, &one, H5P_DEFAULT) >= 0);
    ck_assert(H5Oget_info_by_name(file, b, &other, H5P_DEFAULT) >= 0);
    const bool same = one.addr == other.addr;
#endif
    H5Fclose(file);
    return same;
}

#endif
