/* The state of the event loop: all data that the next event depends on. After loading, the calendar
 * is made again from the plans: its order depends only on times and balls, not on its days. The
 * cells are made from the stored cell of each ball, because a rounded position does not give the
 * cell. No random numbers are drawn after the start, so none are stored. */
#include "engine/sim_private.h"
#include "engine/soft.h"
#include "millsim/state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST 1e7 /* [s] no run takes longer */

/* Valid: an index below `count` with a time, or MILL_NOBODY with the time INFINITY */
static bool is_index(int32_t index, int32_t count, double time)
{
    return !isnan(time) && index < count && (index >= 0 || (index == MILL_NOBODY && isinf(time)));
}

/* Checks the indices of a ball, maybe of a damaged file. An event has a partner or a shape. */
static bool is_sane(const struct mill_sim *sim, int32_t i, int32_t cell)
{
    const struct mill_world *w = sim->world;
    const struct mill_plan *plan = &sim->schedule->plan[i];
    const bool shape = plan->next == MILL_NEXT_SURFACE || plan->next == MILL_NEXT_SEARCH;
    return mill_cells_is_inner(sim->schedule->cells, cell) && w->ball[i].species >= 0 &&
           w->ball[i].species < w->species_count &&
           (w->ball[i].relief == MILL_RELIEF_NONE || w->ball[i].relief == MILL_RELIEF_LASTS) &&
           is_index(plan->partner, w->balls, plan->pair_t) && plan->partner != i &&
           (!sim->bridges.ball ||
            (sim->bridges.ball[i].shape >= -1 && sim->bridges.ball[i].shape < w->shapes)) &&
           is_index(plan->shape, w->shapes, plan->shape_t) && plan->face >= 0 && plan->face <= 5 &&
           (!mill_world_asleep(w, i) ||
            (sim->schedule->rest.calm > 0.0 && isinf(mill_plan_time(plan)))) &&
           (isinf(mill_plan_time(plan)) || plan->next == MILL_NEXT_EXIT ||
            (plan->next == MILL_NEXT_PAIR && plan->partner != MILL_NOBODY) ||
            (shape && plan->shape != MILL_NOBODY));
}

/* What all spheres have */
static void tell_world(struct mill_sim *s, struct mill_state *state)
{
    struct mill_world *w = s->world;
    const size_t n = (size_t)w->balls;
    mill_state_field(state, "base", MILL_FIELD_F64, 1, &w->base);
    mill_state_field(state, "now", MILL_FIELD_F64, 1, &s->now);
    mill_state_structs(state, "start", sizeof w->start, 1, &w->start);
    mill_state_structs(state, "account", sizeof w->account, 1, &w->account);
    mill_state_structs(state, "counts", sizeof w->counts, 1, &w->counts);
    mill_state_structs(state, "ball", sizeof *w->ball, n, w->ball);
    mill_state_structs(state, "spin", sizeof *w->spin, n, w->spin);
}

/* cell: of each ball; when saving, the grid's array, when loading, one of the caller */
static void tell_fields(struct mill_sim *s, int32_t *cell, struct mill_state *state)
{
    const struct mill_rest *rest = &s->schedule->rest;
    const struct mill_pinch *pinch = s->pinches.ball;
    const struct mill_bridge *bridge = s->bridges.ball;
    const size_t n = (size_t)s->world->balls, resting = rest->calm > 0.0 ? n : 0;
    tell_world(s, state);
    mill_state_structs(state, "watch", sizeof s->watch, 1, &s->watch);
    mill_state_structs(state, "plan", sizeof *s->schedule->plan, n, s->schedule->plan);
    mill_state_structs(state, "pinch", sizeof *pinch, pinch ? n : 0, s->pinches.ball);
    mill_state_field(state, "met", MILL_FIELD_F64, n, s->met);
    mill_state_structs(state, "bridge", sizeof *bridge, bridge ? n : 0, s->bridges.ball);
    mill_state_field(state, "cell", MILL_FIELD_I32, n, cell);
    mill_state_structs(state, "place", sizeof *rest->place, resting, rest->place);
    mill_state_field(state, "calm_epochs", MILL_FIELD_I32, resting, rest->calm_epochs);
}

/* Restarts the motions once per epoch, as the run did: their phases contain the rounding errors. */
static void restart_motions(const struct mill_world *w)
{
    for (double t = 0.0; t < w->base; t += MILL_WORLD_EPOCH)
        for (int k = 0; k < w->motions; k++)
            w->motion[k]->type->restart(w->motion[k], t + MILL_WORLD_EPOCH, MILL_WORLD_EPOCH);
}

static void tell_soft(struct mill_sim *sim, struct mill_state *state)
{
    const struct mill_world *w = sim->world;
    tell_world(sim, state);
    if (state->loads && !(sim->now >= 0.0 && w->base >= 0.0 && w->base <= MOST))
        mill_state_refuse(state, "the saved time is damaged");
    for (int32_t i = 0; i < w->balls && state->loads; i++)
        if (w->ball[i].species < 0 || w->ball[i].species >= w->species_count)
            mill_state_refuse(state, "the saved balls are damaged");
    if (state->loads && state->status == MILL_OK)
        restart_motions(w);
    mill_soft_state(sim->soft, state);
}

void mill_sim_state(struct mill_sim *sim, struct mill_state *state)
{
    const struct mill_world *w = sim->world;
    const struct mill_cells *cells = sim->soft ? NULL : sim->schedule->cells;
    /* these numbers come first; they must agree before the rest is loaded */
    const uint64_t own[3] = {(uint64_t)w->balls, cells ? (uint64_t)mill_cells_count(cells) : 0,
                             (uint64_t)w->shapes};
    uint64_t sizes[3] = {own[0], own[1], own[2]};
    mill_state_structs(state, "sizes", sizeof sizes, 1, sizes);
    if (memcmp(sizes, own, sizeof own) != 0)
        mill_state_refuse(state, "the saved balls are of another deck");
    if (sim->soft)
        tell_soft(sim, state);
    else if (!state->loads)
        tell_fields(sim, cells->cell, state);
    if (sim->soft || !state->loads)
        return;
    int32_t *cell = malloc(sizeof *cell * ((size_t)w->balls + 1));
    if (!cell)
        mill_state_refuse(state, "out of memory for the saved balls");
    tell_fields(sim, cell, state);
    int64_t awake = w->balls;
    for (int32_t i = 0; i < w->balls && state->status == MILL_OK; i++) {
        awake -= mill_world_asleep(w, i);
        if (!is_sane(sim, i, cell[i]))
            mill_state_refuse(state, "the saved balls are damaged");
        else if (sim->pinches.ball)
            mill_pinches_hold(&sim->pinches, w, i);
    }
    if (awake + w->counts.asleep != w->balls)
        mill_state_refuse(state, "the saved balls are damaged");
    if (state->status == MILL_OK && !mill_schedule_restore(sim->schedule, cell))
        mill_state_refuse(state, "out of memory for the cell grid");
    if (state->status == MILL_OK)
        restart_motions(w);
    free(cell);
}
