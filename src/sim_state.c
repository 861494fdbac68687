/* The loop's state as one run of bytes: everything that the next event depends on. The calendar is
 * filed again from the plans (its order is that of times and balls, whatever its days), the cells
 * from each ball's cell (a rounded position would not tell it). No random numbers are drawn after
 * the start. */
#include "parts.h"
#include "sim_private.h"

#include <stdlib.h>
#include <string.h>

enum { PARTS = 12 };

/* What must agree before any byte is believed. */
struct header {
    uint64_t balls, cells, shapes, ball, plan, account, counts, pinch;
};

static struct header header_of(const struct mill_sim *sim)
{
    const struct mill_world *w = sim->world;
    return (struct header){.balls = (uint64_t)w->balls,
                           .cells = (uint64_t)mill_cells_count(&sim->predict->cells),
                           .shapes = (uint64_t)w->shapes,
                           .ball = sizeof *w->ball,
                           .plan = sizeof *sim->predict->plan,
                           .account = sizeof w->account,
                           .counts = sizeof w->counts,
                           .pinch = sim->pinch ? sizeof *sim->pinch : 0};
}

/* The last part: each ball's cell, the grid's own when saving, the caller's when loading. Parts are
 * written to only by mill_sim_load. */
static void list_parts(const struct mill_sim *sim, int32_t *cell, struct mill_part part[PARTS])
{
    struct mill_sim *s = (struct mill_sim *)sim;
    struct mill_world *w = s->world;
    const size_t n = (size_t)w->balls;
    const struct mill_part parts[PARTS] = {
        {&w->base, sizeof w->base},
        {&w->turn, sizeof w->turn},
        {&s->now, sizeof s->now},
        {&s->watch, sizeof s->watch},
        {&w->start, sizeof w->start},
        {&w->account, sizeof w->account},
        {&w->counts, sizeof w->counts},
        {w->ball, n * sizeof *w->ball},
        {w->spin, n * sizeof *w->spin},
        {s->predict->plan, n * sizeof *s->predict->plan},
        {s->pinch, s->pinch ? n * sizeof *s->pinch : 0},
        {cell, n * sizeof *cell},
    };
    memcpy(part, parts, sizeof parts);
}

size_t mill_sim_state_size(const struct mill_sim *sim)
{
    struct mill_part part[PARTS];
    list_parts(sim, NULL, part);
    return sizeof(struct header) + mill_parts_size(part, PARTS);
}

void mill_sim_save(const struct mill_sim *sim, unsigned char *state)
{
    struct mill_part part[PARTS];
    const struct header header = header_of(sim);
    memcpy(state, &header, sizeof header);
    list_parts(sim, sim->predict->cells.cell, part);
    mill_parts_pack(part, PARTS, state + sizeof header);
}

/* Indices that a damaged file must not smuggle in */
static bool sane(const struct mill_sim *sim, const int32_t *cell)
{
    const struct mill_world *w = sim->world;
    const int32_t cells = mill_cells_count(&sim->predict->cells);
    for (int32_t i = 0; i < w->balls; i++) {
        const struct mill_plan *plan = &sim->predict->plan[i];
        if (cell[i] < 0 || cell[i] >= cells || w->ball[i].species < 0 ||
            w->ball[i].species >= w->species_count || plan->partner < MILL_NOBODY ||
            plan->partner >= w->balls || plan->shape < MILL_NOBODY || plan->shape >= w->shapes ||
            plan->face < 0 || plan->face > 5)
            return false;
    }
    return true;
}

enum mill_status mill_sim_load(struct mill_sim *sim, const unsigned char *state, size_t size,
                               struct mill_error *error)
{
    const struct header own = header_of(sim);
    struct mill_part part[PARTS];
    if (size != mill_sim_state_size(sim) || memcmp(state, &own, sizeof own) != 0)
        return mill_error_set(error, MILL_FAILED, "the saved balls are of another deck or program");
    int32_t *cell = malloc(sizeof *cell * ((size_t)sim->world->balls + 1));
    if (!cell)
        return mill_error_set(error, MILL_FAILED, "out of memory for the saved balls");
    list_parts(sim, cell, part);
    mill_parts_unpack(part, PARTS, state + sizeof own);
    enum mill_status status = MILL_OK;
    if (!sane(sim, cell))
        status = mill_error_set(error, MILL_FAILED, "the saved balls are damaged");
    else if (!mill_predict_restore(sim->predict, cell))
        status = mill_error_set(error, MILL_FAILED, "out of memory for the cell grid");
    free(cell);
    return status;
}
