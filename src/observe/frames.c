/* Stores places and velocities of the balls and poses of the motions at output.frames, as H5MD 1.1
 * (de Buyl, Colberg and Hoefling, Comput. Phys. Commun. 185, 2014, 1546). The time of frame k is k
 * times the interval. Data are float32: 1e-8 m in a drum of 0.1 m is finer than a picture or a
 * correlation can show. The box has no edges: it is open, and MDAnalysis expects none then. */
#include "observe/observers.h"

#include "millsim/state.h"
#include "observe/vtkhdf.h"
#include "store/version.h"

#include <stdio.h>
#include <string.h>

#define GROUP "/particles/trajectory"
#define FIRST GROUP "/position"

enum { POSITION, VELOCITY, SPIN, STATES, POSE = STATES, TWIST = POSE + 2, ELEMENTS = TWIST + 2 };
enum { PATH = 160 };

struct frames {
    struct mill_observer observer;
    struct mill_observe asked;
    uint64_t rows; /* frames so far */
    struct mill_h5 *file;
    struct mill_h5_column *step, *time, *value[STATES]; /* the file's */
    float *row;                                         /* one state of the balls */
    struct mill_h5_column *pose[MILL_MOTIONS_MOST][2];  /* centre, rotation */
    struct mill_h5_column *twist[2]; /* of the frame in which the charge is steady; NULL: still */
};

/* What the file has of each frame: numbers of each ball, motion, ... */
static const struct element {
    enum mill_h5_type type;
    int rank;
    const char *name, *unit, *meaning;
} element_of[ELEMENTS] = {
    {MILL_H5_F32, 2, "position", "m", "centres of the balls: frame, ball, (x, y, z)"},
    {MILL_H5_F32, 2, "velocity", "m s-1", "velocities of the balls: frame, ball, (x, y, z)"},
    {MILL_H5_F32, 2, "angular_velocity", "rad s-1",
     "angular velocities of the balls: frame, ball, (x, y, z)"},
    /* of motions: so a player needs no laws of motion */
    {MILL_H5_F64, 1, "centre", "m", "where the frame's origin is: frame, (x, y, z)"},
    {MILL_H5_F64, 2, "rotation", "1",
     "axes of the frame, as columns: a point p of it is at centre + rotation p"},
    /* what a ball does in the mill is its velocity minus that of this frame in its place */
    {MILL_H5_F64, 1, "frame_velocity", "m s-1",
     "velocity, at the origin, of the frame in which the charge is steady"},
    {MILL_H5_F64, 1, "frame_spin", "rad s-1", "angular velocity of this frame"},
};

/* /h5md, and the box: it has edges only if its ends along x are periodic */
static void write_head(struct mill_h5 *file, const struct mill_world *world)
{
    static const int32_t version[2] = {1, 1}, units_version[2] = {1, 0}, dimension = 3;
    const bool periodic = world->container.period > 0.0;
    const char *const boundary[3] = {periodic ? "periodic" : "none", "none", "none"};
    const double edges[3] = {world->drum_length, 2 * world->drum_radius, 2 * world->drum_radius};
    static const char *const texts[][3] = {{"/h5md/author", "name", "millsim"},
                                           {"/h5md/creator", "name", "millsim"},
                                           {"/h5md/creator", "version", mill_version},
                                           {"/h5md/modules/units", "system", "SI"}};
    mill_h5_group(file, "/h5md", false);
    mill_h5_attribute(file, "/h5md", "version", MILL_H5_I32, 2, version);
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        mill_h5_group(file, texts[i][0], false);
        mill_h5_attribute(file, texts[i][0], texts[i][1], MILL_H5_TEXT, 0, &texts[i][2]);
    }
    mill_h5_attribute(file, "/h5md/modules/units", "version", MILL_H5_I32, 2, units_version);
    mill_h5_group(file, GROUP "/box", false);
    mill_h5_attribute(file, GROUP "/box", "dimension", MILL_H5_I32, 0, &dimension);
    mill_h5_attribute(file, GROUP "/box", "boundary", MILL_H5_TEXT, 3, boundary);
    if (periodic)
        mill_h5_attribute(file, GROUP "/box", "edges", MILL_H5_F64, 3, edges);
}

/* id, species, mass and diameter of every ball, and the names of the species */
static void write_balls(struct mill_h5 *file, const struct mill_world *world)
{
    const size_t n = (size_t)world->balls, kinds = (size_t)world->species_count;
    const struct mill_ball *ball = world->ball;
    void *room = malloc((n + kinds) * sizeof(double)); /* used for one array after the other */
    int32_t *number = room;
    double *value = room;
    const char **name = room;
    if (!room) {
        mill_h5_spend(file, "out of memory for the balls");
        return;
    }
    for (size_t i = 0; i < n; i++)
        number[i] = (int32_t)i;
    mill_h5_write(file, GROUP "/id", MILL_H5_I32, 1, &n, number, "1",
                  "number of the ball: its line in the start file, from 0");
    for (size_t i = 0; i < n; i++)
        number[i] = ball[i].species;
    mill_h5_write(file, GROUP "/species", MILL_H5_I32, 1, &n, number, "1",
                  "kind of the ball: index into the attribute names");
    for (size_t i = 0; i < kinds; i++)
        name[i] = world->species[i].name;
    mill_h5_attribute(file, GROUP "/species", "names", MILL_H5_TEXT, kinds, name);
    for (size_t i = 0; i < n; i++)
        value[i] = world->species[ball[i].species].mass;
    mill_h5_write(file, GROUP "/mass", MILL_H5_F64, 1, &n, value, "kg", "mass of the ball");
    for (size_t i = 0; i < n; i++)
        value[i] = 2 * world->species[ball[i].species].radius;
    mill_h5_write(file, GROUP "/diameter", MILL_H5_F64, 1, &n, value, "m", "diameter of the ball");
    free(room);
}

/* Opens a column of rows [count or 3] or [count][3]. All have step and time of the first one. */
static struct mill_h5_column *open_element(const struct frames *frames, const char *group,
                                           const struct element *of, size_t count)
{
    const bool balls = of->type == MILL_H5_F32;
    const struct mill_h5_layout layout = {of->type, of->rank,    {count, 3}, 0,
                                          of->unit, of->meaning, balls};
    char path[PATH];
    for (int k = 0; k < 2 && of != element_of; k++) {
        snprintf(path, sizeof path, "%s/%s/%s", group, of->name, k ? "time" : "step");
        mill_h5_link(frames->file, k ? FIRST "/time" : FIRST "/step", path);
    }
    snprintf(path, sizeof path, "%s/%s/value", group, of->name);
    return mill_h5_column_create(frames->file, path, &layout, frames->rows);
}

static void open_columns(struct frames *frames, const struct mill_world *world)
{
    static const struct mill_h5_layout shared[2] = {
        {MILL_H5_I64, 0, {0}, 0, "1", "number of the frame", false},
        {MILL_H5_F64, 0, {0}, 0, "s", "simulated time", false}};
    static const char *const part[] = {"step", "time", "value"};
    struct mill_h5 *file = frames->file;
    frames->step = mill_h5_column_create(file, FIRST "/step", &shared[0], frames->rows);
    frames->time = mill_h5_column_create(file, FIRST "/time", &shared[1], frames->rows);
    for (int i = 0; i < STATES; i++)
        frames->value[i] = open_element(frames, GROUP, &element_of[i], (size_t)world->balls);
    for (int k = 0; k < world->motions; k++) {
        char group[PATH - 32], from[PATH], to[PATH];
        snprintf(group, sizeof group, MILL_VTKHDF_POSE "%s", world->motion_name[k]);
        for (int i = 0; i < 2; i++)
            frames->pose[k][i] = open_element(frames, group, &element_of[POSE + i], 3);
        /* MDAnalysis requires every group in a group of observables to be an element */
        for (int i = 0; i < 3; i++) {
            snprintf(from, sizeof from, "%s/rotation/%s", group, part[i]);
            snprintf(to, sizeof to, "%s/%s", group, part[i]);
            mill_h5_link(file, from, to);
        }
    }
    for (int i = 0; i < 2 && world->container.mapped; i++)
        frames->twist[i] = open_element(frames, "/observables", &element_of[TWIST + i], 3);
}

/* In float64, by the functions that also resolve impacts, so that the numbers are the same */
static void append_poses(const struct frames *frames, const struct mill_world *world, double t)
{
    for (int k = 0; k < world->motions; k++) {
        const struct mill_pose p = mill_motion_pose(world->motion[k], t);
        const double centre[3] = {p.place.x, p.place.y, p.place.z};
        const double rotation[3][3] = {
            {p.x.x, p.y.x, p.z.x}, {p.x.y, p.y.y, p.z.y}, {p.x.z, p.y.z, p.z.z}};
        mill_h5_column_append(frames->pose[k][0], 1, centre);
        mill_h5_column_append(frames->pose[k][1], 1, rotation);
    }
    const struct mill_pose p = mill_world_steady_frame(world, t);
    const vec3 w = p.angular_velocity, v = mill_pose_velocity(&p, vec3_make(0, 0, 0));
    mill_h5_column_append(frames->twist[0], 1, (const double[3]){v.x, v.y, v.z});
    mill_h5_column_append(frames->twist[1], 1, (const double[3]){w.x, w.y, w.z});
}

/* ---- the observer ---- */

static enum mill_status sample(struct mill_observer *self, const struct mill_world *world, double t,
                               struct mill_error *error)
{
    struct frames *frames = (struct frames *)self;
    mill_h5_column_append(frames->step, 1, &frames->rows);
    mill_h5_column_append(frames->time, 1, &self->next);
    for (int state = 0; state < STATES; state++) {
        float *to = frames->row;
        for (int32_t i = 0; i < world->balls; i++) {
            const vec3 a = state == POSITION   ? mill_world_position(world, i, t)
                           : state == VELOCITY ? mill_world_velocity(world, i, t)
                                               : world->spin[i];
            *to++ = (float)a.x;
            *to++ = (float)a.y;
            *to++ = (float)a.z;
        }
        mill_h5_column_append(frames->value[state], 1, frames->row);
    }
    append_poses(frames, world, t);
    self->next = mill_observe_due(frames->asked.frames, frames->asked.end, ++frames->rows);
    return mill_h5_status(frames->file, error);
}

static void tell_state(struct mill_observer *self, struct mill_state *state)
{
    mill_state_structs(state, "rows", sizeof(uint64_t), 1, &((struct frames *)self)->rows);
}

static void open_file(struct mill_observer *self, const struct mill_observe *asked,
                      struct mill_h5 *file, const struct mill_world *world)
{
    struct frames *frames = (struct frames *)self;
    frames->asked = *asked;
    frames->file = file;
    mill_h5_remove(file, "/VTKHDF"); /* of a continued run: its number of frames would be wrong */
    if (frames->rows == 0) {
        write_head(file, world);
        write_balls(file, world);
    }
    if (asked->frames == 0)
        return;
    self->next = mill_observe_due(asked->frames, asked->end, frames->rows);
    open_columns(frames, world);
    frames->row = malloc((3 * (size_t)world->balls + 1) * sizeof *frames->row);
    if (!frames->row)
        mill_h5_spend(file, "out of memory for frames");
}

static bool finish(struct mill_observer *self, const struct mill_world *world,
                   const struct mill_going *going)
{
    struct frames *frames = (struct frames *)self;
    for (int i = 0; i < 2; i++) { /* from now on all frames can be read */
        for (int k = 0; k < world->motions; k++)
            mill_h5_column_close(frames->pose[k][i]);
        mill_h5_column_close(frames->twist[i]);
    }
    return mill_vtkhdf_write(frames->file, &frames->asked, world, frames->rows, going);
}

static void free_frames(struct mill_observer *self)
{
    free(((struct frames *)self)->row);
}

const struct mill_observing mill_frames_type = {.type = {"frames", NULL, sample, NULL},
                                                .size = sizeof(struct frames),
                                                .state = tell_state,
                                                .open = open_file,
                                                .finish = finish,
                                                .free = free_frames};
