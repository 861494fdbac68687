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

static const struct {
    const char *name, *unit, *meaning;
} table[STATES] = {
    {"position", "m", "centres of the balls: frame, ball, (x, y, z)"},
    {"velocity", "m s-1", "velocities of the balls: frame, ball, (x, y, z)"},
    {"angular_velocity", "rad s-1", "angular velocities of the balls: frame, ball, (x, y, z)"},
};

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
        mill_h5_attribute(file, texts[i].group, texts[i].name, MILL_H5_TEXT, 0, &texts[i].text);
    }
    mill_h5_attribute(file, "/h5md/modules/units", "version", MILL_H5_I32, 2, units_version);
}

static void write_box(struct mill_h5 *file)
{
    static const int32_t dimension = 3;
    static const char *const boundary[3] = {"none", "none", "none"};
    mill_h5_group(file, GROUP "/box", false);
    mill_h5_attribute(file, GROUP "/box", "dimension", MILL_H5_I32, 0, &dimension);
    mill_h5_attribute(file, GROUP "/box", "boundary", MILL_H5_TEXT, 3, boundary);
}

/* id, species, mass and diameter of every ball, and the names of the species */
static void write_balls(struct mill_h5 *file, const struct mill_world *world)
{
    const size_t n = (size_t)world->balls, kinds = (size_t)world->species_count;
    int32_t *id = malloc((n + 1) * sizeof *id), *species = malloc((n + 1) * sizeof *species);
    double *mass = malloc((n + 1) * sizeof *mass), *diameter = malloc((n + 1) * sizeof *diameter);
    const char **names = malloc(kinds * sizeof *names);
    if (id && species && mass && diameter && names) {
        for (size_t i = 0; i < n; i++) {
            id[i] = (int32_t)i;
            species[i] = world->ball[i].species;
            mass[i] = world->species[species[i]].mass;
            diameter[i] = 2 * world->species[species[i]].radius;
        }
        for (size_t i = 0; i < kinds; i++)
            names[i] = world->species[i].name;
        mill_h5_write(file, GROUP "/id", MILL_H5_I32, 1, &n, id, "1",
                      "number of the ball: its line in the start file, from 0");
        mill_h5_write(file, GROUP "/species", MILL_H5_I32, 1, &n, species, "1",
                      "kind of the ball: index into the attribute names");
        mill_h5_attribute(file, GROUP "/species", "names", MILL_H5_TEXT, kinds, names);
        mill_h5_write(file, GROUP "/mass", MILL_H5_F64, 1, &n, mass, "kg", "mass of the ball");
        mill_h5_write(file, GROUP "/diameter", MILL_H5_F64, 1, &n, diameter, "m",
                      "diameter of the ball");
    } else {
        mill_h5_spend(file, "out of memory for the balls");
    }
    free(id);
    free(species);
    free(mass);
    free(diameter);
    free(names);
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
                                             .unit = table[i].unit,
                                             .description = table[i].meaning,
                                             .plain = true};
        char path[64];
        snprintf(path, sizeof path, GROUP "/%s/value", table[i].name);
        frames->value[i] = mill_h5_column_create(file, path, &value, rows);
        if (i == POSITION)
            continue;
        snprintf(path, sizeof path, GROUP "/%s/step", table[i].name);
        mill_h5_link(file, GROUP "/position/step", path);
        snprintf(path, sizeof path, GROUP "/%s/time", table[i].name);
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

static enum mill_status create(struct mill_observer *self, const struct mill_observe *asked,
                               const struct mill_world *world, struct mill_error *error)
{
    (void)world;
    (void)error;
    ((struct frames *)self)->asked = *asked;
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
}

const struct mill_observer_type mill_frames_type = {
    .name = "frames",
    .size = sizeof(struct frames),
    .sample = sample,
    .create = create,
    .state = tell_state,
    .open = open_file,
    .finish = finish,
    .free = free_frames,
};
