/* The threads of the soft spheres: each does some parts of a phase, then they wait for each other.
 */
#include "engine/soft.h"

static double cost_of(const struct mill_soft_part *p)
{
    return 0.4 * (double)(p->last - p->first) + 0.1 * (double)p->near.count +
           4.0 * (double)p->touch.count;
}

/* A thread has the same parts in each step, so they stay in the cache of its core. */
static void work(void *self, int thread)
{
    struct mill_soft *s = self;
    for (int k = s->share[thread]; k < s->share[thread + 1]; k++)
        s->phase(s, &s->part[k]);
}

/* Shares the parts among the threads, by what their steps cost: contacts more than balls */
static void share(struct mill_soft *s)
{
    const int threads = s->shared ? s->threads : 1;
    double all = 0.0, so_far = 0.0;
    int thread = 0;
    for (int k = 0; k < s->parts; k++)
        all += cost_of(&s->part[k]);
    for (int k = 0; k < s->parts; k++) {
        while (thread < threads && so_far + 0.5 * cost_of(&s->part[k]) >= thread * all / threads)
            s->share[thread++] = k;
        so_far += cost_of(&s->part[k]);
    }
    while (thread <= threads)
        s->share[thread++] = s->parts;
    s->share[0] = 0;
}

void mill_soft_do(struct mill_soft *s, void (*phase)(struct mill_soft *, struct mill_soft_part *))
{
    s->phase = phase;
    if (s->shared)
        mill_crew_do(s->crew, work, s);
    else
        for (int k = 0; k < s->parts; k++)
            phase(s, &s->part[k]);
}

void mill_soft_begin(struct mill_soft *s)
{
    s->shared = s->crew && mill_crew_begin(s->crew) == s->threads;
    share(s);
}

void mill_soft_end(struct mill_soft *s)
{
    if (s->crew)
        mill_crew_end(s->crew);
    s->shared = false;
}

void mill_soft_use_threads(struct mill_soft *s, int threads)
{
    const int most = s->parts < MILL_CREW_MOST ? s->parts : MILL_CREW_MOST;
    mill_crew_free(s->crew);
    s->threads = threads < most ? threads : most;
    s->crew = s->threads > 1 ? mill_crew_create(s->threads) : NULL;
    s->threads = s->crew ? s->threads : 1;
}
