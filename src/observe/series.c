/* Time series at output.series, as H5MD observables {step, time, value}: step k belongs to k times
 * the interval. Works, losses and counts are cumulative from t = 0, so any window is a difference
 * of two rows; only the rotor's torque is a mean over the interval before. Rows are gathered and
 * written in blocks; step and time are stored once and linked. */
#include "observe/series.h"

#include "millsim/state.h"
#include "observe/observe.h"
#include "store/h5.h"

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
    struct mill_h5 *file;
    double interval;      /* [s] */
    double end;           /* [s] of the run */
    uint64_t rows;        /* as last saved */
    double rotor_impulse; /* [N m s] at the row before */
    /* the file's */
    struct mill_h5_column *step, *time, *single[SINGLES], *kind[PER_KIND][MILL_KINDS];
    struct mill_h5_column *fast[MILL_KINDS];
};

/* One element {step, time, value}; the first one made holds step and time, the others link to them.
 */
static struct mill_h5_column *open_element(struct series *series, const char *group,
                                           const struct mill_h5_layout *value, uint64_t rows)
{
    static const char first[] = "/observables/kinetic_energy";
    static const struct mill_h5_layout layout[2] = {
        {.type = MILL_H5_I64, .unit = "1", .description = "number of the row"},
        {.type = MILL_H5_F64, .unit = "s", .description = "simulated time"}};
    static const char *const name[2] = {"step", "time"};
    struct mill_h5_column **shared[2] = {&series->step, &series->time};
    char path[128], origin[128];
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s", group, name[i]);
        snprintf(origin, sizeof origin, "%s/%s", first, name[i]);
        if (!*shared[i])
            *shared[i] = mill_h5_column_create(series->file, path, &layout[i], rows);
        else
            mill_h5_link(series->file, origin, path);
    }
    snprintf(path, sizeof path, "%s/value", group);
    return mill_h5_column_create(series->file, path, value, rows);
}

/* Three counts a row; the speeds they are counted from stand beside them. */
static void open_fast(struct series *series, uint64_t rows)
{
    static const struct mill_h5_layout value = {
        .type = MILL_H5_U64,
        .rank = 1,
        .dims = {MILL_WORLD_FAST},
        .unit = "1",
        .description = "impacts of this kind with a normal speed at or above each of `thresholds` "
                       "(m s-1), cumulative from t = 0"};
    char group[128];
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        snprintf(group, sizeof group, "/observables/fast_collisions/%s", mill_kind_name[kind]);
        series->fast[kind] = open_element(series, group, &value, rows);
        strcat(group, "/value");
        mill_h5_attribute(series->file, group, "thresholds", MILL_H5_F64, MILL_WORLD_FAST,
                          mill_world_fast);
    }
}

static void open_columns(struct series *series, uint64_t rows)
{
    char group[128];
    for (int i = 0; i < SINGLES; i++) {
        const struct mill_h5_layout value = {
            .type = MILL_H5_F64, .unit = single[i].unit, .description = single[i].meaning};
        snprintf(group, sizeof group, "/observables/%s", single[i].name);
        series->single[i] = open_element(series, group, &value, rows);
    }
    for (int i = 0; i < PER_KIND; i++) {
        const struct mill_h5_layout value = {
            .type = per_kind[i].type, .unit = per_kind[i].unit, .description = per_kind[i].meaning};
        for (int kind = 0; kind < MILL_KINDS; kind++) {
            snprintf(group, sizeof group, "/observables/%s/%s", per_kind[i].name,
                     mill_kind_name[kind]);
            series->kind[i][kind] = open_element(series, group, &value, rows);
        }
    }
    open_fast(series, rows);
}

static void append_kinds(struct series *series, const struct mill_account *account)
{
    for (int kind = 0; kind < MILL_KINDS; kind++) {
        mill_h5_column_append(series->kind[DISSIPATION][kind], 1, &account->dissipation[kind]);
        mill_h5_column_append(series->kind[NORMAL][kind], 1, &account->dissipation_normal[kind]);
        mill_h5_column_append(series->kind[COLLISIONS][kind], 1, &account->collisions[kind]);
        mill_h5_column_append(series->fast[kind], 1, account->fast[kind]);
    }
}

static enum mill_status sample(struct mill_observer *self, const struct mill_world *world, double t,
                               struct mill_error *error)
{
    struct series *series = (struct series *)self;
    const struct mill_account *account = &world->account;
    const struct mill_energy energy = mill_world_energy(world, t);
    const int64_t k = (int64_t)mill_h5_column_rows(series->step);
    const double impulse = account->rotor_impulse - series->rotor_impulse;
    const double row[SINGLES] = {[KINETIC] = energy.kinetic,
                                 [ROTATIONAL] = energy.rotational,
                                 [POTENTIAL] = energy.potential,
                                 [WORK] = account->rotor_work,
                                 [TORQUE] = k > 0 ? impulse / series->interval : 0};
    series->rotor_impulse = account->rotor_impulse;
    mill_h5_column_append(series->step, 1, &k);
    mill_h5_column_append(series->time, 1, &self->next);
    for (int i = 0; i < SINGLES; i++)
        mill_h5_column_append(series->single[i], 1, &row[i]);
    append_kinds(series, account);
    self->next = mill_observe_due(series->interval, series->end, (uint64_t)k + 1);
    return mill_h5_status(series->file, error);
}

static enum mill_status create(const struct mill_observe *asked, const struct mill_world *world,
                               struct mill_observer **out, struct mill_error *error)
{
    struct series *series = calloc(1, sizeof *series);
    (void)world;
    if (!series)
        return mill_error_set(error, MILL_FAILED, "out of memory for the time series");
    series->observer = (struct mill_observer){&mill_series_type, 0};
    series->interval = asked->series;
    series->end = asked->end;
    *out = &series->observer;
    return MILL_OK;
}

static void tell_state(struct mill_observer *self, struct mill_state *state)
{
    struct series *series = (struct series *)self;
    if (!state->loads)
        series->rows = mill_h5_column_rows(series->step);
    mill_state_structs(state, "rows", sizeof series->rows, 1, &series->rows);
    mill_state_field(state, "rotor_impulse", MILL_FIELD_F64, 1, &series->rotor_impulse);
}

static void open_file(struct mill_observer *self, struct mill_h5 *file,
                      const struct mill_world *world)
{
    struct series *series = (struct series *)self;
    (void)world;
    series->file = file;
    self->next = mill_observe_due(series->interval, series->end, series->rows);
    open_columns(series, series->rows);
}

static void free_series(struct mill_observer *self)
{
    free(self);
}

const struct mill_observer_type mill_series_type = {
    .name = "series",
    .sample = sample,
    .create = create,
    .state = tell_state,
    .open = open_file,
    .free = free_series,
};
