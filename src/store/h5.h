/* The one door to HDF5: files, groups, datasets that carry `unit` and `description`, attributes,
 * links, and columns that grow row by row. No other module includes hdf5.h.
 *
 * Paths are absolute ("/run/version"); groups on the way are made. Every function that takes an
 * error returns MILL_OK, or MILL_FAILED with one line in it ("mill.h5: cannot write /run/version:
 * No space left on device"). After the first failure the file is spent: every later call returns
 * that same failure without touching the disk again. Strings are UTF-8 of variable length, as h5py
 * and H5MD readers expect, unless said otherwise. */
#ifndef MILL_H5FILE_H
#define MILL_H5FILE_H

#include "base/parts.h"
#include "millsim/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct mill_h5;
struct mill_h5_column;

/* in memory and in the file (there little-endian) */
enum mill_h5_type {
    MILL_H5_F64,
    MILL_H5_F32,
    MILL_H5_I64,
    MILL_H5_I32,
    MILL_H5_U64,
    MILL_H5_U8,
    MILL_H5_TYPES
};

enum mill_h5_open {
    MILL_H5_NEW,       /* refuse a file that exists */
    MILL_H5_OVERWRITE, /* empty a file that exists */
    MILL_H5_UPDATE,    /* go on in a file as it was last published */
    MILL_H5_READ       /* look into a file, whoever writes it */
};

/* ---- the file ---- */

/* Until the first flush nothing is at `path` that was not there before; what is written goes to
 * PATH.part meanwhile, and PATH.lock keeps a second writer away. Owner: the caller. */
enum mill_status mill_h5_create(const char *path, enum mill_h5_open how, struct mill_h5 **file,
                                struct mill_error *error);

/* Publishes: everything written so far becomes the file in one step. If the process or the machine
 * dies later, or the disk fills up, the file stays as it is now, and readable. Columns are flushed
 * by their owners before. Costs a copy of the file where the file system cannot share blocks. */
enum mill_status mill_h5_flush(struct mill_h5 *file, struct mill_error *error);

/* Publishes and closes, and frees in every case, also after a failure, which it returns again.
 * Columns must have been freed before. NULL is fine. */
enum mill_status mill_h5_close(struct mill_h5 *file, struct mill_error *error);

/* Closes and frees without publishing what was written since the last flush. NULL is fine. */
void mill_h5_abandon(struct mill_h5 *file);

/* True if the path exists in the file (a dataset, a group or a link). */
bool mill_h5_exists(const struct mill_h5 *file, const char *path);

/* Takes the name away (a whole group with all that only it holds); no error where there is none. */
enum mill_status mill_h5_remove(struct mill_h5 *file, const char *path, struct mill_error *error);

/* Makes the group and those above it; fine where it exists. ordered: its members keep the order of
 * their creation (matters only where this call makes it). */
enum mill_status mill_h5_group(struct mill_h5 *file, const char *path, bool ordered,
                               struct mill_error *error);

/* `path` becomes a second name of what `existing` names. */
enum mill_status mill_h5_link(struct mill_h5 *file, const char *existing, const char *path,
                              struct mill_error *error);

/* `path` becomes a soft link to `target`, which need not exist. */
enum mill_status mill_h5_soft_link(struct mill_h5 *file, const char *target, const char *path,
                                   struct mill_error *error);

/* Version of the HDF5 library in use, "1.10.8"; out is `size` long. */
void mill_h5_version(char *out, size_t size);

/* ---- datasets: each replaces what had the name before ---- */

/* values: C order, dims[rank] (NULL at rank 0 = a scalar). A dimension may be 0. */
enum mill_status mill_h5_write(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                               int rank, const size_t *dims, const void *values, const char *unit,
                               const char *description, struct mill_error *error);

/* Scalars, for short call sites. */
enum mill_status mill_h5_write_double(struct mill_h5 *file, const char *path, double value,
                                      const char *unit, const char *description,
                                      struct mill_error *error);
enum mill_status mill_h5_write_count(struct mill_h5 *file, const char *path, uint64_t value,
                                     const char *description, struct mill_error *error);
enum mill_status mill_h5_write_text(struct mill_h5 *file, const char *path, const char *text,
                                    const char *description, struct mill_error *error);

/* A view, storing nothing: the elements of the dataset `source`, of this file and of the shape
 * source_dims[source_rank], in the same order under the shape dims[rank]. */
enum mill_status mill_h5_view(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                              int rank, const size_t *dims, const char *source, int source_rank,
                              const size_t *source_dims, const char *unit, const char *description,
                              struct mill_error *error);

/* Bytes that stand in several places, one part after another, as one array of U8. */
enum mill_status mill_h5_write_parts(struct mill_h5 *file, const char *path,
                                     const struct mill_part *part, size_t parts,
                                     const char *description, struct mill_error *error);

/* What a scalar text holds. MILL_FAILED also where there is none. Owner: the caller, of memory from
 * malloc. */
enum mill_status mill_h5_read_text(struct mill_h5 *file, const char *path, char **text,
                                   struct mill_error *error);

/* How many bytes an array of U8 has, and those from `first` on; MILL_FAILED also where there is no
 * such array, or they are fewer. */
enum mill_status mill_h5_count_bytes(struct mill_h5 *file, const char *path, size_t *count,
                                     struct mill_error *error);
enum mill_status mill_h5_read_bytes(struct mill_h5 *file, const char *path, size_t first,
                                    size_t count, void *bytes, struct mill_error *error);

/* ---- attributes of the group or dataset `object`: each replaces an old one of its name ---- */

/* count values, or one as a scalar where count is 0 */
enum mill_status mill_h5_attribute(struct mill_h5 *file, const char *object, const char *name,
                                   enum mill_h5_type type, size_t count, const void *values,
                                   struct mill_error *error);
enum mill_status mill_h5_attribute_text(struct mill_h5 *file, const char *object, const char *name,
                                        const char *text, struct mill_error *error);
/* An array of `count` > 0 texts. */
enum mill_status mill_h5_attribute_texts(struct mill_h5 *file, const char *object, const char *name,
                                         size_t count, const char *const *texts,
                                         struct mill_error *error);
/* Fixed length, ASCII, no terminator: what VTK asks of its Type attribute. */
enum mill_status mill_h5_attribute_ascii(struct mill_h5 *file, const char *object, const char *name,
                                         const char *text, struct mill_error *error);

/* ---- columns: datasets (rows, dims[0], ..., dims[rank - 1]) that grow by rows ---- */

struct mill_h5_layout {
    enum mill_h5_type type;
    int rank;       /* of one row, 0 = one number */
    size_t dims[2]; /* of one row */
    size_t chunk; /* rows stored together and gathered before they are written; 0 = about 64 KiB */
    const char *unit, *description;
    bool plain; /* neither shuffled nor deflated: for what would hardly get smaller */
};

/* The column takes up after the first `keep` rows of what `path` names (MILL_FAILED where there are
 * fewer) and drops the rest; where nothing has that name and `keep` is 0 it is made empty, chunked
 * and, unless plain, shuffled and deflated at level 1. The file must outlive it. Owner: the caller.
 */
enum mill_status mill_h5_column_create(struct mill_h5 *file, const char *path,
                                       const struct mill_h5_layout *layout, uint64_t keep,
                                       struct mill_h5_column **column, struct mill_error *error);

/* Appends `count` rows, contiguous in C order. Rows are gathered in the column's buffer, so that
 * single rows are cheap; whole chunks of rows go to the file directly. */
enum mill_status mill_h5_column_append(struct mill_h5_column *column, size_t count,
                                       const void *rows, struct mill_error *error);

/* A row of rank 1 or 2 that is long is stored in pieces of so many elements along its first axis,
 * the last one shorter; the others are one piece. Piece by piece, in order, a row needs not be in
 * memory as a whole: `first` is the element that the piece begins with, 0, piece, 2 piece, ... */
size_t mill_h5_column_piece(const struct mill_h5_column *column);
enum mill_status mill_h5_column_append_piece(struct mill_h5_column *column, size_t first,
                                             const void *values, struct mill_error *error);

/* Rows so far, gathered ones included. */
uint64_t mill_h5_column_rows(const struct mill_h5_column *column);

/* Writes the rows gathered. */
enum mill_status mill_h5_column_flush(struct mill_h5_column *column, struct mill_error *error);

/* Frees; gathered rows are dropped: flush first. NULL is fine. */
void mill_h5_column_free(struct mill_h5_column *column);

#endif
