/* Logs every impact (output.impacts = all), one dataset a column. Impacts come by the million a
 * second, so a row costs a few stores into arrays; only every BLOCK rows HDF5 is called. */
#include "observe/impactlog.h"

#include "millsim/state.h"
#include "observe/observe.h"
#include "store/h5.h"

#include <math.h>
#include <stdlib.h>

#define BLOCK 65536
#define CHUNK 16384

enum { TIME, KIND, BALL, PARTNER, POSITION, NORMAL, NORMAL_SPEED, TANGENTIAL_SPEED, LOSS, COLUMNS };

static const struct {
    const char *path, *unit, *meaning;
    enum mill_h5_type type;
    int rank; /* 0: a number, 1: three */
} table[COLUMNS] = {
    {"/impacts/time", "s", "simulated time of the impact", MILL_H5_F64, 0},
    {"/impacts/kind", "1", "kind of contact: index into the attribute kinds", MILL_H5_U8, 0},
    {"/impacts/ball", "1", "number of the ball", MILL_H5_I32, 0},
    {"/impacts/partner", "1",
     "number of the other ball, of the blade or of the end wall; -1 for drum and shaft",
     MILL_H5_I32, 0},
    {"/impacts/position", "m", "point of contact: (x, y, z)", MILL_H5_F32, 1},
    {"/impacts/normal", "1", "unit normal of the contact, into the ball: (x, y, z)", MILL_H5_F32,
     1},
    {"/impacts/normal_speed", "m s-1", "approach speed along the normal just before", MILL_H5_F64,
     0},
    {"/impacts/tangential_speed", "m s-1", "slip of the two surfaces just before", MILL_H5_F64, 0},
    {"/impacts/dissipation", "J",
     "energy lost in the impact; negative where the rebound floor gave energy", MILL_H5_F64, 0},
};

struct block {
    double time[BLOCK];
    uint8_t kind[BLOCK];
    int32_t ball[BLOCK];
    int32_t partner[BLOCK];
    float position[BLOCK][3];
    float normal[BLOCK][3];
    double normal_speed[BLOCK];
    double tangential_speed[BLOCK];
    double loss[BLOCK];
};

struct impactlog {
    struct mill_observer observer;
    struct mill_h5 *file;
    uint64_t rows;                          /* as last saved */
    size_t gathered;                        /* rows in the block */
    struct mill_h5_column *column[COLUMNS]; /* the file's */
    struct block block;
};

static void write_block(struct impactlog *log)
{
    const struct block *block = &log->block;
    const void *const rows[COLUMNS] = {
        block->time,     block->kind,   block->ball,         block->partner,
        block->position, block->normal, block->normal_speed, block->tangential_speed,
        block->loss};
    for (int i = 0; i < COLUMNS; i++)
        mill_h5_column_append(log->column[i], log->gathered, rows[i]);
    log->gathered = 0;
}

static enum mill_status log_impact(struct mill_observer *self, const struct mill_impact *impact,
                                   struct mill_error *error)
{
    struct impactlog *log = (struct impactlog *)self;
    struct block *block = &log->block;
    const size_t i = log->gathered++;
    block->time[i] = impact->time;
    block->kind[i] = (uint8_t)impact->kind;
    block->ball[i] = impact->ball;
    block->partner[i] = impact->partner;
    block->position[i][0] = (float)impact->position.x;
    block->position[i][1] = (float)impact->position.y;
    block->position[i][2] = (float)impact->position.z;
    block->normal[i][0] = (float)impact->normal.x;
    block->normal[i][1] = (float)impact->normal.y;
    block->normal[i][2] = (float)impact->normal.z;
    block->normal_speed[i] = impact->normal_speed;
    block->tangential_speed[i] = impact->tangential_speed;
    block->loss[i] = impact->dissipation;
    if (i + 1 < BLOCK)
        return MILL_OK;
    write_block(log);
    return mill_h5_status(log->file, error);
}

static enum mill_status create(const struct mill_observe *asked, const struct mill_world *world,
                               struct mill_observer **out, struct mill_error *error)
{
    struct impactlog *log = asked->log_impacts ? calloc(1, sizeof *log) : NULL;
    (void)world;
    if (asked->log_impacts && !log)
        return mill_error_set(error, MILL_FAILED, "out of memory for the log of impacts");
    if (log)
        log->observer = (struct mill_observer){&mill_impactlog_type, INFINITY};
    *out = log ? &log->observer : NULL;
    return MILL_OK;
}

static void tell_state(struct mill_observer *self, struct mill_state *state)
{
    struct impactlog *log = (struct impactlog *)self;
    if (!state->loads)
        log->rows = mill_h5_column_rows(log->column[TIME]) + log->gathered;
    mill_state_structs(state, "rows", sizeof log->rows, 1, &log->rows);
}

static void open_file(struct mill_observer *self, struct mill_h5 *file,
                      const struct mill_world *world)
{
    struct impactlog *log = (struct impactlog *)self;
    (void)world;
    log->file = file;
    for (int i = 0; i < COLUMNS; i++) {
        const struct mill_h5_layout layout = {.type = table[i].type,
                                              .rank = table[i].rank,
                                              .dims = {3},
                                              .chunk = CHUNK,
                                              .unit = table[i].unit,
                                              .description = table[i].meaning};
        log->column[i] = mill_h5_column_create(file, table[i].path, &layout, log->rows);
    }
    mill_h5_attribute_texts(file, "/impacts", "kinds", MILL_KINDS, mill_kind_name);
    mill_h5_attribute_texts(file, "/impacts/kind", "kinds", MILL_KINDS, mill_kind_name);
}

static void flush(struct mill_observer *self)
{
    write_block((struct impactlog *)self);
}

static void free_log(struct mill_observer *self)
{
    free(self);
}

const struct mill_observer_type mill_impactlog_type = {
    .name = "impacts",
    .impact = log_impact,
    .create = create,
    .state = tell_state,
    .open = open_file,
    .flush = flush,
    .free = free_log,
};
