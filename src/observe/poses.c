/* Poses of the motions in each frame, in float64, so that a player needs no laws of motion. They
 * are computed for the frame's local time by the functions that also resolve impacts, so the
 * numbers are the same. */
#include "observe/poses.h"

#include <stdio.h>
#include <stdlib.h>

#define GROUP "/observables/pose/"

enum { PATH = 128 };

/* Opens the element `name` of a motion: its value as a column, step and time as links. */
static struct mill_h5_column *open_element(struct mill_h5 *file, const char *motion,
                                           const char *name, const struct mill_h5_layout *value,
                                           uint64_t rows, const char *const common[2])
{
    char path[PATH];
    for (int k = 0; k < 2; k++) {
        snprintf(path, sizeof path, GROUP "%s/%s/%s", motion, name, k ? "time" : "step");
        mill_h5_link(file, common[k], path);
    }
    snprintf(path, sizeof path, GROUP "%s/%s/value", motion, name);
    return mill_h5_column_create(file, path, value, rows);
}

/* MDAnalysis requires every group in a group of observables to be an element. So links to the parts
 * of the rotation are added. */
static void make_element(struct mill_h5 *file, const char *motion)
{
    static const char *const part[] = {"step", "time", "value"};
    for (int k = 0; k < 3; k++) {
        char from[PATH], to[PATH];
        snprintf(from, sizeof from, GROUP "%s/rotation/%s", motion, part[k]);
        snprintf(to, sizeof to, GROUP "%s/%s", motion, part[k]);
        mill_h5_link(file, from, to);
    }
}

void mill_poses_open(struct mill_poses *poses, struct mill_h5 *file, const struct mill_world *world,
                     uint64_t rows, const char *step, const char *time)
{
    static const struct mill_h5_layout
        centre = {MILL_H5_F64, 1, {3}, 0, "m", "where the frame's origin is: frame, (x, y, z)",
                  false},
        rotation = {
            MILL_H5_F64, 2,
            {3, 3},      0,
            "1",         "axes of the frame, as columns: a point p of it is at centre + rotation p",
            false};
    const char *const common[2] = {step, time};
    poses->motions = world->motions;
    for (int k = 0; k < poses->motions; k++) {
        const char *name = world->motion_name[k];
        poses->centre[k] = open_element(file, name, "centre", &centre, rows, common);
        poses->rotation[k] = open_element(file, name, "rotation", &rotation, rows, common);
        make_element(file, name);
    }
}

struct mill_poses_one mill_poses_of(const struct mill_pose *pose)
{
    const vec3 c = pose->place, x = pose->x, y = pose->y, z = pose->z;
    return (struct mill_poses_one){{c.x, c.y, c.z},
                                   {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}};
}

void mill_poses_append(struct mill_poses *poses, const struct mill_world *world, double t)
{
    for (int k = 0; k < poses->motions; k++) {
        const struct mill_pose pose = mill_motion_pose(world->motion[k], t);
        const struct mill_poses_one one = mill_poses_of(&pose);
        mill_h5_column_append(poses->centre[k], 1, one.centre);
        mill_h5_column_append(poses->rotation[k], 1, one.rotation);
    }
}

void mill_poses_close(struct mill_poses *poses)
{
    for (int k = 0; k < poses->motions; k++) {
        mill_h5_column_close(poses->centre[k]);
        mill_h5_column_close(poses->rotation[k]);
    }
    poses->motions = 0;
}

struct mill_poses_one *mill_poses_read(struct mill_h5 *file, const char *motion, size_t frames)
{
    struct mill_poses_one *one = malloc(sizeof *one * (frames + 1));
    double *room = malloc(sizeof one->rotation * (frames + 1));
    char path[PATH];
    bool read = one && room;
    if (!read)
        mill_h5_spend(file, "out of memory for the poses");
    /* read one whole array, then copy it to the poses */
    for (int which = 0; which < 2 && read; which++) {
        const size_t each = which ? 9 : 3;
        snprintf(path, sizeof path, GROUP "%s/%s/value", motion, which ? "rotation" : "centre");
        read = mill_h5_read(file, path, MILL_H5_F64, each * frames, room, NULL) == MILL_OK;
        for (size_t i = 0; i < each * frames && read; i++)
            (which ? one[i / 9].rotation[i % 9 / 3] : one[i / 3].centre)[i % 3] = room[i];
    }
    free(room);
    if (read)
        return one;
    free(one);
    return NULL;
}
