/* What the parts of the h5 module (h5.c, h5_attribute.c, h5_column.c, h5_data.c, h5_file.c)
 * share; no other file includes this. */
#ifndef MILL_H5INTERNAL_H
#define MILL_H5INTERNAL_H

#include "store/draft.h"
#include "store/h5.h"

#include <hdf5.h>

struct mill_h5 {
    struct mill_draft *draft; /* NULL: the file is only read */
    hid_t id;
    hid_t text;                     /* type of a text of variable length in UTF-8 */
    hid_t access;                   /* to datasets of which HDF5 keeps no chunks in memory */
    hid_t transfer;                 /* of values, with little memory */
    char *path;                     /* as the user gave it: for messages */
    enum mill_status spent;         /* MILL_OK until the first failure */
    struct mill_error cause;        /* of the first failure */
    struct mill_h5_column *columns; /* all that are open */
};

/* From now on HDF5 prints nothing, and why it fails is noted. */
void mill_h5_listen(void);

/* Marks the file spent, if it is not yet: "FILE: cannot VERB PATH: REASON", the reason being that
 * of the first call to HDF5 that has failed since the last failure was told. */
void mill_h5_fail(struct mill_h5 *file, const char *verb, const char *path);

/* Has a call to HDF5 failed since the last failure was told? Why, where the system gave no errno.
 */
bool mill_h5_failed(void);
void mill_h5_suppose(const char *why);

/* What HDF5 still holds must not reach the disk, and giving it back must not fail: from now on HDF5
 * writes to nowhere. */
void mill_h5_detach(struct mill_h5 *file);

/* Is the file not spent? */
bool mill_h5_good(const struct mill_h5 *file);

/* Gives an object of HDF5 back, whatever it is; negative ones are none. False: HDF5 refused. */
bool mill_h5_release(hid_t object);

/* Makes the groups above `path` and takes away what has that name. False: the file is spent. */
bool mill_h5_make_way(struct mill_h5 *file, const char *path);

/* Makes the groups above `path`. */
void mill_h5_parents(struct mill_h5 *file, const char *path);

/* Writes what all columns have gathered. */
void mill_h5_flush_columns(struct mill_h5 *file);

/* Frees all columns; what they have gathered is dropped. */
void mill_h5_free_columns(struct mill_h5 *file);

/* Types owned by the library: not to be closed. */
hid_t mill_h5_memory_type(enum mill_h5_type type);
hid_t mill_h5_file_type(enum mill_h5_type type);
size_t mill_h5_type_size(enum mill_h5_type type);

/* The properties of a new object without the times of its making: two runs, the same bytes. The
 * caller closes it. */
hid_t mill_h5_timeless(hid_t property_class);

/* Attaches unit and description to an object just made; false on failure. */
bool mill_h5_label(const struct mill_h5 *file, hid_t object, const char *unit,
                   const char *description);

#endif
