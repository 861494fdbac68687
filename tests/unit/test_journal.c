/* The undo journal: random changes to a file, a kill at any byte of the journal, and the commit is
 * back. */
#include "journal.h"

#include <check.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define MOST 40000 /* [byte] of the test file */

static char path[64], journal_path[80];

static int new_file(struct mill_journal **journal)
{
    int fd;
    snprintf(path, sizeof path, "/tmp/millsim_test_%ld.bytes", (long)getpid());
    snprintf(journal_path, sizeof journal_path, "%s.journal", path);
    unlink(journal_path);
    fd = open(path, O_RDWR | O_CREAT | O_TRUNC, 0600);
    ck_assert_int_ge(fd, 0);
    *journal = mill_journal_create(path);
    ck_assert_ptr_nonnull(*journal);
    return fd;
}

static void clean_up(struct mill_journal *journal, int fd)
{
    mill_journal_free(journal);
    close(fd);
    unlink(path);
    unlink(journal_path);
}

static size_t content(int fd, unsigned char *bytes)
{
    struct stat about;
    ck_assert_int_eq(fstat(fd, &about), 0);
    ck_assert_int_eq(mill_journal_read(fd, 0, bytes, (size_t)about.st_size), 0);
    return (size_t)about.st_size;
}

/* As a program does that keeps the rule: preserve, then change. */
static void change_at_random(struct mill_journal *journal, int fd)
{
    unsigned char bytes[9000];
    const uint64_t offset = (uint64_t)rand() % (MOST - sizeof bytes);
    const size_t length = (size_t)rand() % sizeof bytes;
    ck_assert_int_eq(mill_journal_preserve(journal, fd, offset, rand() % 5 ? length : MOST), 0);
    memset(bytes, rand() % 256, length);
    if (rand() % 5)
        ck_assert_int_eq(mill_journal_write(fd, offset, bytes, length), 0);
    else {
        ck_assert_int_eq(mill_journal_preserve(journal, fd, offset, MOST), 0);
        ck_assert_int_eq(ftruncate(fd, (off_t)offset), 0);
    }
}

START_TEST(any_changes_are_undone)
{
    struct mill_journal *journal;
    const int fd = new_file(&journal);
    static unsigned char before[MOST], after[MOST];
    size_t size;
    bool found;
    int i;
    srand((unsigned)_i);
    ck_assert_int_eq(mill_journal_commit(journal, 0), 0);
    for (i = 0; i < 10; i++)
        change_at_random(journal, fd);
    size = content(fd, before);
    if (size == 0)
        size = (size_t)write(fd, before, 1);
    ck_assert_int_eq(mill_journal_commit(journal, size), 0);
    for (i = 0; i < _i; i++)
        change_at_random(journal, fd);
    ck_assert_int_eq(mill_journal_roll_back(journal, fd, &found), 0);
    ck_assert(found);
    ck_assert_uint_eq(content(fd, after), size);
    ck_assert_mem_eq(before, after, size);
    clean_up(journal, fd);
}
END_TEST

START_TEST(a_record_cut_short_is_of_a_change_not_made)
{
    struct mill_journal *journal;
    const int fd = new_file(&journal);
    static unsigned char before[MOST], after[MOST];
    struct stat about;
    bool found;
    memset(before, 'a', sizeof before);
    ck_assert_int_eq(mill_journal_write(fd, 0, before, sizeof before), 0);
    ck_assert_int_eq(mill_journal_commit(journal, sizeof before), 0);
    ck_assert_int_eq(mill_journal_preserve(journal, fd, 5000, 10), 0);
    ck_assert_int_eq(mill_journal_write(fd, 5000, "changed", 7), 0);
    ck_assert_int_eq(mill_journal_preserve(journal, fd, 30000, 10), 0);
    ck_assert_int_eq(stat(journal_path, &about), 0);
    ck_assert_int_eq(truncate(journal_path, about.st_size - 1 - 200 * _i), 0);
    ck_assert_int_eq(mill_journal_roll_back(journal, fd, &found), 0);
    ck_assert_uint_eq(content(fd, after), sizeof before);
    ck_assert_mem_eq(before, after, sizeof before);
    clean_up(journal, fd);
}
END_TEST

START_TEST(rolling_back_twice_is_the_same_as_once)
{
    struct mill_journal *journal;
    const int fd = new_file(&journal);
    unsigned char bytes[16];
    bool found;
    mill_journal_write(fd, 0, "first state", 11);
    mill_journal_commit(journal, 11);
    mill_journal_preserve(journal, fd, 0, 100);
    mill_journal_write(fd, 0, "another thing, longer", 21);
    ck_assert_int_eq(mill_journal_roll_back(journal, fd, &found), 0);
    ck_assert_int_eq(mill_journal_roll_back(journal, fd, &found), 0);
    ck_assert_uint_eq(content(fd, bytes), 11);
    ck_assert_mem_eq(bytes, "first state", 11);
    clean_up(journal, fd);
}
END_TEST

START_TEST(without_a_journal_nothing_is_changed)
{
    struct mill_journal *journal;
    const int fd = new_file(&journal);
    unsigned char bytes[16];
    bool found = true;
    mill_journal_write(fd, 0, "as it is", 8);
    ck_assert_int_eq(mill_journal_roll_back(journal, fd, &found), 0);
    ck_assert(!found);
    ck_assert_uint_eq(content(fd, bytes), 8);
    clean_up(journal, fd);
}
END_TEST

START_TEST(a_file_without_a_commit_has_nothing_to_come_back_to)
{
    struct mill_journal *journal;
    const int fd = new_file(&journal);
    bool found;
    ck_assert_int_eq(mill_journal_commit(journal, 0), 0);
    ck_assert(!mill_journal_committed(journal));
    ck_assert_int_eq(mill_journal_roll_back(journal, fd, &found), ENODATA);
    clean_up(journal, fd);
}
END_TEST

START_TEST(something_else_is_not_taken_for_a_journal)
{
    struct mill_journal *journal;
    const int fd = new_file(&journal);
    unsigned char bytes[16];
    FILE *other = fopen(journal_path, "w");
    bool found;
    fputs("notes of the day, long enough for a header", other);
    fclose(other);
    mill_journal_write(fd, 0, "as it is", 8);
    ck_assert_int_eq(mill_journal_roll_back(journal, fd, &found), EINVAL);
    ck_assert_uint_eq(content(fd, bytes), 8);
    clean_up(journal, fd);
}
END_TEST

START_TEST(discarding_leaves_no_trace)
{
    struct mill_journal *journal;
    const int fd = new_file(&journal);
    mill_journal_commit(journal, 0);
    ck_assert_int_eq(access(journal_path, F_OK), 0);
    mill_journal_discard(journal);
    ck_assert_int_ne(access(journal_path, F_OK), 0);
    clean_up(journal, fd);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("journal");
    TCase *test_case = tcase_create("journal");
    SRunner *runner;
    int failed;
    tcase_add_loop_test(test_case, any_changes_are_undone, 0, 50);
    tcase_add_loop_test(test_case, a_record_cut_short_is_of_a_change_not_made, 0, 20);
    tcase_add_test(test_case, rolling_back_twice_is_the_same_as_once);
    tcase_add_test(test_case, without_a_journal_nothing_is_changed);
    tcase_add_test(test_case, a_file_without_a_commit_has_nothing_to_come_back_to);
    tcase_add_test(test_case, something_else_is_not_taken_for_a_journal);
    tcase_add_test(test_case, discarding_leaves_no_trace);
    suite_add_tcase(suite, test_case);
    runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
