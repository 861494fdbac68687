/* What the parts of the h5 module (h5.c, h5_data.c, h5_file.c) share. No other file includes it. */
#ifndef MILL_H5INTERNAL_H
#define MILL_H5INTERNAL_H

#include "store/draft.h"
#include "store/h5.h"

#include <hdf5.h>

/* [byte] all paths in a file are shorter, because names from decks are short */
enum { MILL_H5_PATH = 1024, MILL_H5_DEPTH = 32 /* groups within each other, at most */ };

struct mill_h5 {
    struct mill_draft draft; /* not open if the file is only read */
    hid_t id;
    hid_t text;                     /* type: text of variable length in UTF-8 */
    hid_t transfer, simple;         /* properties of most transfers, of most datasets */
    enum mill_status status;        /* MILL_OK until the first failure; then the file is spent */
    struct mill_error cause;        /* of the first failure */
    struct mill_h5_column *columns; /* all open columns */
    /* The group that the last new object is in, "" for the root, and the open groups on the way to
     * it: the root, then one for each name of the path */
    char way[MILL_H5_PATH];
    int depth;
    hid_t group[MILL_H5_DEPTH];
    char path[]; /* as the user gave it, for messages */
};

/* Switches off HDF5's own messages, and records the reasons of its failures. */
void mill_h5_listen(void);

/* Checks whether any call to HDF5 has failed since the last report. If so, the file is spent with
 * "FILE: cannot VERB PATH: REASON", the reason of the first failed call. path may be NULL. One
 * check after several calls is enough: a call that uses the result of a failed call fails too. */
void mill_h5_check(struct mill_h5 *file, const char *verb, const char *path);

/* Reports a failure even if no call to HDF5 has failed. why: used if errno is 0; NULL: HDF5's */
void mill_h5_fail(struct mill_h5 *file, const char *verb, const char *path, const char *why);

/* For a spent file: HDF5 writes what it still holds to nowhere, so that freeing it cannot fail. */
void mill_h5_detach(struct mill_h5 *file);

/* Closes an HDF5 object of any type. Negative ids are ignored. */
void mill_h5_release(hid_t object);

/* Makes the groups above `path` and removes an object of this name. Returns the group that is to
 * hold it, which stays open, and sets `name` to its name there. Negative: the file is spent. */
hid_t mill_h5_make_way(struct mill_h5 *file, const char *path, const char **name);

/* Opens the group that holds `path`, in the same way. */
hid_t mill_h5_enter(struct mill_h5 *file, const char *path, const char **name);

/* Closes the open groups. */
void mill_h5_leave(struct mill_h5 *file);

/* Properties of a new object without a time, so that two runs write the same bytes; to be closed */
hid_t mill_h5_timeless(hid_t property_class);

/* Writes the gathered rows of all columns. */
void mill_h5_flush_columns(struct mill_h5 *file);

#endif
