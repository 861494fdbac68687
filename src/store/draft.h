/* A file that others only ever see whole: it is written as PATH.part and takes the place of PATH in
 * one step at each publication. Whatever happens to the process, PATH is as it was last published.
 * PATH.lock, locked, keeps two writers of one PATH apart. Knows bytes only, nothing of HDF5.
 *
 * Functions that return an int return 0 or an errno. */
#ifndef MILL_DRAFT_H
#define MILL_DRAFT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct mill_draft;

/* For the file `path`, or what it links to. Touches no disk. NULL: out of memory. Owner: the
 * caller. */
struct mill_draft *mill_draft_create(const char *path);

/* Is PATH.part or PATH.lock the file at `path`, by whatever name? */
bool mill_draft_replaces(const struct mill_draft *draft, const char *path);

/* Begins the draft, empty or (`again`) as a copy of the published file. EWOULDBLOCK: another
 * process writes this file. */
int mill_draft_open(struct mill_draft *draft, bool again);

/* Of the open draft, for reading and writing; another one after each publication. */
int mill_draft_descriptor(const struct mill_draft *draft);

/* The bytes written so far reach the disk and become the file. go_on: a new draft begins as a copy
 * of it; when that fails the file is published all the same, and no draft is open. */
int mill_draft_publish(struct mill_draft *draft, bool go_on);

/* Drops what was not published, gives up the lock, frees. NULL is fine. */
void mill_draft_free(struct mill_draft *draft);

/* Reads or writes all of `length` bytes at `offset`; reading past the end gives zeros. */
int mill_draft_read(int fd, uint64_t offset, void *to, size_t length);
int mill_draft_write(int fd, uint64_t offset, const void *from, size_t length);

#endif
