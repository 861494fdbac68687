/* A file that others only ever see whole: it is written as PATH.part, and PATH is replaced in one
 * step at each publication, by a copy of it, at the last one by itself. Whatever happens to the
 * process, PATH is as it was last published. PATH.lock, locked, keeps two writers of one PATH
 * apart. Knows bytes only, nothing of HDF5.
 *
 * Functions that return an int return 0 or an errno. */
#ifndef MILL_DRAFT_H
#define MILL_DRAFT_H

#include "millsim/status.h"

#include <stdbool.h>

enum mill_draft_way {
    MILL_DRAFT_EMPTY, /* a new file */
    MILL_DRAFT_COPY,  /* the published file, to be gone on with */
    MILL_DRAFT_FORCE  /* a new file, whatever stands in the way of PATH.part and PATH.lock */
};

/* Others only read it. */
struct mill_draft {
    /* longer than any that the system takes: what is cut is refused */
    char path[4104], part[4112], new[4112], lock[4112];
    const char *begins;
    const char *obstacle; /* one of these names; NULL: none */
    int fd;               /* of PATH.part, for reading and writing; -1: none is open */
    int lock_fd;          /* -1: not locked */
};

/* For the file `path`, or what it links to. Touches no disk. begins: what it will begin with: by
 * this a PATH.part or PATH.new is known that a killed process has left; NULL: only an empty one is.
 * It must outlive the draft. */
void mill_draft_init(struct mill_draft *draft, const char *path, const char *begins);

/* Which of the four names leads to the file at `path`? NULL: none. */
const char *mill_draft_meets(const struct mill_draft *draft, const char *path);

/* Begins the draft. EWOULDBLOCK: another process writes this file. EEXIST: a file that no draft
 * has left is in the way; it is not touched. After a failure too the caller ends the draft. */
int mill_draft_open(struct mill_draft *draft, enum mill_draft_way way);

/* Why that failed, in one line ("PATH: cannot VERB: No space left on device"): MILL_FAILED, or
 * MILL_BAD_DECK for a file in the way. path: as the user gave it. */
enum mill_status mill_draft_tell(const struct mill_draft *draft, const char *path, const char *verb,
                                 int failed, struct mill_error *error);

/* The bytes written so far become the file and reach the disk. Where they do not, the file stays as
 * it is. last: no draft is open afterwards. */
int mill_draft_publish(struct mill_draft *draft, bool last);

/* Drops what was not published, gives up the lock. */
void mill_draft_end(struct mill_draft *draft);

/* Takes away a PATH.lock that nobody holds: a process killed right after its last publication has
 * left it. */
void mill_draft_clear(const char *path);

#endif
