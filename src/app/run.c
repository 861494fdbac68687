/* A run: deck -> world -> event loop -> observers -> HDF5 file -> summary. Only here all meet. */
#include "app/run.h"

#include "app/forecast.h"
#include "app/starts.h"
#include "app/summary.h"
#include "store/draft.h"
#include "store/version.h"

#include <unistd.h>

#define MOST_SHARE 0.02   /* maximum part of the wall time for checkpoints, for any interval */
#define MANY_FRAMES 10000 /* from this number on, /VTKHDF takes long */

/* A run from its start to its end */
struct run {
    struct mill_run_order *order;
    const char *const *given; /* options */
    const struct mill_deck *deck;
    const char *output; /* path */
    struct mill_error *error;
    enum mill_status status; /* of the last step */
    struct mill_starts starts;
    struct mill_starts_one *first; /* its frames and time series are those of the file */
    struct mill_h5 *file;
    bool resumes;                 /* there is a state to continue from */
    bool complete;                /* the end is reached; the file may still have to be finished */
    double due;                   /* [s] wall time of the next checkpoint */
    struct mill_record_cost cost; /* of parts before --resume; checkpoints also of this part */
    bool saved;                   /* there is a checkpoint to resume from */
    struct mill_error note;       /* what --resume found, to be printed when the file is locked */
};

/* Prints the note once. */
static void say(struct run *r)
{
    struct mill_error line;
    mill_error_set(&line, MILL_OK, "%s: %s", r->output, r->note.text);
    if (r->note.text[0] && !r->given[MILL_QUIET])
        r->order->say(line.text);
    r->note.text[0] = '\0';
}

/* Notes the status of a step; false: it is not MILL_OK, so the steps end here */
static bool ok(struct run *r, enum mill_status status)
{
    r->status = status;
    return status == MILL_OK;
}

/* ---- the start ---- */

/* Finds out whether the file's run is complete, and whether there is a state to continue from. */
static bool read_earlier(struct run *r, struct mill_h5 *file)
{
    char *text = NULL;
    bool good = ok(r, mill_h5_read_text(file, "/run/status", &text, r->error));
    if (good && strcmp(text, "failed") == 0)
        good = ok(r, mill_error_set(r->error, MILL_FAILED,
                                    "%s: its run failed and would fail again; change the deck and "
                                    "start again with --force",
                                    r->output));
    r->complete = good && strcmp(text, "complete") == 0;
    free(text);
    return good && ok(r, mill_checkpoint_find(file, r->output, &r->resumes, r->error));
}

/* Finds what --resume can do: go on, start anew, or nothing (a complete run without a state) */
static bool find_earlier(struct run *r)
{
    struct mill_h5 *file = NULL;
    if (access(r->output, F_OK) != 0) {
        mill_error_set(&r->note, MILL_OK, "does not exist yet: starting from the beginning");
        return true;
    }
    const bool good = ok(r, mill_h5_create(r->output, MILL_H5_READ, &file, r->error)) &&
                      ok(r, mill_record_compare(file, r->output, r->deck, r->error)) &&
                      read_earlier(r, file);
    if (good && r->complete && !r->resumes) {
        mill_draft_clear(r->output);
        mill_error_set(&r->note, MILL_OK, "is complete: nothing to resume");
        say(r);
    } else if (!r->resumes) {
        mill_error_set(&r->note, MILL_OK,
                       "ended before its first checkpoint: starting from the beginning");
    }
    mill_h5_close(file, NULL);
    return good;
}

static bool open_output(struct run *r)
{
    const enum mill_h5_open how = r->resumes              ? MILL_H5_UPDATE
                                  : r->given[MILL_FORCE]  ? MILL_H5_OVERWRITE
                                  : r->given[MILL_RESUME] ? MILL_H5_RESTART
                                                          : MILL_H5_NEW;
    *r->order->begun = 1;
    bool good = ok(r, mill_h5_create(r->output, how, &r->file, r->error));
    if (good && !r->resumes) {
        mill_record_start(r->file, r->deck, r->order->asked->line);
        good = ok(r, mill_h5_status(r->file, r->error));
    }
    if (good)
        say(r);
    return good;
}

/* Loads the state into loop and observers. The file is locked, so no other run writes to it. From
 * now on the file is that of an unfinished run. */
static bool take_up(struct run *r)
{
    r->saved = true;
    if (!read_earlier(r, r->file))
        return false;
    if (!r->resumes)
        return ok(r, mill_error_set(r->error, MILL_FAILED,
                                    "%s: another run has written to it meanwhile; see whether it "
                                    "still needs --resume",
                                    r->output));
    if (!ok(r, mill_checkpoint_load(&r->starts, &r->cost, r->file, r->output, r->error)))
        return false;
    mill_checkpoint_remove(r->file);
    mill_record_deck(r->file, r->deck);
    return true;
}

/* state: NULL during the event loop */
static void show(const struct run *r, bool begins, const char *state)
{
    const struct mill_tally *tally = mill_observers_tally(&r->first->observers);
    /* not before run.sample_from, and not during the start-up if it is to be cut off */
    const bool samples =
        tally->at.open && (!tally->search || tally->at.settled || !(tally->asked.precision > 0));
    const char *now = samples ? "sampling" : "settling";
    struct mill_progress p = {.end = r->deck->observe.end,
                              .early = mill_forecast_early(r->first->world),
                              .wall = mill_record_clock(CLOCK_MONOTONIC) - r->order->display.began,
                              .begins = begins,
                              .state = state ? state : now,
                              .known = mill_summary_known(&r->first->observers)};
    for (int n = 0; n < r->starts.count; n++) {
        const struct mill_starts_one *one = &r->starts.one[n];
        p.time += mill_sim_time(one->sim) / r->starts.count;
        for (int k = 0; k < one->world->kinds.count; k++)
            p.collisions += one->world->account.collisions[k];
    }
    mill_progress_show(&r->order->display, &p);
}

/* Notes what the run will cost, if that is probably more than was meant. */
static void note_cost(struct run *r)
{
    const double interval = r->deck->observe.frames, end = r->deck->observe.end;
    const double frames = interval > 0 ? end / interval : 0;
    const struct mill_tally *tally = mill_observers_tally(&r->first->observers);
    const struct mill_energies *energies = &tally->plan.energies;
    if (frames > 1e6) /* probably a mistake in a unit */
        mill_error_set(&r->note, MILL_OK, "output.frames = %g s makes %.3g frames, %.3g GB or more",
                       interval, frames, frames * r->first->world->balls * 9 * sizeof(float) / 1e9);
    else if (energies->classes < (size_t)r->first->world->species_count)
        mill_error_set(&r->note, MILL_OK,
                       "the impacts of %d kinds of balls are counted in %d classes of about the "
                       "same mass, with %.0f MB of memory and up to as much in the file; with at "
                       "most %d kinds each is counted apart",
                       r->first->world->species_count, MILL_ENERGIES_CLASSES,
                       mill_energies_cost(energies) / 1e6, MILL_ENERGIES_CLASSES);
}

/* Makes the mill from the deck or the state, and a file that holds what is known so far */
static bool prepare(struct run *r)
{
    r->first = r->starts.one;
    if (!ok(r, mill_starts_make(&r->starts, r->deck, &r->order->watch, r->error)) ||
        !open_output(r) || (r->resumes && !take_up(r)) ||
        !ok(r, mill_observers_open(&r->first->observers, &r->deck->observe, r->file,
                                   r->first->world, r->first->sim, r->error)))
        return false;
    show(r, true, NULL);
    if (r->resumes)
        mill_error_set(&r->note, MILL_OK, "resuming at t = %.6g s", mill_sim_time(r->first->sim));
    else
        note_cost(r);
    say(r);
    /* with --force the old file stays until there are results to replace it */
    if (r->resumes || (r->given[MILL_FORCE] && access(r->output, F_OK) == 0))
        return true;
    /* this shows now whether the disk can be written, and a killed run leaves a file */
    return ok(r, mill_h5_flush(r->file, r->error));
}

/* ---- results into the file ---- */

/* Cost up to now, including the parts before --resume */
static struct mill_record_cost cost_of(const struct run *r)
{
    struct mill_record_cost cost = r->cost;
    cost.wall += mill_record_clock(CLOCK_MONOTONIC) - r->order->display.began;
    cost.cpu += mill_record_clock(CLOCK_PROCESS_CPUTIME_ID);
    return cost;
}

/* *sum: the world that they are of, all starts together */
static struct mill_facts facts_of(struct run *r, const char *status, struct mill_world *sum)
{
    const bool asked = r->deck->observe.precision > 0 || r->deck->observe.max_collisions > 0;
    static const char *const ends[] = {"time", "precision", "max_collisions"}; /* mill_tally_end */
    const struct mill_tally *tally = mill_observers_tally(&r->first->observers);
    const char *by = strcmp(status, "complete") != 0 ? "none" : ends[tally->at.ended];
    struct mill_facts facts = {.status = status,
                               .ended_by = asked ? by : NULL,
                               .time = mill_sim_time(r->first->sim),
                               .local = mill_sim_local_time(r->first->sim),
                               .cost = cost_of(r),
                               .starts = r->starts.count,
                               .threads = r->starts.count > 1 ? r->starts.workers
                                                              : mill_sim_threads(r->first->sim),
                               .peak_memory = mill_record_peak_memory(),
                               .deck = r->order->asked->deck,
                               .output = r->output,
                               .version = mill_version};
    *sum = mill_starts_sum(&r->starts, &facts.totals);
    mill_starts_join(&r->starts);
    return facts;
}

/* Writes the state that the run can continue from */
static void keep(struct run *r)
{
    struct mill_record_cost cost = cost_of(r);
    mill_checkpoint_write(&r->starts, &cost, r->file);
}

void mill_run_write(struct mill_h5 *file, const struct mill_observers *observers,
                    const struct mill_world *world, const struct mill_facts *facts)
{
    const struct mill_facts_list *others = facts->foreign;
    const bool stopped = strcmp(facts->status, "stopped") == 0;
    struct mill_tally_results *results = NULL;
    struct mill_notes notes;
    struct mill_sink_file to;
    struct mill_error error;
    mill_sink_file(&to, file, "");
    to.sink.part = others ? MILL_FACTS_PART : NULL;
    const bool made = mill_observers_results(observers, world, facts->local, &to.sink, &results,
                                             &error) == MILL_OK;
    if (made)
        mill_notes_take(&notes, world, results, facts->local, stopped, others);
    else
        mill_h5_spend(file, error.text);
    mill_tally_results_free(results);
    if (!made)
        return;
    mill_sink_file(&to, file, "/run");
    mill_record_tell(world, facts, &to.sink);
    if (others)
        mill_facts_write(others, file, "notes");
    mill_notes_tell(&notes, others ? mill_facts_text(others, "notes") : NULL, &to.sink);
    if (to.sink.failed)
        mill_h5_spend(file, to.sink.failed);
}

static void write_results(struct run *r, const char *status)
{
    struct mill_world sum;
    const struct mill_facts facts = facts_of(r, status, &sum);
    mill_run_write(r->file, &r->first->observers, &sum, &facts);
}

/* Publishes all results up to now, as if the run ended here, and the state. */
static enum mill_status save(struct run *r)
{
    const double before = mill_record_clock(CLOCK_MONOTONIC);
    write_results(r, "running");
    keep(r);
    const enum mill_status status = mill_h5_flush(r->file, r->error);
    mill_checkpoint_remove(r->file); /* its space in the file can be used again */
    r->saved = r->saved || status == MILL_OK;
    const double now = mill_record_clock(CLOCK_MONOTONIC);
    r->cost.checkpoints++;
    r->cost.saving += now - before;
    r->due = now + fmax(r->deck->given.checkpoint, (now - before) * (1.0 / MOST_SHARE - 1.0));
    return status;
}

/* Runs all starts in rounds, so that progress is shown regularly. */
static enum mill_status advance(struct run *r)
{
    const double wall = fmin(MILL_PROGRESS_EVERY, r->deck->given.checkpoint);
    enum mill_status status = MILL_OK;
    r->due = mill_record_clock(CLOCK_MONOTONIC) + r->deck->given.checkpoint;
    while (status == MILL_OK && !r->starts.plan.known) {
        status = mill_starts_go(&r->starts, wall, r->order->stop, r->error);
        show(r, false, NULL);
        if (status == MILL_OK && !mill_starts_extend(&r->starts))
            break;
        if (status == MILL_OK)
            status = mill_starts_grow(&r->starts, r->error);
        if (status == MILL_OK && mill_record_clock(CLOCK_MONOTONIC) > r->due)
            status = save(r);
    }
    r->complete = status == MILL_OK || status == MILL_ENDED;
    return r->complete ? MILL_OK : status;
}

/* ---- the end ---- */

/* Shows writing as a stage of its own; stops when a signal asks for it */
static bool goes_on(void *self, double done, double all)
{
    const struct run *r = self;
    mill_progress_stage(&r->order->display, "writing /VTKHDF", (int32_t)done, (int32_t)all);
    return !*r->order->stop;
}

/* Ends the run: writes everything to the file, then publishes and closes it, also after a stop or a
 * failure. /VTKHDF, which only a finished file has, may take minutes if there are many frames. Then
 * results and state are published before it. MILL_STOPPED: --resume has to add it. */
static enum mill_status conclude(struct run *r, enum mill_status ended, struct mill_error *error)
{
    const struct mill_going going = {goes_on, r};
    const bool many = r->deck->observe.frames > 0 &&
                      mill_sim_time(r->first->sim) / r->deck->observe.frames > MANY_FRAMES;
    const bool slow = many && ended == MILL_OK;
    show(r, false, "writing");
    if (ended == MILL_STOPPED || slow)
        keep(r);
    for (int k = 0; k < r->starts.count; k++)
        /* after the state, because an uninterrupted run has no audit here */
        mill_sim_audit(r->starts.one[k].sim);
    write_results(r, ended == MILL_OK ? "complete" : ended == MILL_STOPPED ? "stopped" : "failed");
    const enum mill_status status = slow ? mill_h5_flush(r->file, error) : MILL_OK;
    if (status != MILL_OK)
        return status;
    r->saved = r->saved || slow;
    if ((slow || !many) &&
        !mill_observers_finish(&r->first->observers, r->first->world, slow ? &going : NULL))
        return mill_error_set(error, MILL_STOPPED,
                              "stopped by a signal; %s holds all results but not the frames "
                              "for ParaView (/VTKHDF), which --resume adds",
                              r->output);
    if (slow)
        mill_checkpoint_remove(r->file);
    struct mill_h5 *file = r->file;
    r->file = NULL;
    return mill_h5_close(file, error);
}

/* Executes the prepared run and closes its file */
static enum mill_status carry_out(struct run *r)
{
    enum mill_status status = MILL_OK;
    if (r->given[MILL_PARANOID])
        status = mill_paranoid_start(r->first->sim, mill_opinion_agrees, r->error);
    if (status == MILL_OK && !r->complete)
        status = advance(r);
    r->order->checks = mill_paranoid_done(r->first->sim);
    /* the first failure is reported */
    struct mill_error *why = status == MILL_OK || status == MILL_STOPPED ? r->error : NULL;
    /* a failed checkpoint does not end the run: the one before it is still valid */
    enum mill_status written = mill_h5_status(r->file, why);
    if (written == MILL_OK)
        written = conclude(r, status, why);
    if (written == MILL_OK)
        return status;
    const struct mill_error what = *r->error;
    if (written == MILL_FAILED && access(r->output, F_OK) == 0)
        mill_error_set(r->error, MILL_FAILED, "%s; %s --resume %s", what.text,
                       r->saved ? "the file is as at its last checkpoint, and"
                                : "there is no checkpoint yet, so",
                       r->saved ? "goes on from there" : "starts from the beginning");
    return written;
}

enum mill_status mill_run(struct mill_run_order *order)
{
    const struct mill_command *asked = order->asked;
    struct run r = {order, asked->given, order->deck, asked->output, order->error, .due = 0.0};
    if ((asked->given[MILL_RESUME] && !find_earlier(&r)) || (r.complete && !r.resumes))
        return r.status;
    if (prepare(&r))
        r.status = carry_out(&r);
    mill_h5_abandon(r.file); /* still open after a failure: the file stays as last published */
    if (r.status == MILL_OK || r.status == MILL_STOPPED) {
        struct mill_world sum;
        const struct mill_facts facts = facts_of(&r, r.complete ? "complete" : "stopped", &sum);
        struct mill_summary s = {order->page, &sum,   &r.first->observers,
                                 &facts,      r.deck, .results = NULL};
        if (mill_summary_write(&s, asked->given[MILL_JSON], r.error) != MILL_OK)
            r.status = MILL_FAILED;
    }
    mill_starts_free(&r.starts);
    return r.status;
}
