/* What the tests of the HDF5 door share: a file to write, and columns that count up. */
#ifndef H5_FIXTURE_H
#define H5_FIXTURE_H

#include "output_fixture.h"

static inline struct mill_h5 *new_file(struct fixture *f)
{
    struct mill_h5 *file = NULL;
    struct mill_error error;
    fixture_init(f);
    ck_assert_msg(mill_h5_create(f->path, MILL_H5_NEW, &file, &error) == MILL_OK, "%s", error.text);
    return file;
}

static inline void close_file(struct mill_h5 *file)
{
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
}

/* appends first..end - 1, one by one or in blocks of 7 */
static inline void append_range(struct mill_h5_column *column, int64_t first, int64_t end,
                                bool blocks)
{
    int64_t rows[7];
    size_t n = 0;
    for (int64_t k = first; k < end; k++) {
        rows[n++] = k;
        if (blocks && n < 7 && k + 1 < end)
            continue;
        mill_h5_column_append(column, n, rows);
        n = 0;
    }
}

static inline void assert_counts_up(const char *path, const char *name, size_t rows)
{
    hsize_t dims[1];
    double *read = look(path, name, 1, dims);
    size_t i, wrong = 0;
    ck_assert_uint_eq(dims[0], rows);
    for (i = 0; i < rows; i++)
        wrong += read[i] != (double)i;
    ck_assert_uint_eq(wrong, 0);
    free(read);
}

/* Scalars, for short call sites */
static inline void write_double(struct mill_h5 *file, const char *path, double value,
                                const char *unit, const char *description)
{
    mill_h5_write(file, path, MILL_H5_F64, 0, NULL, &value, unit, description);
}

static inline void write_count(struct mill_h5 *file, const char *path, uint64_t value,
                               const char *description)
{
    mill_h5_write(file, path, MILL_H5_U64, 0, NULL, &value, "1", description);
}

#endif
