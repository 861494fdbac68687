/* The observers on a second thread. The event loop writes impacts into a ring, in order of events,
 * and the second thread gives them to the observers in this order. For a sample the loop copies the
 * world and goes on, if it knows when the observers want the next one; otherwise it waits until
 * they have got all impacts, and takes the sample itself. So every observer gets the same calls as
 * with one thread, and gathers the same bits.
 *
 * Impacts are handed over in batches, because it takes the loop some microseconds to wake the
 * second thread, which has far less to do and sleeps in between. The thread lives for one call of
 * mill_sim_run. It is started when there is a batch for it, and after the call there is none: the
 * caller may read the observers, write files or fork. If it cannot be started, the loop calls the
 * observers itself. */
#include "engine/sim_private.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum {
    RING = 16384,
    BATCH = 4096,        /* impacts */
    MOST_COPIED = 100000 /* balls: in larger mills a copy would take too much memory */
};

/* A sample that the second thread takes */
struct sample {
    bool due;             /* it has not been taken yet */
    uint64_t after;       /* impacts that come before it */
    double time, local;   /* [s] simulated; the same as local time */
    struct mill_world of; /* with its own balls; it shares everything else */
};

struct mill_sim_thread {
    struct mill_observer *const *observer; /* the loop's */
    int observers;
    double next[MILL_SIM_OBSERVERS]; /* [s] of each: time of its next sample that the loop has not
                                        come to */
    bool runs;                       /* the second thread exists */
    bool ran;                        /* it has existed in this call or an earlier one */
    bool refused;                    /* it could not be started */
    uint64_t made;                   /* impacts in the ring so far */
    uint64_t batch;                  /* of `made`: where the loop hands over, */
    uint64_t decide;                 /* where it must know what the observers say, */
    uint64_t halt;                   /* and the earlier one of both */
    pthread_t id;
    pthread_mutex_t lock;
    pthread_cond_t more, less;
    /* ---- shared: with the lock ---- */
    uint64_t ready, done;    /* impacts handed over; impacts that the observers have got */
    bool waits;              /* the loop waits for `less` */
    bool over;               /* nothing more comes */
    enum mill_status status; /* of the observers; after a failure they are not called any more */
    struct mill_error error;
    struct sample sample;
    struct mill_impact ring[RING];
};

struct mill_sim_thread *mill_sim_thread_create(const struct mill_world *world)
{
    struct mill_sim_thread *t = calloc(1, sizeof *t);
    if (!t)
        return NULL;
    t->batch = BATCH;
    pthread_mutex_init(&t->lock, NULL);
    pthread_cond_init(&t->more, NULL);
    pthread_cond_init(&t->less, NULL);
    if (world->balls <= MOST_COPIED) {
        t->sample.of.ball = malloc(sizeof *world->ball * (size_t)world->balls);
        t->sample.of.spin = malloc(sizeof *world->spin * (size_t)world->balls);
    }
    return t;
}

void mill_sim_thread_free(struct mill_sim_thread *t)
{
    if (!t)
        return;
    free(t->sample.of.ball);
    free(t->sample.of.spin);
    pthread_cond_destroy(&t->less);
    pthread_cond_destroy(&t->more);
    pthread_mutex_destroy(&t->lock);
    free(t);
}

bool mill_sim_thread_ran(const struct mill_sim_thread *t)
{
    return t->ran;
}

enum mill_status mill_sim_sample(struct mill_observer *const *observer, int observers,
                                 const struct mill_world *world, double t, double due,
                                 struct mill_error *error)
{
    enum mill_status all = MILL_OK;
    for (int k = 0; mill_sim_goes_on(all) && k < observers; k++) {
        struct mill_observer *o = observer[k];
        if (o->next > due)
            continue;
        enum mill_status one = o->type->sample(o, world, t, error);
        if (one == MILL_OK && !(o->next > due))
            one = mill_error_set(error, MILL_FAILED,
                                 "%s: did not set a later time for its next sample", o->type->name);
        all = one != MILL_OK ? one : all;
    }
    return all;
}

/* ---- the second thread ---- */

static enum mill_status take_sample(struct mill_sim_thread *t)
{
    const struct sample *s = &t->sample;
    enum mill_status status =
        mill_sim_sample(t->observer, t->observers, &s->of, s->local, s->time, &t->error);
    for (int k = 0; k < t->observers && status == MILL_OK; k++)
        if (t->observer[k]->next != t->next[k])
            status = mill_error_set(&t->error, MILL_FAILED,
                                    "%s: its next sample is at another time than it said",
                                    t->observer[k]->type->name);
    return status;
}

/* Gives what the loop has handed over to the observers: the impacts up to the next sample, but a
 * batch at most, and this sample. The caller holds the lock. */
static void give(struct mill_sim_thread *t)
{
    const uint64_t from = t->done, batch = t->ready < from + BATCH ? t->ready : from + BATCH;
    const bool samples = t->sample.due && t->sample.after <= batch;
    const uint64_t end = samples ? t->sample.after : batch;
    enum mill_status status = t->status;
    pthread_mutex_unlock(&t->lock);
    for (uint64_t i = from; status == MILL_OK && i < end; i++)
        status = mill_sim_tell(t->observer, t->observers, &t->ring[i % RING], &t->error);
    if (samples && status == MILL_OK)
        status = take_sample(t);
    pthread_mutex_lock(&t->lock);
    t->status = status;
    t->done = end;
    t->sample.due = t->sample.due && !samples;
}

static bool has_more(const struct mill_sim_thread *t)
{
    return t->done < t->ready || t->sample.due;
}

static void *serve(void *self)
{
    struct mill_sim_thread *t = self;
    pthread_mutex_lock(&t->lock);
    while (has_more(t) || !t->over) {
        if (has_more(t))
            give(t);
        else
            pthread_cond_wait(&t->more, &t->lock);
        if (t->waits)
            pthread_cond_signal(&t->less);
    }
    pthread_mutex_unlock(&t->lock);
    return NULL;
}

/* ---- the event loop's thread ---- */

/* Signals are for this thread alone. */
static bool start(struct mill_sim_thread *t)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    t->over = false;
    t->runs = pthread_create(&t->id, NULL, serve, t) == 0;
    t->refused = !t->runs;
    t->ran = t->ran || t->runs;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return t->runs;
}

/* Waits until no more than `left` impacts, and no sample if `sample`, are to be given to the
 * observers. The caller holds the lock. */
static void await(struct mill_sim_thread *t, uint64_t left, bool sample)
{
    t->waits = true;
    while (t->made - t->done > left || (sample && t->sample.due))
        pthread_cond_wait(&t->less, &t->lock);
    t->waits = false;
}

/* Hands over all impacts, and waits until no more than `left` are to be given, or nothing for 0.
 * Returns the status of the observers so far. */
static enum mill_status hand_over(struct mill_sim_thread *t, uint64_t left,
                                  struct mill_error *error)
{
    pthread_mutex_lock(&t->lock);
    t->ready = t->made;
    pthread_cond_signal(&t->more);
    while (!t->runs && has_more(t))
        give(t);
    await(t, left, left == 0);
    const enum mill_status status = t->status;
    pthread_mutex_unlock(&t->lock);
    if (status != MILL_OK)
        *error = t->error;
    return status;
}

static void set_halt(struct mill_sim_thread *t, bool handed_over)
{
    t->batch = handed_over ? t->made + BATCH : t->batch;
    t->halt = t->batch < t->decide ? t->batch : t->decide;
}

/* Finds out how many impacts the observers can get before one of them could end the run. They have
 * got all. */
static void look_ahead(struct mill_sim_thread *t)
{
    uint64_t ahead = UINT64_MAX / 2;
    for (int k = 0; k < t->observers; k++) {
        const struct mill_observer *o = t->observer[k];
        const uint64_t own = o->type->impact && o->type->ahead ? o->type->ahead(o) : ahead;
        ahead = own < ahead ? own : ahead;
    }
    t->decide = t->made + (ahead > 0 ? ahead : 1);
}

static void look_at_next(struct mill_sim_thread *t)
{
    for (int k = 0; k < t->observers; k++)
        t->next[k] = t->observer[k]->next;
}

void mill_sim_thread_begin(struct mill_sim_thread *t, struct mill_observer *const *observer,
                           int observers)
{
    t->observer = observer;
    t->observers = observers;
    t->status = MILL_OK;
    look_at_next(t);
    look_ahead(t);
    set_halt(t, false); /* also many short calls fill a batch */
}

enum mill_status mill_sim_thread_wait(struct mill_sim_thread *t, struct mill_error *error)
{
    const enum mill_status status = hand_over(t, 0, error);
    look_ahead(t);
    set_halt(t, t->runs);
    return status;
}

enum mill_status mill_sim_thread_end(struct mill_sim_thread *t, struct mill_error *error)
{
    const enum mill_status status = mill_sim_thread_wait(t, error);
    if (!t->runs)
        return status;
    pthread_mutex_lock(&t->lock);
    t->over = true;
    pthread_cond_signal(&t->more);
    pthread_mutex_unlock(&t->lock);
    pthread_join(t->id, NULL);
    t->runs = false;
    return status;
}

/* Makes this thread the owner of the lines of the ring that the impact after the next one needs:
 * otherwise every impact would wait for the second thread's cache. */
#if defined __x86_64__ && defined __GNUC__
__attribute__((target("prfchw")))
#endif
static void
claim(const struct mill_impact *impact)
{
    for (size_t at = 0; at < sizeof *impact; at += 64)
        __builtin_prefetch((const char *)impact + at, 1);
}

enum mill_status mill_sim_thread_push(struct mill_sim_thread *t, const struct mill_impact *impact,
                                      struct mill_error *error)
{
    t->ring[t->made++ % RING] = *impact;
    claim(&t->ring[(t->made + 1) % RING]);
    if (t->made < t->halt)
        return MILL_OK;
    if (t->made == t->decide)
        return mill_sim_thread_wait(t, error);
    if (!t->runs && !t->refused)
        start(t);
    const enum mill_status status = hand_over(t, RING - BATCH, error);
    set_halt(t, true);
    return status;
}

/* Copies the world for the second thread, if that is allowed. The sample before has been taken. */
static bool copy(struct mill_sim_thread *t, const struct mill_world *world, double local,
                 double due)
{
    struct sample *s = &t->sample;
    struct mill_ball *ball = s->of.ball;
    vec3 *spin = s->of.spin;
    bool known = t->runs && t->status == MILL_OK && ball && spin;
    double next[MILL_SIM_OBSERVERS] = {0};
    for (int k = 0; known && k < t->observers; k++) {
        const struct mill_observer *o = t->observer[k];
        next[k] = t->next[k] > due ? t->next[k] : o->type->then ? o->type->then(o) : 0.0;
        known = next[k] > due;
    }
    if (!known)
        return false;
    memcpy(t->next, next, sizeof next);
    s->of = *world;
    s->of.ball = memcpy(ball, world->ball, sizeof *ball * (size_t)world->balls);
    s->of.spin = memcpy(spin, world->spin, sizeof *spin * (size_t)world->balls);
    s->time = due;
    s->local = local;
    s->after = t->made;
    s->due = true;
    return true;
}

enum mill_status mill_sim_thread_sample(struct mill_sim_thread *t, const struct mill_world *world,
                                        double local, double due, struct mill_error *error)
{
    pthread_mutex_lock(&t->lock);
    await(t, RING, true);
    const bool copied = copy(t, world, local, due);
    if (copied) {
        t->ready = t->made;
        pthread_cond_signal(&t->more);
    }
    pthread_mutex_unlock(&t->lock);
    if (copied) {
        set_halt(t, true);
        return MILL_OK;
    }
    enum mill_status status = mill_sim_thread_wait(t, error);
    if (status == MILL_OK)
        status = mill_sim_sample(t->observer, t->observers, world, local, due, error);
    look_at_next(t);
    return status;
}

double mill_sim_thread_next(const struct mill_sim_thread *t, int k)
{
    return t->next[k];
}
