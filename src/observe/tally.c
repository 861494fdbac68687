/* What happened in the mill between run.sample_from and the end? An observer that sorts every
 * impact into spectra, strikes and maps as it comes, a few tens of nanoseconds each, and looks at
 * the world at a few times of its own: when the window opens, at whole revolutions of the rotor,
 * for the maps' snapshots, when the last tenth begins, and at the end. All these times follow from
 * the deck alone. */
#include "observe/tally.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- impacts ---- */

static void count(struct mill_speeds *speeds, const struct mill_impact *impact, int normal,
                  int tangential)
{
    const int fast = normal >= MILL_SPECTRUM_FAST;
    mill_spectrum_add(&speeds->normal, normal, impact->normal_speed, impact->dissipation);
    mill_spectrum_add(&speeds->tangential[fast], tangential, impact->tangential_speed,
                      impact->dissipation);
}

static enum mill_status count_strike(struct mill_tally *tally, const struct mill_impact *impact,
                                     int normal, int tangential, struct mill_error *error)
{
    struct mill_speeds *speeds = &tally->strikes[impact->kind];
    bool fresh = true;
    struct mill_strike *strike = NULL;
    if (tally->pairs.window > 0) {
        strike = mill_strikes_meet(&tally->pairs, impact->kind, impact->ball, impact->partner,
                                   impact->time, &fresh);
        if (!strike)
            return mill_error_set(error, MILL_FAILED, "out of memory for the table of strikes");
    }
    if (fresh && tally->at.open)
        count(speeds, impact, normal, tangential);
    if (fresh && strike) {
        strike->stretch = tally->at.stretch;
        strike->normal = tally->at.open ? (int16_t)normal : -1;
        strike->tangential = (int16_t)tangential;
    }
    if (!fresh && strike->normal >= 0) {
        if (strike->stretch != tally->at.stretch)
            speeds = &mill_tally_window_strikes(tally, strike->stretch)[impact->kind];
        const int fast = strike->normal >= MILL_SPECTRUM_FAST;
        speeds->normal.slot[strike->normal].dissipation += impact->dissipation;
        speeds->tangential[fast].slot[strike->tangential].dissipation += impact->dissipation;
    }
    return MILL_OK;
}

static enum mill_status gather(struct mill_tally *tally, const struct mill_impact *impact,
                               struct mill_error *error)
{
    const int normal = mill_spectrum_find(&tally->grid, impact->normal_speed);
    const int tangential = mill_spectrum_find(&tally->grid, impact->tangential_speed);
    if (tally->at.open) {
        count(&tally->impacts[impact->kind], impact, normal, tangential);
        mill_maps_impact(tally->maps, impact->position, impact->normal_speed, impact->dissipation);
    }
    return count_strike(tally, impact, normal, tangential, error);
}

static enum mill_status on_impact(struct mill_observer *observer, const struct mill_impact *impact,
                                  struct mill_error *error)
{
    struct mill_tally *tally = (struct mill_tally *)observer;
    enum mill_status status = MILL_OK;
    if (!tally->at.closed && (tally->at.open || impact->time >= tally->watch))
        status = gather(tally, impact, error);
    if (++tally->at.collisions < tally->collisions || status != MILL_OK)
        return status;
    tally->at.ended = MILL_TALLY_COLLISIONS;
    return mill_error_set(error, MILL_ENDED, "max_collisions");
}

/* ---- times ---- */

static double next_snapshot(const struct mill_tally *tally)
{
    return tally->begin + ((double)tally->at.snapshots + 0.5) * tally->interval;
}

/* The last block ends with the window when it is whole but for rounding. */
static double next_block(const struct mill_tally *tally)
{
    const double into = tally->search ? (double)INFINITY : mill_rotorstat_next(&tally->rotor);
    return into < (double)INFINITY ? fmin(tally->begin + into, tally->end) : into;
}

/* A run that may end before its time has the last tenth of its window from the batches' books. */
static double late(const struct mill_tally *tally)
{
    if (tally->tick > 0)
        return tally->end;
    return tally->begin + 0.9 * (tally->end - tally->begin);
}

static void plan(struct mill_tally *tally)
{
    struct mill_tally_progress *at = &tally->at;
    if (at->closed)
        at->next = INFINITY;
    else if (!at->open)
        at->next = fmin(tally->begin, mill_tally_window_next(tally));
    else
        at->next = fmin(fmin(fmin(next_snapshot(tally), next_block(tally)),
                             at->late ? tally->end : late(tally)),
                        mill_tally_window_next(tally));
    tally->observer.next = at->next;
}

static void open_window(struct mill_tally *tally, const struct mill_account *account)
{
    tally->at.open = true;
    tally->at.at_begin = *account;
    mill_rotorstat_open(&tally->rotor, account);
    if (tally->tick > 0)
        mill_precision_open(&tally->batches, account);
}

static void close_window(struct mill_tally *tally, const struct mill_account *account, double time)
{
    tally->at.at_close = *account;
    tally->at.over = time;
    tally->at.closed = true;
}

/* Within the window: all that is due by `now`, which is local time t. */
static void look(struct mill_tally *tally, const struct mill_world *world, double t, double now)
{
    /* batches and blocks that end together may differ by rounding */
    const double same = now + 1e-9 * tally->tick;
    while (next_block(tally) <= same)
        mill_rotorstat_close(&tally->rotor, &world->account);
    while (next_snapshot(tally) <= now) {
        mill_maps_sample(tally->maps, world, t);
        tally->at.snapshots++;
    }
    if (!tally->at.late && late(tally) <= now) {
        tally->at.late = true;
        tally->at.at_late = world->account;
    }
}

static enum mill_status on_sample(struct mill_observer *observer, const struct mill_world *world,
                                  double t, struct mill_error *error)
{
    struct mill_tally *tally = (struct mill_tally *)observer;
    const double now = tally->at.next;
    if (!tally->at.open && tally->begin <= now)
        open_window(tally, &world->account);
    if (tally->at.open)
        look(tally, world, t, now);
    mill_tally_window_sample(tally, &world->account, now);
    const bool known = tally->at.ended == MILL_TALLY_PRECISION;
    if (known)
        close_window(tally, &world->account, now);
    else if (tally->end <= now)
        close_window(tally, &world->account, tally->end);
    plan(tally);
    return known ? mill_error_set(error, MILL_ENDED, "precision") : MILL_OK;
}

/* ---- life ---- */

static void free_tally(struct mill_observer *observer)
{
    struct mill_tally *tally = (struct mill_tally *)observer;
    mill_maps_free(tally->maps);
    mill_strikes_free(&tally->pairs);
    mill_rotorstat_free(&tally->rotor);
    mill_tally_window_free(tally);
    free(tally);
}

static enum mill_status create(const struct mill_observe *asked, const struct mill_world *world,
                               struct mill_observer **out, struct mill_error *error)
{
    struct mill_tally *tally = calloc(1, sizeof *tally);
    if (!tally)
        return mill_error_set(error, MILL_FAILED, "out of memory for the statistics");
    const double duration = fmax(0, asked->end - asked->sample_from);
    tally->observer.type = &mill_tally_type;
    tally->begin = asked->sample_from; /* 0 where it is to be found */
    tally->end = fmax(asked->end, asked->sample_from);
    tally->watch = asked->sample_from - 2 * asked->strike_window; /* twice: for the rounding */
    tally->interval = duration > 0 ? fmin(1e-3, duration / 100) : (double)INFINITY;
    mill_spectrum_grid_init(&tally->grid);
    enum mill_status status = mill_maps_create(world, &tally->maps, error);
    if (status == MILL_OK && (!mill_strikes_init(&tally->pairs, asked->strike_window) ||
                              !mill_rotorstat_init(&tally->rotor, world->rotor_speed, duration) ||
                              !mill_tally_window_init(tally, asked, world)))
        status = mill_error_set(error, MILL_FAILED, "out of memory for the statistics");
    if (status != MILL_OK) {
        free_tally(&tally->observer);
        return status;
    }
    if (tally->begin <= 0 && duration > 0)
        open_window(tally, &world->account);
    plan(tally);
    *out = &tally->observer;
    return MILL_OK;
}

static enum mill_status results(const struct mill_observer *observer,
                                const struct mill_world *world, double t, struct mill_sink *sink,
                                struct mill_error *error)
{
    struct mill_tally_results *results;
    const struct mill_tally *tally = (const struct mill_tally *)observer;
    enum mill_status status = mill_tally_results_make(tally, world, t, &results, error);
    if (status == MILL_OK)
        status = mill_tally_tell(results, sink, error);
    mill_tally_results_free(results);
    return status;
}

const struct mill_observer_type mill_tally_type = {
    .name = "statistics",
    .impact = on_impact,
    .sample = on_sample,
    .create = create,
    .state = mill_tally_state,
    .results = results,
    .free = free_tally,
};
