/* Which ball was let go, and from when until when: a ball in a relief may be inside a body. */
#include "base/memory.h"
#include "millsim/state.h"
#include "observe/observers.h"
#include "observe/sums.h"

enum { MOST = 100000 /* rows */ };

struct row {
    int64_t ball;
    double time, until; /* [s]; until: INFINITY while the relief lasts */
};

struct reliefs {
    struct mill_observer observer;
    struct mill_memory_list rows;
};

static struct mill_memory_list *rows_of(struct mill_observer *self)
{
    struct mill_memory_list *rows = &((struct reliefs *)self)->rows;
    rows->size = sizeof(struct row);
    return rows;
}

static enum mill_status on_relief(struct mill_observer *self, int32_t ball, double time,
                                  bool begins, struct mill_error *error)
{
    struct mill_memory_list *rows = rows_of(self);
    struct row *row = rows->item;
    if (begins && rows->count < MOST) {
        row = mill_memory_add(rows);
        if (!row)
            return mill_error_set(error, MILL_FAILED, "out of memory for the reliefs");
        *row = (struct row){ball, time, INFINITY};
    }
    size_t k = begins ? 0 : rows->count;
    while (k > 0 && !(isinf(row[k - 1].until) && row[k - 1].ball == ball))
        k--;
    if (k > 0)
        row[k - 1].until = time;
    return MILL_OK;
}

static void tell_state(struct mill_observer *self, struct mill_state *state)
{
    struct mill_memory_list *rows = rows_of(self);
    uint64_t count = rows->count;
    mill_state_structs(state, "count", sizeof count, 1, &count);
    if (state->loads && state->status == MILL_OK && count > MOST)
        mill_state_refuse(state, "the saved reliefs are damaged");
    while (rows->count < count && state->status == MILL_OK)
        if (!mill_memory_add(rows))
            mill_state_refuse(state, "out of memory for the reliefs");
    mill_state_structs(state, "rows", sizeof(struct row), rows->count, rows->item);
}

/* Only of a run with reliefs */
static enum mill_status tell_results(const struct mill_observer *self,
                                     const struct mill_world *world, double t,
                                     struct mill_sink *sink, struct mill_error *error)
{
    static const struct mill_sum sum[] = {
        {"ball", "1",
         "number of a ball that was let go, in order of time; at most 100000 are listed",
         MILL_H5_I64, offsetof(struct row, ball), 0, 0},
        {"time", "s", "when it was let go", MILL_H5_F64, offsetof(struct row, time), 0, 0},
        {"until", "s", "when it was clear again; infinite: not before the end of the run",
         MILL_H5_F64, offsetof(struct row, until), 0, 0}};
    static const struct mill_sums_list list = {"reliefs", sizeof(struct row), 3, sum};
    const struct mill_memory_list *rows = &((const struct reliefs *)self)->rows;
    const struct mill_sums sums = {&list, rows->count, rows->item};
    (void)world, (void)t, (void)error;
    if (rows->count == 0 || !sink->full)
        return MILL_OK;
    sink->open(sink, "reliefs");
    mill_sums_tell_all(&sums, sink);
    sink->close(sink);
    return MILL_OK;
}

static void free_reliefs(struct mill_observer *self)
{
    free(((struct reliefs *)self)->rows.item);
}

const struct mill_observing mill_reliefs_type = {.type = {.name = "reliefs", .relief = on_relief},
                                                 .size = sizeof(struct reliefs),
                                                 .state = tell_state,
                                                 .results = tell_results,
                                                 .free = free_reliefs};
