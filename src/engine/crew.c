/* A crew of threads. Work comes every fraction of a millisecond, so a thread that waits first looks
 * again and again for a while; only then does it sleep, because to wake it takes many microseconds.
 */
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

struct member {
    struct mill_crew *crew;
    pthread_t id;
    int part;
};

struct mill_crew {
    int parts;
    int started; /* threads, without the caller's */
    struct member *member;
    mill_crew_fn *part;
    void *work;
    pthread_mutex_t lock;
    pthread_cond_t change;
    /* ---- shared ---- */
    uint64_t round; /* number of the present work */
    int left;       /* threads that have not done their part yet */
    int asleep;     /* threads that wait for `change` */
    bool over;      /* there is no more work */
};

struct mill_crew *mill_crew_create(int parts)
{
    struct mill_crew *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    c->parts = parts;
    c->member = calloc((size_t)parts, sizeof *c->member);
    pthread_mutex_init(&c->lock, NULL);
    pthread_cond_init(&c->change, NULL);
    if (c->member)
        return c;
    mill_crew_free(c);
    return NULL;
}

void mill_crew_free(struct mill_crew *c)
{
    if (!c)
        return;
    pthread_cond_destroy(&c->change);
    pthread_mutex_destroy(&c->lock);
    free(c->member);
    free(c);
}

static bool has_begun(const struct mill_crew *c, uint64_t round)
{
    return __atomic_load_n(&c->round, __ATOMIC_SEQ_CST) != round;
}

static bool is_done(const struct mill_crew *c, uint64_t none)
{
    (void)none;
    return __atomic_load_n(&c->left, __ATOMIC_SEQ_CST) == 0;
}

/* Waits until `ready` is true. */
static void await(struct mill_crew *c, bool (*ready)(const struct mill_crew *, uint64_t),
                  uint64_t round)
{
    for (int k = 0; k < LOOKS; k++) {
        if (ready(c, round))
            return;
        if (k % POLITE == POLITE - 1)
            sched_yield();
#ifdef __x86_64__
        _mm_pause();
#endif
    }
    pthread_mutex_lock(&c->lock);
    __atomic_add_fetch(&c->asleep, 1, __ATOMIC_SEQ_CST);
    while (!ready(c, round))
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

static void *serve(void *self)
{
    const struct member *m = self;
    struct mill_crew *c = m->crew;
    for (uint64_t round = 1;; round++) {
        await(c, has_begun, round - 1);
        if (c->over)
            return NULL;
        c->part(c->work, m->part);
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
    c->over = false;
    for (c->started = 0; c->started + 1 < c->parts; c->started++) {
        struct member *m = &c->member[c->started];
        *m = (struct member){.crew = c, .part = c->started + 1};
        if (pthread_create(&m->id, NULL, serve, m) != 0)
            break;
    }
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return c->started + 1;
}

static void begin_round(struct mill_crew *c)
{
    __atomic_store_n(&c->left, c->started, __ATOMIC_SEQ_CST);
    __atomic_add_fetch(&c->round, 1, __ATOMIC_SEQ_CST);
    wake(c);
}

void mill_crew_end(struct mill_crew *c)
{
    c->over = true;
    begin_round(c);
    for (int k = 0; k < c->started; k++)
        pthread_join(c->member[k].id, NULL);
    c->started = 0;
}

void mill_crew_do(struct mill_crew *c, mill_crew_fn *part, void *work)
{
    c->part = part;
    c->work = work;
    begin_round(c);
    part(work, 0);
    for (int k = c->started + 1; k < c->parts; k++)
        part(work, k);
    await(c, is_done, 0);
}
