/* An undo journal beside a file that is changed in place: whatever happens to the process, the file
 * can be brought back to its last commit. Knows bytes only, nothing of HDF5. */
#ifndef MILL_JOURNAL_H
#define MILL_JOURNAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct mill_journal;

/* For the file `path`; the journal is PATH.journal. Touches no disk. NULL: out of memory. Owner:
 * the caller. */
struct mill_journal *mill_journal_create(const char *path);
void mill_journal_free(struct mill_journal *journal);

/* The functions below return 0 or an errno. */

/* Commits: the file's first `size` bytes, as they are now, are the state to come back to; 0 means
 * there is none yet. Takes the place of the journal before in one step. */
int mill_journal_commit(struct mill_journal *journal, uint64_t size);

/* Before [offset, offset + length) of the open file is changed or cut off: saves what of it belongs
 * to the commit and is not saved yet. When it fails the change must not be made. */
int mill_journal_preserve(struct mill_journal *journal, int fd, uint64_t offset, uint64_t length);

/* Brings the open file back to the last commit of the journal on the disk, which stays, so that
 * being killed here does no harm. No journal: nothing happens and *found is false. ENODATA: there
 * was no commit yet. */
int mill_journal_roll_back(const struct mill_journal *journal, int fd, bool *found);

/* There has been a commit since the file was emptied or opened. */
bool mill_journal_committed(const struct mill_journal *journal);

/* Removes the journal from the disk: the file is good as it is. */
void mill_journal_discard(struct mill_journal *journal);

/* Reads or writes all of `length` bytes at `offset`; reading past the end gives zeros. */
int mill_journal_read(int fd, uint64_t offset, void *to, size_t length);
int mill_journal_write(int fd, uint64_t offset, const void *from, size_t length);

#endif
