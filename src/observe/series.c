/* Time series at output.series, as H5MD observables {step, time, value}, step k at k times the
 * interval. Works, losses and counts are cumulative from t = 0: a window is the difference of two
 * rows. The rotor's torque is a mean over the interval before. Step and time are stored once. */
#include "observe/observers.h"

#include "millsim/state.h"
#include "observe/kinds.h"
#include "store/h5.h"

#include <stdio.h>

/* Sources of the values */
struct row {
    struct mill_energy energy;
    double work, torque; /* [J], [N m] of the rotor */
    struct mill_account account;
};

/* A line of the table is one series, or one for each kind, each motion, a rotor, or springs */
enum each { ONE, KIND, MOTION, ROTOR, SPRINGS };

/* offset, each, step, width, type */
#define FROM(member) offsetof(struct row, member)
#define F64(member, each) FROM(member), each, 0, 1, MILL_H5_F64
#define KIND_F64(member) FROM(account.member), KIND, sizeof(double), 1, MILL_H5_F64

static const struct {
    const char *name, *unit;
    size_t from; /* offset of its value in a row */
    enum each each;
    size_t step;  /* [bytes] from one of these series to the next */
    size_t width; /* numbers in a row of a series */
    enum mill_h5_type type;
    const char *meaning;
} table[] = {
    {"kinetic_energy", "J", F64(energy.kinetic, ONE), "translational kinetic energy of all balls"},
    {"rotational_energy", "J", F64(energy.rotational, ONE),
     "rotational kinetic energy of all balls"},
    {"potential_energy", "J", F64(energy.potential, ONE),
     "potential energy of all balls in gravity, 0 at the laboratory's origin"},
    {"rotor_work", "J", F64(work, ROTOR),
     "work done by the rotor on the balls, cumulative from t = 0"},
    {"rotor_torque", "N m", F64(torque, ROTOR),
     "torque of the rotor on the balls about +x, mean over the interval before; 0 in the first "
     "row"},
    {"motion_work", "J", FROM(account.motion[0].work), MOTION,
     sizeof((struct mill_account *)0)->motion[0], 1, MILL_H5_F64,
     "work done on the balls by this motion's own velocity, cumulative from t = 0"},
    {"dissipation", "J", KIND_F64(dissipation),
     "energy lost in impacts of this kind, cumulative from t = 0"},
    {"dissipation_normal", "J", KIND_F64(dissipation_normal),
     "normal part of the energy lost in impacts of this kind, cumulative from t = 0"},
    {"collisions", "1", FROM(account.collisions), KIND, sizeof(uint64_t), 1, MILL_H5_U64,
     "impacts of this kind, cumulative from t = 0"},
    {"fast_collisions", "1", FROM(account.fast), KIND, MILL_WORLD_FAST * sizeof(uint64_t),
     MILL_WORLD_FAST, MILL_H5_U64,
     "impacts of this kind with a normal speed at or above each of `thresholds` (m s-1), "
     "cumulative from t = 0"},
    {"elastic_energy", "J", F64(account.elastic, SPRINGS),
     "energy stored in the springs of all contacts"}};
enum { TABLE = sizeof table / sizeof *table };

struct series {
    struct mill_observer observer;
    struct mill_h5 *file;
    double interval, end;  /* [s] of the rows; of the run */
    uint64_t rows;         /* rows so far */
    double rotor_impulse;  /* [N m s] at the row before */
    int many[SPRINGS + 1]; /* number of series of a line of the table */
    struct mill_listed kinds;
    /* the file's: step and time */
    struct mill_h5_column *shared[2], *column[TABLE][MILL_KINDS_MOST];
};

/* Opens the elements {step, time, value} of row i; all but the first link to its step and time. */
static void open_elements(struct series *series, const struct mill_world *world, int i)
{
    static const struct mill_h5_layout layout[2] = {
        {MILL_H5_I64, 0, {0}, 0, "1", "number of the row", false},
        {MILL_H5_F64, 0, {0}, 0, "s", "simulated time", false}};
    static const char *const name[2] = {"step", "time"};
    const size_t width = table[i].width;
    const struct mill_h5_layout value = {table[i].type, width > 1,        {width}, 0,
                                         table[i].unit, table[i].meaning, false};
    const enum each each = table[i].each;
    struct mill_h5 *file = series->file;
    char group[128], path[160], origin[128];
    for (int n = 0; n < series->many[each]; n++) {
        const char *of = each == KIND ? series->kinds.name[n] : world->motion_name[n];
        const bool one = each != KIND && each != MOTION;
        snprintf(group, sizeof group, "/observables/%s%s%s", table[i].name, one ? "" : "/",
                 one ? "" : of);
        for (int k = 0; k < 2; k++) {
            snprintf(path, sizeof path, "%s/%s", group, name[k]);
            snprintf(origin, sizeof origin, "/observables/%s/%s", table[0].name, name[k]);
            if (i == 0)
                series->shared[k] = mill_h5_column_create(file, path, &layout[k], series->rows);
            else
                mill_h5_link(file, origin, path);
        }
        snprintf(path, sizeof path, "%s/value", group);
        series->column[i][n] = mill_h5_column_create(file, path, &value, series->rows);
        if (width > 1) /* the limits of speed for these counts are stored next to them */
            mill_h5_attribute(file, path, "thresholds", MILL_H5_F64, width, mill_world_fast);
    }
}

static enum mill_status sample(struct mill_observer *self, const struct mill_world *world, double t,
                               struct mill_error *error)
{
    struct series *series = (struct series *)self;
    const int rotor = world->rotor;
    const double now = rotor < 0 ? 0 : world->account.motion[rotor].impulse;
    const double impulse = now - series->rotor_impulse;
    const struct row row = {.energy = mill_world_energy(world, t),
                            .work = rotor < 0 ? 0 : world->account.motion[rotor].work,
                            .torque = series->rows > 0 ? impulse / series->interval : 0,
                            .account = world->account};
    series->rotor_impulse = now;
    mill_h5_column_append(series->shared[0], 1, &series->rows);
    mill_h5_column_append(series->shared[1], 1, &self->next);
    for (int i = 0; i < TABLE; i++)
        for (int n = 0; n < series->many[table[i].each]; n++) {
            const size_t which = (size_t)(table[i].each == KIND ? series->kinds.kind[n] : n);
            const char *value = (const char *)&row + table[i].from + which * table[i].step;
            mill_h5_column_append(series->column[i][n], 1, value);
        }
    self->next = mill_observe_due(series->interval, series->end, ++series->rows);
    return mill_h5_status(series->file, error);
}

static void tell_state(struct mill_observer *self, struct mill_state *state)
{
    struct series *series = (struct series *)self;
    mill_state_structs(state, "rows", sizeof series->rows, 1, &series->rows);
    mill_state_field(state, "rotor_impulse", MILL_FIELD_F64, 1, &series->rotor_impulse);
}

static void open_file(struct mill_observer *self, const struct mill_observe *asked,
                      struct mill_h5 *file, const struct mill_world *world)
{
    struct series *series = (struct series *)self;
    series->file = file;
    series->many[ONE] = 1;
    series->kinds = mill_kinds_listed(world);
    series->many[KIND] = series->kinds.count;
    series->many[ROTOR] = world->rotor >= 0;
    series->many[MOTION] = world->motions;
    series->many[SPRINGS] = asked->springs;
    series->interval = asked->series;
    series->end = asked->end;
    self->next = mill_observe_due(asked->series, asked->end, series->rows);
    for (int i = 0; i < TABLE; i++)
        open_elements(series, world, i);
}

const struct mill_observing mill_series_type = {.type = {"series", NULL, sample, NULL},
                                                .size = sizeof(struct series),
                                                .state = tell_state,
                                                .open = open_file};
