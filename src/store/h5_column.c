/* Datasets that grow by rows. Single rows are gathered in memory and written a chunk at a time,
 * because one call to HDF5 costs microseconds; a chunk holds about 64 KiB, the compromise between
 * the cost per chunk and the cost of reading one frame; longer rows than
 * LARGEST_CHUNK are cut. Shuffled and deflated at level 1, unless plain. Whole chunks are written,
 * so HDF5 is told to keep none in memory. */
#include "store/h5_internal.h"

#include <stdlib.h>
#include <string.h>

#define CHUNK_BYTES 65536
#define LARGEST_CHUNK 262144 /* [byte] HDF5 needs three times as much to pack one */
#define MAX_ROW_RANK 2

struct mill_h5_column {
    struct mill_h5 *file;        /* NULL once that is closed */
    struct mill_h5_column *next; /* open in the same file */
    hid_t set;
    char *path;
    enum mill_h5_type type;
    int rank;                         /* of a row */
    hsize_t extent[MAX_ROW_RANK + 1]; /* rows in the file, then those of a row */
    size_t row_bytes;
    size_t capacity, gathered; /* [rows] */
    size_t piece;              /* of a row, along its first axis, in one chunk */
    unsigned char *buffer;
};

static size_t choose_chunk(size_t row_bytes)
{
    size_t rows = 1;
    while (2 * rows * row_bytes <= CHUNK_BYTES && rows < CHUNK_BYTES)
        rows *= 2;
    return rows;
}

/* Rows that have a chunk each and are long are cut into equal pieces, the last a little shorter. */
static size_t choose_piece(const struct mill_h5_column *column)
{
    const size_t length = column->rank > 0 ? (size_t)column->extent[1] : 1;
    const size_t pieces =
        column->capacity == 1 ? (column->row_bytes + LARGEST_CHUNK - 1) / LARGEST_CHUNK : 1;
    return pieces > 1 ? (length + pieces - 1) / pieces : length;
}

/* Rows are there only once they are written, so none is filled first; and without filters HDF5 then
 * writes from where the rows lie, where it else would copy them (and lose the copy when a disk is
 * full). */
static hid_t chunked(const struct mill_h5_column *column, bool plain)
{
    const hid_t list = mill_h5_timeless(H5P_DATASET_CREATE);
    hsize_t chunk[MAX_ROW_RANK + 1];
    memcpy(chunk, column->extent, sizeof chunk);
    chunk[0] = column->capacity;
    if (column->rank > 0)
        chunk[1] = column->piece;
    if (list < 0 || H5Pset_chunk(list, column->rank + 1, chunk) < 0 ||
        (plain ? H5Pset_fill_time(list, H5D_FILL_TIME_NEVER) < 0
               : H5Pset_shuffle(list) < 0 || H5Pset_deflate(list, 1) < 0))
        return -1;
    return list;
}

static hid_t without_cache(void)
{
    const hid_t list = H5Pcreate(H5P_DATASET_ACCESS);
    if (list >= 0)
        H5Pset_chunk_cache(list, H5D_CHUNK_CACHE_NSLOTS_DEFAULT, 0, H5D_CHUNK_CACHE_W0_DEFAULT);
    return list;
}

static bool make_set(struct mill_h5_column *column, const struct mill_h5_layout *layout)
{
    hsize_t most[MAX_ROW_RANK + 1];
    hid_t space, list, access;
    bool done;
    memcpy(most, column->extent, sizeof most);
    most[0] = H5S_UNLIMITED;
    space = H5Screate_simple(column->rank + 1, column->extent, most);
    list = chunked(column, layout->plain);
    access = without_cache();
    if (space < 0 || list < 0 || access < 0)
        return false;
    column->set = H5Dcreate2(column->file->id, column->path, mill_h5_file_type(column->type), space,
                             H5P_DEFAULT, list, access);
    done = column->set >= 0 && mill_h5_label(column->set, layout->unit, layout->description);
    if (done) { /* else the error stack must live on until it is read */
        H5Pclose(access);
        H5Pclose(list);
        H5Sclose(space);
    }
    return done;
}

static bool take_up(struct mill_h5_column *column, uint64_t keep, uint64_t *rows)
{
    hsize_t extent[MAX_ROW_RANK + 1];
    const hid_t access = without_cache();
    hid_t space;
    column->set = H5Dopen2(column->file->id, column->path, access);
    if (column->set < 0)
        return false;
    H5Pclose(access);
    space = H5Dget_space(column->set);
    if (H5Sget_simple_extent_ndims(space) != column->rank + 1 ||
        H5Sget_simple_extent_dims(space, extent, NULL) < 0)
        return false;
    H5Sclose(space);
    *rows = extent[0];
    column->extent[0] = *rows < keep ? *rows : keep;
    return H5Dset_extent(column->set, column->extent) >= 0;
}

static struct mill_h5_column *allocate(struct mill_h5 *file, const char *path,
                                       const struct mill_h5_layout *layout)
{
    struct mill_h5_column *column = calloc(1, sizeof *column);
    int i;
    if (!column)
        return NULL;
    column->file = file;
    column->set = -1;
    column->type = layout->type;
    column->rank = layout->rank;
    column->row_bytes = mill_h5_type_size(layout->type);
    for (i = 0; i < layout->rank; i++) {
        column->extent[i + 1] = layout->dims[i];
        column->row_bytes *= layout->dims[i];
    }
    column->capacity = layout->chunk ? layout->chunk : choose_chunk(column->row_bytes);
    column->piece = choose_piece(column);
    column->buffer = malloc(column->capacity * column->row_bytes);
    column->path = malloc(strlen(path) + 1);
    if (!column->buffer || !column->path) {
        mill_h5_column_free(column);
        return NULL;
    }
    strcpy(column->path, path);
    column->next = file->columns;
    file->columns = column;
    return column;
}

enum mill_status mill_h5_column_create(struct mill_h5 *file, const char *path,
                                       const struct mill_h5_layout *layout, uint64_t keep,
                                       struct mill_h5_column **out, struct mill_error *error)
{
    enum mill_status status = mill_h5_parents(file, path, error);
    struct mill_h5_column *column;
    uint64_t rows = 0;
    *out = NULL;
    if (status != MILL_OK)
        return status;
    column = allocate(file, path, layout);
    if (!column)
        return mill_error_set(error, MILL_FAILED, "%s: out of memory for %s", file->path, path);
    if (!(mill_h5_exists(file, path) ? take_up(column, keep, &rows) : make_set(column, layout))) {
        status = mill_h5_fail(file, error, "write", path);
    } else if (rows < keep) {
        status =
            mill_error_set(error, MILL_FAILED,
                           "%s: %s has %llu rows, its checkpoint says %llu: damaged; start "
                           "again with --force",
                           file->path, path, (unsigned long long)rows, (unsigned long long)keep);
    }
    if (status != MILL_OK) {
        mill_h5_column_free(column);
        return status;
    }
    *out = column;
    return MILL_OK;
}

/* Writes a block: `first` of `size`, in rows and along the axes of a row. */
static bool write_block(struct mill_h5_column *column, const hsize_t *first, const hsize_t *size,
                        const void *values)
{
    const hid_t memory = H5Screate_simple(column->rank + 1, size, NULL);
    hid_t place;
    if (memory < 0)
        return false;
    if (column->extent[0] < first[0] + size[0]) {
        column->extent[0] = first[0] + size[0];
        if (H5Dset_extent(column->set, column->extent) < 0)
            return false;
    }
    place = H5Dget_space(column->set);
    if (place < 0 || H5Sselect_hyperslab(place, H5S_SELECT_SET, first, NULL, size, NULL) < 0 ||
        H5Dwrite(column->set, mill_h5_memory_type(column->type), memory, place, H5P_DEFAULT,
                 values) < 0)
        return false;
    H5Sclose(place);
    H5Sclose(memory);
    return true;
}

static enum mill_status write_rows(struct mill_h5_column *column, size_t count, const void *rows,
                                   struct mill_error *error)
{
    const hsize_t first[MAX_ROW_RANK + 1] = {column->extent[0], 0, 0};
    enum mill_status status = mill_h5_check(column->file, error);
    hsize_t size[MAX_ROW_RANK + 1];
    if (status != MILL_OK || count == 0)
        return status;
    memcpy(size, column->extent, sizeof size);
    size[0] = count;
    if (!write_block(column, first, size, rows))
        status = mill_h5_fail(column->file, error, "write", column->path);
    return status;
}

enum mill_status mill_h5_column_append(struct mill_h5_column *column, size_t count,
                                       const void *rows, struct mill_error *error)
{
    const unsigned char *from = rows;
    enum mill_status status = MILL_OK;
    while (status == MILL_OK && count > 0) {
        /* the buffer ends where a chunk does, so that none is packed twice */
        const size_t begun = (size_t)(column->extent[0] % column->capacity);
        const size_t left = column->capacity - begun - column->gathered;
        size_t some = count < left ? count : left;
        if (column->gathered == 0 && count >= left) {
            some += (count - left) / column->capacity * column->capacity;
            status = write_rows(column, some, from, error);
        } else {
            memcpy(column->buffer + column->gathered * column->row_bytes, from,
                   some * column->row_bytes);
            column->gathered += some;
            if (some == left)
                status = mill_h5_column_flush(column, error);
        }
        from += some * column->row_bytes;
        count -= some;
    }
    return status;
}

size_t mill_h5_column_piece(const struct mill_h5_column *column)
{
    return column->piece;
}

enum mill_status mill_h5_column_append_piece(struct mill_h5_column *column, size_t first,
                                             const void *values, struct mill_error *error)
{
    const size_t length = (size_t)column->extent[1], left = length - first;
    if (column->piece == length)
        return mill_h5_column_append(column, 1, values, error);
    const hsize_t at[MAX_ROW_RANK + 1] = {column->extent[0] - (first > 0), first, 0};
    hsize_t size[MAX_ROW_RANK + 1];
    enum mill_status status = mill_h5_check(column->file, error);
    memcpy(size, column->extent, sizeof size);
    size[0] = 1;
    size[1] = column->piece < left ? column->piece : left;
    if (status == MILL_OK && !write_block(column, at, size, values))
        status = mill_h5_fail(column->file, error, "write", column->path);
    return status;
}

uint64_t mill_h5_column_rows(const struct mill_h5_column *column)
{
    return column->extent[0] + column->gathered;
}

enum mill_status mill_h5_column_flush(struct mill_h5_column *column, struct mill_error *error)
{
    const enum mill_status status = write_rows(column, column->gathered, column->buffer, error);
    if (status == MILL_OK)
        column->gathered = 0;
    return status;
}

void mill_h5_orphan_columns(struct mill_h5 *file)
{
    struct mill_h5_column *column, *next;
    for (column = file->columns; column; column = next) {
        next = column->next;
        column->file = NULL;
        column->next = NULL;
    }
    file->columns = NULL;
}

static void take_out(struct mill_h5_column *column)
{
    struct mill_h5_column **at = &column->file->columns;
    while (*at && *at != column)
        at = &(*at)->next;
    if (*at)
        *at = column->next;
}

void mill_h5_column_free(struct mill_h5_column *column)
{
    if (!column)
        return;
    if (column->file) {
        if (column->set >= 0 && column->file->spent == MILL_OK)
            H5Dclose(column->set);
        take_out(column);
    }
    free(column->path);
    free(column->buffer);
    free(column);
}
