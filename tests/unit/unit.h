/* How the tests of a unit are run. */
#ifndef UNIT_H
#define UNIT_H

#include <check.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* A test whose row does not say so is fast */
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"

enum unit_speed {
    UNIT_FAST,
    UNIT_SLOW, /* more than a second of a quiet core, all rounds together */
};

/* A test, run so many times with _i = 0, 1, ... */
struct unit_test {
    const TTest *test;
    int rounds;
    enum unit_speed speed;
};

/* Returns what main does; add: how set_up and tear_down, which may be NULL, are added to a case of
 * tests. */
static inline int unit_run_as(void (*add)(TCase *, SFun, SFun), const char *name,
                              void (*set_up)(void), void (*tear_down)(void),
                              const struct unit_test *test, size_t tests)
{
    /* a test of two minutes hangs; SLOWER: how much slower it is while it is measured (make
     * coverage) */
    const char *slower = getenv("SLOWER");
    const double limit = 120.0 * (slower ? atof(slower) : 1.0);
    Suite *suite = suite_create(name);
    TCase *tests_of[] = {[UNIT_FAST] = tcase_create(name), [UNIT_SLOW] = tcase_create(name)};
    tcase_set_tags(tests_of[UNIT_SLOW], "slow"); /* CK_EXCLUDE_TAGS=slow leaves them out */
    for (size_t k = 0; k < sizeof tests_of / sizeof *tests_of; k++) {
        tcase_set_timeout(tests_of[k], limit);
        add(tests_of[k], set_up, tear_down);
        suite_add_tcase(suite, tests_of[k]);
    }
    for (size_t k = 0; k < tests; k++)
        tcase_add_loop_test(tests_of[test[k].speed], test[k].test, 0, test[k].rounds);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_ENV);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}

/* set_up and tear_down: around each test */
static inline int unit_run_in(const char *name, void (*set_up)(void), void (*tear_down)(void),
                              const struct unit_test *test, size_t tests)
{
    return unit_run_as(tcase_add_checked_fixture, name, set_up, tear_down, test, tests);
}

/* set_up and tear_down: around all tests of a speed; each test has a copy of what set_up leaves */
static inline int unit_run_after(const char *name, void (*set_up)(void), void (*tear_down)(void),
                                 const struct unit_test *test, size_t tests)
{
    return unit_run_as(tcase_add_unchecked_fixture, name, set_up, tear_down, test, tests);
}

static inline int unit_run(const char *name, const struct unit_test *test, size_t tests)
{
    return unit_run_in(name, NULL, NULL, test, tests);
}

#endif
