/* The turn at constant speed about a fixed axis: a rotor, a tumbling drum, a planetary jar. The
 * rotation uses Rodrigues' formula: the part of a vector along the axis remains; the part normal to
 * it becomes cos(angle) times itself plus sin(angle) times its cross product with the axis. */
#include "base/elementary.h"
#include "geometry/phase.h"
#include "millsim/motion.h"

#include <assert.h>
#include <stdlib.h>

struct turn {
    struct mill_motion base;
    struct mill_turn is; /* with an axis of length 1 and the angle at local time 0 */
    double start;        /* [rad] its angle at simulated time 0 */
    bool about_x;        /* its axis is x through the carrier's origin */
    vec3 along[3], across[3], turned[3]; /* of the directions x, y, z in Rodrigues' formula */
};

static bool is_sound(const void *form)
{
    const struct mill_turn *is = form;
    return vec3_norm(is->axis) > 0.0 && isfinite(vec3_norm(is->axis)) &&
           isfinite(vec3_norm(is->centre)) && isfinite(is->speed) && isfinite(is->angle);
}

static struct mill_motion *create(const void *form)
{
    const struct mill_turn *asked = form;
    static const vec3 direction[3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    struct turn *turn = calloc(1, sizeof *turn);
    if (!turn)
        return NULL;
    assert(vec3_norm(asked->axis) > 0.0);
    const vec3 axis = vec3_scale(asked->axis, 1.0 / vec3_norm(asked->axis));
    turn->base = (struct mill_motion){&mill_turn_type, .axial = true, .through = asked->centre,
                                      .axis = axis};
    turn->base.period = 2.0 * MILL_PI / fabs(asked->speed);
    turn->is = *asked;
    turn->is.axis = axis;
    turn->about_x = vec3_norm(asked->centre) == 0.0 && axis.x == 1.0;
    turn->start = turn->is.angle = fmod(asked->angle, 2.0 * MILL_PI);
    for (int k = 0; k < 3; k++) {
        turn->along[k] = vec3_scale(axis, vec3_dot(axis, direction[k]));
        turn->across[k] = vec3_sub(direction[k], turn->along[k]);
        turn->turned[k] = vec3_cross(axis, direction[k]);
    }
    return &turn->base;
}

static vec3 axis_at(const struct turn *turn, int k, struct mill_heading at)
{
    return vec3_axpy(vec3_axpy(turn->along[k], at.cos, turn->across[k]), at.sin, turn->turned[k]);
}

static struct mill_pose pose(const struct mill_motion *motion, double t)
{
    const struct turn *turn = (const struct turn *)motion;
    const struct mill_heading at = mill_elementary_heading(turn->is.angle + turn->is.speed * t);
    if (turn->about_x)
        return (struct mill_pose){.x = {1.0, 0.0, 0.0},
                                  .y = {0.0, at.cos, at.sin},
                                  .z = {0.0, -at.sin, at.cos},
                                  .angular_velocity = {turn->is.speed, 0.0, 0.0},
                                  .about_x = true};
    struct mill_pose pose = {.angular_velocity = vec3_scale(turn->is.axis, turn->is.speed)};
    pose.x = axis_at(turn, 0, at);
    pose.y = axis_at(turn, 1, at);
    pose.z = axis_at(turn, 2, at);
    const vec3 origin = mill_pose_turn_out(&pose, vec3_scale(turn->is.centre, -1.0));
    pose.place = vec3_add(turn->is.centre, origin);
    pose.velocity = vec3_cross(pose.angular_velocity, origin);
    return pose;
}

static void carry(const struct mill_motion *motion, double t, vec3 *point, vec3 *velocity)
{
    const struct mill_turn *is = &((const struct turn *)motion)->is;
    const struct mill_heading at = mill_elementary_heading(is->angle + is->speed * t);
    const vec3 arm = vec3_turned(vec3_sub(*point, is->centre), is->axis, at.cos, at.sin);
    *point = vec3_add(is->centre, arm);
    *velocity = vec3_axpy(vec3_turned(*velocity, is->axis, at.cos, at.sin), is->speed,
                          vec3_cross(is->axis, arm));
}

/* A point moves on a circle about its projection on the axis. */
static struct mill_motion_bounds bounds(const struct mill_motion *motion, vec3 point)
{
    const struct mill_turn *is = &((const struct turn *)motion)->is;
    const vec3 out = vec3_sub(point, is->centre);
    const vec3 home = vec3_axpy(is->centre, vec3_dot(out, is->axis), is->axis);
    const double far = vec3_norm(vec3_sub(point, home)), turning = fabs(is->speed);
    const double speed = turning * far, acceleration = turning * turning * far;
    return (struct mill_motion_bounds){home, far, speed, acceleration, turning, 0.0, is->axis};
}

/* For a rotor the angle is added up from restart to restart, so that runs give the same bits as in
 * earlier versions; the error is 2e-15 rad per turn. */
static void restart(struct mill_motion *motion, double base, double by)
{
    struct turn *turn = (struct turn *)motion;
    struct mill_turn *is = &turn->is;
    is->angle = turn->about_x && !motion->on ? fmod(is->angle + is->speed * by, 2.0 * MILL_PI)
                                             : mill_phase_radians(turn->start, is->speed, base);
}

const struct mill_motion_type mill_turn_type = {is_sound, create, pose, bounds, restart, carry};
