/* Text files are opened without waiting for what may never come, and read through signals. */
#define _XOPEN_SOURCE 700 /* setitimer */
#include "deck/textfile.h"
#include "unit.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static char folder[] = "/tmp/mill-textfile-XXXXXX";

static void enter_folder(void)
{
    strcpy(strrchr(folder, '-'), "-XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(folder));
    ck_assert_int_eq(chdir(folder), 0);
    ck_assert_int_eq(mkfifo("pipe", 0600), 0);
}

static void leave_folder(void)
{
    unlink("pipe");
    unlink("file");
    ck_assert_int_eq(rmdir(folder), 0);
}

static void doze(long time) /* [ms] */
{
    const struct timespec span = {time / 1000, time % 1000 * 1000000};
    nanosleep(&span, NULL);
}

/* A process that writes `text` to the pipe, waiting [ms] before it opens it and before it writes.
 */
static void start_writer(const char *text, long before, long within)
{
    const pid_t child = fork();
    ck_assert_int_ge(child, 0);
    if (child > 0)
        return;
    doze(before);
    const int fd = open("pipe", O_WRONLY);
    doze(within);
    _exit(write(fd, text, strlen(text)) < 0);
}

static void check_text(const char *path, const char *text)
{
    const char *wrong;
    FILE *file = mill_textfile_open(path, &wrong);
    ck_assert_ptr_nonnull(file);
    ck_assert_ptr_null(wrong);
    for (; *text; text++)
        ck_assert_int_eq(mill_textfile_next(file), *text);
    ck_assert_int_eq(mill_textfile_next(file), EOF);
    ck_assert_int_eq(ferror(file), 0);
    fclose(file);
}

TEST(a_file_is_read_to_its_end)
{
    FILE *file = fopen("file", "w");
    fputs("one\ntwo", file);
    fclose(file);
    check_text("file", "one\ntwo");
}

SLOW_TEST(a_pipe_is_read_whenever_its_writer_comes_and_writes, 4)
{
    static const long waits[][2] = {{0, 0}, {300, 0}, {0, 300}, {0, 2500}};
    start_writer("one\ntwo", waits[_i][0], waits[_i][1]);
    check_text("pipe", "one\ntwo");
    ck_assert_int_gt(wait(NULL), 0);
}

SLOW_TEST(a_pipe_without_a_writer_is_not_waited_for, 1)
{
    const char *wrong;
    ck_assert_ptr_null(mill_textfile_open("pipe", &wrong));
    ck_assert_str_eq(wrong, "is a pipe that nobody writes to");
}

TEST(what_is_no_file_is_told)
{
    const char *wrong;
    ck_assert_ptr_null(mill_textfile_open("/dev/zero", &wrong));
    ck_assert_str_eq(wrong, "is a device, not a file");
    ck_assert_ptr_null(mill_textfile_open(".", &wrong));
    ck_assert_ptr_null(wrong);
    ck_assert_int_eq(errno, EISDIR);
    ck_assert_ptr_null(mill_textfile_open("none", &wrong));
    ck_assert_ptr_null(wrong);
    ck_assert_int_eq(errno, ENOENT);
}

static void ignore(int number)
{
    (void)number;
}

/* Without SA_RESTART, as on a network's disk: what waits ends with EINTR. */
SLOW_TEST(a_signal_ends_neither_opening_nor_reading, 1)
{
    const struct sigaction action = {.sa_handler = ignore};
    const struct itimerval often = {{.tv_usec = 20000}, {.tv_usec = 20000}};
    sigaction(SIGALRM, &action, NULL);
    start_writer("one\ntwo", 200, 2500);
    setitimer(ITIMER_REAL, &often, NULL);
    check_text("pipe", "one\ntwo");
}

int main(void)
{
    return unit_run_in("textfile", enter_folder, leave_folder);
}
