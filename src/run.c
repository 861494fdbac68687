/* One run: deck -> world -> event loop -> observers -> HDF5 file -> summary. The only place where
 * they are wired together. */
#include "run.h"

#include "frames.h"
#include "h5.h"
#include "impactlog.h"
#include "millsim/sim.h"
#include "record.h"
#include "series.h"
#include "summary.h"
#include "tally.h"

#include <gsl/gsl_errno.h>
#ifdef __linux__
#include <malloc.h>
#endif
#include <math.h>
#include <stdlib.h>
#include <time.h>

#ifndef MILL_VERSION
#define MILL_VERSION "unknown"
#endif

#define SHOW_EVERY 0.25 /* [s] of wall time between two reports of progress */

struct run {
    const struct mill_deck *deck;
    const struct mill_run_options *options;
    struct mill_world *world;
    struct mill_sim *sim;
    struct mill_h5 *file;
    struct mill_observer *frames, *series, *log;
    struct mill_tally *tally;
    double started, saved; /* [s] of wall time */
};

static double wall_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static enum mill_status open_output(struct run *r, struct mill_error *error)
{
    enum mill_status status = mill_h5_create(
        r->options->output, r->options->force ? MILL_H5_OVERWRITE : MILL_H5_NEW, &r->file, error);
    if (status == MILL_OK)
        status = mill_record_deck(r->file, r->deck, error);
    if (status == MILL_OK)
        status = mill_record_start(r->file, r->options->command, error);
    return status;
}

static enum mill_status add_observers(struct run *r, struct mill_error *error)
{
    enum mill_status status = mill_tally_create(r->deck, r->world, &r->tally, error);
    if (status == MILL_OK)
        status = mill_sim_observe(r->sim, mill_tally_observer(r->tally));
    if (status == MILL_OK)
        status = mill_frames_create(r->file, r->deck, r->world, &r->frames, error);
    if (status == MILL_OK)
        status = mill_sim_observe(r->sim, r->frames);
    if (status == MILL_OK)
        status = mill_series_create(r->file, r->deck, r->world, &r->series, error);
    if (status == MILL_OK)
        status = mill_sim_observe(r->sim, r->series);
    if (status == MILL_OK && r->deck->log_impacts) {
        status = mill_impactlog_create(r->file, r->deck, r->world, &r->log, error);
        if (status == MILL_OK)
            status = mill_sim_observe(r->sim, r->log);
    }
    return status;
}

static void show(const struct run *r)
{
    struct mill_progress p = {mill_sim_time(r->sim), r->deck->time, 0, wall_clock() - r->started};
    for (int k = 0; k < MILL_KINDS; k++)
        p.collisions += r->world->account.collisions[k];
    if (r->options->progress)
        r->options->progress(r->options->self, &p);
}

/* Everything gathered so far goes to the disk: a killed run leaves what it had at the last of
 * these. */
static enum mill_status save(struct run *r, struct mill_error *error)
{
    enum mill_status status = mill_frames_finish(r->frames, error);
    if (status == MILL_OK)
        status = mill_series_finish(r->series, error);
    if (status == MILL_OK && r->log)
        status = mill_impactlog_finish(r->log, error);
    if (status == MILL_OK)
        status = mill_h5_flush(r->file, error);
    r->saved = wall_clock();
    return status;
}

/* Runs in slices of events, sized by the clock so that progress moves on whatever an event costs.
 */
static enum mill_status advance(struct run *r, struct mill_error *error)
{
    uint64_t slice = 1000;
    enum mill_status status = save(r, error);
    while (status == MILL_OK) {
        const double before = wall_clock();
        const double reached = mill_sim_time(r->sim);
        status = mill_sim_run(r->sim, r->deck->time, slice, r->options->stop, error);
        const double took = wall_clock() - before;
        show(r);
        /* the end was reached before this slice too: nothing was left that is due at it */
        if (mill_sim_time(r->sim) >= r->deck->time && reached >= r->deck->time)
            break;
        if (status == MILL_OK && wall_clock() - r->saved > r->deck->checkpoint)
            status = save(r, error);
        slice = (uint64_t)fmin(fmax((double)slice * SHOW_EVERY / fmax(took, 1e-6), 100.0), 1e8);
    }
    return status;
}

/* Closes the books: everything up to now goes into the file, also after a stop or a failure. */
static enum mill_status conclude(struct run *r, enum mill_status ended, struct mill_error *error)
{
    const double local = mill_sim_local_time(r->sim);
    mill_sim_audit(r->sim);
    mill_tally_finish(r->tally, r->world, local);
    enum mill_status status = save(r, error);
    if (status == MILL_OK)
        status = mill_tally_write(r->tally, r->file, error);
    const struct mill_record_end end = {
        ended == MILL_OK ? "complete" : (ended == MILL_STOPPED ? "stopped" : "failed"),
        mill_sim_time(r->sim),
        local,
        wall_clock() - r->started,
        mill_record_cpu_time(),
        mill_record_peak_memory(),
    };
    if (status == MILL_OK)
        status = mill_record_finish(r->file, r->world, &end, error);
    return status;
}

static void summarise(const struct run *r, bool stopped)
{
    const struct mill_summary_facts facts = {wall_clock() - r->started,
                                             mill_record_cpu_time(),
                                             mill_record_peak_memory(),
                                             mill_sim_time(r->sim),
                                             MILL_VERSION,
                                             mill_deck_file(r->deck),
                                             r->options->output,
                                             stopped};
    if (r->options->json)
        mill_summary_json(r->options->summary, r->deck, r->world, r->tally, &facts);
    else
        mill_summary_print(r->options->summary, r->deck, r->world, r->tally, &facts);
}

static void release(struct run *r)
{
    mill_frames_free(r->frames);
    mill_series_free(r->series);
    mill_impactlog_free(r->log);
    mill_tally_free(r->tally);
    mill_sim_free(r->sim);
    mill_world_free(r->world);
}

enum mill_status mill_run(const struct mill_deck *deck, const struct mill_run_options *options,
                          struct mill_error *error)
{
    struct run r = {0};
    struct mill_error later = {""};
    r.deck = deck;
    r.options = options;
    r.started = wall_clock();
    gsl_set_error_handler_off(); /* its own handler would abort */
#ifdef M_MMAP_THRESHOLD
    /* else glibc keeps what the start's packing needed for good: half the memory of a large run */
    mallopt(M_MMAP_THRESHOLD, 1 << 20);
#endif
    enum mill_status status = mill_world_create(deck, &r.world, error);
    if (status == MILL_OK)
        status = mill_sim_create(r.world, &r.sim, error);
    if (status == MILL_OK && options->begun)
        *options->begun = 1;
    if (status == MILL_OK)
        status = open_output(&r, error);
    if (status == MILL_OK)
        status = add_observers(&r, error);
    if (status == MILL_OK) {
        if (options->paranoid)
            status = mill_sim_paranoid(r.sim, true, error);
        if (status == MILL_OK)
            status = advance(&r, error);
        const enum mill_status written = conclude(&r, status, &later);
        if (written != MILL_OK && (status == MILL_OK || status == MILL_STOPPED)) {
            status = written;
            *error = later;
        }
    }
    if (r.file) {
        const enum mill_status closed = mill_h5_close(r.file, &later);
        if (closed != MILL_OK && (status == MILL_OK || status == MILL_STOPPED)) {
            status = closed;
            *error = later;
        }
    }
    if (status == MILL_OK || status == MILL_STOPPED)
        summarise(&r, status == MILL_STOPPED);
    if (options->paranoid && r.sim)
        *options->paranoid = mill_sim_checks(r.sim);
    release(&r);
    return status;
}
