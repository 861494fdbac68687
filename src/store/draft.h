/* A file that other processes only ever see complete. It is written as PATH.part. Each publication
 * replaces PATH in one step by a copy of PATH.part, the last one by itself. If the process dies,
 * PATH is as last published. PATH.lock prevents two writers of one PATH. Here are only bytes, no
 * HDF5. Functions that return an int return 0 or an errno. */
#ifndef MILL_DRAFT_H
#define MILL_DRAFT_H

#include "millsim/status.h"

#include <stdbool.h>

enum mill_draft_way {
    MILL_DRAFT_EMPTY, /* a new file */
    MILL_DRAFT_COPY,  /* a copy of the published file, to continue it */
    MILL_DRAFT_FORCE  /* a new file; replaces any PATH.part and PATH.lock */
};

/* Other modules only read it. */
struct mill_draft {
    char path[4104], part[4112], new[4112], lock[4112]; /* a path that is cut is too long */
    const char *begins;
    const char *obstacle; /* the one of these names that is in the way; NULL: none */
    int fd;               /* of PATH.part, for reading and writing; -1: none is open */
    int lock_fd;          /* -1: not locked */
};

/* Prepares a draft of the file `path`, or of the file that this links to, off the disk. begins: the
 * file's first bytes, which show what a killed process has left (NULL: an empty file). They must
 * outlive the draft. */
void mill_draft_init(struct mill_draft *draft, const char *path, const char *begins);

/* Returns the one of the four names that leads to the file at `path`; NULL: none. */
const char *mill_draft_meets(const struct mill_draft *draft, const char *path);

/* Begins the draft. EWOULDBLOCK: another process is writing this file. EEXIST: a file that is not
 * from a draft is in the way; it is not touched. The caller ends the draft even after a failure. */
int mill_draft_open(struct mill_draft *draft, enum mill_draft_way way);

/* Describes why a draft could not be opened or published, in one line ("PATH: cannot VERB: No space
 * left on device"). Returns MILL_FAILED, or MILL_BAD_DECK for a file in the way. path: as given */
enum mill_status mill_draft_tell(const struct mill_draft *draft, const char *path, const char *verb,
                                 int failed, struct mill_error *error);

/* Makes the bytes written so far the file, and waits until they are on the disk. After a failure
 * the file is unchanged. last: closes the draft. */
int mill_draft_publish(struct mill_draft *draft, bool last);

/* Deletes what was not published, and releases the lock. */
void mill_draft_end(struct mill_draft *draft);

/* Removes a PATH.lock that no process holds: one killed after its last publication has left it. */
void mill_draft_clear(const char *path);

#endif
