/* The only access to HDF5: files, groups, datasets with `unit` and `description`, attributes,
 * links, and columns that grow row by row. Paths are absolute ("/run/version"); missing groups on
 * the way are made. After its first failure a file is *spent*: every later call does nothing. So
 * functions that write return nothing, and the caller checks mill_h5_status once after many calls.
 * Strings are UTF-8 of variable length, as h5py expects, unless stated otherwise. */
#ifndef MILL_H5FILE_H
#define MILL_H5FILE_H

#include "millsim/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct mill_h5;
struct mill_h5_column;

/* in memory; in the file the same, little-endian */
enum mill_h5_type {
    MILL_H5_F64,
    MILL_H5_F32,
    MILL_H5_I64,
    MILL_H5_I32,
    MILL_H5_U64,
    MILL_H5_U8,
    MILL_H5_TEXT /* const char *; not in columns */
};

enum mill_h5_open {
    MILL_H5_NEW,       /* refuse a file that exists */
    MILL_H5_RESTART,   /* replace a file that exists */
    MILL_H5_OVERWRITE, /* as RESTART, and also replace any PATH.part and PATH.lock in the way */
    MILL_H5_UPDATE,    /* continue a file as it was last published */
    MILL_H5_READ       /* only read a file, even if another process writes it */
};

/* ---- the file ---- */

/* Opens a file. Until the first flush `path` is unchanged: data go to PATH.part, and PATH.lock
 * prevents a second writer. MILL_BAD_DECK: one of these is a file of others. Owner: the caller. */
enum mill_status mill_h5_create(const char *path, enum mill_h5_open how, struct mill_h5 **file,
                                struct mill_error *error);

/* MILL_OK, or MILL_FAILED and the first failure ("mill.h5: cannot write /run/version: REASON"). */
enum mill_status mill_h5_status(const struct mill_h5 *file, struct mill_error *error);

/* Reports a failure of the caller, such as "out of memory for the maps"; the file is spent. */
void mill_h5_spend(struct mill_h5 *file, const char *why);

/* Publishes: in one step, everything written so far becomes the file, with the rows still in
 * columns. If later the process dies or the disk fills up, the file stays readable as it is now.
 * Where the file system cannot share blocks, this takes the time of a copy of the file. */
enum mill_status mill_h5_flush(struct mill_h5 *file, struct mill_error *error);

/* Publishes and closes the file, and always frees it. Returns an earlier failure. May be NULL. */
enum mill_status mill_h5_close(struct mill_h5 *file, struct mill_error *error);

/* Closes and frees the file without publishing what is new since the last flush. May be NULL. */
void mill_h5_abandon(struct mill_h5 *file);

/* True if the path exists in the file (a dataset, a group or a link). If the file cannot be read,
 * it is spent, and the result false does not mean that the path is missing. */
bool mill_h5_exists(struct mill_h5 *file, const char *path);

/* Removes a name (of a group: with everything that has no other name), if it exists. */
void mill_h5_remove(struct mill_h5 *file, const char *path);

/* Makes a group and those above it, if they do not exist. ordered: its members keep their order. */
void mill_h5_group(struct mill_h5 *file, const char *path, bool ordered);

/* Makes `path` a second name of the object `existing`. */
void mill_h5_link(struct mill_h5 *file, const char *existing, const char *path);

/* Makes `path` a soft link to `target`, which need not exist. */
void mill_h5_soft_link(struct mill_h5 *file, const char *target, const char *path);

/* Version of the HDF5 library in use, "1.10.8"; out is `size` long. */
void mill_h5_version(char *out, size_t size);

/* ---- datasets: each replaces an older one of its name ---- */

/* values: C order, dims[rank] (NULL at rank 0 = a scalar). A dimension may be 0. */
void mill_h5_write(struct mill_h5 *file, const char *path, enum mill_h5_type type, int rank,
                   const size_t *dims, const void *values, const char *unit,
                   const char *description);

/* Writes `count` numbers with a checksum of HDF5, which reading checks. For a state that is removed
 * after the publication: rows still in columns are written first, so that the state is at the end
 * of the file, and the file becomes shorter again when the state is removed. */
void mill_h5_write_checked(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                           size_t count, const void *values, const char *description);

void mill_h5_write_text(struct mill_h5 *file, const char *path, const char *text,
                        const char *description);

/* Makes a view, which stores no data: it shows the elements of the dataset `source` of this file,
 * whose shape is source_dims[source_rank], in the same order in the shape dims[rank]. */
void mill_h5_view(struct mill_h5 *file, const char *path, enum mill_h5_type type, int rank,
                  const size_t *dims, const char *source, int source_rank,
                  const size_t *source_dims, const char *unit, const char *description);

/* ---- reading: MILL_FAILED and a spent file if the file does not hold what is asked for ---- */

/* Reads a scalar text. Owner: the caller; free(). */
enum mill_status mill_h5_read_text(struct mill_h5 *file, const char *path, char **text,
                                   struct mill_error *error);

/* Reads all elements of a dataset. Fails with "FILE: damaged: PATH ..." unless their type, their
 * number and their checksum, if there is one, are right. */
enum mill_status mill_h5_read(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                              size_t count, void *values, struct mill_error *error);

/* ---- attributes of the group or dataset `object`: each replaces an older one of its name ---- */

/* count: number of values; 0: one value, as a scalar */
void mill_h5_attribute(struct mill_h5 *file, const char *object, const char *name,
                       enum mill_h5_type type, size_t count, const void *values);
/* Fixed length, ASCII, no terminator: VTK requires this for its Type attribute. */
void mill_h5_attribute_ascii(struct mill_h5 *file, const char *object, const char *name,
                             const char *text);

/* ---- columns: datasets (rows, dims[0], ..., dims[rank - 1]) that grow by rows ---- */

struct mill_h5_layout {
    enum mill_h5_type type;
    int rank;       /* of one row, 0 = one number */
    size_t dims[2]; /* of one row */
    size_t chunk;   /* rows that are written and stored together; 0: about 64 KiB, at most 1024 */
    const char *unit, *description;
    bool plain; /* neither shuffled nor deflated: for data that hardly become smaller */
};

/* Opens a column. If the dataset exists, the column continues after its first `keep` rows (a
 * failure if there are fewer) and drops the rest. Otherwise it is made: chunked and, unless plain,
 * shuffled and deflated at level 1. NULL on failure; all functions below accept NULL. Owner: the
 * file, which writes the rows when it is published and frees the column when it is closed. */
struct mill_h5_column *mill_h5_column_create(struct mill_h5 *file, const char *path,
                                             const struct mill_h5_layout *layout, uint64_t keep);

/* Appends `count` rows, contiguous in C order. The column's buffer gathers rows, so single rows
 * cost little. A whole chunk is written directly. */
void mill_h5_column_append(struct mill_h5_column *column, size_t count, const void *rows);

/* Writes the gathered rows and frees the column, before the file is closed. */
void mill_h5_column_close(struct mill_h5_column *column);

#endif
