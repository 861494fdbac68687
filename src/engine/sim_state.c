/* The loop's state as one run of bytes: everything that the next event depends on. The calendar is
 * filed again from the plans (its order is that of times and balls, whatever its days), the cells
 * from each ball's cell (a rounded position would not tell it). No random numbers are drawn after
 * the start. */
#include "base/parts.h"
#include "engine/sim_private.h"

#include <stdlib.h>
#include <string.h>

static struct mill_sim_header header_of(const struct mill_sim *sim)
{
    const struct mill_world *w = sim->world;
    return (struct mill_sim_header){.balls = (uint64_t)w->balls,
                                    .cells = (uint64_t)mill_cells_count(&sim->schedule->cells),
                                    .shapes = (uint64_t)w->shapes,
                                    .ball = sizeof *w->ball,
                                    .plan = sizeof *sim->schedule->plan,
                                    .account = sizeof w->account,
                                    .counts = sizeof w->counts,
                                    .pinch = sim->pinch ? sizeof *sim->pinch : 0};
}

/* cell: each ball's, the grid's own when saving, the caller's when loading. */
static size_t list_parts(struct mill_sim *s, int32_t *cell, struct mill_part part[MILL_SIM_PARTS],
                         size_t *values)
{
    struct mill_world *w = s->world;
    const size_t n = (size_t)w->balls;
    const struct mill_part value[] = {
        {&s->header, sizeof s->header}, {&w->base, sizeof w->base},
        {&s->now, sizeof s->now},       {&s->watch, sizeof s->watch},
        {&w->start, sizeof w->start},   {&w->account, sizeof w->account},
        {&w->counts, sizeof w->counts},
    };
    const struct mill_part array[] = {
        {w->ball, n * sizeof *w->ball},
        {w->spin, n * sizeof *w->spin},
        {s->schedule->plan, n * sizeof *s->schedule->plan},
        {s->pinch, s->pinch ? n * sizeof *s->pinch : 0},
        {cell, n * sizeof *cell},
    };
    *values = sizeof value / sizeof *value;
    memcpy(part, value, sizeof value);
    memcpy(part + *values, array, sizeof array);
    return *values + sizeof array / sizeof *array;
}

size_t mill_sim_parts(struct mill_sim *sim, struct mill_part *part, size_t *values)
{
    sim->header = header_of(sim);
    return list_parts(sim, sim->schedule->cells.cell, part, values);
}

/* Indices that a damaged file must not smuggle in */
static bool sane(const struct mill_sim *sim, const int32_t *cell)
{
    const struct mill_world *w = sim->world;
    const int32_t cells = mill_cells_count(&sim->schedule->cells);
    for (int32_t i = 0; i < w->balls; i++) {
        const struct mill_plan *plan = &sim->schedule->plan[i];
        if (cell[i] < 0 || cell[i] >= cells || w->ball[i].species < 0 ||
            w->ball[i].species >= w->species_count || plan->partner < MILL_NOBODY ||
            plan->partner >= w->balls || plan->shape < MILL_NOBODY || plan->shape >= w->shapes ||
            plan->face < 0 || plan->face > 5)
            return false;
    }
    return true;
}

/* What stands in front says whose state it is; it is read, and nothing else yet. */
static enum mill_status read_header(struct mill_sim *sim, struct mill_source *source, size_t size,
                                    struct mill_error *error)
{
    struct mill_sim_header header;
    const struct mill_sim_header own = header_of(sim);
    enum mill_status status = MILL_FAILED;
    if (source->left == size) {
        status = mill_parts_read(source, &header, sizeof header, error);
        if (status != MILL_OK || memcmp(&header, &own, sizeof own) == 0)
            return status;
    }
    return mill_error_set(error, MILL_FAILED, "the saved balls are of another deck or program");
}

enum mill_status mill_sim_load(struct mill_sim *sim, struct mill_source *source,
                               struct mill_error *error)
{
    struct mill_part part[MILL_SIM_PARTS];
    size_t values;
    int32_t *cell = malloc(sizeof *cell * ((size_t)sim->world->balls + 1));
    if (!cell)
        return mill_error_set(error, MILL_FAILED, "out of memory for the saved balls");
    const size_t parts = list_parts(sim, cell, part, &values);
    enum mill_status status = read_header(sim, source, mill_parts_size(part, parts), error);
    if (status == MILL_OK)
        status = mill_parts_read_all(source, part + 1, parts - 1, error);
    if (status == MILL_OK && !sane(sim, cell))
        status = mill_error_set(error, MILL_FAILED, "the saved balls are damaged");
    if (status == MILL_OK && !mill_schedule_restore(sim->schedule, cell))
        status = mill_error_set(error, MILL_FAILED, "out of memory for the cell grid");
    /* the motions as they are after so many epochs: a sum of roundings, so they are gone through */
    for (double t = 0.0; status == MILL_OK && t < sim->world->base; t += MILL_SIM_EPOCH)
        for (int k = 0; k < sim->world->motions; k++)
            sim->world->motion[k]->type->restart(sim->world->motion[k], MILL_SIM_EPOCH);
    free(cell);
    return status;
}
