/* A file that others only ever see whole: whatever is done to the writer or to the files around it,
 * the name leads to what was last published, and nothing is left behind. */
#define _DEFAULT_SOURCE /* syscall */
#include "store/draft.h"
#include "unit.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static char folder[64], path[80], part[96], new[96], lock[96];

static void setup(void)
{
    strcpy(folder, "/tmp/millsim_draft_XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/file", folder);
    snprintf(part, sizeof part, "%s.part", path);
    snprintf(new, sizeof new, "%s.new", path);
    snprintf(lock, sizeof lock, "%s.lock", path);
}

static void teardown(void)
{
    char command[128];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    ck_assert_int_eq(system(command), 0);
}

/* How often a call is to be interrupted by a signal from now on */
enum { OPEN, FSYNC, RENAME, FLOCK, WRITE, PREAD, CALLS };
static int interrupted[CALLS], made[CALLS];

static bool interrupts(int call)
{
    if (interrupted[call] <= 0)
        return false;
    interrupted[call]--;
    made[call]++;
    errno = EINTR;
    return true;
}

int open(const char *name, int flags, ...)
{
    va_list mode;
    va_start(mode, flags);
    const mode_t bits = flags & O_CREAT ? va_arg(mode, mode_t) : 0;
    va_end(mode);
    return interrupts(OPEN) ? -1 : (int)syscall(SYS_openat, AT_FDCWD, name, flags, bits);
}

int fsync(int fd)
{
    return interrupts(FSYNC) ? -1 : (int)syscall(SYS_fsync, fd);
}

int rename(const char *from, const char *to)
{
    return interrupts(RENAME) ? -1 : renameat(AT_FDCWD, from, AT_FDCWD, to);
}

int flock(int fd, int how)
{
    return interrupts(FLOCK) ? -1 : (int)syscall(SYS_flock, fd, how);
}

ssize_t write(int fd, const void *from, size_t length)
{
    return interrupts(WRITE) ? -1 : (ssize_t)syscall(SYS_write, fd, from, length);
}

ssize_t pread(int fd, void *to, size_t length, off_t at)
{
    return interrupts(PREAD) ? -1 : (ssize_t)syscall(SYS_pread64, fd, to, length, at);
}

static bool there(const char *name)
{
    struct stat about;
    return lstat(name, &about) == 0;
}

static bool is_link(const char *name)
{
    struct stat about;
    return lstat(name, &about) == 0 && S_ISLNK(about.st_mode);
}

static void put(const char *name, const char *text)
{
    FILE *out = fopen(name, "w");
    ck_assert_ptr_nonnull(out);
    fputs(text, out);
    ck_assert_int_eq(fclose(out), 0);
}

static void assert_holds(const char *name, const char *text)
{
    char read[256] = "";
    FILE *in = fopen(name, "r");
    ck_assert_msg(in != NULL, "%s is not there", name);
    read[fread(read, 1, sizeof read - 1, in)] = '\0';
    fclose(in);
    ck_assert_str_eq(read, text);
}

static struct mill_draft *named(const char *name, const char *begins)
{
    struct mill_draft *draft = malloc(sizeof *draft);
    ck_assert_ptr_nonnull(draft);
    mill_draft_init(draft, name, begins);
    return draft;
}

static void finish(struct mill_draft *draft)
{
    mill_draft_end(draft);
    free(draft);
}

static struct mill_draft *begin(const char *name, enum mill_draft_way way)
{
    struct mill_draft *draft = named(name, "half");
    ck_assert_int_eq(mill_draft_open(draft, way), 0);
    return draft;
}

static void write_text(const struct mill_draft *draft, off_t offset, const char *text)
{
    const int fd = draft->fd;
    ck_assert_int_eq(pwrite(fd, text, strlen(text), offset), strlen(text));
}

static void write_file(enum mill_draft_way way, const char *text)
{
    struct mill_draft *draft = begin(path, way);
    write_text(draft, 0, text);
    ck_assert_int_eq(mill_draft_publish(draft, true), 0);
    finish(draft);
}

static void assert_nothing_left(void)
{
    ck_assert(!there(part));
    ck_assert(!there(new));
    ck_assert(!there(lock));
}

TEST(nothing_is_there_before_the_first_publication)
{
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    write_text(draft, 0, "half");
    ck_assert(!there(path));
    finish(draft);
    ck_assert(!there(path));
    assert_nothing_left();
}

TEST(each_publication_shows_what_was_written_up_to_then)
{
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    write_text(draft, 0, "one");
    ck_assert_int_eq(mill_draft_publish(draft, false), 0);
    write_text(draft, 3, " two");
    assert_holds(path, "one");
    ck_assert_int_eq(mill_draft_publish(draft, false), 0);
    write_text(draft, 0, "TWO");
    assert_holds(path, "one two");
    ck_assert_int_eq(mill_draft_publish(draft, true), 0);
    assert_holds(path, "TWO two");
    ck_assert_int_eq(mill_draft_publish(draft, true), EBADF);
    finish(draft);
    assert_holds(path, "TWO two");
    assert_nothing_left();
}

TEST(a_draft_taken_up_again_begins_with_the_published_bytes)
{
    put(path, "published");
    struct mill_draft *draft = begin(path, MILL_DRAFT_COPY);
    char read[16] = "";
    ck_assert_int_eq(pread(draft->fd, read, 9, 0), 9);
    ck_assert_str_eq(read, "published");
    write_text(draft, 0, "P");
    assert_holds(path, "published");
    ck_assert_int_eq(mill_draft_publish(draft, true), 0);
    assert_holds(path, "Published");
    finish(draft);
}

TEST(a_new_draft_begins_empty_and_leaves_the_old_file_until_it_is_published)
{
    put(path, "old and long");
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    write_text(draft, 0, "new");
    assert_holds(path, "old and long");
    ck_assert_int_eq(mill_draft_publish(draft, true), 0);
    assert_holds(path, "new");
    finish(draft);
}

TEST(taking_up_what_is_not_there_fails)
{
    struct mill_draft *draft = named(path, "half");
    ck_assert_int_eq(mill_draft_open(draft, MILL_DRAFT_COPY), ENOENT);
    finish(draft);
    assert_nothing_left();
}

TEST(a_reader_that_has_the_file_open_keeps_its_version)
{
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    char read[4] = "";
    write_text(draft, 0, "one");
    ck_assert_int_eq(mill_draft_publish(draft, false), 0);
    const int reader = open(path, O_RDONLY);
    write_text(draft, 0, "two");
    ck_assert_int_eq(mill_draft_publish(draft, false), 0);
    ck_assert_int_eq(pread(reader, read, 3, 0), 3);
    ck_assert_str_eq(read, "one");
    assert_holds(path, "two");
    close(reader);
    finish(draft);
}

/* A version: how drafts begin here, and its number, so many times that the versions differ in
 * length */
enum { WORDS = 3000, STEP = 700 };

static size_t words_of(uint32_t version)
{
    return WORDS + version % 7 * STEP;
}

/* Publishes one version after another for ever; after each it tells which. Words are written in
 * several pieces, so that a kill may come between them. */
static void publish_for_ever(int tell)
{
    static uint32_t words[WORDS + 6 * STEP];
    struct mill_draft *draft = named(path, "half");
    if (mill_draft_open(draft, MILL_DRAFT_EMPTY) != 0)
        return;
    for (uint32_t version = 1;; version++) {
        const size_t n = words_of(version);
        memcpy(words, "half", 4);
        for (size_t i = 1; i < n; i++)
            words[i] = version;
        const int fd = draft->fd;
        for (size_t i = 0; i < n; i += STEP / 2) {
            const size_t bytes = 4 * (n - i < STEP / 2 ? n - i : STEP / 2);
            if (pwrite(fd, words + i, bytes, (off_t)(4 * i)) != (ssize_t)bytes)
                return;
        }
        if (ftruncate(fd, (off_t)(4 * n)) != 0 || mill_draft_publish(draft, false) != 0 ||
            write(tell, &version, sizeof version) != sizeof version)
            return;
    }
}

/* The version that the file is; 0: the file is none of them. */
static uint32_t version_there(void)
{
    static uint32_t words[WORDS + 6 * STEP + 1];
    FILE *in = fopen(path, "rb");
    ck_assert_ptr_nonnull(in);
    const size_t n = fread(words, 4, sizeof words / 4, in);
    fclose(in);
    if (n < 2 || memcmp(words, "half", 4) != 0 || n != words_of(words[1]))
        return 0;
    for (size_t i = 1; i < n; i++)
        if (words[i] != words[1])
            return 0;
    return words[1];
}

LOOP_TEST(a_writer_killed_at_any_moment_leaves_its_last_version_whole, 40)
{
    const struct timespec later = {0, 1000L * (7919 * _i % 20000)};
    int tube[2], end;
    uint32_t told = 0;
    ck_assert(pipe(tube) == 0);
    const pid_t child = fork();
    if (child == 0) {
        publish_for_ever(tube[1]);
        _exit(1);
    }
    close(tube[1]);
    ck_assert(read(tube[0], &told, sizeof told) == sizeof told);
    nanosleep(&later, NULL);
    for (int k = 0; k < 20; k++) /* at any moment of its life too */
        ck_assert_uint_gt(version_there(), 0);
    kill(child, SIGKILL);
    waitpid(child, &end, 0);
    ck_assert(WIFSIGNALED(end) && WTERMSIG(end) == SIGKILL);
    while (read(tube[0], &told, sizeof told) == sizeof told)
        ;
    close(tube[0]);
    const uint32_t version = version_there();
    ck_assert_msg(version == told || version == told + 1, "version %u, told %u", version, told);
    struct mill_draft *next = begin(path, MILL_DRAFT_COPY); /* what it left is no hindrance */
    ck_assert_int_eq(mill_draft_publish(next, true), 0);
    finish(next);
    ck_assert_uint_eq(version_there(), version);
    assert_nothing_left();
}

LOOP_TEST(leftovers_of_a_killed_run_are_cleared_up, 2)
{
    put(part, _i % 2 ? "half of something" : "");
    put(new, _i % 2 ? "" : "half of something");
    put(lock, "");
    write_file(MILL_DRAFT_EMPTY, "x");
    assert_holds(path, "x");
    assert_nothing_left();
}

LOOP_TEST(files_of_others_in_the_way_are_left_alone_unless_forced, 3)
{
    const char *const names[] = {part, new, lock}, *const name = names[_i % 3];
    struct mill_error error = {""};
    put(name, _i % 3 == 2 ? "half" : "precious"); /* a lock is empty */
    struct mill_draft *draft = named(path, "half");
    const int failed = mill_draft_open(draft, MILL_DRAFT_EMPTY);
    ck_assert_int_eq(failed, EEXIST);
    ck_assert_int_eq(mill_draft_tell(draft, path, "write", failed, &error), MILL_BAD_DECK);
    ck_assert_msg(strncmp(error.text, name, strlen(name)) == 0 &&
                      strstr(error.text, ": exists and is not an unfinished file of millsim; move "
                                         "it away, or use --force"),
                  "%s", error.text);
    finish(draft);
    assert_holds(name, _i % 3 == 2 ? "half" : "precious");
    for (int k = 0; k < 3; k++)
        ck_assert(there(names[k]) == (k == _i % 3));
    write_file(MILL_DRAFT_FORCE, "x");
    assert_holds(path, "x");
    assert_nothing_left();
}

/* Also where it leads to a file that a killed run might have left */
LOOP_TEST(links_in_the_way_are_not_followed, 3)
{
    const char *const names[] = {part, new, lock}, *const name = names[_i % 3];
    char victim[96];
    snprintf(victim, sizeof victim, "%s/victim", folder);
    put(victim, _i % 3 == 2 ? "" : "half of something");
    ck_assert_int_eq(symlink(victim, name), 0);
    struct mill_draft *draft = named(path, "half");
    ck_assert_int_eq(mill_draft_open(draft, MILL_DRAFT_EMPTY), EEXIST);
    finish(draft);
    ck_assert(is_link(name));
    write_file(MILL_DRAFT_FORCE, "x");
    assert_holds(victim, _i % 3 == 2 ? "" : "half of something");
    assert_holds(path, "x");
    assert_nothing_left();
}

TEST(a_link_to_nothing_in_the_way_of_the_lock_makes_no_file)
{
    char victim[96];
    snprintf(victim, sizeof victim, "%s/victim", folder);
    ck_assert_int_eq(symlink(victim, lock), 0);
    struct mill_draft *draft = named(path, NULL);
    ck_assert_int_eq(mill_draft_open(draft, MILL_DRAFT_EMPTY), EEXIST);
    finish(draft);
    ck_assert(!there(victim));
}

TEST(a_lock_that_nobody_holds_is_cleared)
{
    mill_draft_clear(path);
    assert_nothing_left();
    put(lock, "");
    mill_draft_clear(path);
    assert_nothing_left();
    put(lock, "precious");
    mill_draft_clear(path);
    assert_holds(lock, "precious");
    unlink(lock);
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    mill_draft_clear(path);
    ck_assert(there(lock));
    finish(draft);
}

TEST(calls_that_a_signal_interrupts_are_made_again)
{
    for (int call = 0; call < CALLS; call++) {
        put(path, "one");
        interrupted[call] = 2;
        struct mill_draft *draft = begin(path, MILL_DRAFT_COPY);
        write_text(draft, 3, "two");
        interrupted[call] = 2;
        ck_assert_int_eq(mill_draft_publish(draft, false), 0);
        assert_holds(path, "onetwo");
        interrupted[call] = 2;
        ck_assert_int_eq(mill_draft_publish(draft, true), 0);
        finish(draft);
        /* blocks may be shared instead of read and written */
        ck_assert(made[call] > 0 || call == WRITE || call == PREAD);
        interrupted[call] = 0;
    }
    assert_nothing_left();
}

/* Of the draft, or of what was published, or of both */
LOOP_TEST(a_file_whose_name_was_removed_is_published_all_the_same, 3)
{
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    write_text(draft, 0, "one");
    if (_i != 1)
        ck_assert_int_eq(unlink(part), 0);
    ck_assert_int_eq(mill_draft_publish(draft, false), 0);
    assert_holds(path, "one");
    if (_i != 0)
        ck_assert_int_eq(unlink(path), 0);
    write_text(draft, 3, "two");
    ck_assert_int_eq(mill_draft_publish(draft, true), 0);
    assert_holds(path, "onetwo");
    finish(draft);
    assert_nothing_left();
}

LOOP_TEST(another_file_put_in_place_of_the_draft_is_neither_published_nor_removed, 2)
{
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    write_text(draft, 0, "mine");
    unlink(part);
    put(part, "not mine");
    if (_i % 2)
        ck_assert_int_eq(mill_draft_publish(draft, true), 0);
    finish(draft);
    if (_i % 2)
        assert_holds(path, "mine");
    assert_holds(part, "not mine");
}

TEST(a_removed_folder_is_an_error)
{
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    unlink(part);
    unlink(lock);
    ck_assert_int_eq(rmdir(folder), 0);
    ck_assert_int_eq(mill_draft_publish(draft, false), ENOENT);
    finish(draft);
    ck_assert(!there(folder));
}

/* To a file or to nothing yet */
LOOP_TEST(a_link_stays_a_link, 2)
{
    char target[96];
    snprintf(target, sizeof target, "%s/target", folder);
    if (_i)
        put(target, "old");
    ck_assert_int_eq(symlink("target", path), 0);
    write_file(MILL_DRAFT_EMPTY, "new");
    ck_assert(is_link(path));
    assert_holds(target, "new");
    assert_nothing_left();
}

TEST(the_mode_of_a_file_taken_up_again_is_kept)
{
    struct stat about;
    put(path, "x");
    ck_assert_int_eq(chmod(path, 0640), 0);
    struct mill_draft *draft = begin(path, MILL_DRAFT_COPY);
    for (int k = 0; k < 3; k++)
        ck_assert_int_eq(mill_draft_publish(draft, k == 2), 0);
    finish(draft);
    ck_assert_int_eq(stat(path, &about), 0);
    ck_assert_int_eq(about.st_mode & 0777, 0640);
}

/* The answer of another process that wants to write the same file, by the name it has there */
static int another_writer(const char *name)
{
    int end;
    const pid_t child = fork();
    if (child == 0) {
        struct mill_draft *draft = named(name, "half");
        const int answer = mill_draft_open(draft, MILL_DRAFT_EMPTY);
        finish(draft);
        _exit(answer);
    }
    waitpid(child, &end, 0);
    ck_assert(WIFEXITED(end));
    return WEXITSTATUS(end);
}

TEST(a_file_has_one_writer_at_a_time)
{
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    write_text(draft, 0, "mine");
    ck_assert_int_eq(another_writer(path), EWOULDBLOCK);
    ck_assert_int_eq(mill_draft_publish(draft, false), 0);
    ck_assert_int_eq(another_writer(path), EWOULDBLOCK);
    ck_assert(there(lock) && there(part));
    ck_assert_int_eq(mill_draft_publish(draft, true), 0);
    assert_holds(path, "mine");
    finish(draft);
    ck_assert_int_eq(another_writer(path), 0);
    assert_holds(path, "mine");
    assert_nothing_left();
}

TEST(a_file_has_one_writer_at_a_time_whatever_it_is_called)
{
    char alias[96];
    snprintf(alias, sizeof alias, "%s/alias", folder);
    put(path, "x");
    ck_assert_int_eq(symlink("file", alias), 0);
    struct mill_draft *draft = begin(path, MILL_DRAFT_COPY);
    ck_assert_int_eq(another_writer(alias), EWOULDBLOCK);
    finish(draft);
}

/* Somebody removed the lock's name, and another writer has made one of its own. */
TEST(a_lock_of_another_writer_is_not_removed)
{
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    ck_assert_int_eq(unlink(lock), 0);
    put(lock, "");
    finish(draft);
    ck_assert(there(lock));
}

TEST(what_does_not_fit_is_told_and_the_file_stays_as_published)
{
    struct rlimit limit;
    char much[4096];
    ssize_t put = 0;
    struct mill_draft *draft = begin(path, MILL_DRAFT_EMPTY);
    write_text(draft, 0, "one");
    ck_assert_int_eq(mill_draft_publish(draft, false), 0);
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &limit);
    const rlim_t before = limit.rlim_cur;
    limit.rlim_cur = 10000;
    setrlimit(RLIMIT_FSIZE, &limit);
    memset(much, 'x', sizeof much);
    for (off_t at = 3; put >= 0 && at < 100000; at += put)
        put = pwrite(draft->fd, much, sizeof much, at);
    ck_assert_int_eq(errno, EFBIG);
    limit.rlim_cur = before;
    setrlimit(RLIMIT_FSIZE, &limit);
    finish(draft);
    assert_holds(path, "one");
    assert_nothing_left();
}

int main(void)
{
    return unit_run_in("draft", setup, teardown);
}
