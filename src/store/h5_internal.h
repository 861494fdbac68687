/* What the parts of the h5 module (h5.c, h5_driver.c, h5_data.c,
 * h5_attribute.c, h5_column.c) share; no
 * other file includes this. */
#ifndef MILL_H5INTERNAL_H
#define MILL_H5INTERNAL_H

#include "store/draft.h"
#include "store/h5.h"

#include <hdf5.h>

/* What the file driver and the owner of the file tell each other. */
struct mill_h5_disk {
    struct mill_draft *draft; /* NULL: the file is only read */
    bool mute;                /* nothing is to be written any more */
    int number;               /* errno of the first failure, 0 = none */
};

struct mill_h5 {
    struct mill_h5_disk disk;
    hid_t id;
    char *path;                     /* as the user gave it: for messages */
    enum mill_status spent;         /* MILL_OK until the first failure */
    struct mill_error cause;        /* of the first failure */
    struct mill_h5_column *columns; /* all that are open */
};

/* Marks the file spent and sets "FILE: cannot VERB PATH: REASON", the reason taken from HDF5's
 * error stack: call it before any other call to HDF5. */
enum mill_status mill_h5_fail(struct mill_h5 *file, struct mill_error *error, const char *verb,
                              const char *path);

/* MILL_OK, or the first failure once more. */
enum mill_status mill_h5_check(const struct mill_h5 *file, struct mill_error *error);

/* Makes the groups above `path`. */
enum mill_status mill_h5_parents(struct mill_h5 *file, const char *path, struct mill_error *error);

/* Files opened with this access list go through h5_driver.c; `disk` must outlive them. */
bool mill_h5_use_disk(hid_t access_list, struct mill_h5_disk *disk);

/* The columns outlive their file as empty shells. */
void mill_h5_orphan_columns(struct mill_h5 *file);

/* Types owned by the library: not to be closed. */
hid_t mill_h5_memory_type(enum mill_h5_type type);
hid_t mill_h5_file_type(enum mill_h5_type type);
size_t mill_h5_type_size(enum mill_h5_type type);

/* A text of variable length in UTF-8; the caller closes it. */
hid_t mill_h5_text_type(void);

/* The properties of a new object without the times of its making: two runs, the same bytes. The
 * caller closes it. */
hid_t mill_h5_timeless(hid_t property_class);

/* Attaches unit and description to an object just made; false on failure. */
bool mill_h5_label(hid_t object, const char *unit, const char *description);

#endif
