/* A crew of threads. Work comes every fraction of a millisecond, so a waiting thread first looks
 * again and again for a while, and only then sleeps: to wake it takes many microseconds. */
#include "engine/crew.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#ifdef __x86_64__
#include <emmintrin.h>
#endif

#define LOOKS 4000 /* before a thread sleeps: some 100 microseconds */
#define POLITE 250 /* looks after which another thread may have the core */

struct mill_crew {
    int parts;
    int started; /* threads, without the caller's */
    pthread_t thread[MILL_CREW_MOST];
    mill_crew_fn *part;
    void *work;
    pthread_mutex_t lock;
    pthread_cond_t change;
    /* ---- shared ---- */
    /* All threads look at these two words all the time: each has lines of the cache of its own. */
    char apart[128];
    uint64_t round; /* number of the present work */
    char from[128];
    uint64_t left; /* threads that have not done their part yet */
    char others[128];
    int joined; /* threads that know their part */
    int asleep; /* threads that wait for `change` */
    bool over;  /* there is no more work */
};

struct mill_crew *mill_crew_create(int parts)
{
    struct mill_crew *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    c->parts = parts;
    pthread_mutex_init(&c->lock, NULL);
    pthread_cond_init(&c->change, NULL);
    return c;
}

void mill_crew_free(struct mill_crew *c)
{
    if (!c)
        return;
    pthread_cond_destroy(&c->change);
    pthread_mutex_destroy(&c->lock);
    free(c);
}

/* Waits until a shared word has this value. */
static void await(struct mill_crew *c, const uint64_t *word, uint64_t value)
{
    for (int k = 0; k < LOOKS; k++) {
        if (__atomic_load_n(word, __ATOMIC_SEQ_CST) == value)
            return;
        if (k % POLITE == POLITE - 1)
            sched_yield();
#ifdef __x86_64__
        _mm_pause();
#endif
    }
    pthread_mutex_lock(&c->lock);
    __atomic_add_fetch(&c->asleep, 1, __ATOMIC_SEQ_CST);
    while (__atomic_load_n(word, __ATOMIC_SEQ_CST) != value)
        pthread_cond_wait(&c->change, &c->lock);
    __atomic_sub_fetch(&c->asleep, 1, __ATOMIC_SEQ_CST);
    pthread_mutex_unlock(&c->lock);
}

/* Call this after a change of what `await` waits for. */
static void wake(struct mill_crew *c)
{
    if (__atomic_load_n(&c->asleep, __ATOMIC_SEQ_CST) == 0)
        return;
    pthread_mutex_lock(&c->lock);
    pthread_cond_broadcast(&c->change);
    pthread_mutex_unlock(&c->lock);
}

static void *serve(void *crew)
{
    struct mill_crew *c = crew;
    const int part = __atomic_add_fetch(&c->joined, 1, __ATOMIC_SEQ_CST);
    for (uint64_t round = 1;; round++) {
        await(c, &c->round, round);
        if (c->over)
            return NULL;
        c->part(c->work, part);
        if (__atomic_sub_fetch(&c->left, 1, __ATOMIC_SEQ_CST) == 0)
            wake(c);
    }
}

int mill_crew_begin(struct mill_crew *c)
{
    sigset_t all, before;
    sigfillset(&all); /* signals are for the caller's thread alone */
    pthread_sigmask(SIG_SETMASK, &all, &before);
    c->round = 0;
    c->joined = 0;
    c->over = false;
    for (c->started = 0; c->started + 1 < c->parts; c->started++)
        if (pthread_create(&c->thread[c->started], NULL, serve, c) != 0)
            break;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return c->started + 1;
}

static void begin_round(struct mill_crew *c)
{
    __atomic_store_n(&c->left, (uint64_t)c->started, __ATOMIC_SEQ_CST);
    __atomic_add_fetch(&c->round, 1, __ATOMIC_SEQ_CST);
    wake(c);
}

void mill_crew_end(struct mill_crew *c)
{
    c->over = true;
    begin_round(c);
    for (int k = 0; k < c->started; k++)
        pthread_join(c->thread[k], NULL);
    c->started = 0;
}

void mill_crew_do(struct mill_crew *c, mill_crew_fn *part, void *work)
{
    c->part = part;
    c->work = work;
    begin_round(c);
    part(work, 0);
    await(c, &c->left, 0);
}
