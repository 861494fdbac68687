/* How a run ends, or stands for the moment: all that is known into the file, the summary, and what
 * is said when the file could not be written. */
#include "app/run_private.h"
#include "app/summary.h"
#include "observe/vtkhdf.h"

#include <string.h>
#include <unistd.h>

#ifndef MILL_VERSION
#define MILL_VERSION "unknown"
#endif

struct mill_record_cost mill_run_cost(const struct mill_run *r)
{
    struct mill_record_cost cost = r->cost;
    cost.wall += mill_run_clock() - r->started;
    cost.cpu += mill_record_cpu_time();
    return cost;
}

static struct mill_facts facts_of(const struct mill_run *r, const char *status)
{
    const bool done = strcmp(status, "complete") == 0;
    const char *by = mill_tally_ended_by(r->tally);
    return (struct mill_facts){
        .status = status,
        .ended_by = by && !done ? "none" : by,
        .time = mill_sim_time(r->sim),
        .local = mill_sim_local_time(r->sim),
        .end = r->deck->time,
        .cost = mill_run_cost(r),
        .peak_memory = mill_record_peak_memory(),
        .deck = mill_deck_file(r->deck),
        .output = r->options->output,
        .version = MILL_VERSION,
    };
}

/* /statistics and /run */
static void write_results(const struct mill_run *r, const char *status)
{
    const struct mill_facts facts = facts_of(r, status);
    struct mill_error error;
    struct mill_tally_results *results;
    struct mill_sink_file to;
    enum mill_status told =
        mill_tally_results_make(r->tally, r->world, facts.local, &results, &error);
    mill_sink_file(&to, r->file, "");
    if (told == MILL_OK)
        told = mill_tally_tell(results, &to.sink, &error);
    if (told != MILL_OK)
        mill_h5_spend(r->file, error.text);
    mill_tally_results_free(results);
    mill_sink_file(&to, r->file, "/run");
    mill_record_tell(r->world, &facts, &to.sink);
}

void mill_run_write(struct mill_run *r, const char *ended, struct mill_checkpoint_state *state)
{
    if (r->log)
        mill_impactlog_finish(r->log);
    write_results(r, ended);
    /* a run that goes on has no use for it yet */
    if (strcmp(ended, "running") != 0)
        mill_vtkhdf_write(r->file, r->deck, r->world, r->frames);
    mill_checkpoint_remove(r->file);
    if (state)
        mill_checkpoint_write(state, r->file);
}

enum mill_status mill_run_summarise(const struct mill_run *r, bool stopped,
                                    struct mill_error *error)
{
    const struct mill_facts facts = facts_of(r, stopped ? "stopped" : "complete");
    FILE *out = r->options->summary;
    struct mill_tally_results *results;
    const enum mill_status status =
        mill_tally_results_make(r->tally, r->world, facts.local, &results, error);
    if (status != MILL_OK)
        return status;
    if (r->options->json)
        mill_summary_json(out, r->world, results, &facts);
    else
        mill_summary_print(out, r->world, results, &facts);
    mill_tally_results_free(results);
    return MILL_OK;
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
