/* Where a body is and how it moves. A body has a frame of its own, in which it stands still; its
 * pose says where that frame is in the laboratory at one instant. */
#ifndef MILLSIM_POSE_H
#define MILLSIM_POSE_H

#include "millsim/vec3.h"

/* A point p of the frame is at place + p.x x + p.y y + p.z z. */
struct mill_pose {
    vec3 place;            /* [m] of the frame's origin */
    vec3 x, y, z;          /* its axes: unit, orthogonal, right-handed */
    vec3 velocity;         /* [m/s] of the origin */
    vec3 angular_velocity; /* [rad/s] */
};

/* That of the laboratory: what stands still */
static const struct mill_pose mill_pose_still = {
    .x = {1.0, 0.0, 0.0}, .y = {0.0, 1.0, 0.0}, .z = {0.0, 0.0, 1.0}};

/* A direction of the laboratory, seen from the frame, and one of the frame in the laboratory */
static inline vec3 mill_pose_turn_in(const struct mill_pose *pose, vec3 a)
{
    return vec3_make(vec3_dot(pose->x, a), vec3_dot(pose->y, a), vec3_dot(pose->z, a));
}

static inline vec3 mill_pose_turn_out(const struct mill_pose *pose, vec3 a)
{
    return vec3_axpy(vec3_axpy(vec3_scale(pose->x, a.x), a.y, pose->y), a.z, pose->z);
}

/* The same of points [m] */
static inline vec3 mill_pose_in(const struct mill_pose *pose, vec3 point)
{
    return mill_pose_turn_in(pose, vec3_sub(point, pose->place));
}

static inline vec3 mill_pose_out(const struct mill_pose *pose, vec3 point)
{
    return vec3_add(pose->place, mill_pose_turn_out(pose, point));
}

/* [m/s] in the laboratory, of what is fixed to the frame at a point of the laboratory */
static inline vec3 mill_pose_velocity(const struct mill_pose *pose, vec3 point)
{
    return vec3_add(pose->velocity,
                    vec3_cross(pose->angular_velocity, vec3_sub(point, pose->place)));
}

#endif
