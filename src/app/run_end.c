/* How a run ends, or stands for the moment: all that is known into the file, the summary, and what
 * is said when the file could not be written. */
#include "app/run_private.h"
#include "app/summary.h"
#include "base/version.h"

#include <string.h>
#include <unistd.h>

#define MANY_FRAMES 10000 /* from here on /VTKHDF takes long */

/* What all legs of the run have cost up to now. */
static struct mill_record_cost cost_of(const struct mill_run *r)
{
    struct mill_record_cost cost = r->cost;
    cost.wall += mill_run_clock() - r->started;
    cost.cpu += mill_record_cpu_time();
    return cost;
}

static struct mill_facts facts_of(const struct mill_run *r, const char *status)
{
    const bool asked = r->deck->precision > 0 || r->deck->max_collisions > 0;
    const char *by = strcmp(status, "complete") == 0 ? r->ended_by.text : "none";
    return (struct mill_facts){
        .status = status,
        .ended_by = asked ? by : NULL,
        .time = mill_sim_time(r->sim),
        .local = mill_sim_local_time(r->sim),
        .end = r->deck->time,
        .cost = cost_of(r),
        .peak_memory = mill_record_peak_memory(),
        .deck = r->deck->file,
        .output = r->options->output,
        .version = mill_version,
    };
}

void mill_run_keep(const struct mill_run *r)
{
    struct mill_record_cost cost = cost_of(r);
    const struct mill_checkpoint from = {r->sim, &r->observers, &cost};
    mill_checkpoint_write(&from, r->file);
}

void mill_run_write(const struct mill_run *r, const char *status)
{
    const struct mill_facts facts = facts_of(r, status);
    struct mill_sink_file to;
    struct mill_error error;
    mill_sink_file(&to, r->file, "");
    if (mill_observers_results(&r->observers, r->world, facts.local, &to.sink, &error) != MILL_OK)
        mill_h5_spend(r->file, error.text);
    mill_sink_file(&to, r->file, "/run");
    mill_record_tell(r->world, &facts, &to.sink);
}

/* Shown as a stage of its own, and left when a signal asks for it */
static bool goes_on(void *self, double done, double all)
{
    const struct mill_run *r = self;
    const struct mill_progress p = {.time = done,
                                    .end = all,
                                    .wall = mill_run_clock() - r->started,
                                    .stage = "writing /VTKHDF"};
    if (r->options->progress)
        r->options->progress(r->options->self, &p);
    return !(r->options->stop && *r->options->stop);
}

static enum mill_status close_output(struct mill_run *r, struct mill_error *error)
{
    struct mill_h5 *file = r->file;
    r->file = NULL;
    return mill_h5_close(file, error);
}

/* What only a finished file has may take minutes where frames are many. The results are then
 * published before, with the state, so that what is missing can be added by --resume. */
static enum mill_status finish_slowly(struct mill_run *r, struct mill_error *error)
{
    const struct mill_going going = {goes_on, r};
    enum mill_status status = mill_h5_flush(r->file, error);
    if (status != MILL_OK)
        return status;
    r->saved = true;
    if (!mill_observers_finish(&r->observers, r->world, &going))
        return mill_error_set(error, MILL_STOPPED,
                              "stopped by a signal; %s holds all results, but for /VTKHDF, which "
                              "--resume adds",
                              r->options->output);
    mill_checkpoint_remove(r->file);
    return close_output(r, error);
}

enum mill_status mill_run_conclude(struct mill_run *r, enum mill_status ended,
                                   struct mill_error *error)
{
    const double frames = r->deck->frames > 0 ? mill_sim_time(r->sim) / r->deck->frames : 0;
    const bool slow = frames > MANY_FRAMES;
    if (ended == MILL_STOPPED || (slow && ended == MILL_OK))
        mill_run_keep(r);
    mill_sim_audit(r->sim); /* after the state: an undisturbed run is not audited here */
    mill_run_write(r, ended == MILL_OK ? "complete" : ended == MILL_STOPPED ? "stopped" : "failed");
    if (slow && ended == MILL_OK)
        return finish_slowly(r, error);
    if (!slow)
        mill_observers_finish(&r->observers, r->world, NULL);
    return close_output(r, error);
}

enum mill_status mill_run_summarise(const struct mill_run *r, struct mill_error *error)
{
    const struct mill_facts facts = facts_of(r, r->complete ? "complete" : "stopped");
    return mill_summary_write(r->options->summary, r->options->json, r->world, &r->observers,
                              &facts, error);
}

void mill_run_explain(const struct mill_run *r, struct mill_error *error)
{
    const struct mill_error what = *error;
    if (access(r->options->output, F_OK) != 0)
        return;
    mill_error_set(error, MILL_FAILED, "%s; %s", what.text,
                   r->saved ? "the file is as at its last checkpoint, and --resume goes on from "
                              "there"
                            : "there is no checkpoint yet, so --resume starts from the beginning");
}
