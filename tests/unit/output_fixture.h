/* What the tests of the output modules share: a world of three balls made by hand, a scratch file,
 * and reading back through HDF5 itself. */
#ifndef OUTPUT_FIXTURE_H
#define OUTPUT_FIXTURE_H

#include "millsim/observer.h"
#include "millsim/world.h"
#include "observe/observers.h"
#include "store/h5.h"

#include "state_fixture.h"
#include "unit.h"

#include <hdf5.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Three balls of two kinds, falling; no shapes. Positions are exact in binary fractions of a
 * second. */
struct fixture {
    char path[64];
    struct mill_observe asked;
    struct mill_world world;
    struct mill_ball ball[3];
    vec3 spin[3];
    struct mill_species species[2];
    struct mill_motion *motion[1]; /* the rotor */
    char motion_name[1][MILL_MOTION_NAME];
};

extern const struct mill_observer_type mill_frames_type, mill_series_type, mill_impactlog_type;

static inline void fixture_init(struct fixture *f)
{
    static struct mill_motion *rotor; /* one for all, until the program ends */
    int i;
    memset(f, 0, sizeof *f);
    snprintf(f->path, sizeof f->path, "/tmp/millsim_test_%ld.h5", (long)getpid());
    unlink(f->path);
    f->asked.end = 0.3;
    f->asked.frames = 0.1;
    f->asked.series = 0.01;
    strcpy(f->species[0].name, "steel");
    strcpy(f->species[1].name, "glass");
    f->species[0].radius = 0.0025;
    f->species[0].mass = 0.0005;
    f->species[0].inertia = 0.4 * 0.0005 * 0.0025 * 0.0025;
    f->species[1] = f->species[0];
    strcpy(f->species[1].name, "glass");
    f->species[1].mass = 0.0002;
    for (i = 0; i < 3; i++) {
        f->ball[i].r = vec3_make(0.01 * i, 0, 0.02);
        f->ball[i].v = vec3_make(0, 0.5 * i, 1);
        f->ball[i].species = i == 2;
        f->spin[i] = vec3_make(i, 10 * i, -i);
    }
    f->world.g = vec3_make(0, 0, -8);
    f->world.balls = 3;
    f->world.ball = f->ball;
    f->world.spin = f->spin;
    f->world.species_count = 2;
    f->world.species = f->species;
    if (!rotor)
        rotor = mill_turn_type.create(&(struct mill_turn){.axis = {1, 0, 0}, .speed = 7});
    f->motion[0] = rotor;
    strcpy(f->motion_name[0], "rotor");
    f->world.motions = 1;
    f->world.motion = f->motion;
    f->world.motion_name = f->motion_name;
    f->world.container.still = true;
    f->world.container.frame = mill_pose_still;
    mill_kinds_init(&f->world.kinds);
}

/* An observer that writes to the file; state: of one that was saved, or NULL */
static inline struct mill_observer *make_writer(const struct mill_observer_type *type,
                                                const struct fixture *f, struct mill_h5 *file,
                                                struct kept *state)
{
    struct mill_observer *writer = mill_observers_one(type, &f->asked, &f->world, NULL);
    ck_assert_ptr_nonnull(writer);
    if (state)
        type->state(writer, kept_load(state));
    type->open(writer, &f->asked, file, &f->world);
    ck_assert_int_eq(mill_h5_status(file, NULL), MILL_OK);
    return writer;
}

static inline void save_writer(struct mill_observer *writer, struct kept *state)
{
    kept_init(state);
    writer->type->state(writer, &state->state);
}

/* Runs the observer as the loop would, up to the end of the run. */
static inline void run_samples(struct mill_observer *observer, const struct mill_world *world,
                               double end)
{
    int refused = 0;
    while (observer->next <= end)
        refused += observer->type->sample(observer, world, observer->next, NULL) != MILL_OK;
    ck_assert_int_eq(refused, 0);
}

static inline hid_t look_open(const char *path)
{
    const hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    ck_assert_msg(file >= 0, "%s does not open", path);
    return file;
}

/* All elements of a dataset, as doubles; *count of them; its shape in dims[rank]. */
static inline double *look(const char *path, const char *name, int rank, hsize_t *dims)
{
    const hid_t file = look_open(path);
    const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    hid_t space;
    double *values;
    ck_assert_msg(set >= 0, "no dataset %s", name);
    space = H5Dget_space(set);
    ck_assert_int_eq(H5Sget_simple_extent_ndims(space), rank);
    H5Sget_simple_extent_dims(space, dims, NULL);
    values = malloc((size_t)(H5Sget_simple_extent_npoints(space) + 1) * sizeof *values);
    ck_assert(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
    H5Sclose(space);
    H5Dclose(set);
    H5Fclose(file);
    return values;
}

/* One element of a one-dimensional dataset, or a scalar. */
static inline double look_at(const char *path, const char *name, int rank, size_t i)
{
    hsize_t dims[8];
    double *values = look(path, name, rank, dims);
    const double value = values[i];
    free(values);
    return value;
}

/* Rows of a dataset of the given rank. */
static inline size_t look_rows(const char *path, const char *name, int rank)
{
    hsize_t dims[8];
    free(look(path, name, rank, dims));
    return (size_t)dims[0];
}

/* A text attribute, or with attribute NULL the text dataset itself; the caller frees it. Fails
 * unless it is a scalar UTF-8 text of variable length. */
static inline char *look_text(const char *path, const char *name, const char *attribute)
{
    const hid_t file = look_open(path);
    const hid_t owner = attribute ? H5Aopen_by_name(file, name, attribute, H5P_DEFAULT, H5P_DEFAULT)
                                  : H5Dopen2(file, name, H5P_DEFAULT);
    hid_t type;
    char *text = NULL, *copy;
    ck_assert_msg(owner >= 0, "no %s of %s", attribute ? attribute : "text", name);
    type = attribute ? H5Aget_type(owner) : H5Dget_type(owner);
    ck_assert(H5Tis_variable_str(type) > 0);
    ck_assert_int_eq(H5Tget_cset(type), H5T_CSET_UTF8);
    if (attribute)
        ck_assert(H5Aread(owner, type, &text) >= 0);
    else
        ck_assert(H5Dread(owner, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &text) >= 0);
    copy = malloc(strlen(text) + 1);
    strcpy(copy, text);
    H5free_memory(text);
    H5Tclose(type);
    H5Oclose(owner);
    H5Fclose(file);
    return copy;
}

static inline void assert_text(const char *path, const char *name, const char *attribute,
                               const char *expected)
{
    char *text = look_text(path, name, attribute);
    ck_assert_str_eq(text, expected);
    free(text);
}

/* Both names lead to one object. */
static inline bool look_same(const char *path, const char *a, const char *b)
{
    const hid_t file = look_open(path);
#if H5_VERSION_GE(1, 12, 0)
    H5O_info2_t one, other;
    ck_assert(H5Oget_info_by_name3(file, a, &one, H5O_INFO_BASIC, H5P_DEFAULT) >= 0);
    ck_assert(H5Oget_info_by_name3(file, b, &other, H5O_INFO_BASIC, H5P_DEFAULT) >= 0);
    const bool same = memcmp(&one.token, &other.token, sizeof one.token) == 0;
#else
    H5O_info_t one, other;
    ck_assert(H5Oget_info_by_name(file, a, &one, H5P_DEFAULT) >= 0);
    ck_assert(H5Oget_info_by_name(file, b, &other, H5P_DEFAULT) >= 0);
    const bool same = one.addr == other.addr;
#endif
    H5Fclose(file);
    return same;
}

#endif
