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
    struct mill_h5 *file;
    struct mill_h5_column *next; /* open in the same file */
    hid_t set;
    char *path;
    enum mill_h5_type type;
    int rank;                         /* of a row */
    hsize_t extent[MAX_ROW_RANK + 1]; /* rows in the file, then those of a row */
    size_t row_bytes;
    size_t capacity, gathered; /* [rows] */
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
        chunk[1] = choose_piece(column);
    if (H5Pset_chunk(list, column->rank + 1, chunk) >= 0 &&
        (plain ? H5Pset_fill_time(list, H5D_FILL_TIME_NEVER) >= 0
               : H5Pset_shuffle(list) >= 0 && H5Pset_deflate(list, 1) >= 0))
        return list;
    mill_h5_release(list);
    return -1;
}

static bool make_set(struct mill_h5_column *column, const struct mill_h5_layout *layout)
{
    struct mill_h5 *file = column->file;
    hsize_t most[MAX_ROW_RANK + 1];
    memcpy(most, column->extent, sizeof most);
    most[0] = H5S_UNLIMITED;
    const hid_t space = H5Screate_simple(column->rank + 1, column->extent, most);
    const hid_t list = chunked(column, layout->plain);
    if (space >= 0 && list >= 0)
        column->set = H5Dcreate2(file->id, column->path, mill_h5_file_type(column->type), space,
                                 H5P_DEFAULT, list, file->access);
    mill_h5_release(list);
    mill_h5_release(space);
    return column->set >= 0 && mill_h5_label(file, column->set, layout->unit, layout->description);
}

static bool take_up(struct mill_h5_column *column, uint64_t keep, uint64_t *rows)
{
    hsize_t extent[MAX_ROW_RANK + 1];
    column->set = H5Dopen2(column->file->id, column->path, column->file->access);
    const hid_t space = column->set >= 0 ? H5Dget_space(column->set) : -1;
    const bool fits = space >= 0 && H5Sget_simple_extent_ndims(space) == column->rank + 1 &&
                      H5Sget_simple_extent_dims(space, extent, NULL) >= 0;
    mill_h5_release(space);
    if (!fits)
        return false;
    *rows = extent[0];
    column->extent[0] = *rows < keep ? *rows : keep;
    return H5Dset_extent(column->set, column->extent) >= 0;
}

/* Makes the dataset, or takes up the one that is there. */
static void open_set(struct mill_h5_column *column, const struct mill_h5_layout *layout,
                     uint64_t keep)
{
    struct mill_h5 *file = column->file;
    uint64_t rows = 0;
    if (!(mill_h5_exists(file, column->path) ? take_up(column, keep, &rows)
                                             : make_set(column, layout)))
        mill_h5_fail(file, "write", column->path);
    if (rows < keep) {
        struct mill_error text;
        mill_error_set(&text, MILL_FAILED,
                       "%s has %llu rows, its checkpoint says %llu: damaged; start again with "
                       "--force",
                       column->path, (unsigned long long)rows, (unsigned long long)keep);
        mill_h5_spend(file, text.text);
    }
}

static void release(struct mill_h5_column *column)
{
    if (!mill_h5_release(column->set))
        mill_h5_fail(column->file, "write", column->path);
    free(column->path);
    free(column->buffer);
    free(column);
}

static struct mill_h5_column *allocate(struct mill_h5 *file, const char *path,
                                       const struct mill_h5_layout *layout)
{
    struct mill_h5_column *column = calloc(1, sizeof *column);
    if (!column)
        return NULL;
    column->file = file;
    column->set = -1;
    column->type = layout->type;
    column->rank = layout->rank;
    column->row_bytes = mill_h5_type_size(layout->type);
    for (int i = 0; i < layout->rank; i++) {
        column->extent[i + 1] = layout->dims[i];
        column->row_bytes *= layout->dims[i];
    }
    column->capacity = layout->chunk ? layout->chunk : choose_chunk(column->row_bytes);
    column->buffer = malloc(column->capacity * column->row_bytes);
    column->path = strdup(path);
    if (column->buffer && column->path)
        return column;
    release(column);
    return NULL;
}

struct mill_h5_column *mill_h5_column_create(struct mill_h5 *file, const char *path,
                                             const struct mill_h5_layout *layout, uint64_t keep)
{
    mill_h5_parents(file, path);
    struct mill_h5_column *column = mill_h5_good(file) ? allocate(file, path, layout) : NULL;
    if (!column) {
        mill_h5_spend(file, "out of memory for a column of rows");
        return NULL;
    }
    column->next = file->columns;
    file->columns = column;
    open_set(column, layout, keep);
    return mill_h5_good(file) ? column : NULL;
}

static bool good(const struct mill_h5_column *column)
{
    return column && mill_h5_good(column->file);
}

static void write_rows(struct mill_h5_column *column, size_t count, const void *rows)
{
    const hsize_t first[MAX_ROW_RANK + 1] = {column->extent[0], 0, 0};
    hsize_t size[MAX_ROW_RANK + 1];
    if (count == 0)
        return;
    memcpy(size, column->extent, sizeof size);
    size[0] = count;
    column->extent[0] += count;
    const bool room = H5Dset_extent(column->set, column->extent) >= 0;
    const hid_t memory = H5Screate_simple(column->rank + 1, size, NULL);
    const hid_t place = room ? H5Dget_space(column->set) : -1;
    const bool done = memory >= 0 && place >= 0 &&
                      H5Sselect_hyperslab(place, H5S_SELECT_SET, first, NULL, size, NULL) >= 0 &&
                      H5Dwrite(column->set, mill_h5_memory_type(column->type), memory, place,
                               H5P_DEFAULT, rows) >= 0;
    mill_h5_release(place);
    mill_h5_release(memory);
    if (!done)
        mill_h5_fail(column->file, "write", column->path);
}

static void flush(struct mill_h5_column *column)
{
    if (good(column))
        write_rows(column, column->gathered, column->buffer);
    if (good(column))
        column->gathered = 0;
}

void mill_h5_column_append(struct mill_h5_column *column, size_t count, const void *rows)
{
    const unsigned char *from = rows;
    while (good(column) && count > 0) {
        /* the buffer ends where a chunk does, so that none is packed twice */
        const size_t begun = (size_t)(column->extent[0] % column->capacity);
        const size_t left = column->capacity - begun - column->gathered;
        size_t some = count < left ? count : left;
        if (column->gathered == 0 && count >= left) {
            some += (count - left) / column->capacity * column->capacity;
            write_rows(column, some, from);
        } else {
            memcpy(column->buffer + column->gathered * column->row_bytes, from,
                   some * column->row_bytes);
            column->gathered += some;
            if (some == left)
                flush(column);
        }
        from += some * column->row_bytes;
        count -= some;
    }
}

uint64_t mill_h5_column_rows(const struct mill_h5_column *column)
{
    return column ? column->extent[0] + column->gathered : 0;
}

void mill_h5_flush_columns(struct mill_h5 *file)
{
    for (struct mill_h5_column *column = file->columns; column; column = column->next)
        flush(column);
}

void mill_h5_free_columns(struct mill_h5 *file)
{
    while (file->columns) {
        struct mill_h5_column *column = file->columns;
        file->columns = column->next;
        release(column);
    }
}

void mill_h5_column_close(struct mill_h5_column *column)
{
    if (!column)
        return;
    struct mill_h5_column **at = &column->file->columns;
    while (*at != column)
        at = &(*at)->next;
    flush(column);
    *at = column->next;
    release(column);
}
