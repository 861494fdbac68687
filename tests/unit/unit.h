/* How the tests of a unit are run. */
#ifndef UNIT_H
#define UNIT_H

#include <check.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Check would write to a pipe at each assertion that holds, to tell where a crash was: a system
 * call, too slow in loops. Debuggers and sanitizers tell it too. */
#define _mark_point(file, line) ((void)0)

enum unit_speed {
    UNIT_FAST,
    UNIT_SLOW, /* more than a second of a quiet core, all rounds together */
    UNIT_SPEEDS
};

/* A test, run so many times with _i = 0, 1, ... */
struct unit_test {
    const TTest *test;
    int rounds;
    enum unit_speed speed;
    struct unit_test *next;
};

static struct unit_test *unit_first, **unit_last = &unit_first; /* of all tests of the file */

/* Before main, the test that follows is added to those of the file. */
#define UNIT_TEST(name, times, how_fast)                                                           \
    static const TTest *name;                                                                      \
    __attribute__((constructor)) static void name##_is_known(void)                                 \
    {                                                                                              \
        static struct unit_test row;                                                               \
        row = (struct unit_test){name, times, how_fast, NULL};                                     \
        *unit_last = &row;                                                                         \
        unit_last = &row.next;                                                                     \
    }                                                                                              \
    START_TEST(name)

#define TEST(name) UNIT_TEST(name, 1, UNIT_FAST)
#define LOOP_TEST(name, times) UNIT_TEST(name, times, UNIT_FAST)
#define SLOW_TEST(name, times) UNIT_TEST(name, times, UNIT_SLOW)
#define COUNT(list) (int)(sizeof list / sizeof *list)

/* So many draws are made by a random test that makes `all` of them with UNIT_THOROUGH=1 in the
 * environment (make thorough), and ten times as many with UNIT_THOROUGH=10. */
static inline int unit_draws(int all)
{
    const char *thorough = getenv("UNIT_THOROUGH");
    return thorough ? all * atoi(thorough) : (all + 2) / 3;
}

/* Returns what main does; add: how set_up and tear_down, which may be NULL, are added to a case of
 * tests. */
static inline int unit_run_as(void (*add)(TCase *, SFun, SFun), const char *name,
                              void (*set_up)(void), void (*tear_down)(void))
{
    /* a test of two minutes hangs; SLOWER: how much slower it is while it is measured (make
     * coverage) */
    const char *slower = getenv("SLOWER");
    const double limit = 120.0 * (slower ? atof(slower) : 1.0);
    Suite *suite = suite_create(name);
    TCase *tests_of[UNIT_SPEEDS] = {NULL};
    for (const struct unit_test *is = unit_first; is; is = is->next) {
        TCase **tests = &tests_of[is->speed];
        if (!*tests) {
            *tests = tcase_create(name);
            tcase_set_timeout(*tests, limit);
            add(*tests, set_up, tear_down);
            suite_add_tcase(suite, *tests);
            if (is->speed == UNIT_SLOW) /* CK_EXCLUDE_TAGS=slow leaves them out */
                tcase_set_tags(*tests, "slow");
        }
        tcase_add_loop_test(*tests, is->test, 0, is->rounds);
    }
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_ENV);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}

/* set_up and tear_down: around each test */
static inline int unit_run_in(const char *name, void (*set_up)(void), void (*tear_down)(void))
{
    return unit_run_as(tcase_add_checked_fixture, name, set_up, tear_down);
}

/* set_up and tear_down: around all tests of a speed; each test has a copy of what set_up leaves */
static inline int unit_run_after(const char *name, void (*set_up)(void), void (*tear_down)(void))
{
    return unit_run_as(tcase_add_unchecked_fixture, name, set_up, tear_down);
}

static inline int unit_run(const char *name)
{
    return unit_run_in(name, NULL, NULL);
}

#endif
