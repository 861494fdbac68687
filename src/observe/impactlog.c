/* Stores every impact (output.impacts = all); each column is a dataset. */
#include "observe/observers.h"

#include "millsim/state.h"
#include "observe/kinds.h"
#include "store/h5.h"

enum { CHUNK = 16384 }; /* rows */

static const struct {
    const char *path, *unit;
    enum mill_h5_type type;
    int rank; /* 0: a number, 1: three */
    const char *meaning;
} table[] = {
    {"/impacts/time", "s", MILL_H5_F64, 0, "simulated time of the impact"},
    {"/impacts/kind", "1", MILL_H5_U8, 0, "kind of contact: index into the attribute kinds"},
    {"/impacts/ball", "1", MILL_H5_I32, 0, "number of the ball"},
    {"/impacts/partner", "1", MILL_H5_I32, 0,
     "number of the other ball, of the blade, the end wall or the body's copy; -1 for drum and "
     "shaft"},
    {"/impacts/position", "m", MILL_H5_F32, 1, "point of contact: (x, y, z)"},
    {"/impacts/normal", "1", MILL_H5_F32, 1,
     "unit normal of the contact, into the ball: (x, y, z)"},
    {"/impacts/normal_speed", "m s-1", MILL_H5_F64, 0,
     "approach speed along the normal just before"},
    {"/impacts/tangential_speed", "m s-1", MILL_H5_F64, 0, "slip of the two surfaces just before"},
    {"/impacts/dissipation", "J", MILL_H5_F64, 0,
     "energy lost in the impact; negative where the rebound floor gave energy"}};
enum { COLUMNS = sizeof table / sizeof *table };

struct impactlog {
    struct mill_observer observer;
    struct mill_h5 *file;
    struct mill_listed kinds;
    uint64_t rows;                          /* so far */
    struct mill_h5_column *column[COLUMNS]; /* the file's */
};

static bool is_wanted(const struct mill_observe *asked)
{
    return asked->log_impacts;
}

static enum mill_status log_impact(struct mill_observer *self, const struct mill_impact *impact,
                                   struct mill_error *error)
{
    struct impactlog *log = (struct impactlog *)self;
    const vec3 *r = &impact->position, *n = &impact->normal;
    const uint8_t kind = (uint8_t)log->kinds.number[impact->kind];
    const float position[3] = {(float)r->x, (float)r->y, (float)r->z};
    const float normal[3] = {(float)n->x, (float)n->y, (float)n->z};
    /* in the order of the table */
    const void *const row[COLUMNS] = {&impact->time,
                                      &kind,
                                      &impact->ball,
                                      &impact->partner,
                                      position,
                                      normal,
                                      &impact->normal_speed,
                                      &impact->tangential_speed,
                                      &impact->dissipation};
    if (impact->lasting)
        return MILL_OK;
    log->rows++;
    for (int i = 0; i < COLUMNS; i++)
        mill_h5_column_append(log->column[i], 1, row[i]);
    return mill_h5_status(log->file, error);
}

static void tell_state(struct mill_observer *self, struct mill_state *state)
{
    mill_state_structs(state, "rows", sizeof(uint64_t), 1, &((struct impactlog *)self)->rows);
}

static void open_file(struct mill_observer *self, const struct mill_observe *asked,
                      struct mill_h5 *file, const struct mill_world *world)
{
    struct impactlog *log = (struct impactlog *)self;
    (void)asked;
    log->file = file;
    log->kinds = mill_kinds_listed(world);
    for (int i = 0; i < COLUMNS; i++) {
        const struct mill_h5_layout layout = {table[i].type, table[i].rank,    {3},  CHUNK,
                                              table[i].unit, table[i].meaning, false};
        log->column[i] = mill_h5_column_create(file, table[i].path, &layout, log->rows);
    }
    const size_t kinds = (size_t)log->kinds.count;
    mill_h5_attribute(file, "/impacts", "kinds", MILL_H5_TEXT, kinds, log->kinds.name);
    mill_h5_attribute(file, "/impacts/kind", "kinds", MILL_H5_TEXT, kinds, log->kinds.name);
}

const struct mill_observing mill_impactlog_type = {.type = {"impacts", log_impact, NULL, NULL},
                                                   .size = sizeof(struct impactlog),
                                                   .wanted = is_wanted,
                                                   .state = tell_state,
                                                   .open = open_file};
