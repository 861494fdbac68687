/* What the tests of the HDF5 door share: a file to write, and columns that count up. */
#ifndef H5_FIXTURE_H
#define H5_FIXTURE_H

#include "output_fixture.h"

static char path[64];
static struct mill_h5 *file; /* open from the begin of a test on, NULL once it is closed */

static inline void open_file(enum mill_h5_open how)
{
    struct mill_error error;
    ck_assert_msg(mill_h5_create(path, how, &file, &error) == MILL_OK, "%s", error.text);
}

static inline void open_new(void)
{
    snprintf(path, sizeof path, "/tmp/millsim_test_%ld.h5", (long)getpid());
    unlink(path);
    open_file(MILL_H5_NEW);
}

static inline void close_file(void)
{
    ck_assert_int_eq(mill_h5_close(file, NULL), MILL_OK);
    file = NULL;
}

/* error: where it is told; may be NULL */
static inline void close_failed(struct mill_error *error)
{
    ck_assert_int_eq(mill_h5_close(file, error), MILL_FAILED);
    file = NULL;
}

static inline void abandon_file(void)
{
    if (file)
        mill_h5_abandon(file);
    file = NULL;
}

static inline void remove_file(void)
{
    abandon_file();
    unlink(path);
}

/* A column of whole numbers that has `rows` rows already */
static inline struct mill_h5_column *open_rows(const char *name, size_t chunk, uint64_t rows)
{
    const struct mill_h5_layout layout = {MILL_H5_I64, 0, {0, 0}, chunk, "1", "rows", false};
    return mill_h5_column_create(file, name, &layout, rows);
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

static inline void assert_counts_up(const char *name, size_t rows)
{
    hsize_t dims[1];
    double *read = look(path, name, 1, dims);
    ck_assert_uint_eq(dims[0], rows);
    for (size_t i = 0; i < rows; i++)
        ck_assert(read[i] == (double)i);
    free(read);
}

/* Scalars, for short call sites */
static inline void write_double(const char *name, double value, const char *unit)
{
    mill_h5_write(file, name, MILL_H5_F64, 0, NULL, &value, unit, "-");
}

static inline void write_count(const char *name, uint64_t value)
{
    mill_h5_write(file, name, MILL_H5_U64, 0, NULL, &value, "1", "-");
}

#endif
