/* Places and rotations of the motions at each frame (output.frames):
 * /observables/pose/NAME/{centre,rotation}, as H5MD elements that share step and time with the
 * trajectory. */
#ifndef MILL_POSES_H
#define MILL_POSES_H

#include "millsim/world.h"
#include "store/h5.h"

/* A point p of the motion's frame is at centre + rotation p; the columns of `rotation` are the
 * frame's axes. */
struct mill_poses_one {
    double centre[3], rotation[3][3]; /* [m], [1] */
};

/* The columns of a file, two for each motion */
struct mill_poses {
    int motions;
    struct mill_h5_column *centre[MILL_MOTIONS_MOST], *rotation[MILL_MOTIONS_MOST];
};

/* Makes the columns, or continues after the first `rows` frames. step, time: paths of these
 * datasets of the trajectory. */
void mill_poses_open(struct mill_poses *poses, struct mill_h5 *file, const struct mill_world *world,
                     uint64_t rows, const char *step, const char *time);

/* Adds one frame; the world is at local time t */
void mill_poses_append(struct mill_poses *poses, const struct mill_world *world, double t);

/* Afterwards all frames are in the file and can be read. */
void mill_poses_close(struct mill_poses *poses);

/* Reads the poses of a motion in `frames` frames. NULL: failed; the file reports why. Owner: the
 * caller; free(). */
struct mill_poses_one *mill_poses_read(struct mill_h5 *file, const char *motion, size_t frames);

/* Converts a pose of the world */
struct mill_poses_one mill_poses_of(const struct mill_pose *pose);

#endif
