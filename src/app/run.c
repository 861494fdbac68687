/* One run: deck -> world -> event loop -> observers -> HDF5 file -> summary. The only place where
 * they are wired together. */
#include "app/run.h"

#include "app/run_private.h"
#include "app/summary.h"
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

/* Is the file's run complete, what ended it, and is there a state to go on from? */
static enum mill_status look_into(struct mill_run *r, struct mill_h5 *file,
                                  struct mill_error *error)
{
    const char *name = r->options->output;
    char *text = NULL;
    enum mill_status status = mill_h5_read_text(file, "/run/status", &text, error);
    if (status == MILL_OK && strcmp(text, "failed") == 0)
        status = mill_error_set(error, MILL_FAILED,
                                "%s: its run failed and would fail again; change the deck and "
                                "start again with --force",
                                name);
    r->complete = status == MILL_OK && strcmp(text, "complete") == 0;
    free(text);
    text = NULL;
    if (status == MILL_OK)
        status = mill_checkpoint_find(file, name, &r->resumes, error);
    if (status == MILL_OK && r->complete && mill_h5_exists(file, "/run/ended_by"))
        status = mill_h5_read_text(file, "/run/ended_by", &text, error);
    mill_error_set(&r->ended_by, MILL_OK, "%s", text ? text : "time");
    free(text);
    return status;
}

/* What --resume finds: `done` where nothing is left to do, a state to go on from, or none. */
static enum mill_status look(struct mill_run *r, bool *done, struct mill_error *error)
{
    const char *name = r->options->output;
    struct mill_h5 *file;
    if (access(name, F_OK) != 0) {
        r->note = "does not exist yet: starting from the beginning";
        return MILL_OK;
    }
    enum mill_status status = mill_h5_create(name, MILL_H5_READ, &file, error);
    if (status != MILL_OK)
        return status;
    status = mill_record_compare(file, name, r->deck, error);
    if (status == MILL_OK)
        status = look_into(r, file, error);
    *done = status == MILL_OK && r->complete && !r->resumes;
    if (*done) {
        mill_draft_clear(name);
        say(r, "is complete: nothing to resume");
    } else if (status == MILL_OK && !r->resumes) {
        r->note = "ended before its first checkpoint: starting from the beginning";
    }
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

/* What the deck asks of the observers */
static struct mill_observe asked_by(const struct mill_deck *deck)
{
    const double radius = deck->drum_radius;
    return (struct mill_observe){
        .end = deck->time,
        .sample_from = deck->sample_from,
        .sample_found = deck->sample_found,
        .precision = deck->precision,
        .max_collisions = deck->max_collisions,
        .strike_window = deck->strike_window,
        .frames = deck->frames,
        .series = deck->series,
        .log_impacts = deck->log_impacts,
        .rotor_angle = deck->rotor_angle,
        .drum = deck->wavy ? mill_profile_make((int)deck->buckles, radius, deck->buckle_height,
                                               deck->buckle_angle)
                           : mill_profile_make(2, radius, 0.0, 0.0),
    };
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
    mill_summary_known(known, &r->observers);
    for (int k = 0; k < MILL_KINDS; k++)
        p.collisions += r->world->account.collisions[k];
    if (r->options->progress)
        r->options->progress(r->options->self, &p);
}

/* Loop and observers take up the state, of a file that nobody else writes to any more; it is then
 * that of a run that goes on. */
static enum mill_status take_up(struct mill_run *r, struct mill_error *error)
{
    const struct mill_checkpoint to = {r->sim, &r->observers, &r->cost};
    enum mill_status status = look_into(r, r->file, error);
    if (status == MILL_OK && !r->resumes)
        status = mill_error_set(error, MILL_FAILED,
                                "%s: another run has written to it meanwhile; see whether it still "
                                "needs --resume",
                                r->options->output);
    if (status == MILL_OK)
        status = mill_checkpoint_load(&to, r->file, r->options->output, error);
    if (status == MILL_OK)
        mill_checkpoint_remove(r->file);
    r->saved = true;
    return status;
}

/* New observers, or those of the state */
static enum mill_status add_observers(struct mill_run *r, struct mill_error *error)
{
    const struct mill_observe asked = asked_by(r->deck);
    enum mill_status status = mill_observers_create(&asked, r->world, &r->observers, error);
    if (status == MILL_OK && r->resumes)
        status = take_up(r, error);
    if (status == MILL_OK)
        status = mill_observers_open(&r->observers, &asked, r->file, r->sim, error);
    return status;
}

/* Publishes all results up to now, as if the run ended here, together with the state. */
static enum mill_status save(struct mill_run *r, struct mill_error *error)
{
    const double before = mill_run_clock();
    mill_run_write(r, "running");
    mill_run_keep(r);
    const enum mill_status status = mill_h5_flush(r->file, error);
    mill_checkpoint_remove(r->file); /* its room in the file is free for what comes */
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
    r->due = shown + r->deck->checkpoint;
    while (status == MILL_OK) {
        const double end = r->deck->time;
        const double before = mill_run_clock();
        const double reached = mill_sim_time(r->sim);
        status = mill_sim_run(r->sim, end, slice, r->options->stop, error);
        const double now = mill_run_clock(), took = now - before;
        const bool whole = mill_sim_time(r->sim) < end; /* the slice: it was not cut off */
        if (whole || now - shown >= aim || mill_sim_time(r->sim) >= end) {
            show(r, false);
            shown = now;
        }
        /* the end was reached before this slice too: nothing was left that is due at it */
        if (mill_sim_time(r->sim) >= end && reached >= end)
            break;
        if (status == MILL_OK && mill_run_clock() > r->due)
            status = save(r, error);
        if (whole)
            slice = (uint64_t)fmin(fmax((double)slice * aim / fmax(took, 1e-6), 100.0), 1e8);
    }
    mill_error_set(&r->ended_by, MILL_OK, "%s", status == MILL_ENDED ? error->text : "time");
    r->complete = status == MILL_OK || status == MILL_ENDED;
    return r->complete ? MILL_OK : status;
}

static void release(struct mill_run *r)
{
    mill_observers_free(&r->observers);
    mill_sim_free(r->sim);
    mill_world_free(r->world);
}

/* Frames by the million rather come from a slip in a unit than from a wish. */
static void warn_of_frames(const struct mill_run *r)
{
    const double frames = r->deck->frames > 0 ? r->deck->time / r->deck->frames : 0;
    const double bytes = frames * r->world->balls * 9 * sizeof(float);
    char text[120];
    snprintf(text, sizeof text, "output.frames = %g s makes %.3g frames, %.3g GB or more",
             r->deck->frames, frames, bytes / 1e9);
    if (frames > 1e6)
        say(r, text);
}

static void say_resuming(const struct mill_run *r)
{
    char text[80];
    snprintf(text, sizeof text, "resuming at t = %.6g s", mill_sim_time(r->sim));
    say(r, text);
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
    if (status != MILL_OK)
        return status;
    if (r->resumes)
        say_resuming(r);
    else
        warn_of_frames(r);
    show(r, true);
    if (r->resumes)
        return MILL_OK;
    /* what --force replaces stays until there are results to put in its place */
    if (r->options->force && access(r->options->output, F_OK) == 0)
        return MILL_OK;
    /* a disk that cannot be written is told now, and a killed run leaves a file */
    return mill_h5_flush(r->file, error);
}

/* From the prepared run to its closed file */
static enum mill_status carry_out(struct mill_run *r, struct mill_error *error)
{
    struct mill_error later = {""};
    enum mill_status status =
        r->options->paranoid ? mill_sim_paranoid(r->sim, true, error) : MILL_OK;
    if (status == MILL_OK && !r->complete)
        status = advance(r, error);
    /* a checkpoint that failed is no end of the run: the one before it stands */
    const enum mill_status written =
        r->unsaved ? MILL_FAILED : mill_run_conclude(r, status, &later);
    if (written == MILL_OK)
        return status;
    if (!r->unsaved && (status == MILL_OK || status == MILL_STOPPED))
        *error = later;
    if (written == MILL_FAILED)
        mill_run_explain(r, error);
    return written;
}

enum mill_status mill_run(const struct mill_deck *deck, const struct mill_run_options *options,
                          struct mill_error *error)
{
    struct mill_run r = {.deck = deck, .options = options, .started = mill_run_clock()};
    struct mill_error later = {""};
    bool done = false;
    enum mill_status status = options->resume ? look(&r, &done, error) : MILL_OK;
    if (status != MILL_OK || done)
        return status;
    status = prepare(&r, error);
    if (status == MILL_OK)
        status = carry_out(&r, error);
    mill_h5_abandon(r.file); /* still open: something failed, and what was published stands */
    if ((status == MILL_OK || status == MILL_STOPPED) &&
        mill_run_summarise(&r, &later) != MILL_OK) {
        *error = later;
        status = MILL_FAILED;
    }
    if (options->paranoid && r.sim)
        *options->paranoid = mill_sim_checks(r.sim);
    release(&r);
    return status;
}
