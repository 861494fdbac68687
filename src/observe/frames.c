/* Stores where the balls are and how they move, at output.frames, as H5MD 1.1 (de Buyl, Colberg and
 * Hoefling, Comput. Phys. Commun. 185, 2014, 1546; www.nongnu.org/h5md). Frame k belongs to k times
 * the interval, computed so and not summed up. float32: 1e-8 m in a drum of 0.1 m is far below what
 * a picture or a correlation can show, and half the disk. The box carries no edges: it is open, and
 * MDAnalysis expects none then. */
#include "observe/frames.h"

#include "base/version.h"
#include "millsim/state.h"
#include "observe/vtkhdf.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GROUP "/particles/trajectory"

enum { POSITION, VELOCITY, SPIN, STATES };

struct frames {
    struct mill_observer observer;
    struct mill_observe asked;
    uint64_t rows; /* frames, as last saved */
    struct mill_h5 *file;
    struct mill_h5_column *step, *time, *value[STATES]; /* the file's */
    float *row;                                         /* one state of the balls */
};

static const char *const state_name[STATES] = {"position", "velocity", "angular_velocity"};
static const char *const state_unit[STATES] = {"m", "m s-1", "rad s-1"};
static const char *const state_meaning[STATES] = {
    "centres of the balls: frame, ball, (x, y, z)",
    "velocities of the balls: frame, ball, (x, y, z)",
    "angular velocities of the balls: frame, ball, (x, y, z)"};

static void write_h5md(struct mill_h5 *file)
{
    static const int32_t version[2] = {1, 1}, units_version[2] = {1, 0};
    static const struct {
        const char *group, *name, *text;
    } texts[] = {{"/h5md/author", "name", "millsim"},
                 {"/h5md/creator", "name", "millsim"},
                 {"/h5md/creator", "version", mill_version},
                 {"/h5md/modules/units", "system", "SI"}};
    mill_h5_group(file, "/h5md", false);
    mill_h5_attribute(file, "/h5md", "version", MILL_H5_I32, 2, version);
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        mill_h5_group(file, texts[i].group, false);
        mill_h5_attribute_text(file, texts[i].group, texts[i].name, texts[i].text);
    }
    mill_h5_attribute(file, "/h5md/modules/units", "version", MILL_H5_I32, 2, units_version);
}

static void write_box(struct mill_h5 *file)
{
    static const int32_t dimension = 3;
    static const char *const boundary[3] = {"none", "none", "none"};
    mill_h5_group(file, GROUP "/box", false);
    mill_h5_attribute(file, GROUP "/box", "dimension", MILL_H5_I32, 0, &dimension);
    mill_h5_attribute_texts(file, GROUP "/box", "boundary", 3, boundary);
}

static void write_species_names(struct mill_h5 *file, const struct mill_world *world)
{
    const size_t count = (size_t)world->species_count;
    const char **names = malloc(count * sizeof *names);
    if (!names) {
        mill_h5_spend(file, "out of memory for the names of the ball kinds");
        return;
    }
    for (size_t i = 0; i < count; i++)
        names[i] = world->species[i].name;
    mill_h5_attribute_texts(file, GROUP "/species", "names", count, names);
    free(names);
}

/* id, species, mass and diameter of every ball */
static void write_balls(struct mill_h5 *file, const struct mill_world *world)
{
    const size_t n = (size_t)world->balls;
    int32_t *number = malloc((n ? n : 1) * sizeof *number);
    double *value = malloc((n ? n : 1) * sizeof *value);
    if (!number || !value) {
        mill_h5_spend(file, "out of memory for the balls");
        free(number);
        free(value);
        return;
    }
    for (size_t i = 0; i < n; i++)
        number[i] = (int32_t)i;
    mill_h5_write(file, GROUP "/id", MILL_H5_I32, 1, &n, number, "1",
                  "number of the ball: its line in the start file, from 0");
    for (size_t i = 0; i < n; i++)
        number[i] = world->ball[i].species;
    mill_h5_write(file, GROUP "/species", MILL_H5_I32, 1, &n, number, "1",
                  "kind of the ball: index into the attribute names");
    for (size_t i = 0; i < n; i++)
        value[i] = world->species[world->ball[i].species].mass;
    mill_h5_write(file, GROUP "/mass", MILL_H5_F64, 1, &n, value, "kg", "mass of the ball");
    for (size_t i = 0; i < n; i++)
        value[i] = 2 * world->species[world->ball[i].species].radius;
    mill_h5_write(file, GROUP "/diameter", MILL_H5_F64, 1, &n, value, "m", "diameter of the ball");
    free(number);
    free(value);
}

static void open_columns(struct frames *frames, size_t balls, uint64_t rows)
{
    static const struct mill_h5_layout step = {.type = MILL_H5_I64,
                                               .unit = "1",
                                               .description = "number of the frame"},
                                       time = {.type = MILL_H5_F64,
                                               .unit = "s",
                                               .description = "simulated time"};
    struct mill_h5 *file = frames->file;
    frames->step = mill_h5_column_create(file, GROUP "/position/step", &step, rows);
    frames->time = mill_h5_column_create(file, GROUP "/position/time", &time, rows);
    for (int i = 0; i < STATES; i++) {
        const struct mill_h5_layout value = {.type = MILL_H5_F32,
                                             .rank = 2,
                                             .dims = {balls, 3},
                                             .unit = state_unit[i],
                                             .description = state_meaning[i],
                                             .plain = true};
        char path[64];
        snprintf(path, sizeof path, GROUP "/%s/value", state_name[i]);
        frames->value[i] = mill_h5_column_create(file, path, &value, rows);
        if (i == POSITION)
            continue;
        snprintf(path, sizeof path, GROUP "/%s/step", state_name[i]);
        mill_h5_link(file, GROUP "/position/step", path);
        snprintf(path, sizeof path, GROUP "/%s/time", state_name[i]);
        mill_h5_link(file, GROUP "/position/time", path);
    }
}

static vec3 state_of(const struct mill_world *world, int state, int32_t ball, double t)
{
    if (state == POSITION)
        return mill_world_position(world, ball, t);
    return state == VELOCITY ? mill_world_velocity(world, ball, t) : world->spin[ball];
}

static void store_state(struct frames *frames, const struct mill_world *world, int state, double t)
{
    for (int32_t i = 0; i < world->balls; i++) {
        const vec3 a = state_of(world, state, i, t);
        float *to = frames->row + 3 * (size_t)i;
        to[0] = (float)a.x;
        to[1] = (float)a.y;
        to[2] = (float)a.z;
    }
    mill_h5_column_append(frames->value[state], 1, frames->row);
}

static enum mill_status sample(struct mill_observer *self, const struct mill_world *world, double t,
                               struct mill_error *error)
{
    struct frames *frames = (struct frames *)self;
    const int64_t k = (int64_t)mill_h5_column_rows(frames->step);
    mill_h5_column_append(frames->step, 1, &k);
    mill_h5_column_append(frames->time, 1, &self->next);
    for (int i = 0; i < STATES; i++)
        store_state(frames, world, i, t);
    self->next = mill_observe_due(frames->asked.frames, frames->asked.end, (uint64_t)k + 1);
    return mill_h5_status(frames->file, error);
}

static enum mill_status create(const struct mill_observe *asked, const struct mill_world *world,
                               struct mill_observer **out, struct mill_error *error)
{
    struct frames *frames = calloc(1, sizeof *frames);
    (void)world;
    if (!frames)
        return mill_error_set(error, MILL_FAILED, "out of memory for frames");
    frames->observer = (struct mill_observer){&mill_frames_type, INFINITY};
    frames->asked = *asked;
    *out = &frames->observer;
    return MILL_OK;
}

static void tell_state(struct mill_observer *self, struct mill_state *state)
{
    struct frames *frames = (struct frames *)self;
    if (!state->loads)
        frames->rows = mill_h5_column_rows(frames->step);
    mill_state_structs(state, "rows", sizeof frames->rows, 1, &frames->rows);
}

static void open_file(struct mill_observer *self, struct mill_h5 *file,
                      const struct mill_world *world)
{
    struct frames *frames = (struct frames *)self;
    frames->file = file;
    mill_vtkhdf_remove(file);
    if (frames->rows == 0) {
        write_h5md(file);
        write_box(file);
        write_balls(file, world);
        write_species_names(file, world);
    }
    if (frames->asked.frames == 0)
        return;
    self->next = mill_observe_due(frames->asked.frames, frames->asked.end, frames->rows);
    open_columns(frames, (size_t)world->balls, frames->rows);
    frames->row = malloc((3 * (size_t)world->balls + 1) * sizeof *frames->row);
    if (!frames->row)
        mill_h5_spend(file, "out of memory for frames");
}

static bool finish(struct mill_observer *self, const struct mill_world *world,
                   const struct mill_going *going)
{
    const struct frames *frames = (const struct frames *)self;
    const uint64_t rows = mill_h5_column_rows(frames->step);
    return mill_vtkhdf_write(frames->file, &frames->asked, world, rows, going);
}

static void free_frames(struct mill_observer *self)
{
    free(((struct frames *)self)->row);
    free(self);
}

const struct mill_observer_type mill_frames_type = {
    .name = "frames",
    .sample = sample,
    .create = create,
    .state = tell_state,
    .open = open_file,
    .finish = finish,
    .free = free_frames,
};
