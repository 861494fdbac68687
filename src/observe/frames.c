/* Stores where the balls are and how they move, at output.frames, as H5MD 1.1 (de Buyl, Colberg and
 * Hoefling, Comput. Phys. Commun. 185, 2014, 1546; www.nongnu.org/h5md). Frame k belongs to k times
 * the interval, computed so and not summed up. float32: 1e-8 m in a drum of 0.1 m is far below what
 * a picture or a correlation can show, and half the disk. The box carries no edges: it is open, and
 * MDAnalysis expects none then. */
#include "observe/frames.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifndef MILL_VERSION
#define MILL_VERSION "unknown"
#endif

#define GROUP "/particles/trajectory"

enum { POSITION, VELOCITY, SPIN, STATES };

struct frames {
    struct mill_observer observer;
    double interval; /* [s] */
    double end;      /* [s] of the run */
    uint64_t last;   /* number of the last frame */
    struct mill_h5_column *step, *time, *value[STATES];
    int32_t piece; /* balls stored together */
    float *row;    /* one state of them */
};

static const char *const state_name[STATES] = {"position", "velocity", "angular_velocity"};
static const char *const state_unit[STATES] = {"m", "m s-1", "rad s-1"};
static const char *const state_meaning[STATES] = {
    "centres of the balls: frame, ball, (x, y, z)",
    "velocities of the balls: frame, ball, (x, y, z)",
    "angular velocities of the balls: frame, ball, (x, y, z)"};

/* Due time of frame k; the last one may lie a rounding error behind the end of the run. */
static double due(const struct frames *frames, uint64_t k)
{
    if (k > frames->last)
        return INFINITY;
    return fmin((double)k * frames->interval, frames->end);
}

static enum mill_status write_h5md(struct mill_h5 *file, struct mill_error *error)
{
    static const int32_t version[2] = {1, 1}, units_version[2] = {1, 0};
    static const struct {
        const char *group, *name, *text;
    } texts[] = {{"/h5md/author", "name", "millsim"},
                 {"/h5md/creator", "name", "millsim"},
                 {"/h5md/creator", "version", MILL_VERSION},
                 {"/h5md/modules/units", "system", "SI"}};
    enum mill_status status = mill_h5_group(file, "/h5md", false, error);
    size_t i;
    if (status == MILL_OK)
        status = mill_h5_attribute(file, "/h5md", "version", MILL_H5_I32, 2, version, error);
    for (i = 0; status == MILL_OK && i < sizeof texts / sizeof texts[0]; i++) {
        status = mill_h5_group(file, texts[i].group, false, error);
        if (status == MILL_OK)
            status =
                mill_h5_attribute_text(file, texts[i].group, texts[i].name, texts[i].text, error);
    }
    if (status == MILL_OK)
        status = mill_h5_attribute(file, "/h5md/modules/units", "version", MILL_H5_I32, 2,
                                   units_version, error);
    return status;
}

static enum mill_status write_box(struct mill_h5 *file, struct mill_error *error)
{
    static const int32_t dimension = 3;
    static const char *const boundary[3] = {"none", "none", "none"};
    enum mill_status status = mill_h5_group(file, GROUP "/box", false, error);
    if (status == MILL_OK)
        status =
            mill_h5_attribute(file, GROUP "/box", "dimension", MILL_H5_I32, 0, &dimension, error);
    if (status == MILL_OK)
        status = mill_h5_attribute_texts(file, GROUP "/box", "boundary", 3, boundary, error);
    return status;
}

static enum mill_status write_species_names(struct mill_h5 *file, const struct mill_world *world,
                                            struct mill_error *error)
{
    const size_t count = (size_t)world->species_count;
    const char **names = malloc(count * sizeof *names);
    enum mill_status status;
    size_t i;
    if (!names)
        return mill_error_set(error, MILL_FAILED, "out of memory for the names of %zu ball kinds",
                              count);
    for (i = 0; i < count; i++)
        names[i] = world->species[i].name;
    status = mill_h5_attribute_texts(file, GROUP "/species", "names", count, names, error);
    free(names);
    return status;
}

/* id, species, mass and diameter of every ball */
static enum mill_status write_balls(struct mill_h5 *file, const struct mill_world *world,
                                    struct mill_error *error)
{
    const size_t n = (size_t)world->balls;
    int32_t *number = malloc((n ? n : 1) * sizeof *number);
    double *value = malloc((n ? n : 1) * sizeof *value);
    enum mill_status status = MILL_OK;
    size_t i;
    if (!number || !value)
        status = mill_error_set(error, MILL_FAILED, "out of memory for %zu balls", n);
    for (i = 0; status == MILL_OK && i < n; i++)
        number[i] = (int32_t)i;
    if (status == MILL_OK)
        status = mill_h5_write(file, GROUP "/id", MILL_H5_I32, 1, &n, number, "1",
                               "number of the ball: its line in the start file, from 0", error);
    for (i = 0; status == MILL_OK && i < n; i++)
        number[i] = world->ball[i].species;
    if (status == MILL_OK)
        status = mill_h5_write(file, GROUP "/species", MILL_H5_I32, 1, &n, number, "1",
                               "kind of the ball: index into the attribute names", error);
    for (i = 0; status == MILL_OK && i < n; i++)
        value[i] = world->species[world->ball[i].species].mass;
    if (status == MILL_OK)
        status = mill_h5_write(file, GROUP "/mass", MILL_H5_F64, 1, &n, value, "kg",
                               "mass of the ball", error);
    for (i = 0; status == MILL_OK && i < n; i++)
        value[i] = 2 * world->species[world->ball[i].species].radius;
    if (status == MILL_OK)
        status = mill_h5_write(file, GROUP "/diameter", MILL_H5_F64, 1, &n, value, "m",
                               "diameter of the ball", error);
    free(number);
    free(value);
    return status == MILL_OK ? write_species_names(file, world, error) : status;
}

static enum mill_status open_columns(struct frames *frames, struct mill_h5 *file, size_t balls,
                                     uint64_t rows, struct mill_error *error)
{
    const struct mill_h5_layout step = {MILL_H5_I64,           0,    {0, 0}, 0, "1",
                                        "number of the frame", false};
    const struct mill_h5_layout time = {MILL_H5_F64, 0, {0, 0}, 0, "s", "simulated time", false};
    enum mill_status status =
        mill_h5_column_create(file, GROUP "/position/step", &step, rows, &frames->step, error);
    int i;
    if (status == MILL_OK)
        status =
            mill_h5_column_create(file, GROUP "/position/time", &time, rows, &frames->time, error);
    for (i = 0; status == MILL_OK && i < STATES; i++) {
        const struct mill_h5_layout value = {MILL_H5_F32,      2,   {balls, 3}, 0, state_unit[i],
                                             state_meaning[i], true};
        char path[64];
        snprintf(path, sizeof path, GROUP "/%s/value", state_name[i]);
        status = mill_h5_column_create(file, path, &value, rows, &frames->value[i], error);
        if (status != MILL_OK || i == POSITION)
            continue;
        snprintf(path, sizeof path, GROUP "/%s/step", state_name[i]);
        status = mill_h5_link(file, GROUP "/position/step", path, error);
        if (status != MILL_OK)
            continue;
        snprintf(path, sizeof path, GROUP "/%s/time", state_name[i]);
        status = mill_h5_link(file, GROUP "/position/time", path, error);
    }
    return status;
}

static vec3 state_of(const struct mill_world *world, int state, int32_t ball, double t)
{
    if (state == POSITION)
        return mill_world_position(world, ball, t);
    return state == VELOCITY ? mill_world_velocity(world, ball, t) : world->spin[ball];
}

static enum mill_status store_state(struct frames *frames, const struct mill_world *world,
                                    int state, double t, struct mill_error *error)
{
    enum mill_status status = MILL_OK;
    for (int32_t first = 0; status == MILL_OK && first < world->balls; first += frames->piece) {
        const int32_t left = world->balls - first;
        const int32_t some = left < frames->piece ? left : frames->piece;
        for (int32_t k = 0; k < some; k++) {
            const vec3 a = state_of(world, state, first + k, t);
            float *to = frames->row + 3 * (size_t)k;
            to[0] = (float)a.x;
            to[1] = (float)a.y;
            to[2] = (float)a.z;
        }
        status =
            mill_h5_column_append_piece(frames->value[state], (size_t)first, frames->row, error);
    }
    return status;
}

static enum mill_status sample(struct mill_observer *self, const struct mill_world *world, double t,
                               struct mill_error *error)
{
    struct frames *frames = (struct frames *)self;
    const int64_t k = (int64_t)mill_h5_column_rows(frames->step);
    enum mill_status status = mill_h5_column_append(frames->step, 1, &k, error);
    int i;
    if (status == MILL_OK)
        status = mill_h5_column_append(frames->time, 1, &self->next, error);
    for (i = 0; status == MILL_OK && i < STATES; i++)
        status = store_state(frames, world, i, t, error);
    self->next = due(frames, (uint64_t)k + 1);
    return status;
}

static enum mill_status make_row(struct frames *frames, struct mill_error *error)
{
    const size_t piece = mill_h5_column_piece(frames->value[POSITION]);
    frames->piece = (int32_t)piece;
    frames->row = malloc((3 * piece + 1) * sizeof *frames->row);
    if (frames->row)
        return MILL_OK;
    return mill_error_set(error, MILL_FAILED, "out of memory for frames of %zu balls", piece);
}

static enum mill_status build(struct mill_h5 *file, const struct mill_deck *deck,
                              const struct mill_world *world, uint64_t rows,
                              struct mill_observer **out, struct mill_error *error)
{
    struct frames *frames = calloc(1, sizeof *frames);
    enum mill_status status = MILL_OK;
    *out = NULL;
    if (!frames)
        return mill_error_set(error, MILL_FAILED, "out of memory for frames");
    frames->observer.next = INFINITY;
    frames->interval = deck->frames;
    frames->end = deck->time;
    if (deck->frames > 0) {
        frames->last = (uint64_t)floor(deck->time / deck->frames + 1e-9);
        frames->observer.sample = sample;
        frames->observer.next = due(frames, rows);
        status = open_columns(frames, file, (size_t)world->balls, rows, error);
        if (status == MILL_OK)
            status = make_row(frames, error);
    }
    if (status != MILL_OK) {
        mill_frames_free(&frames->observer);
        return status;
    }
    *out = &frames->observer;
    return MILL_OK;
}

enum mill_status mill_frames_create(struct mill_h5 *file, const struct mill_deck *deck,
                                    const struct mill_world *world, struct mill_observer **observer,
                                    struct mill_error *error)
{
    enum mill_status status = write_h5md(file, error);
    *observer = NULL;
    if (status == MILL_OK)
        status = write_box(file, error);
    if (status == MILL_OK)
        status = write_balls(file, world, error);
    return status == MILL_OK ? build(file, deck, world, 0, observer, error) : status;
}

enum mill_status mill_frames_resume(struct mill_h5 *file, const struct mill_deck *deck,
                                    const struct mill_world *world,
                                    const struct mill_frames_state *state,
                                    struct mill_observer **observer, struct mill_error *error)
{
    return build(file, deck, world, state->rows, observer, error);
}

uint64_t mill_frames_count(const struct mill_observer *observer)
{
    const struct frames *frames = (const struct frames *)observer;
    return frames->step ? mill_h5_column_rows(frames->step) : 0;
}

double mill_frames_time(const struct mill_observer *observer, uint64_t k)
{
    return due((const struct frames *)observer, k);
}

void mill_frames_save(const struct mill_observer *observer, struct mill_frames_state *state)
{
    state->rows = mill_frames_count(observer);
}

enum mill_status mill_frames_finish(struct mill_observer *observer, struct mill_error *error)
{
    struct frames *frames = (struct frames *)observer;
    enum mill_status status = MILL_OK;
    int i;
    if (!frames->step)
        return MILL_OK;
    for (i = 0; status == MILL_OK && i < STATES; i++)
        status = mill_h5_column_flush(frames->value[i], error);
    if (status == MILL_OK)
        status = mill_h5_column_flush(frames->time, error);
    if (status == MILL_OK)
        status = mill_h5_column_flush(frames->step, error);
    return status;
}

void mill_frames_free(struct mill_observer *observer)
{
    struct frames *frames = (struct frames *)observer;
    int i;
    if (!frames)
        return;
    mill_h5_column_free(frames->step);
    mill_h5_column_free(frames->time);
    for (i = 0; i < STATES; i++)
        mill_h5_column_free(frames->value[i]);
    free(frames->row);
    free(frames);
}
