/* Chains of motions: a pose within its carrier's, and bounds that hold for both together. */
#include "millsim/motion.h"

#include <assert.h>
#include <stdbool.h>
#include <stddef.h>

/* The pose `inner` within the frame of `outer`. */
static struct mill_pose within(const struct mill_pose *outer, const struct mill_pose *inner)
{
    const vec3 place = mill_pose_out(outer, inner->place);
    return (struct mill_pose){
        .place = place,
        .x = mill_pose_turn_out(outer, inner->x),
        .y = mill_pose_turn_out(outer, inner->y),
        .z = mill_pose_turn_out(outer, inner->z),
        .velocity =
            vec3_add(mill_pose_velocity(outer, place), mill_pose_turn_out(outer, inner->velocity)),
        .angular_velocity =
            vec3_add(outer->angular_velocity, mill_pose_turn_out(outer, inner->angular_velocity)),
    };
}

struct mill_pose mill_motion_pose(const struct mill_motion *motion, double t)
{
    assert(t == t);
    if (!motion)
        return mill_pose_still;
    if (!motion->on)
        return motion->type->pose(motion, t);
    struct mill_pose pose = motion->type->pose(motion, t);
    for (const struct mill_motion *m = motion->on; m; m = m->on) {
        const struct mill_pose outer = m->type->pose(m, t);
        pose = within(&outer, &pose);
    }
    return pose;
}

/* Of a frame within another: sums of what each does alone, and of what the outer one does to the
 * inner one's motion (centrifugal, Coriolis and Euler terms). */
static struct mill_motion_bounds bounds_within(const struct mill_motion_bounds *o,
                                               const struct mill_motion_bounds *i)
{
    const double turning = o->turning;
    const bool parallel = vec3_norm(o->axis) > 0.0 && vec3_norm(i->axis) > 0.0 &&
                          vec3_norm(vec3_cross(o->axis, i->axis)) < 1e-15;
    const vec3 none = {0.0, 0.0, 0.0};
    return (struct mill_motion_bounds){
        .far = o->far + i->far,
        .speed = o->speed + turning * i->far + i->speed,
        .acceleration = o->acceleration + (o->spin_up + turning * turning) * i->far +
                        2.0 * turning * i->speed + i->acceleration,
        .turning = turning + i->turning,
        .spin_up = o->spin_up + i->spin_up + (parallel ? 0.0 : turning * i->turning),
        .axis = turning == 0.0                  ? i->axis
                : i->turning == 0.0 || parallel ? o->axis
                                                : none,
    };
}

struct mill_motion_bounds mill_motion_bounds(const struct mill_motion *motion)
{
    if (!motion)
        return (struct mill_motion_bounds){0};
    struct mill_motion_bounds bounds = motion->type->bounds(motion);
    for (const struct mill_motion *m = motion->on; m; m = m->on) {
        const struct mill_motion_bounds outer = m->type->bounds(m);
        if (outer.turning == 0.0) { /* it may stand turned */
            const struct mill_pose pose = m->type->pose(m, 0.0);
            bounds.axis = mill_pose_turn_out(&pose, bounds.axis);
        }
        bounds = bounds_within(&outer, &bounds);
    }
    return bounds;
}

double mill_motion_reach(const struct mill_motion *motion, double radius, double half_length)
{
    if (!motion || mill_motion_pose(motion, 0.0).about_x)
        return radius;
    return sqrt(radius * radius + half_length * half_length) + mill_motion_bounds(motion).far;
}
