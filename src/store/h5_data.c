/* Attributes and datasets. There are three kinds of datasets, each with unit and description: those
 * written in one piece; views, which show the elements of another dataset in another shape (HDF5
 * virtual datasets, since 1.10); and columns, which gather single rows in memory and write whole
 * chunks, because one call to HDF5 costs microseconds. A chunk holds about 64 KiB, between the cost
 * of a chunk and that of reading a frame; a row beyond LARGEST_CHUNK is divided. Texts are UTF-8 of
 * variable length: h5py turns only these into str, and MDAnalysis compares the unit with one. */
#include "store/h5_internal.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum {
    MAX_RANK = 8,
    CHECKED = 1 << 20, /* [byte] for one checksum, at most: HDF5 copies this much at a time */
    PACKED = 1 << 18,  /* [byte] from this size on, arrays of three or more dimensions are packed */
    CHUNK = 65536,
    CHUNK_ROWS = 1024,     /* at most: HDF5 compresses whole chunks, also in a short run */
    LARGEST_CHUNK = 262144 /* [byte] HDF5 needs three times as much to compress a chunk */
};

/* Types in the file and in memory. The caller closes neither. */
struct types {
    hid_t kept, held;
};

static struct types types_of(const struct mill_h5 *file, enum mill_h5_type type)
{
    const struct types all[] = {
        [MILL_H5_F64] = {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE},
        [MILL_H5_F32] = {H5T_IEEE_F32LE, H5T_NATIVE_FLOAT},
        [MILL_H5_I64] = {H5T_STD_I64LE, H5T_NATIVE_INT64},
        [MILL_H5_I32] = {H5T_STD_I32LE, H5T_NATIVE_INT32},
        [MILL_H5_U64] = {H5T_STD_U64LE, H5T_NATIVE_UINT64},
        [MILL_H5_U8] = {H5T_STD_U8LE, H5T_NATIVE_UINT8},
        [MILL_H5_TEXT] = {file->text, file->text},
    };
    return all[type];
}

static hid_t make_space(int rank, const size_t *dims)
{
    hsize_t extent[MAX_RANK];
    assert(rank <= MAX_RANK);
    for (int i = 0; i < rank; i++)
        extent[i] = dims[i];
    return rank == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(rank, extent, NULL);
}

/* ---- attributes ---- */

/* count 0: writes a scalar */
static void put(hid_t in, const char *name, struct types types, size_t count, const void *values)
{
    const hid_t space = make_space(count > 0, &count);
    const hid_t attribute = H5Acreate2(in, name, types.kept, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, types.held, values);
    mill_h5_release(attribute);
    mill_h5_release(space);
}

static void attach(struct mill_h5 *file, const char *object, const char *name, struct types types,
                   size_t count, const void *values)
{
    if (file->status != MILL_OK)
        return;
    const char *last;
    const hid_t in = mill_h5_enter(file, object, &last), owner = H5Oopen(in, last, H5P_DEFAULT);
    if (H5Aexists(owner, name) > 0)
        H5Adelete(owner, name);
    put(owner, name, types, count, values);
    mill_h5_release(owner);
    mill_h5_check(file, "write the attributes of", object);
}

void mill_h5_attribute(struct mill_h5 *file, const char *object, const char *name,
                       enum mill_h5_type type, size_t count, const void *values)
{
    attach(file, object, name, types_of(file, type), count, values);
}

void mill_h5_attribute_ascii(struct mill_h5 *file, const char *object, const char *name,
                             const char *text)
{
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, strlen(text));
    H5Tset_strpad(type, H5T_STR_NULLPAD);
    attach(file, object, name, (struct types){type, type}, 0, text);
    mill_h5_release(type);
}

/* ---- datasets in one piece ---- */

/* Makes an empty dataset with unit and description; closes space and list. < 0: file is spent */
static hid_t make(struct mill_h5 *file, const char *path, struct types types, hid_t space,
                  hid_t list, const char *unit, const char *description)
{
    const struct types text = types_of(file, MILL_H5_TEXT);
    hid_t set = -1;
    const char *name;
    const hid_t in = mill_h5_make_way(file, path, &name);
    if (in >= 0) {
        set = H5Dcreate2(in, name, types.kept, space, H5P_DEFAULT, list, H5P_DEFAULT);
        put(set, "unit", text, 0, &unit);
        put(set, "description", text, 0, &description);
    }
    mill_h5_release(list);
    mill_h5_release(space);
    mill_h5_check(file, "write", path);
    return set;
}

/* Makes a dataset, writes its values and closes it. values: NULL for a view. */
static void store(struct mill_h5 *file, const char *path, struct types types, hid_t space,
                  hid_t list, const void *values, const char *unit, const char *description)
{
    const hid_t set = make(file, path, types, space, list, unit, description);
    if (values)
        H5Dwrite(set, types.held, H5S_ALL, H5S_ALL, file->transfer, values);
    mill_h5_release(set);
    mill_h5_check(file, "write", path);
}

/* Properties of a dataset in one piece: large histograms of many pairs are mostly zeros, so they
 * are deflated, in chunks of the last dimensions. */
static hid_t packed(size_t size, int rank, const size_t *dims)
{
    hsize_t chunk[MAX_RANK];
    if (!dims || rank < 3)
        return -1;
    for (int i = rank; i-- > 0; size *= dims[i])
        chunk[i] = size * dims[i] <= LARGEST_CHUNK ? dims[i] : 1;
    if (size < PACKED)
        return -1;
    const hid_t list = mill_h5_timeless(H5P_DATASET_CREATE);
    H5Pset_chunk(list, rank, chunk);
    H5Pset_shuffle(list);
    H5Pset_deflate(list, 1);
    return list;
}

void mill_h5_write(struct mill_h5 *file, const char *path, enum mill_h5_type type, int rank,
                   const size_t *dims, const void *values, const char *unit,
                   const char *description)
{
    const struct types types = types_of(file, type);
    hid_t list = packed(H5Tget_size(types.held), rank, dims);
    if (list < 0) {
        H5Iinc_ref(file->simple); /* it is released with the dataset */
        list = file->simple;
    }
    store(file, path, types, make_space(rank, dims), list, values, unit, description);
}

void mill_h5_write_text(struct mill_h5 *file, const char *path, const char *text,
                        const char *description)
{
    mill_h5_write(file, path, MILL_H5_TEXT, 0, NULL, &text, "", description);
}

/* Divides `length` elements of `bytes` in all into equal pieces of at most `most` bytes; the last
 * one may be shorter. Returns the length of a piece. */
static hsize_t piece(size_t length, size_t bytes, size_t most)
{
    const size_t pieces = (bytes + most - 1) / most;
    return pieces > 1 ? (length + pieces - 1) / pieces : length;
}

void mill_h5_write_checked(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                           size_t count, const void *values, const char *description)
{
    const struct types types = types_of(file, type);
    const hid_t list = mill_h5_timeless(H5P_DATASET_CREATE);
    const hsize_t chunk = piece(count, count * H5Tget_size(types.held), CHECKED);
    if (count > 0) { /* HDF5 cannot make chunks of 0 elements */
        H5Pset_chunk(list, 1, &chunk);
        H5Pset_fletcher32(list);
        H5Pset_fill_time(list, H5D_FILL_TIME_NEVER);
    }
    mill_h5_flush_columns(file);
    store(file, path, types, make_space(1, &count), list, values, "", description);
}

void mill_h5_view(struct mill_h5 *file, const char *path, enum mill_h5_type type, int rank,
                  const size_t *dims, const char *source, int source_rank,
                  const size_t *source_dims, const char *unit, const char *description)
{
    const hid_t space = make_space(rank, dims), origin = make_space(source_rank, source_dims);
    const hid_t list = mill_h5_timeless(H5P_DATASET_CREATE);
    /* "." means this file, also under a new name */
    H5Pset_virtual(list, space, ".", source, origin);
    mill_h5_check(file, "write", path);
    mill_h5_release(origin);
    store(file, path, types_of(file, type), space, list, NULL, unit, description);
}

/* ---- reading ---- */

/* Opens a dataset for reading and counts its elements. Negative: there is none. */
static hid_t look(struct mill_h5 *file, const char *path, size_t *count)
{
    if (!mill_h5_exists(file, path))
        return -1;
    const hid_t set = H5Dopen2(file->id, path, H5P_DEFAULT), space = H5Dget_space(set);
    *count = (size_t)H5Sget_simple_extent_npoints(space);
    mill_h5_release(space);
    return set;
}

enum mill_status mill_h5_read_text(struct mill_h5 *file, const char *path, char **text,
                                   struct mill_error *error)
{
    size_t count = 0;
    const hid_t set = look(file, path, &count);
    char *held = NULL; /* memory of HDF5 */
    if (set >= 0 && count == 1)
        H5Dread(set, file->text, H5S_ALL, H5S_ALL, H5P_DEFAULT, &held);
    *text = held ? strdup(held) : NULL;
    H5free_memory(held);
    mill_h5_release(set);
    if (!*text)
        mill_h5_fail(file, "read", path, NULL);
    return mill_h5_status(file, error);
}

enum mill_status mill_h5_read(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                              size_t count, void *values, struct mill_error *error)
{
    const struct types types = types_of(file, type);
    size_t there = 0;
    const hid_t set = look(file, path, &there), kept = set >= 0 ? H5Dget_type(set) : -1;
    const char *wrong = NULL;
    if (set < 0)
        wrong = "is missing";
    else if (H5Tequal(kept, types.kept) <= 0)
        wrong = "is of another type";
    else if (there != count)
        wrong = "is of another length";
    else if (count > 0 && H5Dread(set, types.held, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
        wrong = "cannot be read, or its checksum is wrong";
    mill_h5_release(kept);
    mill_h5_release(set);
    if (wrong) {
        struct mill_error text;
        mill_error_set(&text, MILL_FAILED, "damaged: %s %s", path, wrong);
        mill_h5_spend(file, text.text);
    }
    return mill_h5_status(file, error);
}

/* ---- columns ---- */

struct mill_h5_column {
    struct mill_h5 *file;
    struct mill_h5_column *next; /* next open column of the file */
    hid_t set;
    struct types types;
    int rank;          /* of the dataset */
    hsize_t extent[3]; /* rows in the file, then the dimensions of a row */
    size_t row_bytes;
    size_t capacity, gathered; /* [rows] */
    unsigned char *buffer;
    char path[];
};

static bool good(const struct mill_h5_column *column)
{
    return column && column->file->status == MILL_OK;
}

/* Makes the dataset of a new column, without rows. Space for rows exists only once they are
 * written, so plain rows need no fill. Without fill and filters HDF5 writes rows directly from the
 * caller's memory. Otherwise it would copy them, and lose the copy when the disk is full. */
static hid_t make_rows(struct mill_h5_column *column, const struct mill_h5_layout *layout)
{
    const hid_t list = mill_h5_timeless(H5P_DATASET_CREATE);
    const size_t bytes = column->capacity * column->row_bytes;
    const hsize_t *row = column->extent, most[] = {H5S_UNLIMITED, row[1], row[2]};
    const hsize_t chunk[] = {column->capacity, piece(row[1], bytes, LARGEST_CHUNK), row[2]};
    H5Pset_chunk(list, column->rank, chunk);
    if (layout->plain) {
        H5Pset_fill_time(list, H5D_FILL_TIME_NEVER);
    } else {
        H5Pset_shuffle(list);
        H5Pset_deflate(list, 1);
    }
    return make(column->file, column->path, column->types,
                H5Screate_simple(column->rank, column->extent, most), list, layout->unit,
                layout->description);
}

/* Makes the dataset, or opens an existing one. */
static void open_rows(struct mill_h5_column *c, const struct mill_h5_layout *layout, uint64_t keep)
{
    struct mill_h5 *file = c->file;
    hsize_t there[3] = {0};
    c->set = mill_h5_exists(file, c->path) ? H5Dopen2(file->id, c->path, H5P_DEFAULT)
                                           : make_rows(c, layout);
    const hid_t space = H5Dget_space(c->set);
    if (H5Sget_simple_extent_ndims(space) == c->rank)
        H5Sget_simple_extent_dims(space, there, NULL);
    else
        mill_h5_fail(file, "write", c->path, NULL);
    mill_h5_release(space);
    if (there[0] < keep) {
        struct mill_error text;
        mill_error_set(&text, MILL_FAILED,
                       "%s has %llu rows, its checkpoint says %llu: damaged; start again with "
                       "--force",
                       c->path, (unsigned long long)there[0], (unsigned long long)keep);
        mill_h5_spend(file, text.text);
    }
    c->extent[0] = keep;
    if (file->status == MILL_OK)
        H5Dset_extent(c->set, c->extent);
    mill_h5_check(file, "write", c->path);
}

struct mill_h5_column *mill_h5_column_create(struct mill_h5 *file, const char *path,
                                             const struct mill_h5_layout *layout, uint64_t keep)
{
    struct mill_h5_column *column =
        file->status == MILL_OK ? calloc(1, sizeof *column + strlen(path) + 1) : NULL;
    if (column) {
        const struct types types = types_of(file, layout->type);
        *column = (struct mill_h5_column){.file = file,
                                          .next = file->columns,
                                          .set = -1,
                                          .types = types,
                                          .rank = layout->rank + 1,
                                          .row_bytes = H5Tget_size(types.held),
                                          .capacity = 1};
        strcpy(column->path, path);
        file->columns = column;
        for (int i = 0; i < layout->rank; i++) {
            column->extent[i + 1] = layout->dims[i];
            column->row_bytes *= layout->dims[i];
        }
        while (2 * column->capacity * column->row_bytes <= CHUNK && column->capacity < CHUNK_ROWS)
            column->capacity *= 2;
        if (layout->chunk)
            column->capacity = layout->chunk;
        column->buffer = malloc(column->capacity * column->row_bytes);
    }
    if (!column || !column->buffer) {
        mill_h5_spend(file, "out of memory for a column of rows");
        return NULL;
    }
    open_rows(column, layout, keep);
    return good(column) ? column : NULL;
}

static void write_rows(struct mill_h5_column *column, size_t count, const void *rows)
{
    const hsize_t first[] = {column->extent[0], 0, 0};
    const hsize_t size[] = {count, column->extent[1], column->extent[2]};
    column->extent[0] += count;
    H5Dset_extent(column->set, column->extent);
    const hid_t memory = H5Screate_simple(column->rank, size, NULL);
    const hid_t place = H5Dget_space(column->set);
    H5Sselect_hyperslab(place, H5S_SELECT_SET, first, NULL, size, NULL);
    H5Dwrite(column->set, column->types.held, memory, place, H5P_DEFAULT, rows);
    mill_h5_release(place);
    mill_h5_release(memory);
    mill_h5_check(column->file, "write", column->path);
}

static void flush(struct mill_h5_column *column)
{
    if (good(column) && column->gathered > 0)
        write_rows(column, column->gathered, column->buffer);
    column->gathered = 0;
}

void mill_h5_column_append(struct mill_h5_column *column, size_t count, const void *rows)
{
    const unsigned char *from = rows;
    while (good(column) && count > 0) {
        /* the buffer ends where a chunk ends, so that no chunk is compressed twice */
        const size_t begun = (size_t)(column->extent[0] % column->capacity);
        const size_t left = column->capacity - begun - column->gathered;
        const size_t some = count < left ? count : left;
        if (some == column->capacity) {
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

void mill_h5_flush_columns(struct mill_h5 *file)
{
    for (struct mill_h5_column *column = file->columns; column; column = column->next)
        flush(column);
}

void mill_h5_column_close(struct mill_h5_column *column)
{
    if (!column)
        return;
    struct mill_h5_column **at = &column->file->columns;
    while (*at != column)
        at = &(*at)->next;
    *at = column->next;
    flush(column);
    mill_h5_release(column->set);
    mill_h5_check(column->file, "write", column->path);
    free(column->buffer);
    free(column);
}
