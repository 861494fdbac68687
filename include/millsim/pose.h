/* Where a body is and how it moves. A body has its own frame, in which it does not move. Its pose
 * gives the place, axes and velocity of this frame in the laboratory at one time. */
#ifndef MILLSIM_POSE_H
#define MILLSIM_POSE_H

#include "millsim/vec3.h"

#include <stdbool.h>

/* A point p of the frame is at place + p.x x + p.y y + p.z z. */
struct mill_pose {
    vec3 place;            /* [m] of the frame's origin */
    vec3 x, y, z;          /* its axes: unit, orthogonal, right-handed */
    vec3 velocity;         /* [m/s] of the origin */
    vec3 angular_velocity; /* [rad/s] */
    /* it is and stays turned about the x axis through the origin only, like a rotor: then fewer
     * operations give the same numbers */
    bool about_x;
};

/* The pose of the laboratory, for all that does not move */
static const struct mill_pose mill_pose_still = {
    .x = {1.0, 0.0, 0.0}, .y = {0.0, 1.0, 0.0}, .z = {0.0, 0.0, 1.0}};

/* turn_in: a direction of the laboratory, in coordinates of the frame. turn_out: the inverse. */
static inline vec3 mill_pose_turn_in(const struct mill_pose *pose, vec3 a)
{
    if (pose->about_x)
        return vec3_make(a.x, pose->y.y * a.y + pose->y.z * a.z, pose->z.y * a.y + pose->z.z * a.z);
    return vec3_make(vec3_dot(pose->x, a), vec3_dot(pose->y, a), vec3_dot(pose->z, a));
}

static inline vec3 mill_pose_turn_out(const struct mill_pose *pose, vec3 a)
{
    if (pose->about_x)
        return vec3_make(a.x, a.y * pose->y.y + a.z * pose->z.y, a.y * pose->y.z + a.z * pose->z.z);
    return vec3_axpy(vec3_axpy(vec3_scale(pose->x, a.x), a.y, pose->y), a.z, pose->z);
}

/* The same for points [m] */
static inline vec3 mill_pose_in(const struct mill_pose *pose, vec3 point)
{
    return mill_pose_turn_in(pose, pose->about_x ? point : vec3_sub(point, pose->place));
}

static inline vec3 mill_pose_out(const struct mill_pose *pose, vec3 point)
{
    return vec3_add(pose->place, mill_pose_turn_out(pose, point));
}

/* The pose a as seen from b, without its velocities */
static inline struct mill_pose mill_pose_relative(const struct mill_pose *a,
                                                  const struct mill_pose *b)
{
    return (struct mill_pose){.place = mill_pose_in(b, a->place),
                              .x = mill_pose_turn_in(b, a->x),
                              .y = mill_pose_turn_in(b, a->y),
                              .z = mill_pose_turn_in(b, a->z)};
}

/* [m/s] Velocity of the point of the body that is at this place, both in the laboratory */
static inline vec3 mill_pose_velocity(const struct mill_pose *pose, vec3 point)
{
    const vec3 w = pose->angular_velocity;
    if (pose->about_x)
        return vec3_make(0.0, -w.x * point.z, w.x * point.y);
    return vec3_add(pose->velocity, vec3_cross(w, vec3_sub(point, pose->place)));
}

#endif
