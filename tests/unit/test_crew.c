/* Claims about a crew of threads: each part of the work is done once, on threads of its own, before
 * the caller goes on, however often and after whatever pause there is more to do. */
#define _GNU_SOURCE /* pthread_setattr_default_np */
#include "engine/crew.h"

#include "unit.h"

#include <pthread.h>
#include <signal.h>
#include <time.h>

enum { MOST = 5 };

/* Work that remembers what was done. The members are plain: a part that is still at work when the
 * caller looks is a data race, which ThreadSanitizer reports. */
struct work {
    uint64_t round;      /* set by the caller */
    uint64_t seen[MOST]; /* the last round, by each part */
    uint64_t times[MOST];
    pthread_t thread[MOST];
    bool hears[MOST]; /* a part's thread can get signals */
    int slow;         /* this part takes long; -1: none */
};

static void sleep_for(long milliseconds)
{
    nanosleep(&(struct timespec){.tv_nsec = 1000000 * milliseconds}, NULL);
}

static void work(void *all, int part)
{
    struct work *w = all;
    sigset_t blocked;
    if (part == w->slow)
        sleep_for(3);
    pthread_sigmask(SIG_SETMASK, NULL, &blocked);
    w->hears[part] = !sigismember(&blocked, SIGINT);
    w->seen[part] = w->round;
    w->times[part]++;
    w->thread[part] = pthread_self();
}

static struct mill_crew *begin(int parts, struct work *w)
{
    struct mill_crew *crew = mill_crew_create(parts);
    ck_assert_ptr_nonnull(crew);
    memset(w, 0, sizeof *w);
    w->slow = -1;
    ck_assert_int_eq(mill_crew_begin(crew), parts);
    return crew;
}

static void end(struct mill_crew *crew)
{
    mill_crew_end(crew);
    mill_crew_free(crew);
}

/* Lets the crew work so often. */
static void work_on(struct mill_crew *crew, int parts, struct work *w, int rounds)
{
    for (int k = 0; k < rounds; k++) {
        w->round++;
        mill_crew_do(crew, work, w);
        for (int part = 0; part < parts; part++)
            ck_assert(w->seen[part] == w->round && w->times[part] == w->round);
    }
}

LOOP_TEST(every_part_is_done_once_before_the_caller_goes_on, MOST)
{
    const int parts = _i + 1;
    struct work w;
    struct mill_crew *crew = begin(parts, &w);
    work_on(crew, parts, &w, parts <= 2 ? 20000 : 300); /* more threads than cores wait for long */
    end(crew);
}

TEST(threads_that_sleep_are_woken)
{
    struct work w;
    struct mill_crew *crew = begin(4, &w);
    for (int k = 0; k < 30; k++) {
        sleep_for(k % 3);
        work_on(crew, 4, &w, 1 + k % 2);
    }
    end(crew);
}

TEST(all_wait_for_a_slow_part)
{
    struct work w;
    struct mill_crew *crew = begin(3, &w);
    for (int k = 0; k < 30; k++) {
        w.slow = k % 4 - 1; /* the caller's part, too */
        work_on(crew, 3, &w, 1);
    }
    end(crew);
}

static void other_work(void *all, int part)
{
    ((struct work *)all)->times[part] += 100;
}

TEST(two_kinds_of_work_take_turns)
{
    struct work w, other = {0};
    struct mill_crew *crew = begin(2, &w);
    for (int k = 0; k < 1000; k++) {
        work_on(crew, 2, &w, 1);
        mill_crew_do(crew, other_work, &other);
    }
    for (int part = 0; part < 2; part++)
        ck_assert_uint_eq(other.times[part], 100000);
    end(crew);
}

TEST(the_caller_does_the_first_part_and_each_other_part_has_a_thread_of_its_own)
{
    struct work w;
    struct mill_crew *crew = begin(4, &w);
    work_on(crew, 4, &w, 3);
    ck_assert(pthread_equal(w.thread[0], pthread_self()));
    for (int a = 0; a < 4; a++)
        for (int b = 0; b < a; b++)
            ck_assert(!pthread_equal(w.thread[a], w.thread[b]));
    end(crew);
}

TEST(signals_are_for_the_caller_alone)
{
    struct work w;
    sigset_t blocked;
    struct mill_crew *crew = begin(3, &w);
    work_on(crew, 3, &w, 1);
    ck_assert(w.hears[0] && !w.hears[1] && !w.hears[2]);
    pthread_sigmask(SIG_SETMASK, NULL, &blocked);
    ck_assert(!sigismember(&blocked, SIGINT));
    end(crew);
}

TEST(a_crew_can_begin_and_end_again_and_again)
{
    struct work w;
    struct mill_crew *crew = begin(3, &w);
    for (int k = 0; k < 200; k++) {
        work_on(crew, 3, &w, k % 3); /* also without any work */
        sleep_for(k % 50 == 0 ? 2 : 0);
        mill_crew_end(crew);
        ck_assert_int_eq(mill_crew_begin(crew), 3);
    }
    end(crew);
}

TEST(where_no_thread_can_be_started_the_caller_is_told)
{
    pthread_attr_t attr;
    ck_assert_int_eq(pthread_attr_init(&attr), 0);
    ck_assert_int_eq(pthread_attr_setstacksize(&attr, (size_t)1 << 60), 0); /* too large */
    ck_assert_int_eq(pthread_setattr_default_np(&attr), 0);
    struct mill_crew *crew = mill_crew_create(4);
    ck_assert_int_eq(mill_crew_begin(crew), 1);
    end(crew);
}

int main(void)
{
    return unit_run("crew");
}
