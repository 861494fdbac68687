/* The threads of the soft spheres: each does some parts of a phase, then waits for the others */
#include "engine/soft.h"

/* Costs have the unit of 10 ns, more or less. */
#define TELLING 80.0 /* cost of one contact */

static double cost_of(const struct mill_soft_part *p)
{
    return 0.4 * (double)(p->last - p->first) + 0.1 * (double)p->near.count +
           4.0 * (double)p->touch.count;
}

/* Contacts that have ended go to the account and to the observers. */
static void tell(struct mill_sim *sim)
{
    struct mill_soft *s = sim->soft;
    struct mill_soft_part *p = s->part;
    for (uint64_t left = s->told; left != 0; left >>= 1, p++) {
        if (!(left & 1))
            continue;
        const struct mill_sim_entry *entry = p->told.item;
        for (size_t n = 0; n < p->told.count; n++)
            mill_sim_count(sim, &entry[n]);
        s->tells += p->told.count;
        p->told.count = 0;
    }
}

/* A thread has the same parts in each step, so they stay in the cache of its core. */
static void work(void *self, int thread)
{
    struct mill_soft *s = self;
    if (thread == 0 && s->teller)
        tell(s->teller);
    struct mill_soft_gist gist = {.fastest = 0.0};
    for (int k = s->share[thread]; k < s->share[thread + 1]; k++) {
        const struct mill_soft_part *p = &s->part[k];
        s->phase(s, &s->part[k]);
        gist.fastest = mill_greatest(gist.fastest, p->fastest);
        if (!s->teller) /* else the first thread takes them now */
            gist.told |= (uint64_t)(p->told.count > 0) << k;
        gist.failed += p->failed;
    }
    s->gist[thread] = gist;
}

void mill_soft_share(struct mill_soft *s)
{
    const int threads = s->threads;
    const double steps = (double)s->world->soft_facts.steps + 1.0;
    double so_far = TELLING * (double)s->tells / steps, all = so_far;
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

bool mill_soft_do(struct mill_soft *s, void (*phase)(struct mill_soft *, struct mill_soft_part *))
{
    uint64_t failed = 0;
    s->phase = phase;
    if (s->crew)
        mill_crew_do(s->crew, work, s);
    else
        work(s, 0);
    s->fastest = 0.0;
    s->told = 0;
    for (int k = 0; k < s->threads; k++) {
        s->fastest = mill_greatest(s->fastest, s->gist[k].fastest);
        s->told |= s->gist[k].told;
        failed += s->gist[k].failed;
    }
    return failed == 0;
}

static void drop(struct mill_soft *s)
{
    if (s->crew)
        mill_crew_end(s->crew);
    mill_crew_free(s->crew);
    s->crew = NULL;
    s->threads = 1;
}

void mill_soft_use_threads(struct mill_soft *s, int threads)
{
    const int most = s->parts < MILL_CREW_MOST ? s->parts : MILL_CREW_MOST;
    drop(s);
    s->crew = threads > 1 ? mill_crew_create(threads < most ? threads : most) : NULL;
    s->threads = s->crew ? mill_crew_begin(s->crew) : 1;
    if (s->threads < threads && s->threads < most)
        drop(s); /* there are no more threads: one does all */
    mill_soft_share(s);
}
