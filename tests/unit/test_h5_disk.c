/* What becomes of an HDF5 file when the disk fills up, the process is killed or a second one wants
 * it: it is always as last flushed, whole, and readable by HDF5 itself. */
#define _DEFAULT_SOURCE /* syscall */
#include "h5_fixture.h"

#include <errno.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>

/* From here on this process cannot make a file longer than `bytes`: writing on fails with EFBIG, as
 * it fails with ENOSPC on a full disk. Undone by 0. */
static void limit_files(rlim_t bytes)
{
    struct rlimit limit;
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &limit);
    limit.rlim_cur = bytes ? bytes : limit.rlim_max;
    setrlimit(RLIMIT_FSIZE, &limit);
}

/* The column is closed by itself (_i even) or with the file. */
LOOP_TEST(a_full_disk_is_told_once_and_the_file_still_closes, 20)
{
    const struct mill_h5_layout layout = {MILL_H5_F64, 0, {0, 0}, 1024, "1", "noise", false};
    struct mill_h5_column *column;
    struct mill_error error = {""}, again = {""};
    column = mill_h5_column_create(file, "/particles/noise", &layout, 0);
    mill_h5_flush(file, NULL);
    limit_files(100000);
    for (int i = 0; i < 1000000 && mill_h5_status(file, &error) == MILL_OK; i++) {
        const double noise = rand() / 7.0;
        mill_h5_column_append(column, 1, &noise);
    }
    ck_assert_msg(strstr(error.text, "cannot write /particles/noise: File too large"), "%s",
                  error.text);
    write_double("/x", 1, "1");
    if (_i % 2 == 0)
        mill_h5_column_close(column);
    close_failed(&again);
    limit_files(0);
    ck_assert_str_eq(again.text, error.text);
}

/* So many calls from now on a read from a disk fails; 0: none does. */
static int read_fails;

ssize_t pread(int fd, void *to, size_t length, off_t at)
{
    if (read_fails > 0 && --read_fails == 0) {
        errno = EIO;
        return -1;
    }
    return (ssize_t)syscall(SYS_pread64, fd, to, length, at);
}

/* Else it would be written a second time: a group then has two members of one name, and loses
 * others. */
LOOP_TEST(what_cannot_be_read_is_not_taken_for_missing, 20)
{
    struct mill_error error = {""};
    write_double("/a/b", 1, "1");
    close_file();
    open_file(MILL_H5_READ);
    read_fails = 1 + _i;
    const bool there = mill_h5_exists(file, "/a/b");
    ck_assert(there != (read_fails == 0));
    ck_assert_int_eq(mill_h5_status(file, &error), there ? MILL_OK : MILL_FAILED);
    ck_assert(there || strstr(error.text, ": cannot read /a"));
    read_fails = 0;
    abandon_file();
}

static bool has(const char *end)
{
    char name[sizeof path + sizeof ".part"];
    snprintf(name, sizeof name, "%s%s", path, end);
    return access(name, F_OK) == 0;
}

static void assert_nothing_left(void)
{
    ck_assert(!has(".part"));
    ck_assert(!has(".lock"));
}

TEST(nothing_is_there_before_the_first_flush)
{
    write_double("/x", 7, "1");
    ck_assert(!has(""));
    ck_assert_int_eq(mill_h5_flush(file, NULL), MILL_OK);
    ck_assert(look_at(path, "/x", 0, 0) == 7);
    close_file();
    assert_nothing_left();
}

TEST(the_old_file_stands_until_the_first_flush_of_the_new_one)
{
    write_double("/x", 7, "1");
    close_file();
    open_file(MILL_H5_OVERWRITE);
    write_double("/y", 8, "1");
    ck_assert(look_at(path, "/x", 0, 0) == 7);
    ck_assert_int_eq(mill_h5_flush(file, NULL), MILL_OK);
    ck_assert(look_at(path, "/y", 0, 0) == 8);
    close_file();
}

TEST(a_file_closed_unflushed_is_published)
{
    write_double("/x", 7, "1");
    close_file();
    ck_assert(look_at(path, "/x", 0, 0) == 7);
}

TEST(an_abandoned_file_is_as_last_flushed)
{
    write_double("/x", 7, "1");
    mill_h5_flush(file, NULL);
    write_double("/x", 8, "1");
    abandon_file();
    ck_assert(look_at(path, "/x", 0, 0) == 7);
    assert_nothing_left();
}

TEST(a_file_abandoned_unflushed_never_was)
{
    write_double("/x", 7, "1");
    abandon_file();
    ck_assert(!has(""));
    assert_nothing_left();
}

TEST(between_flushes_the_file_is_readable_and_as_last_flushed)
{
    struct mill_h5_column *column = open_rows("/c", 64, 0);
    for (int k = 0; k < 20; k++) {
        ck_assert_int_eq(mill_h5_flush(file, NULL), MILL_OK);
        append_range(column, 777 * k, 777 * (k + 1), k % 2);
        write_count("/k", (uint64_t)k);
        assert_counts_up("/c", 777 * (size_t)k);
        if (k > 0)
            ck_assert(look_at(path, "/k", 0, 0) == k - 1);
    }
    close_file();
}

TEST(a_file_may_be_read_while_another_writes_it)
{
    struct mill_h5 *reader;
    char *text = NULL;
    mill_h5_write_text(file, "/t", "one", "-");
    mill_h5_flush(file, NULL);
    ck_assert_int_eq(mill_h5_create(path, MILL_H5_READ, &reader, NULL), MILL_OK);
    mill_h5_write_text(file, "/t", "two", "-");
    close_file();
    ck_assert_int_eq(mill_h5_read_text(reader, "/t", &text, NULL), MILL_OK);
    ck_assert_str_eq(text, "one");
    free(text);
    ck_assert_int_eq(mill_h5_close(reader, NULL), MILL_OK);
    assert_text(path, "/t", NULL, "two");
}

TEST(after_a_full_disk_the_file_is_as_last_flushed)
{
    uint64_t noise = 1;
    struct mill_h5_column *column = open_rows("/c", 64, 0);
    append_range(column, 0, 1000, false);
    ck_assert_int_eq(mill_h5_flush(file, NULL), MILL_OK);
    limit_files(60000);
    while (mill_h5_status(file, NULL) == MILL_OK) {
        mill_h5_column_append(column, 1, &noise);
        noise = noise * 6364136223846793005u + 1442695040888963407u;
    }
    close_failed(NULL);
    limit_files(0);
    assert_nothing_left();
    assert_counts_up("/c", 1000);
}

/* The disk is as full as the file is long, so that the copy after the flush fits and what comes
 * next does not, wherever that is met first: in a write, a flush or the closing (by _i). */
LOOP_TEST(a_disk_that_fills_up_at_any_moment_takes_nothing_that_was_flushed, 20)
{
    struct mill_error error = {""};
    int64_t flushed = 0;
    struct mill_h5_column *column = open_rows("/c", 512, 0);
    mill_h5_flush(file, NULL);
    limit_files(6000 + 1237 * (rlim_t)_i);
    for (int64_t rows = 0;; rows += 1500) {
        int64_t row[1500];
        for (int64_t k = 0; k < 1500; k++)
            row[k] = rows + k;
        mill_h5_column_append(column, 1500, row);
        if (mill_h5_flush(file, &error) != MILL_OK)
            break;
        flushed = rows + 1500;
    }
    close_failed(NULL);
    limit_files(0);
    ck_assert_msg(strstr(error.text, "File too large"), "%s", error.text);
    assert_nothing_left();
    const size_t rows = look_rows(path, "/c", 1);
    ck_assert_msg(rows == (size_t)flushed || rows == (size_t)flushed + 1500,
                  "%zu rows, %ld flushed", rows,
                  (long)flushed); /* the publication itself may be done, the copy not */
    assert_counts_up("/c", rows);
}

/* Appends rows for ever, flushing now and then; after each flush it tells how many there are. */
static void write_until_killed(int tell)
{
    int64_t k;
    if (mill_h5_create(path, MILL_H5_OVERWRITE, &file, NULL) != MILL_OK)
        return;
    struct mill_h5_column *column = open_rows("/c", 64, 0);
    for (k = 1;; k++) {
        const int64_t row = k - 1;
        mill_h5_column_append(column, 1, &row);
        if (k % 1000 != 0)
            continue;
        write_double("/run/time", (double)k, "s");
        if (mill_h5_flush(file, NULL) != MILL_OK || write(tell, &k, sizeof k) != sizeof k)
            return;
    }
}

LOOP_TEST(a_killed_file_is_as_last_flushed_and_can_be_gone_on_with, 20)
{
    const struct timespec later = {0, 1000000L * (17 * _i % 40)};
    struct mill_error error = {""};
    int tube[2], end;
    int64_t told = 0, rows;
    pid_t child;
    abandon_file();
    ck_assert(pipe(tube) == 0);
    child = fork();
    if (child == 0) {
        write_until_killed(tube[1]);
        _exit(1);
    }
    close(tube[1]);
    ck_assert(read(tube[0], &told, sizeof told) == sizeof told);
    nanosleep(&later, NULL);
    kill(child, SIGKILL);
    waitpid(child, &end, 0);
    ck_assert(WIFSIGNALED(end) && WTERMSIG(end) == SIGKILL);
    while (read(tube[0], &told, sizeof told) == sizeof told)
        ;
    rows = (int64_t)look_rows(path, "/c", 1);
    ck_assert(rows == told || rows == told + 1000); /* killed before it could tell */
    assert_counts_up("/c", (size_t)rows);
    ck_assert(look_at(path, "/run/time", 0, 0) == (double)rows);
    ck_assert_msg(mill_h5_create(path, MILL_H5_UPDATE, &file, &error) == MILL_OK, "%s", error.text);
    write_double("/x", 1, "1");
    close_file();
    ck_assert(look_at(path, "/x", 0, 0) == 1);
    assert_counts_up("/c", (size_t)rows);
    assert_nothing_left();
}

TEST(a_file_killed_before_its_first_flush_never_was)
{
    struct mill_error error = {""};
    int end;
    pid_t child;
    abandon_file();
    child = fork();
    if (child == 0)
        _exit(mill_h5_create(path, MILL_H5_NEW, &file, NULL)); /* and not closed */
    waitpid(child, &end, 0);
    ck_assert(!has(""));
    ck_assert_int_eq(mill_h5_create(path, MILL_H5_UPDATE, &file, &error), MILL_FAILED);
    ck_assert_msg(strstr(error.text, "cannot open: No such file or directory"), "%s", error.text);
    open_file(MILL_H5_NEW);
    close_file();
    assert_nothing_left();
}

TEST(a_file_in_use_is_not_opened_twice)
{
    struct mill_error error = {""};
    int end;
    mill_h5_flush(file, NULL);
    const enum mill_h5_open how[] = {MILL_H5_NEW, MILL_H5_OVERWRITE, MILL_H5_UPDATE};
    for (size_t k = 0; k < 3; k++) {
        const pid_t child = fork();
        if (child == 0) {
            struct mill_h5 *second;
            const enum mill_status status = mill_h5_create(path, how[k], &second, &error);
            _exit(status == MILL_FAILED && strstr(error.text, "another run is writing it") ? 0 : 1);
        }
        waitpid(child, &end, 0);
        ck_assert_msg(WIFEXITED(end) && WEXITSTATUS(end) == 0, "way %zu", k);
    }
    write_double("/x", 1, "1");
    close_file();
    ck_assert(look_at(path, "/x", 0, 0) == 1);
    assert_nothing_left();
}

int main(void)
{
    return unit_run_in("h5_disk", open_new, remove_file);
}
