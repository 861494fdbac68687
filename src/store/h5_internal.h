/* What the parts of the h5 module (h5.c, h5_data.c, h5_file.c) share; nobody else includes it. */
#ifndef MILL_H5INTERNAL_H
#define MILL_H5INTERNAL_H

#include "store/draft.h"
#include "store/h5.h"

#include <hdf5.h>

struct mill_h5 {
    struct mill_draft draft; /* not open where the file is only read */
    hid_t id;
    hid_t text;                     /* type of a text of variable length in UTF-8 */
    enum mill_status status;        /* MILL_OK until the first failure: then the file is spent */
    struct mill_error cause;        /* of the first failure */
    struct mill_h5_column *columns; /* all that are open */
    char path[];                    /* as the user gave it: for messages */
};

/* From now on HDF5 prints nothing, and why it fails is noted. */
void mill_h5_listen(void);

/* If a call to HDF5 has failed since the last failure was told, the file is spent: "FILE: cannot
 * VERB PATH: REASON", the reason being that of the first that failed; path may be NULL. So none of
 * several calls need be looked at: those that build on one that failed fail too. */
void mill_h5_check(struct mill_h5 *file, const char *verb, const char *path);

/* The same, although HDF5 may have found nothing wrong; why: the reason where the system gave no
 * errno, NULL: what HDF5 says. */
void mill_h5_fail(struct mill_h5 *file, const char *verb, const char *path, const char *why);

/* What HDF5 still holds must not reach the disk, and giving it back must not fail: from now on HDF5
 * writes to nowhere. */
void mill_h5_detach(struct mill_h5 *file);

/* Gives an object of HDF5 back, whatever it is; negative ones are none. */
void mill_h5_release(hid_t object);

/* Makes the groups above `path` and takes away what has that name. False: the file is spent. */
bool mill_h5_make_way(struct mill_h5 *file, const char *path);

/* The properties of a new object without the times of its making: two runs, the same bytes. The
 * caller closes it. */
hid_t mill_h5_timeless(hid_t property_class);

/* Writes what all columns have gathered. */
void mill_h5_flush_columns(struct mill_h5 *file);

#endif
