/* How a run begins: the world from the deck, watched, for it may take a while; and the command that
 * wants nothing but that, as a file. */
#include "app/run_private.h"
#include "app/start_write.h"
#include "deck/deck.h"

#include <time.h>

double mill_run_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

struct watch {
    const struct mill_run_options *options;
    double began; /* [s] of wall time */
    double shown; /* [s] from then, when the start was shown last */
};

/* A start that takes long is seen too. */
static void show(void *self, const char *what, int32_t done, int32_t all)
{
    struct watch *w = self;
    const double wall = mill_run_clock() - w->began;
    const struct mill_progress p = {done, all, 0, wall, false, what, NULL};
    if (!w->options->progress || wall < w->shown + MILL_RUN_SHOW_EVERY)
        return;
    w->shown = wall;
    w->options->progress(w->options->self, &p);
}

enum mill_status mill_run_build(const struct mill_deck *deck,
                                const struct mill_run_options *options, struct mill_world **world,
                                struct mill_error *error)
{
    struct watch w = {options, mill_run_clock(), 0.0};
    const struct mill_start_watch watch = {show, &w};
    return mill_deck_setup_world(deck, &watch, world, error);
}

enum mill_status mill_run_export(const struct mill_deck *deck,
                                 const struct mill_run_options *options, struct mill_error *error)
{
    struct mill_world *world = NULL;
    enum mill_status status = mill_run_build(deck, options, &world, error);
    if (status != MILL_OK)
        return status;
    if (options->begun) /* a signal waits: writing takes a moment, and would leave its draft */
        *options->begun = 1;
    status = mill_start_write(world, deck->file, options->output, options->force, error);
    mill_world_free(world);
    return status;
}
