/* How to get a file back that was being changed when its writer was killed: a rollback journal, as
 * data bases keep it (Gray and Reuter, Transaction Processing, 1993, section 10.3). Before a page
 * that belongs to the last commit is changed for the first time, its old bytes are appended to the
 * journal. Rolling back writes them all back and cuts the file to its old size. A record cut short
 * by a kill is of a change that was never made. Guards against the death of the process, not of the
 * machine: nothing is synced, because the operating system keeps the order of writes while it
 * lives. */
#include "journal.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PAGE 4096

/* header of the journal's file, then records, each an offset, a length and as many bytes */
struct header {
    char magic[8];
    uint64_t size; /* [byte] of the file at the commit */
};

struct record {
    uint64_t offset, length;
    unsigned char bytes[PAGE];
};

static const char magic[8] = {'M', 'I', 'L', 'L', 'U', 'N', 'D', 'O'};

struct mill_journal {
    char *path, *draft;   /* the new journal is written as a draft and renamed */
    int fd;               /* -1: none yet */
    uint64_t committed;   /* [byte] size of the file at the commit */
    uint64_t end;         /* [byte] of the journal's file */
    unsigned char *saved; /* one bit a page */
    int broken;           /* errno of the first failure */
};

struct mill_journal *mill_journal_create(const char *path)
{
    struct mill_journal *journal = calloc(1, sizeof *journal);
    const size_t room = strlen(path) + sizeof ".journal.new";
    if (!journal)
        return NULL;
    journal->fd = -1;
    journal->path = malloc(room);
    journal->draft = malloc(room);
    if (!journal->path || !journal->draft) {
        mill_journal_free(journal);
        return NULL;
    }
    snprintf(journal->path, room, "%s.journal", path);
    snprintf(journal->draft, room, "%s.journal.new", path);
    return journal;
}

void mill_journal_free(struct mill_journal *journal)
{
    if (!journal)
        return;
    if (journal->fd >= 0)
        close(journal->fd);
    free(journal->saved);
    free(journal->path);
    free(journal->draft);
    free(journal);
}

int mill_journal_read(int fd, uint64_t offset, void *to, size_t length)
{
    unsigned char *at = to;
    while (length > 0) {
        const ssize_t got = pread(fd, at, length, (off_t)offset);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return errno;
        if (got == 0) {
            memset(at, 0, length);
            return 0;
        }
        at += got;
        offset += (uint64_t)got;
        length -= (size_t)got;
    }
    return 0;
}

int mill_journal_write(int fd, uint64_t offset, const void *from, size_t length)
{
    const unsigned char *at = from;
    while (length > 0) {
        const ssize_t put = pwrite(fd, at, length, (off_t)offset);
        if (put < 0 && errno == EINTR)
            continue;
        if (put <= 0)
            return put < 0 ? errno : ENOSPC;
        at += put;
        offset += (uint64_t)put;
        length -= (size_t)put;
    }
    return 0;
}

int mill_journal_commit(struct mill_journal *journal, uint64_t size)
{
    struct header header;
    unsigned char *saved = calloc(size / PAGE / 8 + 1, 1);
    int failed = saved ? 0 : ENOMEM, fd = -1;
    memcpy(header.magic, magic, sizeof magic);
    header.size = size;
    if (!failed) {
        fd = open(journal->draft, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
        failed = fd < 0 ? errno : mill_journal_write(fd, 0, &header, sizeof header);
    }
    if (!failed && rename(journal->draft, journal->path) != 0)
        failed = errno;
    if (failed) {
        if (fd >= 0) {
            close(fd);
            unlink(journal->draft);
        }
        free(saved);
        journal->broken = failed;
        return failed;
    }
    if (journal->fd >= 0)
        close(journal->fd);
    free(journal->saved);
    journal->fd = fd;
    journal->saved = saved;
    journal->committed = size;
    journal->end = sizeof header;
    return 0;
}

static int save_page(struct mill_journal *journal, int fd, uint64_t page)
{
    const uint64_t left = journal->committed - page * PAGE;
    const size_t fixed = offsetof(struct record, bytes);
    struct record record;
    int failed;
    record.offset = page * PAGE;
    record.length = left < PAGE ? left : PAGE;
    failed = mill_journal_read(fd, record.offset, record.bytes, (size_t)record.length);
    if (!failed)
        failed =
            mill_journal_write(journal->fd, journal->end, &record, fixed + (size_t)record.length);
    if (failed)
        return failed;
    journal->end += fixed + record.length;
    journal->saved[page / 8] |= (unsigned char)(1u << page % 8);
    return 0;
}

int mill_journal_preserve(struct mill_journal *journal, int fd, uint64_t offset, uint64_t length)
{
    uint64_t page, end = offset + length;
    if (end > journal->committed)
        end = journal->committed;
    for (page = offset / PAGE; page * PAGE < end && !journal->broken; page++)
        if (!(journal->saved[page / 8] >> page % 8 & 1))
            journal->broken = save_page(journal, fd, page);
    return journal->broken;
}

static int apply(int journal, int fd)
{
    struct header header;
    struct record record;
    uint64_t at = sizeof header;
    const size_t fixed = offsetof(struct record, bytes);
    const off_t end = lseek(journal, 0, SEEK_END);
    int failed =
        end < (off_t)sizeof header ? EINVAL : mill_journal_read(journal, 0, &header, sizeof header);
    if (!failed && memcmp(header.magic, magic, sizeof magic) != 0)
        failed = EINVAL;
    if (!failed && header.size == 0)
        failed = ENODATA;
    while (!failed && at + fixed <= (uint64_t)end) {
        failed = mill_journal_read(journal, at, &record, fixed);
        if (failed || record.length > PAGE || at + fixed + record.length > (uint64_t)end)
            break; /* cut short: the change was not made */
        failed = mill_journal_read(journal, at + fixed, record.bytes, (size_t)record.length);
        if (!failed)
            failed = mill_journal_write(fd, record.offset, record.bytes, (size_t)record.length);
        at += fixed + record.length;
    }
    if (!failed && ftruncate(fd, (off_t)header.size) != 0)
        failed = errno;
    return failed;
}

int mill_journal_roll_back(const struct mill_journal *journal, int fd, bool *found)
{
    const int old = open(journal->path, O_RDONLY | O_CLOEXEC);
    int failed;
    *found = old >= 0;
    if (old < 0)
        return errno == ENOENT ? 0 : errno;
    failed = apply(old, fd);
    close(old);
    return failed;
}

bool mill_journal_committed(const struct mill_journal *journal)
{
    return journal->committed > 0;
}

void mill_journal_discard(struct mill_journal *journal)
{
    if (journal->fd < 0)
        return;
    close(journal->fd);
    journal->fd = -1;
    journal->committed = 0;
    unlink(journal->path);
}
