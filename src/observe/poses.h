/* Where the motions of the mill are at output.frames: /observables/pose/NAME/{centre,rotation}, as
 * H5MD elements whose step and time are those of the trajectory. */
#ifndef MILL_POSES_H
#define MILL_POSES_H

#include "millsim/world.h"
#include "store/h5.h"

/* A point p of the motion's frame is at centre + rotation p: the frame's axes are the columns. */
struct mill_poses_one {
    double centre[3], rotation[3][3]; /* [m], [1] */
};

/* The columns of a file, two for each motion */
struct mill_poses {
    int motions;
    struct mill_h5_column *centre[MILL_MOTIONS_MOST], *rotation[MILL_MOTIONS_MOST];
};

/* Makes them, or goes on behind the first `rows` frames. step, time: what the file calls those of
 * the frames. */
void mill_poses_open(struct mill_poses *poses, struct mill_h5 *file, const struct mill_world *world,
                     uint64_t rows, const char *step, const char *time);

/* One frame more, world at local time t */
void mill_poses_append(struct mill_poses *poses, const struct mill_world *world, double t);

/* All frames are then in the file, for reading. */
void mill_poses_close(struct mill_poses *poses);

/* Those of a motion in `frames` frames. A failure is the file's to tell; NULL then. Owner: the
 * caller; free(). */
struct mill_poses_one *mill_poses_read(struct mill_h5 *file, const char *motion, size_t frames);

/* Of a pose as the world tells it */
struct mill_poses_one mill_poses_of(const struct mill_pose *pose);

#endif
