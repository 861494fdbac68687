/* What does the window come to? Worked out from what the tally has gathered by now, which stays as
 * it is: a checkpoint may ask in the middle of a run, and the run goes on. */
#include "observe/tally.h"

#include <math.h>
#include <stdlib.h>

static void sum_rows(struct mill_speeds rows[MILL_TALLY_ROWS])
{
    struct mill_speeds *all = &rows[MILL_TALLY_ALL];
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        mill_spectrum_merge(&all->normal, &rows[kind].normal);
        mill_spectrum_merge(&all->tangential[0], &rows[kind].tangential[0]);
        mill_spectrum_merge(&all->tangential[1], &rows[kind].tangential[1]);
    }
}

enum mill_status mill_tally_results_make(const struct mill_tally *tally,
                                         const struct mill_world *world, double t,
                                         struct mill_tally_results **out, struct mill_error *error)
{
    const struct mill_tally_progress *at = &tally->at;
    struct mill_tally_results *r = *out = calloc(1, sizeof *r);
    if (!r)
        return mill_error_set(error, MILL_FAILED, "out of memory for the results");
    const double end = at->closed ? at->over : world->base + t;
    r->tally = tally;
    r->begin = tally->begin;
    r->late = at->late;
    r->at_late = at->at_late;
    r->settled = at->settled;
    r->known = at->known;
    r->at_end = at->closed ? at->at_close : world->account;
    r->at_begin = at->open ? at->at_begin : r->at_end;
    r->maps = tally->maps;
    r->rotor = tally->rotor;
    mill_tally_add(r->impacts, tally->impacts);
    mill_tally_add(r->strikes, tally->strikes);
    if (at->open && tally->tick > 0 && !mill_tally_window_results(tally, r)) {
        mill_tally_results_free(r);
        *out = NULL;
        return mill_error_set(error, MILL_FAILED, "out of memory for the results");
    }
    r->duration = at->open ? fmax(0, end - r->begin) : 0;
    sum_rows(r->impacts);
    sum_rows(r->strikes);
    return MILL_OK;
}

void mill_tally_results_free(struct mill_tally_results *results)
{
    if (results)
        mill_maps_free(results->sum);
    free(results);
}

const char *mill_tally_name(int row)
{
    return row < MILL_KINDS ? mill_kind_name[row] : "all";
}

double mill_tally_per_second(const struct mill_tally_results *results, double sum)
{
    return results->duration > 0 ? sum / results->duration : 0;
}

void mill_tally_tangential(const struct mill_speeds *speeds, struct mill_spectrum *both)
{
    *both = speeds->tangential[0];
    mill_spectrum_merge(both, &speeds->tangential[1]);
}

double mill_tally_floor_share(const struct mill_tally_results *results, int row)
{
    const struct mill_account *from = &results->at_begin, *to = &results->at_end;
    uint64_t floored = 0, impacts = 0;
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        if (row != kind && row != MILL_TALLY_ALL)
            continue;
        floored += to->floored[kind] - from->floored[kind];
        impacts += to->collisions[kind] - from->collisions[kind];
    }
    return impacts > 0 ? (double)floored / (double)impacts : (double)NAN;
}

static double mean_rate(const struct mill_tally_results *results, double change)
{
    return results->duration > 0 ? change / results->duration : (double)NAN;
}

double mill_tally_power(const struct mill_tally_results *results)
{
    return mean_rate(results, results->at_end.rotor_work - results->at_begin.rotor_work);
}

double mill_tally_torque(const struct mill_tally_results *results)
{
    return mean_rate(results, results->at_end.rotor_impulse - results->at_begin.rotor_impulse);
}

bool mill_tally_reached(const struct mill_tally_results *results)
{
    const double asked = results->tally->precision;
    return asked > 0 && results->settled && mill_precision_reached(&results->known, asked);
}
