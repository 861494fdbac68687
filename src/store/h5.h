/* The one door to HDF5: files, groups, datasets that carry `unit` and `description`, attributes,
 * links, and columns that grow row by row. No other module includes hdf5.h.
 *
 * Paths are absolute ("/run/version"); groups on the way are made. After the first failure the file
 * is spent: every later call does nothing. So functions that write return nothing, and whoever
 * wrote a chain of things asks mill_h5_status once. Strings are UTF-8 of variable length, as h5py
 * and H5MD readers expect, unless said otherwise. */
#ifndef MILL_H5FILE_H
#define MILL_H5FILE_H

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
    MILL_H5_TEXT /* const char *; in columns there are none */
};

enum mill_h5_open {
    MILL_H5_NEW,       /* refuse a file that exists */
    MILL_H5_RESTART,   /* replace a file that exists */
    MILL_H5_OVERWRITE, /* the same, and whatever stands in the way of PATH.part and PATH.lock */
    MILL_H5_UPDATE,    /* go on in a file as it was last published */
    MILL_H5_READ       /* look into a file, whoever writes it */
};

/* ---- the file ---- */

/* Until the first flush nothing is at `path` that was not there before; what is written goes to
 * PATH.part meanwhile, and PATH.lock keeps a second writer away. MILL_BAD_DECK: there is a file of
 * such a name that millsim has not left behind. Owner: the caller. */
enum mill_status mill_h5_create(const char *path, enum mill_h5_open how, struct mill_h5 **file,
                                struct mill_error *error);

/* MILL_OK, or MILL_FAILED and the first failure in one line ("mill.h5: cannot write /run/version:
 * No space left on device"). */
enum mill_status mill_h5_status(const struct mill_h5 *file, struct mill_error *error);

/* For the caller's own failures, such as "out of memory for the maps": the file is spent. */
void mill_h5_spend(struct mill_h5 *file, const char *why);

/* Publishes: everything written so far, the rows gathered in columns too, becomes the file in one
 * step. If the process or the machine dies later, or the disk fills up, the file stays as it is
 * now, and readable. Costs a copy of the file where the file system cannot share blocks. */
enum mill_status mill_h5_flush(struct mill_h5 *file, struct mill_error *error);

/* Publishes and closes, and frees in every case, its columns too; also after a failure, which it
 * returns again. NULL is fine. */
enum mill_status mill_h5_close(struct mill_h5 *file, struct mill_error *error);

/* Closes and frees without publishing what was written since the last flush. NULL is fine. */
void mill_h5_abandon(struct mill_h5 *file);

/* True if the path exists in the file (a dataset, a group or a link). Where that cannot be read,
 * the file is spent: what seems to be missing then is not. */
bool mill_h5_exists(struct mill_h5 *file, const char *path);

/* Takes the name away (a whole group with all that only it holds); no error where there is none. */
void mill_h5_remove(struct mill_h5 *file, const char *path);

/* Makes the group and those above it; fine where it exists. ordered: a new one's members keep the
 * order of their creation. */
void mill_h5_group(struct mill_h5 *file, const char *path, bool ordered);

/* `path` becomes a second name of what `existing` names. */
void mill_h5_link(struct mill_h5 *file, const char *existing, const char *path);

/* `path` becomes a soft link to `target`, which need not exist. */
void mill_h5_soft_link(struct mill_h5 *file, const char *target, const char *path);

/* Version of the HDF5 library in use, "1.10.8"; out is `size` long. */
void mill_h5_version(char *out, size_t size);

/* ---- datasets: each replaces what had the name before ---- */

/* values: C order, dims[rank] (NULL at rank 0 = a scalar). A dimension may be 0. */
void mill_h5_write(struct mill_h5 *file, const char *path, enum mill_h5_type type, int rank,
                   const size_t *dims, const void *values, const char *unit,
                   const char *description);

/* `count` numbers with a checksum of HDF5's own, which reading tests. For a state that is removed
 * after the publication: rows gathered in columns are written first, so that its room is at the end
 * of the file, which gets shorter again. */
void mill_h5_write_checked(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                           size_t count, const void *values, const char *description);

void mill_h5_write_text(struct mill_h5 *file, const char *path, const char *text,
                        const char *description);

/* A view, storing nothing: the elements of the dataset `source`, of this file and of the shape
 * source_dims[source_rank], in the same order under the shape dims[rank]. */
void mill_h5_view(struct mill_h5 *file, const char *path, enum mill_h5_type type, int rank,
                  const size_t *dims, const char *source, int source_rank,
                  const size_t *source_dims, const char *unit, const char *description);

/* ---- reading: MILL_FAILED and a spent file, where it does not hold what is asked for ---- */

/* What a scalar text holds. Owner: the caller, of memory from malloc. */
enum mill_status mill_h5_read_text(struct mill_h5 *file, const char *path, char **text,
                                   struct mill_error *error);

/* All elements of a dataset, which are of this type and so many, their checksum, if they have one,
 * right: else "FILE: damaged: PATH ...". */
enum mill_status mill_h5_read(struct mill_h5 *file, const char *path, enum mill_h5_type type,
                              size_t count, void *values, struct mill_error *error);

/* ---- attributes of the group or dataset `object`: each replaces an old one of its name ---- */

/* count values, or one as a scalar where count is 0 */
void mill_h5_attribute(struct mill_h5 *file, const char *object, const char *name,
                       enum mill_h5_type type, size_t count, const void *values);
/* Fixed length, ASCII, no terminator: what VTK asks of its Type attribute. */
void mill_h5_attribute_ascii(struct mill_h5 *file, const char *object, const char *name,
                             const char *text);

/* ---- columns: datasets (rows, dims[0], ..., dims[rank - 1]) that grow by rows ---- */

struct mill_h5_layout {
    enum mill_h5_type type;
    int rank;       /* of one row, 0 = one number */
    size_t dims[2]; /* of one row */
    size_t chunk; /* rows stored together and gathered before they are written; 0 = about 64 KiB */
    const char *unit, *description;
    bool plain; /* neither shuffled nor deflated: for what would hardly get smaller */
};

/* The column takes up after the first `keep` rows of what `path` names (a failure where there are
 * fewer) and drops the rest; where nothing has that name it is made empty, chunked and, unless
 * plain, shuffled and deflated at level 1. NULL on failure, which all that follows here accepts.
 * Owner: the file, which flushes it when it is published and frees it when it is closed. */
struct mill_h5_column *mill_h5_column_create(struct mill_h5 *file, const char *path,
                                             const struct mill_h5_layout *layout, uint64_t keep);

/* Appends `count` rows, contiguous in C order. Rows are gathered in the column's buffer, so that
 * single rows are cheap; a whole chunk goes to the file directly. */
void mill_h5_column_append(struct mill_h5_column *column, size_t count, const void *rows);

/* Writes the rows gathered, and frees before the file is closed. */
void mill_h5_column_close(struct mill_h5_column *column);

#endif
