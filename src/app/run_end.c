/* How a run ends, or stands for the moment: all that is known into the file, the summary, and what
 * is said when the file could not be written. */
#include "app/run_private.h"
#include "app/summary.h"
#include "base/version.h"
#include "observe/vtkhdf.h"

#include <string.h>
#include <unistd.h>

struct mill_record_cost mill_run_cost(const struct mill_run *r)
{
    struct mill_record_cost cost = r->cost;
    cost.wall += mill_run_clock() - r->started;
    cost.cpu += mill_record_cpu_time();
    return cost;
}

void mill_run_write(struct mill_run *r, const char *ended, struct mill_checkpoint_state *state)
{
    const double local = mill_sim_local_time(r->sim);
    if (r->log)
        mill_impactlog_finish(r->log);
    mill_tally_finish(r->tally, r->world, local);
    mill_tally_write(r->tally, r->file);
    const char *by = mill_tally_ended_by(r->tally);
    const struct mill_record_end end = {
        ended,
        mill_sim_time(r->sim),
        local,
        mill_run_cost(r),
        mill_record_peak_memory(),
        by && strcmp(ended, "complete") != 0 ? "none" : by,
    };
    mill_record_finish(r->file, r->world, &end);
    /* a run that goes on has no use for it yet */
    if (strcmp(ended, "running") != 0)
        mill_vtkhdf_write(r->file, r->deck, r->world, r->frames);
    mill_checkpoint_remove(r->file);
    if (state)
        mill_checkpoint_write(state, r->file);
}

void mill_run_summarise(const struct mill_run *r, bool stopped)
{
    const struct mill_record_cost cost = mill_run_cost(r);
    const struct mill_summary_facts facts = {cost.wall,
                                             cost.cpu,
                                             mill_record_peak_memory(),
                                             mill_sim_time(r->sim),
                                             mill_version,
                                             mill_deck_file(r->deck),
                                             r->options->output,
                                             stopped};
    if (r->options->json)
        mill_summary_json(r->options->summary, r->deck, r->world, r->tally, &facts);
    else
        mill_summary_print(r->options->summary, r->deck, r->world, r->tally, &facts);
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
