/* Logs every impact (output.impacts = all), one dataset a column. Impacts come by the million a
 * second, so a row costs a few stores into arrays; only every BLOCK rows HDF5 is called. */
#include "observe/impactlog.h"

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

enum mill_status mill_impactlog_resume(struct mill_h5 *file, const struct mill_deck *deck,
                                       const struct mill_world *world,
                                       const struct mill_impactlog_state *state,
                                       struct mill_observer **observer, struct mill_error *error)
{
    struct impactlog *log = calloc(1, sizeof *log);
    (void)deck;
    (void)world;
    *observer = NULL;
    if (!log)
        return mill_error_set(error, MILL_FAILED, "out of memory for the log of impacts");
    log->file = file;
    log->observer.next = INFINITY;
    log->observer.impact = log_impact;
    for (int i = 0; i < COLUMNS; i++) {
        const struct mill_h5_layout layout = {.type = table[i].type,
                                              .rank = table[i].rank,
                                              .dims = {3},
                                              .chunk = CHUNK,
                                              .unit = table[i].unit,
                                              .description = table[i].meaning};
        log->column[i] = mill_h5_column_create(file, table[i].path, &layout, state->rows);
    }
    mill_h5_attribute_texts(file, "/impacts", "kinds", MILL_KINDS, mill_kind_name);
    mill_h5_attribute_texts(file, "/impacts/kind", "kinds", MILL_KINDS, mill_kind_name);
    const enum mill_status status = mill_h5_status(file, error);
    if (status == MILL_OK)
        *observer = &log->observer;
    else
        free(log);
    return status;
}

enum mill_status mill_impactlog_create(struct mill_h5 *file, const struct mill_deck *deck,
                                       const struct mill_world *world,
                                       struct mill_observer **observer, struct mill_error *error)
{
    const struct mill_impactlog_state fresh = {0};
    return mill_impactlog_resume(file, deck, world, &fresh, observer, error);
}

void mill_impactlog_save(const struct mill_observer *observer, struct mill_impactlog_state *state)
{
    const struct impactlog *log = (const struct impactlog *)observer;
    state->rows = mill_h5_column_rows(log->column[TIME]) + log->gathered;
}

void mill_impactlog_finish(struct mill_observer *observer)
{
    write_block((struct impactlog *)observer);
}

void mill_impactlog_free(struct mill_observer *observer)
{
    free((struct impactlog *)observer);
}
