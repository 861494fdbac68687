/* Time series at output.series, as H5MD observables {step, time, value}: step k belongs to k times
 * the interval. Works, losses and counts are cumulative from t = 0, so any window is a difference
 * of two rows; only the rotor's torque is a mean over the interval before. Rows are gathered and
 * written in blocks; step and time are stored once and linked. */
#include "observe/series.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KINETIC, ROTATIONAL, POTENTIAL, WORK, TORQUE, SINGLES };
enum { DISSIPATION, NORMAL, COLLISIONS, PER_KIND };

static const struct {
    const char *name, *unit, *meaning;
} single[SINGLES] = {
    {"kinetic_energy", "J", "translational kinetic energy of all balls"},
    {"rotational_energy", "J", "rotational kinetic energy of all balls"},
    {"potential_energy", "J", "potential energy of all balls in gravity, 0 at the drum's centre"},
    {"rotor_work", "J", "work done by the rotor on the balls, cumulative from t = 0"},
    {"rotor_torque", "N m",
     "torque of the rotor on the balls about +x, mean over the interval before; 0 in the first "
     "row"},
};

static const struct {
    const char *name, *unit, *meaning;
    enum mill_h5_type type;
} per_kind[PER_KIND] = {
    {"dissipation", "J", "energy lost in impacts of this kind, cumulative from t = 0", MILL_H5_F64},
    {"dissipation_normal", "J",
     "normal part of the energy lost in impacts of this kind, cumulative from t = 0", MILL_H5_F64},
    {"collisions", "1", "impacts of this kind, cumulative from t = 0", MILL_H5_U64},
};

struct series {
    struct mill_observer observer;
    double interval;      /* [s] */
    double end;           /* [s] of the run */
    uint64_t last;        /* number of the last row */
    double rotor_impulse; /* [N m s] at the row before */
    struct mill_h5_column *step, *time, *single[SINGLES], *kind[PER_KIND][MILL_KINDS];
    struct mill_h5_column *fast[MILL_KINDS];
};

/* Due time of row k; the last one may lie a rounding error behind the end of the run. */
static double due(const struct series *series, uint64_t k)
{
    if (k > series->last)
        return INFINITY;
    return fmin((double)k * series->interval, series->end);
}

/* One element {step, time, value}; the first one made holds step and time, the others link to them.
 */
static enum mill_status open_element(struct series *series, struct mill_h5 *file, const char *group,
                                     const struct mill_h5_layout *value, uint64_t rows,
                                     struct mill_h5_column **column, struct mill_error *error)
{
    static const char first[] = "/observables/kinetic_energy";
    const struct mill_h5_layout layout[2] = {
        {MILL_H5_I64, 0, {0, 0}, 0, "1", "number of the row", false},
        {MILL_H5_F64, 0, {0, 0}, 0, "s", "simulated time", false}};
    static const char *const name[2] = {"step", "time"};
    struct mill_h5_column **shared[2] = {&series->step, &series->time};
    enum mill_status status = MILL_OK;
    char path[128], origin[128];
    int i;
    for (i = 0; status == MILL_OK && i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s", group, name[i]);
        snprintf(origin, sizeof origin, "%s/%s", first, name[i]);
        if (!*shared[i])
            status = mill_h5_column_create(file, path, &layout[i], rows, shared[i], error);
        else
            status = mill_h5_link(file, origin, path, error);
    }
    if (status != MILL_OK)
        return status;
    snprintf(path, sizeof path, "%s/value", group);
    return mill_h5_column_create(file, path, value, rows, column, error);
}

/* Three counts a row; the speeds they are counted from stand beside them. */
static enum mill_status open_fast(struct series *series, struct mill_h5 *file, uint64_t rows,
                                  struct mill_error *error)
{
    const struct mill_h5_layout value = {MILL_H5_U64,
                                         1,
                                         {MILL_WORLD_FAST, 0},
                                         0,
                                         "1",
                                         "impacts of this kind with a normal speed at or above "
                                         "each of `thresholds` (m s-1), cumulative from t = 0",
                                         false};
    enum mill_status status = MILL_OK;
    char group[128];
    for (int kind = 0; status == MILL_OK && kind < MILL_KINDS; kind++) {
        snprintf(group, sizeof group, "/observables/fast_collisions/%s", mill_kind_name[kind]);
        status = open_element(series, file, group, &value, rows, &series->fast[kind], error);
        strcat(group, "/value");
        if (status == MILL_OK)
            status = mill_h5_attribute(file, group, "thresholds", MILL_H5_F64, MILL_WORLD_FAST,
                                       mill_world_fast, error);
    }
    return status;
}

static enum mill_status open_columns(struct series *series, struct mill_h5 *file, uint64_t rows,
                                     struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    char group[128];
    int i, kind;
    for (i = 0; status == MILL_OK && i < SINGLES; i++) {
        const struct mill_h5_layout value = {MILL_H5_F64,       0,    {0, 0}, 0, single[i].unit,
                                             single[i].meaning, false};
        snprintf(group, sizeof group, "/observables/%s", single[i].name);
        status = open_element(series, file, group, &value, rows, &series->single[i], error);
    }
    for (i = 0; status == MILL_OK && i < PER_KIND * MILL_KINDS; i++) {
        const int what = i / MILL_KINDS;
        const struct mill_h5_layout value = {
            per_kind[what].type, 0, {0, 0}, 0, per_kind[what].unit, per_kind[what].meaning, false};
        kind = i % MILL_KINDS;
        snprintf(group, sizeof group, "/observables/%s/%s", per_kind[what].name,
                 mill_kind_name[kind]);
        status = open_element(series, file, group, &value, rows, &series->kind[what][kind], error);
    }
    return status == MILL_OK ? open_fast(series, file, rows, error) : status;
}

static enum mill_status append_kinds(struct series *series, const struct mill_account *account,
                                     struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    int kind;
    for (kind = 0; status == MILL_OK && kind < MILL_KINDS; kind++) {
        status = mill_h5_column_append(series->kind[DISSIPATION][kind], 1,
                                       &account->dissipation[kind], error);
        if (status == MILL_OK)
            status = mill_h5_column_append(series->kind[NORMAL][kind], 1,
                                           &account->dissipation_normal[kind], error);
        if (status == MILL_OK)
            status = mill_h5_column_append(series->kind[COLLISIONS][kind], 1,
                                           &account->collisions[kind], error);
        if (status == MILL_OK)
            status = mill_h5_column_append(series->fast[kind], 1, account->fast[kind], error);
    }
    return status;
}

static enum mill_status sample(struct mill_observer *self, const struct mill_world *world, double t,
                               struct mill_error *error)
{
    struct series *series = (struct series *)self;
    const struct mill_account *account = &world->account;
    const struct mill_energy energy = mill_world_energy(world, t);
    const int64_t k = (int64_t)mill_h5_column_rows(series->step);
    double row[SINGLES];
    enum mill_status status = mill_h5_column_append(series->step, 1, &k, error);
    int i;
    row[KINETIC] = energy.kinetic;
    row[ROTATIONAL] = energy.rotational;
    row[POTENTIAL] = energy.potential;
    row[WORK] = account->rotor_work;
    row[TORQUE] = k > 0 ? (account->rotor_impulse - series->rotor_impulse) / series->interval : 0;
    series->rotor_impulse = account->rotor_impulse;
    if (status == MILL_OK)
        status = mill_h5_column_append(series->time, 1, &self->next, error);
    for (i = 0; status == MILL_OK && i < SINGLES; i++)
        status = mill_h5_column_append(series->single[i], 1, &row[i], error);
    if (status == MILL_OK)
        status = append_kinds(series, account, error);
    self->next = due(series, (uint64_t)k + 1);
    return status;
}

enum mill_status mill_series_resume(struct mill_h5 *file, const struct mill_deck *deck,
                                    const struct mill_world *world,
                                    const struct mill_series_state *state,
                                    struct mill_observer **observer, struct mill_error *error)
{
    struct series *series = calloc(1, sizeof *series);
    enum mill_status status;
    (void)world;
    *observer = NULL;
    if (!series)
        return mill_error_set(error, MILL_FAILED, "out of memory for the time series");
    series->interval = deck->series;
    series->end = deck->time;
    series->last = (uint64_t)floor(deck->time / deck->series + 1e-9);
    series->rotor_impulse = state->rotor_impulse;
    series->observer.sample = sample;
    series->observer.next = due(series, state->rows);
    status = open_columns(series, file, state->rows, error);
    if (status != MILL_OK) {
        mill_series_free(&series->observer);
        return status;
    }
    *observer = &series->observer;
    return MILL_OK;
}

enum mill_status mill_series_create(struct mill_h5 *file, const struct mill_deck *deck,
                                    const struct mill_world *world, struct mill_observer **observer,
                                    struct mill_error *error)
{
    const struct mill_series_state fresh = {0, 0};
    return mill_series_resume(file, deck, world, &fresh, observer, error);
}

void mill_series_save(const struct mill_observer *observer, struct mill_series_state *state)
{
    const struct series *series = (const struct series *)observer;
    state->rows = mill_h5_column_rows(series->step);
    state->rotor_impulse = series->rotor_impulse;
}

enum mill_status mill_series_finish(struct mill_observer *observer, struct mill_error *error)
{
    struct series *series = (struct series *)observer;
    enum mill_status status = MILL_OK;
    int i;
    for (i = 0; status == MILL_OK && i < SINGLES; i++)
        status = mill_h5_column_flush(series->single[i], error);
    for (i = 0; status == MILL_OK && i < PER_KIND * MILL_KINDS; i++)
        status = mill_h5_column_flush(series->kind[i / MILL_KINDS][i % MILL_KINDS], error);
    for (i = 0; status == MILL_OK && i < MILL_KINDS; i++)
        status = mill_h5_column_flush(series->fast[i], error);
    if (status == MILL_OK)
        status = mill_h5_column_flush(series->time, error);
    if (status == MILL_OK)
        status = mill_h5_column_flush(series->step, error);
    return status;
}

void mill_series_free(struct mill_observer *observer)
{
    struct series *series = (struct series *)observer;
    int i;
    if (!series)
        return;
    mill_h5_column_free(series->step);
    mill_h5_column_free(series->time);
    for (i = 0; i < SINGLES; i++)
        mill_h5_column_free(series->single[i]);
    for (i = 0; i < PER_KIND * MILL_KINDS; i++)
        mill_h5_column_free(series->kind[i / MILL_KINDS][i % MILL_KINDS]);
    for (i = 0; i < MILL_KINDS; i++)
        mill_h5_column_free(series->fast[i]);
    free(series);
}
