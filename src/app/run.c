/* One run: deck -> world -> event loop -> observers -> HDF5 file -> summary. The only place where
 * they are wired together. */
#include "app/run.h"

#include "app/checkpoint.h"
#include "app/record.h"
#include "app/run_private.h"
#include "app/summary.h"
#include "observe/vtkhdf.h"
#include "store/draft.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define MOST_SHARE 0.02 /* of the wall time goes into checkpoints, whatever their interval */

static void say(const struct mill_run *r, const char *what)
{
    struct mill_error line;
    mill_error_set(&line, MILL_OK, "%s: %s", r->options->output, what);
    if (r->options->say)
        r->options->say(line.text);
}

/* What --resume finds: `done` where nothing is left to do, a state to go on from, or none. */
static enum mill_status look(struct mill_run *r, bool *done, struct mill_error *error)
{
    const char *name = r->options->output;
    struct mill_h5 *file;
    char *ended = NULL;
    if (access(name, F_OK) != 0) {
        r->note = "does not exist yet: starting from the beginning";
        return MILL_OK;
    }
    enum mill_status status = mill_h5_create(name, MILL_H5_READ, &file, error);
    if (status != MILL_OK)
        return status;
    status = mill_record_compare(file, name, r->deck, error);
    if (status == MILL_OK)
        status = mill_h5_read_text(file, "/run/status", &ended, error);
    if (status == MILL_OK && strcmp(ended, "failed") == 0)
        status = mill_error_set(error, MILL_FAILED,
                                "%s: its run failed and would fail again; change the deck and "
                                "start again with --force",
                                name);
    *done = status == MILL_OK && strcmp(ended, "complete") == 0;
    if (status == MILL_OK && !*done)
        status = mill_checkpoint_read(file, name, &r->at, &r->resumes, error);
    if (*done) {
        mill_draft_clear(name);
        say(r, "is complete: nothing to resume");
    } else if (status == MILL_OK && !r->resumes)
        r->note = "ended before its first checkpoint: starting from the beginning";
    free(ended);
    mill_h5_close(file, NULL);
    return status;
}

static enum mill_status open_output(struct mill_run *r, struct mill_error *error)
{
    const char *name = r->options->output;
    if (r->resumes)
        return mill_h5_create(name, MILL_H5_UPDATE, &r->file, error);
    const enum mill_h5_open how = r->options->force    ? MILL_H5_OVERWRITE
                                  : r->options->resume ? MILL_H5_RESTART
                                                       : MILL_H5_NEW;
    const enum mill_status status = mill_h5_create(name, how, &r->file, error);
    if (status != MILL_OK)
        return status;
    mill_record_deck(r->file, r->deck);
    mill_record_start(r->file, r->options->command);
    return mill_h5_status(r->file, error);
}

/* The observers that write as they go: new ones, or those of the state. */
static enum mill_status make_writers(struct mill_run *r, struct mill_error *error)
{
    const struct mill_checkpoint *at = &r->at;
    mill_vtkhdf_remove(r->file);
    enum mill_status status =
        r->resumes ? mill_frames_resume(r->file, r->deck, r->world, &at->frames, &r->frames, error)
                   : mill_frames_create(r->file, r->deck, r->world, &r->frames, error);
    if (status == MILL_OK)
        status = r->resumes ? mill_series_resume(r->file, r->deck, r->world, &at->series,
                                                 &r->series, error)
                            : mill_series_create(r->file, r->deck, r->world, &r->series, error);
    if (status == MILL_OK && r->deck->log_impacts)
        status = r->resumes
                     ? mill_impactlog_resume(r->file, r->deck, r->world, &at->log, &r->log, error)
                     : mill_impactlog_create(r->file, r->deck, r->world, &r->log, error);
    return status;
}

static enum mill_status add_observers(struct mill_run *r, struct mill_error *error)
{
    enum mill_status status = mill_tally_create(r->deck, r->world, &r->tally, error);
    if (status == MILL_OK)
        status = make_writers(r, error);
    if (status != MILL_OK)
        return status;
    struct mill_observer *all[] = {mill_tally_observer(r->tally), r->frames, r->series, r->log};
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++)
        if (all[k] && status == MILL_OK)
            status = mill_sim_observe(r->sim, all[k]);
    return status;
}

static void show(const struct mill_run *r, bool begins)
{
    char known[MILL_SUMMARY_KNOWN];
    struct mill_progress p = {mill_sim_time(r->sim),
                              r->deck->time,
                              0,
                              mill_run_clock() - r->started,
                              begins,
                              NULL,
                              known};
    mill_summary_known(known, r->tally);
    for (int k = 0; k < MILL_KINDS; k++)
        p.collisions += r->world->account.collisions[k];
    if (r->options->progress)
        r->options->progress(r->options->self, &p);
}

/* Sim and tally take up the state; the file is then that of a run that goes on. */
static enum mill_status take_up(struct mill_run *r, struct mill_error *error)
{
    char text[80];
    const enum mill_status status =
        mill_checkpoint_load(r->file, r->options->output, &r->at, r->sim, r->tally, error);
    r->saved = true;
    r->cost = r->at.cost;
    snprintf(text, sizeof text, "resuming at t = %.6g s", mill_sim_time(r->sim));
    if (status == MILL_OK) {
        say(r, text);
        show(r, true);
    }
    return status;
}

static enum mill_status take_state(const struct mill_run *r, struct mill_checkpoint_state *state,
                                   struct mill_error *error)
{
    const struct mill_checkpoint_parts parts = {r->sim, r->tally, r->frames, r->series, r->log};
    const struct mill_record_cost cost = mill_run_cost(r);
    return mill_checkpoint_take(&parts, &cost, state, error);
}

/* Publishes all results up to now, as if the run ended here, together with the state. */
static enum mill_status save(struct mill_run *r, struct mill_error *error)
{
    const double before = mill_run_clock();
    struct mill_checkpoint_state state;
    enum mill_status status = take_state(r, &state, error);
    if (status == MILL_OK) {
        mill_run_write(r, "running", &state);
        status = mill_h5_flush(r->file, error);
    }
    if (status == MILL_OK) {
        mill_checkpoint_remove(r->file); /* its room in the file is free for what comes */
        mill_checkpoint_rewind(&state, r->tally);
    }
    mill_checkpoint_release(&state);
    r->unsaved = status != MILL_OK;
    r->saved = r->saved || status == MILL_OK;
    const double now = mill_run_clock();
    r->cost.checkpoints++;
    r->cost.saving += now - before;
    r->due = now + fmax(r->deck->checkpoint, (now - before) * (1.0 / MOST_SHARE - 1.0));
    return status;
}

/* Runs in slices of events, sized by the clock so that progress moves on whatever an event costs.
 */
static enum mill_status advance(struct mill_run *r, struct mill_error *error)
{
    const double aim = fmin(MILL_RUN_SHOW_EVERY, r->deck->checkpoint);
    uint64_t slice = 1000;
    enum mill_status status = MILL_OK;
    double shown = mill_run_clock();
    bool over;
    r->due = shown + r->deck->checkpoint;
    while (status == MILL_OK) {
        /* the tally may end the run at times of its own */
        const double until = fmin(r->deck->time, mill_tally_next_end(r->tally, &over));
        const double before = mill_run_clock();
        const double reached = mill_sim_time(r->sim);
        if (over)
            break;
        status = mill_sim_run(r->sim, until, slice, r->options->stop, error);
        const double now = mill_run_clock(), took = now - before;
        const bool whole = mill_sim_time(r->sim) < until; /* the slice: it was not cut off */
        if (whole || now - shown >= aim || mill_sim_time(r->sim) >= r->deck->time) {
            show(r, false);
            shown = now;
        }
        /* the end was reached before this slice too: nothing was left that is due at it */
        if (mill_sim_time(r->sim) >= r->deck->time && reached >= r->deck->time)
            break;
        if (status == MILL_OK && mill_run_clock() > r->due)
            status = save(r, error);
        if (whole)
            slice = (uint64_t)fmin(fmax((double)slice * aim / fmax(took, 1e-6), 100.0), 1e8);
    }
    return status;
}

/* Closes the books: everything up to now goes into the file, also after a stop or a failure. A
 * stopped run can go on. */
static enum mill_status conclude(struct mill_run *r, enum mill_status ended,
                                 struct mill_error *error)
{
    const bool stopped = ended == MILL_STOPPED;
    struct mill_checkpoint_state state = {0};
    enum mill_status status = stopped ? take_state(r, &state, error) : MILL_OK;
    if (status == MILL_OK) {
        mill_sim_audit(r->sim); /* after the state: an undisturbed run is not audited here */
        mill_run_write(r, ended == MILL_OK ? "complete" : (stopped ? "stopped" : "failed"),
                       stopped ? &state : NULL);
    }
    mill_checkpoint_release(&state);
    return status;
}

static void release(struct mill_run *r)
{
    mill_frames_free(r->frames);
    mill_series_free(r->series);
    mill_impactlog_free(r->log);
    mill_tally_free(r->tally);
    mill_sim_free(r->sim);
    mill_world_free(r->world);
}

/* The mill as the deck or the state says, and a file that holds what is known so far. */
static enum mill_status prepare(struct mill_run *r, struct mill_error *error)
{
    enum mill_status status = mill_run_build(r->deck, r->options, &r->world, error);
    if (status == MILL_OK)
        status = mill_sim_create(r->world, &r->sim, error);
    if (status == MILL_OK && r->options->begun)
        *r->options->begun = 1;
    if (status == MILL_OK)
        status = open_output(r, error);
    if (status == MILL_OK && r->note)
        say(r, r->note);
    if (status == MILL_OK)
        status = add_observers(r, error);
    if (status == MILL_OK && r->resumes)
        return take_up(r, error);
    if (status == MILL_OK)
        show(r, true);
    /* what --force replaces stays until there are results to put in its place */
    if (status == MILL_OK && r->options->force && access(r->options->output, F_OK) == 0)
        return MILL_OK;
    /* a disk that cannot be written is told now, and a killed run leaves a file */
    return status == MILL_OK ? mill_h5_flush(r->file, error) : status;
}

static enum mill_status close_output(struct mill_run *r, struct mill_error *error)
{
    struct mill_h5 *file = r->file;
    r->file = NULL;
    return mill_h5_close(file, error);
}

enum mill_status mill_run(const struct mill_deck *deck, const struct mill_run_options *options,
                          struct mill_error *error)
{
    struct mill_run r = {0};
    struct mill_error later = {""};
    bool done = false;
    r.deck = deck;
    r.options = options;
    r.started = mill_run_clock();
    enum mill_status status = options->resume ? look(&r, &done, error) : MILL_OK;
    if (status != MILL_OK || done)
        return status;
    status = prepare(&r, error);
    const bool prepared = status == MILL_OK;
    if (prepared) {
        if (options->paranoid)
            status = mill_sim_paranoid(r.sim, true, error);
        if (status == MILL_OK)
            status = advance(&r, error);
        /* a checkpoint that failed is no end of the run: the one before it stands */
        enum mill_status written = r.unsaved ? MILL_FAILED : conclude(&r, status, &later);
        if (written == MILL_OK)
            written = close_output(&r, &later);
        if (written != MILL_OK && (status == MILL_OK || status == MILL_STOPPED))
            *error = later;
        if (written != MILL_OK) {
            status = written;
            mill_run_explain(&r, error);
        }
    }
    mill_h5_abandon(r.file); /* still open: something failed, and what was published stands */
    if (status == MILL_OK || status == MILL_STOPPED)
        mill_run_summarise(&r, status == MILL_STOPPED);
    if (options->paranoid && r.sim)
        *options->paranoid = mill_sim_checks(r.sim);
    release(&r);
    return status;
}
